// Words and figures: what was run, tiles, the thesis's measures, differences between runs, configuration, errors.
"use strict";

R.figure = (run, key) => (run.figures[key] === undefined ? null : run.figures[key]);

// Index of the run whose value is the best; -1: none is by 1 % or more.
R.best = function (kind, values) {
  const known = values.map((v, i) => [v, i]).filter(([v]) => v !== null);
  if (!kind.better || known.length < 2) return -1;
  known.sort((a, b) => kind.better * (b[0] - a[0]));
  const [first, second] = [known[0][0], known[1][0]];
  return Math.abs(first - second) < 0.01 * Math.max(Math.abs(first), Math.abs(second)) || first === second ? -1 : known[0][1];
};

R.header = function () {
  const toggle = R.el("button", {
    class: "no-print", title: "dark or light",
    text: "dark / light", onclick: () => R.setTheme(R.dark() ? "light" : "dark"),
  });
  const names = R.runs.map((r) => r.name);
  const title = R.data.sweep ? "Sweep of " + R.data.sweep.flags.join(", ") : R.several ? `${names.length} runs compared` : names[0];
  R.nav = R.el("nav", { class: "no-print" });
  document.getElementById("main").append(
    R.el("div", { class: "bar" },
      R.el("div", {}, R.el("h1", { text: title }),
        R.several ? R.legendOfRuns() : R.el("div", { class: "muted", text: R.subtitle(R.runs[0]) }), R.nav),
      toggle));
};
R.fact = (run, what) => (run.facts.find(([w]) => w === what) || [null, null])[1];
R.subtitle = (run) =>
  ["scene", "kind", "display", "coupling", "began"].map((w) => R.fact(run, w)).filter((v) => v).join(" \u00b7 ") || run.directory;

R.tiles = function () {
  const box = R.el("div", { class: "tiles" });
  for (const kind of R.data.figures.filter((f) => f.table === "tile")) {
    const values = R.runs.map((run) => R.figure(run, kind.key));
    if (values.every((v) => v === null)) continue;
    const tile = R.el("div", { class: "tile", title: kind.meaning }, R.el("div", { class: "what", text: kind.label }));
    if (!R.several)
      tile.append(R.el("div", {}, R.el("div", { class: "value" }, R.number(values[0]), R.el("small", { text: kind.unit }))));
    else
      values.forEach((v, i) => tile.append(R.el("div", { class: "of-run" }, R.runSwatch(i), R.withUnit(v, kind.unit))));
    box.append(tile);
  }
  const errors = R.runs.map(R.errorsOf);
  if (errors.some((n) => n > 0)) {
    const tile = R.el("div", { class: "tile bad", title: "see the end of this page" }, R.el("div", { class: "what", text: "errors" }));
    if (!R.several) tile.append(R.el("div", { class: "value", text: R.number(errors[0]) }));
    else errors.forEach((n, i) => tile.append(R.el("div", { class: "of-run" }, R.runSwatch(i), R.number(n))));
    box.append(tile);
  }
  document.getElementById("main").append(box);
};
R.errorsOf = (run) =>
  R.data.figures.filter((f) => f.table === "error").reduce((sum, f) => sum + (R.figure(run, f.key) || 0), 0) +
  run.logs.reduce((sum, log) => sum + log.errors, 0);

R.notes = function () {
  const lines = R.runs.flatMap((run) => run.notes.map((n) => (R.several ? run.name + ": " : "") + n));
  if (lines.length)
    document.getElementById("main").append(
      R.el("div", { class: "notes" }, "What this page lacks, and why:", R.el("ul", {}, lines.map((l) => R.el("li", { text: l })))));
};

R.table = (head, rows) =>
  R.el("div", { class: "scroll" },
    R.el("table", {},
      R.el("thead", {}, R.el("tr", {}, head.map((h) => R.el("th", { class: h.number ? "number" : "" }, h.swatch !== undefined ? R.runSwatch(h.swatch) : null, h.text)))),
      R.el("tbody", {}, rows)));
R.runHeads = (number) => R.runs.map((run, i) => ({ text: R.several ? run.name : "", number, swatch: R.several ? i : undefined }));

R.about = function () {
  const kinds = [];
  R.runs.forEach((run) => run.facts.forEach(([what]) => kinds.includes(what) || kinds.push(what)));
  const rows = kinds.map((what) => {
    const values = R.runs.map((run) => R.fact(run, what));
    const differs = new Set(values).size > 1;
    return R.el("tr", {}, R.el("td", { class: "muted", text: what }),
      values.map((v) => R.el("td", { class: "wrap" + (differs ? " differs" : "") + (what === "command" ? " mono" : ""), text: v || "-" })));
  });
  rows.push(R.el("tr", {}, R.el("td", { class: "muted", text: "folder" }), R.runs.map((run) => R.el("td", { class: "wrap", text: run.directory }))));
  R.section("about", "What was run", R.help("What is needed to do it again."), R.el("div", { class: "panel" },
    R.table([{ text: "" }, ...R.runHeads(false)], rows),
    R.several ? R.el("p", { class: "muted small", text: "What differs is marked." }) : null));
};

