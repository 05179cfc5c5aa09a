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

  // Colours with too little contrast to the page have a stand-in.
  const look = (ink, grid) => ({
    background: null, font: "system-ui, sans-serif", padding: 4,
    axis: { labelColor: ink, titleColor: ink, gridColor: grid, domainColor: grid, tickColor: grid, labelSeparation: 6, labelFontSize: 12, titleFontSize: 12, titleFontWeight: "normal" },
    title: { color: ink, subtitleColor: ink, anchor: "start", fontSize: 13 }, view: { stroke: null },
  });
  const shade = (colour, dark) => content.colours[dark ? "dark" : "light"][colour.toUpperCase()] ?? colour;
  const dressed = (spec, dark) => JSON.parse(JSON.stringify(spec).replace(/#[0-9A-Fa-f]{6}/g, (colour) => shade(colour, dark)));

  const folded = (figure) => figure.closest("details:not([open])");

  async function draw(figure, dark) {
    if (folded(figure) || figure.dataset.drawn === String(dark)) return;
    figure.dataset.drawn = dark;
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

  // A numeric column has its numbers in data-order. Cells without a number, and dashes, stay last.
  const ways = (compare) => {
    const empty = (cell) => cell === "" || cell === "–";
    const placed = (way) => (a, b) => empty(a) - empty(b) || way * compare(a, b);
    return { asc: placed(1), desc: placed(-1) };
  };
  const words = new Intl.Collator("en", { numeric: true });

  async function equip() {
    if (!document.getElementById("datatables")) return;
    const DataTable = await load("datatables");
    const search = (cell) => String(cell).replace(/<[^>]*>/g, " ");  // the text of a cell, not its markup
    DataTable.type("words", { detect: () => true, order: ways(words.compare), search });
    DataTable.type("numbers", { detect: (cell) => !Number.isNaN(Number(cell)), order: ways((a, b) => a - b), search });
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

  const mark = (scroll) => scroll.classList.toggle("more", scroll.scrollLeft + scroll.clientWidth < scroll.scrollWidth - 8);
  const sized = new ResizeObserver((entries) => { for (const { target } of entries) mark(target.closest(".scroll")); });
  for (const scroll of document.querySelectorAll(".scroll")) {
    scroll.addEventListener("scroll", () => mark(scroll), { passive: true });
    sized.observe(scroll);
    sized.observe(scroll.querySelector("table"));
  }

  // Figures are drawn one after the other and tables are made sortable last, so that the page responds at once.
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
  // A chart has the width of its place, so one in a folded part is drawn when that is opened.
  document.addEventListener("toggle", () => drawAll(night.matches), true);

  // Rows of measurements.csv are in the page if they are few; otherwise the link leads to the file next to the page.
  for (const link of document.querySelectorAll("[data-rows]")) {
    link.addEventListener("click", async (event) => {
      if (link.download || !document.getElementById("rows")) return;
      event.preventDefault();
      const [columns, ...rows] = JSON.parse(await unpack("rows")), wanted = Object.entries(JSON.parse(link.dataset.rows));
      const text = (value) => (/[",\n]/.test(value ?? "") ? `"${value.replaceAll('"', '""')}"` : value ?? "");
      const found = rows.filter((row) => wanted.every(([name, value]) => [value].flat().includes(row[columns.indexOf(name)])));
      const file = new Blob([[columns, ...found].map((row) => row.map(text).join(",")).join("\n"), "\n"], { type: "text/csv" });
      link.href = URL.createObjectURL(file);
      link.download = `${wanted.flatMap(([, value]) => value).join("_") || "measurements"}.csv`;
      link.click();
    });
  }

  for (const figure of figures) {
    const entries = [...figure.querySelectorAll(".entry")];
    const show = () => set(figure, "hidden", entries.filter((e) => e.ariaPressed === "false").map((e) => e.dataset.series));
    if (entries.length) show();
    const press = (some, on) => { some.forEach((e) => { e.ariaPressed = String(on); }); show(); };
    entries.forEach((entry) => entry.addEventListener("click", () => press([entry], entry.ariaPressed === "false")));
    figure.querySelector(".all")?.addEventListener("click", () => press(entries, true));
    figure.querySelector(".none")?.addEventListener("click", () => press(entries, false));
  }

  // The text of the selected cell of a grid is shown below the grid.
  for (const grid of document.querySelectorAll(".grid")) {
    const showText = (event) => {
      const cell = event.target.closest("td");
      if (!cell) return;
      grid.querySelector(".shown")?.classList.remove("shown");
      cell.classList.add("shown");
      grid.querySelector("output").textContent = cell.dataset.about;
    };
    grid.addEventListener("mouseover", showText);
    grid.addEventListener("click", showText);
  }

  // A link into a folded part opens it.
  const reveal = () => {
    const goal = document.getElementById(location.hash.slice(1));
    for (let e = goal; e; e = e.parentElement) if (e.localName === "details") e.open = true;
    goal?.scrollIntoView();
  };
  addEventListener("hashchange", reveal);
  if (location.hash) reveal();

  drawAll(night.matches);
})();
