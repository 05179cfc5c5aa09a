"use strict";
(() => {
  const content = JSON.parse(document.getElementById("charts").textContent);
  const night = matchMedia("(prefers-color-scheme: dark)");
  const figures = [...document.querySelectorAll("[data-figure]")];
  const views = new Map(figures.map((figure) => [figure, []]));
  const signals = new Map(figures.map((figure) => [figure, {}]));

  // The colours of a chart on the page as it is now: those too close to the paper have a stand-in.
  const look = (ink, grid) => ({
    background: null, font: "system-ui, sans-serif", padding: 4,
    axis: { labelColor: ink, titleColor: ink, gridColor: grid, domainColor: grid, tickColor: grid, labelFontSize: 12, titleFontSize: 12, titleFontWeight: "normal" },
    title: { color: ink, subtitleColor: ink, anchor: "start", fontSize: 13 }, view: { stroke: null },
  });
  const shade = (colour, dark) => content.colours[dark ? "dark" : "light"][colour.toUpperCase()] ?? colour;
  const dressed = (spec, dark) => JSON.parse(JSON.stringify(spec).replace(/#[0-9A-Fa-f]{6}/g, (colour) => shade(colour, dark)));

  async function draw(figure, dark) {
    const boxes = [...figure.querySelectorAll(".chart")];
    views.get(figure).splice(0).forEach((view) => view.finalize());
    for (const [k, spec] of content.figures[figure.dataset.figure].entries()) {
      const config = dark ? look("#e8eaed", "#383e45") : look("#1a1d21", "#e3e6ea");
      const height = Math.min(spec.height, Math.max(200, 0.65 * boxes[k].clientWidth));
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

  // One figure after the other, so that the first is there at once and the page stays quick to answer.
  let drawing = Promise.resolve();
  const drawAll = (dark) => {
    for (const path of document.querySelectorAll("path[data-colour]")) {
      const colour = shade(path.dataset.colour, dark);
      path.setAttribute(path.hasAttribute("stroke") ? "stroke" : "fill", colour);
    }
    for (const figure of figures) {
      drawing = drawing.then(() => draw(figure, dark)).then(() => new Promise((done) => setTimeout(done, 0)));
    }
    drawing = drawing.then(() => { document.documentElement.dataset.drawn = dark ? "dark" : "light"; });
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

  // A column sorts as numbers where every cell that is not a dash begins with one, after any status symbol.
  const number = (text) => parseFloat(text.replace(/^[✓≈✗]\s*/, "").replace(/(\d),(?=\d{3})/g, "$1"));
  const key = (row, column) => row.cells[column].textContent.trim();
  function sort(table, column) {
    const head = table.tHead.rows[0].cells[column];
    const down = head.ariaSort === "ascending";
    const rows = [...table.tBodies[0].rows];
    const filled = rows.filter((row) => !/^–|^$/.test(key(row, column)));
    const numeric = filled.every((row) => !Number.isNaN(number(key(row, column))));
    const compare = numeric
      ? (a, b) => number(key(a, column)) - number(key(b, column))
      : (a, b) => key(a, column).localeCompare(key(b, column), "en", { numeric: true });
    filled.sort((a, b) => (down ? -compare(a, b) : compare(a, b)));
    table.tBodies[0].append(...filled, ...rows.filter((row) => !filled.includes(row)));
    [...table.tHead.rows[0].cells].forEach((cell) => { cell.ariaSort = "none"; });
    head.ariaSort = down ? "descending" : "ascending";
  }
  for (const table of document.querySelectorAll("table.sortable")) {
    [...table.tHead.rows[0].cells].forEach((cell, k) => cell.querySelector("button").addEventListener("click", () => sort(table, k)));
  }

  // A filter keeps the rows of its table that have all of its words.
  for (const part of document.querySelectorAll(".filter")) {
    const rows = [...part.nextElementSibling.querySelectorAll("tbody tr")];
    const keep = () => {
      const words = part.querySelector("input").value.toLowerCase().split(/\s+/).filter(Boolean);
      rows.forEach((row) => { row.hidden = !words.every((word) => row.textContent.toLowerCase().includes(word)); });
      part.querySelector("output").textContent = words.length ? `${rows.filter((row) => !row.hidden).length} of ${rows.length}` : "";
    };
    part.querySelector("input").addEventListener("input", keep);
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