// What a value is more than the first run's, and in percent of that.
R.differenceCell = function (v, first) {
  const known = v !== null && v !== undefined && first !== null && first !== undefined, difference = known ? v - first : 0;
  const share = known && first !== 0 ? ` (${R.signed((100 * difference) / Math.abs(first), 3)}\u202f%)` : "";
  return R.el("td", { class: "number muted", text: known ? R.signed(difference) + share : "-" });
};

// A row a figure: value of each run, and from the second on its difference from the first.
R.figureRows = function (kinds, withMeaning) {
  return kinds.map((kind) => {
    const values = R.runs.map((run) => R.figure(run, kind.key));
    if (values.every((v) => v === null)) return null;
    const best = R.best(kind, values);
    const cells = [];
    values.forEach((v, i) => {
      cells.push(R.el("td", { class: "number" + (i === best ? " better" : "") }, R.withUnit(v, kind.unit), i === best ? " \u2713" : ""));
      if (i === 0) return;
      cells.push(R.differenceCell(v, values[0]));
    });
    return R.el("tr", {}, R.el("td", { text: kind.label }),
      withMeaning ? R.el("td", { class: "muted", text: kind.meaning }) : null, cells);
  }).filter((row) => row);
};
R.figureHead = function (withMeaning) {
  const out = [{ text: "" }];
  if (withMeaning) out.push({ text: "definition" });
  R.runHeads(true).forEach((head, i) => {
    out.push(R.several ? head : { text: "value", number: true });
    if (i > 0) out.push({ text: "difference", number: true });
  });
  return out;
};

R.measures = function () {
  const kinds = R.data.figures.filter((f) => f.table === "measure");
  R.section("measures", "The seven measures",
    R.el("p", { class: "muted", text: "The figures by which the thesis behind this program judges a pipeline (section 6.2). Latencies and construction times are medians, the inter-frame delay is the mean, rates are means over the run." }),
    R.el("div", { class: "panel" }, R.table(R.figureHead(true), R.figureRows(kinds, true))));
};
R.allFigures = function () {
  const kinds = R.data.figures.filter((f) => f.table === "more" || (R.several && f.table === "tile"));
  const rows = R.figureRows(kinds, false);
  if (!rows.length) return;
  R.section("figures", R.several ? "Differences" : "Further figures",
    R.several ? null : R.help("What else was measured over the whole run."),
    R.several ? R.el("p", { class: "muted", text: `Differences are from ${R.runs[0].name}; the best one is marked with \u2713, where more or less is better and it is so by 1 % or more.` }) : null,
    R.el("div", { class: "panel" }, R.table(R.figureHead(false), rows)));
};

// What each process did when: trace.json of the run.
R.traces = function () {
  const box = R.runs.map((run, i) => R.el("p", {}, R.several ? [R.runSwatch(i), run.name + ": "] : null,
    run.trace === null ? "trace.json is not there." : R.el("a", { href: "./" + run.trace.split("/").map(encodeURIComponent).join("/"), text: run.trace })));
  R.section("trace", "Timeline", R.help("What each process did at each moment, as spans: open the file in ui.perfetto.dev, a page that reads it in the browser, or in chrome://tracing."), R.el("div", { class: "panel" }, box));
};

R.errors = function () {
  const kinds = R.data.figures.filter((f) => f.table === "error");
  const body = [R.table(R.figureHead(true), R.figureRows(kinds, true))];
  R.runs.forEach((run, i) => {
    if (R.several) body.push(R.el("h3", { style: { marginTop: "14px" } }, R.runSwatch(i), run.name));
    const loud = run.logs.filter((log) => log.warnings + log.errors > 0);
    if (!loud.length)
      body.push(R.el("p", { class: "muted", text: run.logs.length ? "No process logged a warning or an error." : "The run kept no logs." }));
    for (const log of loud) {
      body.push(R.el("p", {}, R.el("b", { text: log.process }), `: ${log.errors} errors, ${log.warnings} warnings`,
        log.read_mb ? ` in the first ${log.read_mb} MiB` : "", log.errors + log.warnings > log.lines.length ? `; the first ${log.lines.length}:` : ":"));
      body.push(R.el("pre", { class: log.errors ? "error-line" : "", text: log.lines.join("\n") }));
    }
  });
  R.section("errors", "Errors and warnings", R.help("Messages and work that were lost, and what processes complained about. All zero is good."), R.el("div", { class: "panel" }, body));
};

R.configuration = function () {
  const boxes = R.runs.map((run, i) => R.el("details", {},
    R.el("summary", {}, R.several ? R.runSwatch(i) : null, R.several ? run.name : "session.toml"),
    R.el("pre", { text: run.config === null ? "session.toml is not there." : run.config })));
  R.section("configuration", "Configuration", R.help("All settings of the session, as telesplat run takes them again."), R.el("div", { class: "panel" }, boxes));
};
