// Where the time of view updates went: their stages over time, on average, and in a table.
"use strict";

R.stages = function () {
  const with_ = R.runs.filter((run) => run.stages && run.stages.t.length);
  if (!with_.length) {
    R.section("stages", "Where the time went", R.el("div", { class: "notes", text: "The stages of view updates are not known: " + (R.several ? "no run has a" : "the run has no") + " stages.csv, which records of earlier versions lack. What is known of latency stands below, over time." }));
    return;
  }
  const heights = with_.flatMap((run) => Array.from(run.stages.latency));
  const top = Math.max(...with_.map((run) => Math.max(...run.stages.latency)));
  const boxes = with_.flatMap((run) => {
    const s = run.stages, colours = R.stageColours(s);
    // The first is drawn on top: in reverse, so that the request lies at the bottom.
    const series = s.stages.map((stage, i) => ({ label: stage.label, t: s.t, v: stage.v.map((v) => Math.max(0, v || 0)), of: 0, colour: () => colours()[i] })).reverse();
    const hover = (x) => {
      const i = R.nearest(s.t, x);
      const told = [["request " + R.id(s.request[i]), "frame " + R.id(s.frame[i]) + ", tile " + R.id(s.tile[i])]];
      if (s.sampler[i] !== null) told.push(["sampled by", s.sampler[i]]);
      told.push(["latency", R.withUnit(s.latency[i], "ms")]);
      return told.concat(s.stages.map((stage, k) => [stage.label, R.withUnit(stage.v[i], "ms"), colours()[k]]));
    };
    const name = R.several ? run.name + ": " : "";
    return [
      R.chart(name + "stages of the view updates, by request time", series, { unit: "ms", stacked: true, high: true, wide: true, hover, yMax: top * 1.05, heights, noLegend: true }),
      R.el("div", { class: "panel wide" }, R.meanBar(run, colours), R.stageTable(run, colours)),
    ];
  });
  const thin = with_.filter((run) => run.stages.of > run.stages.t.length);
  R.section("stages", "Where the time went",
    R.el("p", { class: "muted" }, "What each view update spent its time on, from the viewer's request until its last points were there, followed along the part of the view that came last. Blue: something travels over the network. Orange: it waits for somebody who is busy. Green: somebody works on it. The largest colour is what to speed up first."),
    thin.length ? R.el("p", { class: "muted small", text: `Thinned over time: of each of ${thin[0].stages.t.length} parts the slowest update is shown (${thin.map((run) => `${R.number(run.stages.of)} updates`).join(", ")}). Tables count all.` }) : null,
    R.el("div", { class: "grid" }, with_.length > 1 ? R.stageComparison(with_) : null, boxes));
};
// Medians of the stages of several runs, and how they differ from the first.
R.stageComparison = function (runs) {
  const kinds = [];
  for (const run of runs) for (const stage of run.stages.stages) if (!kinds.some((k) => k.key === stage.key)) kinds.push(stage);
  const row = (label, group, of) => {
    const values = runs.map((run) => (of(run.stages) || {}).median);
    const best = R.best({ better: -1 }, values.map((v) => (v === undefined ? null : v)));
    return R.el("tr", {}, R.el("td", { text: label }), R.el("td", { class: "muted", text: group }), values.flatMap((v, i) => [
      R.el("td", { class: "number" + (i === best ? " better" : "") }, R.withUnit(v, "ms"), i === best ? " \u2713" : ""), i > 0 ? R.differenceCell(v, values[0]) : null]));
  };
  const rows = kinds.map((kind) => row(kind.label, kind.group, (s) => (s.stages.find((x) => x.key === kind.key) || {}).row));
  rows.push(row("latency", "", (s) => s.latency_row));
  const heads = runs.flatMap((run, i) => [{ text: run.name, number: true, swatch: R.runs.indexOf(run) }, i > 0 ? { text: "difference", number: true } : null]);
  return R.el("div", { class: "panel wide" }, R.el("h3", { text: "Medians of the stages" }), R.help("The middle value of each stage, side by side; \u2713 marks the fastest."), R.table([{ text: "stage" }, { text: "" }, ...heads.filter((h) => h)], rows));
};
// Whether the stages can be trusted: clocks of several machines may differ.
R.stageCheck = (s) => (s.off < 0.01 ? "The stages of each update add up to its latency." : `The stages of an update differ from its latency by up to ${R.percent(s.off)}.`) +
  (s.negative ? ` ${R.number(s.negative)} stages are shorter than nothing: the machines' clocks differ by that much.` : "");
