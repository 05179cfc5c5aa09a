"use strict";
(async () => {
  // Charts are compressed JSON, libraries are compressed modules.
  const unpack = async (id) => {
    const { body } = await fetch(`data:;base64,${document.getElementById(id).textContent}`);
    return new Response(body.pipeThrough(new DecompressionStream("gzip"))).text();
  };
  const load = async (id) => (await import(URL.createObjectURL(new Blob([await unpack(id)], { type: "text/javascript" })))).default;
  const drawable = document.getElementById("charts");
  const content = drawable ? JSON.parse(await unpack("charts")) : { figures: {}, colours: { light: {}, dark: {} } };
  const vegaEmbed = drawable && (await load("vega"));

  const night = matchMedia("(prefers-color-scheme: dark)");
  const figures = [...document.querySelectorAll("[data-figure]")];
  const views = new Map(figures.map((figure) => [figure, []]));
  const signals = new Map(figures.map((figure) => [figure, {}]));

  // The colours of a chart on the page as it is now: those too close to the paper have a stand-in.
  const look = (ink, grid) => ({
    background: null, font: "system-ui, sans-serif", padding: 4,
    axis: { labelColor: ink, titleColor: ink, gridColor: grid, domainColor: grid, tickColor: grid, labelSeparation: 6, labelFontSize: 12, titleFontSize: 12, titleFontWeight: "normal" },
    title: { color: ink, subtitleColor: ink, anchor: "start", fontSize: 13 }, view: { stroke: null },
  });
  const shade = (colour, dark) => content.colours[dark ? "dark" : "light"][colour.toUpperCase()] ?? colour;
  const dressed = (spec, dark) => JSON.parse(JSON.stringify(spec).replace(/#[0-9A-Fa-f]{6}/g, (colour) => shade(colour, dark)));

  async function draw(figure, dark) {
    const boxes = [...figure.querySelectorAll(".chart")];
    views.get(figure).splice(0).forEach((view) => view.finalize());
    for (const [k, spec] of (content.figures[figure.dataset.figure] ?? []).entries()) {
      const config = dark ? look("#e8eaed", "#383e45") : look("#1a1d21", "#e3e6ea");
      const height = Math.min(spec.height, Math.max(200, 0.55 * boxes[k].clientWidth));
      const { view } = await vegaEmbed(boxes[k], { ...dressed(spec, dark), height }, { actions: false, renderer: "svg", config });
      views.get(figure).push(view);
      for (const [name, value] of Object.entries(signals.get(figure))) view.signal(name, value);
      await view.runAsync();
    }
    if (!performance.getEntriesByName("first chart").length) performance.mark("first chart");
  }

  const set = (figure, name, value) => {
    signals.get(figure)[name] = value;
    return Promise.all(views.get(figure).map((view) => view.signal(name, value).runAsync()));
  };

  // A column sorts as numbers where every cell that is not a dash begins with one, after any status symbol; dashes stay last.
  // Of a change, "1 → 2", the later number counts.
  const number = (cell) => parseFloat(cell.split("→").pop().trim().replace(/^[✓≈✗]\s*/, "").replace(/(\d),(?=\d{3})/g, "$1"));
  const empty = (cell) => /^–|^$/.test(cell.trim());
  const ways = (value, compare) => {
    const placed = (way) => (a, b) => empty(a) - empty(b) || way * compare(value(a), value(b));
    return { asc: placed(1), desc: placed(-1) };
  };
  const words = new Intl.Collator("en", { numeric: true });

  async function equip() {
    if (!document.getElementById("datatables")) return;
    const DataTable = await load("datatables");
    const search = (cell) => String(cell).replace(/<[^>]*>/g, " ");  // the text of a cell, not its markup
    DataTable.type("words", { detect: () => true, order: ways(String, words.compare), search });
    DataTable.type("numbers", { search, detect: (cell) => empty(cell) || !Number.isNaN(number(cell)), order: ways(number, (a, b) => a - b) });
    const language = { zeroRecords: "No row has all of these words." };
    const layout = { topStart: null, topEnd: null, bottomStart: null, bottomEnd: null };
    for (const table of document.querySelectorAll("table.sortable")) {
      const rows = new DataTable(table, { autoWidth: false, paging: false, order: [], language, layout });
      const filter = table.closest(".scroll").previousElementSibling?.closest(".filter");
      filter?.querySelector("input").addEventListener("input", ({ target }) => {
        const { recordsDisplay: left, recordsTotal: all } = rows.search(target.value).draw().page.info();
        filter.querySelector("output").textContent = target.value.trim() ? `${left} of ${all}` : "";
      });
      await pause();
    }
  }

  // One figure after the other, so that the first is there at once and the page stays quick to answer; then come the tables.
  const pause = () => new Promise((done) => setTimeout(done, 0));
  let drawing = Promise.resolve(), equipped;
  const drawAll = (dark) => {
    for (const path of document.querySelectorAll("path[data-colour]")) {
      const colour = shade(path.dataset.colour, dark);
      path.setAttribute(path.hasAttribute("stroke") ? "stroke" : "fill", colour);
    }
    for (const figure of figures) {
      drawing = drawing.then(() => draw(figure, dark)).then(pause).then(() => (equipped ??= equip()));
    }
    drawing = drawing.then(() => (equipped ??= equip())).then(() => { document.documentElement.dataset.drawn = dark ? "dark" : "light"; });
    return drawing;
  };
  night.addEventListener("change", () => drawAll(night.matches));
  addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((part) => { part.open = true; }));

  for (const figure of figures) {
    const entries = [...figure.querySelectorAll(".entry")];
    const show = () => set(figure, "hidden", entries.filter((e) => e.ariaPressed === "false").map((e) => e.dataset.series));
    const press = (some, on) => { some.forEach((e) => { e.ariaPressed = String(on); }); show(); };
    entries.forEach((entry) => entry.addEventListener("click", () => press([entry], entry.ariaPressed === "false")));
    figure.querySelector(".all")?.addEventListener("click", () => press(entries, true));
    figure.querySelector(".none")?.addEventListener("click", () => press(entries, false));
    for (const input of figure.querySelectorAll("[data-signal]")) {
      const value = () => (input.type === "checkbox" ? input.checked : Number(input.value));
      input.addEventListener("input", () => set(figure, input.dataset.signal, value()));
    }
  }

  // What a cell of the grid of hard cases says, told below it.
  for (const grid of document.querySelectorAll(".grid")) {
    const tell = (event) => {
      const cell = event.target.closest("td");
      if (!cell) return;
      grid.querySelector(".told")?.classList.remove("told");
      cell.classList.add("told");
      grid.querySelector("output").textContent = cell.dataset.about;
    };
    grid.addEventListener("mouseover", tell);
    grid.addEventListener("click", tell);
  }

  drawAll(night.matches);
})();