R.id = (v) => (v === null || v === undefined || v < 0 ? "-" : String(v));
R.stageColours = function (s) {
  const of = (group) => s.stages.filter((x) => x.group === group);
  return () => s.stages.map((stage) => R.stageColour(stage.group, of(stage.group).indexOf(stage), of(stage.group).length));
};
R.meanBar = function (run, colours) {
  const bar = R.el("div", { class: "stack" }), legend = R.el("div", { class: "legend" });
  const rows = run.stages.stages.map((stage) => stage.row), all = rows.reduce((sum, r) => sum + Math.max(0, (r || {}).mean || 0), 0) || 1;
  const paint = () => bar.replaceChildren(...run.stages.stages.map((stage, i) =>
    R.el("div", {
      style: { background: colours()[i], flexBasis: (100 * Math.max(0, (rows[i] || {}).mean || 0)) / all + "%" },
      onmousemove: (e) => R.tip(e, stage.label, [["mean", R.withUnit((rows[i] || {}).mean, "ms")], ["share", R.percent((rows[i] || {}).share)]]), onmouseleave: R.hideTip,
    })));
  paint();
  R.redraws.push(paint);
  for (const group of ["work", "queue", "network"]) {
    const sum = run.stages.stages.reduce((s, stage, i) => s + (stage.group === group ? (rows[i] || {}).mean || 0 : 0), 0);
    const words = { work: "work", queue: "queues", network: "network" }[group];
    const swatch = R.el("i", { class: "swatch", style: { background: R.stageColour(group, 0, 1) } });
    legend.append(R.el("span", {}, swatch, `${words} ${R.number(sum)}\u202fms (${R.percent(sum / all)})`));
  }
  return R.el("div", {}, R.el("h3", { text: (R.several ? run.name + ": " : "") + "mean update, " + R.withUnit(all, "ms") }), legend, bar);
};
R.stageTable = function (run, colours) {
  const s = run.stages;
  const cells = (row) => ["median", "p95", "mean"].map((k) => R.el("td", { class: "number", text: row ? R.withUnit(row[k], "ms") : "-" })).concat(R.el("td", { class: "number", text: row ? R.percent(row.share) : "-" }));
  const rows = s.stages.map((stage, i) => {
    const swatch = R.el("i", { class: "swatch" });
    const paint = () => (swatch.style.background = colours()[i]);
    paint();
    R.redraws.push(paint);
    return R.el("tr", {}, R.el("td", {}, swatch, stage.label), R.el("td", { class: "muted", text: stage.group }), cells(stage.row));
  });
  rows.push(R.el("tr", {}, R.el("td", {}, R.el("b", { text: "latency" })), R.el("td"), cells(s.latency_row)));
  if (s.display_row) rows.push(R.el("tr", {}, R.el("td", { text: "then, to the end of the first frame that shows it" }), R.el("td"), cells(s.display_row)));
  return R.el("div", {},
    R.table([{ text: "stage" }, { text: "" }, { text: "median", number: true }, { text: "p95", number: true }, { text: "mean", number: true }, { text: "share of the mean", number: true }], rows),
    R.el("p", { class: "muted small", text: `Of ${R.number(s.of)} updates. ` + R.stageCheck(s) }));
};
