// Charts over time (dygraphs). All show the same span of time: dragging zooms all of them, a double-click shows all.
"use strict";

R.time = {
  full: [0, Math.max(1e-3, ...R.runs.map((run) => run.duration_s || 0))],
  charts: [],
  listeners: [],
};
R.time.now = R.time.full.slice();
R.time.set = function (from, to) {
  if (R.time.busy || !(to > from)) return;
  R.time.busy = true;
  R.time.now = [Math.max(R.time.full[0], from), Math.min(R.time.full[1], to)];
  if (!(R.time.now[1] > R.time.now[0])) R.time.now = R.time.full.slice();
  for (const chart of R.time.charts) chart.graph.updateOptions({ dateWindow: R.time.now.slice() });
  R.time.listeners.forEach((listen) => listen());
  R.time.busy = false;
};
R.time.point = function (t) {
  for (const chart of R.time.charts) {
    const area = chart.graph.getArea(), x = chart.graph.toDomXCoord(t);
    chart.cursor.hidden = t === null || x < area.x || x > area.x + area.w;
    chart.cursor.style.left = x + "px";
  }
};

// One table of rows for several series, each with its own moments.
function merged(series) {
  const at = new Map();
  series.forEach((s, k) => s.t.forEach((t, i) => {
    let row = at.get(t);
    if (!row) at.set(t, (row = [t, ...series.map(() => null)]));
    row[k + 1] = s.v[i] === null ? NaN : s.v[i];
  }));
  return [...at.values()].sort((a, b) => a[0] - b[0]);
}

function drawLines(lines, context, area, graph) {
  context.save();
  context.strokeStyle = R.css("--mark");
  context.setLineDash([4, 4]);
  for (const line of lines) {
    const y = graph.toDomYCoord(line.y);
    context.beginPath();
    context.moveTo(area.x, y);
    context.lineTo(area.x + area.w, y);
    context.stroke();
  }
  context.restore();
}
// Their labels stand beside the picture, at least 13 pixels from each other.
function labelLines(chart, graph) {
  const [low, high] = graph.yAxisRange(), area = graph.getArea();
  const lines = (chart.options.lines || []).filter((line) => line.y >= low && line.y <= high);
  const places = lines.map((line) => graph.toDomYCoord(line.y)), last = lines.length - 1;
  const near = places.some((y, i) => i > 0 && y - places[i - 1] < 13);
  const top = Math.min(area.y + area.h - 8 - 13 * last, (places[0] + places[last]) / 2 - 6.5 * last);
  chart.box.querySelectorAll(".line-label").forEach((label) => label.remove());
  lines.forEach((line, i) =>
    chart.box.append(R.el("div", { class: "line-label", text: line.label, style: { left: area.x + area.w + 5 + "px", top: (near ? top + 13 * i : places[i]) - 9 + "px" } })));
}

// The periods of displays.
R.hertz = [60, 72, 90].map((hz) => ({ y: 1000 / hz, x: 1000 / hz, label: hz + " Hz", hz }));

// Where a few values lie far above all others, the axis ends before them: {limit, above}; null: it shows all.
R.cap = function (values) {
  const sorted = Float64Array.from(values.filter((v) => v > 0)).sort(), n = sorted.length;
  if (n < 30) return null;
  const usual = sorted[Math.floor(0.98 * (n - 1))];
  if (sorted[n - 1] < 4 * usual) return null;
  const limit = 1.25 * usual;
  return { limit, above: sorted.filter((v) => v > limit).length };
};

// series: [{label, colour: () => css, t, v, of}]. options: unit, lines, stacked, high, log (offers it), hover (rows for
// a tooltip in place of the usual ones), points, free (the axis need not begin at 0), heights (what its end is judged by
// in place of all values), yMax.
R.chart = function (title, series, options) {
  const box = R.el("div", { class: "chart" + (options.high ? " high" : "") });
  const log = options.log ? R.el("button", { class: "no-print", "aria-pressed": "false", text: "log scale" }) : null;
  const cap = options.free ? null : R.cap(options.heights || series.flatMap((s) => Array.from(s.v)));
  const whole = cap ? R.el("button", { class: "no-print", "aria-pressed": "false", text: "whole range" }) : null;
  const thin = series.filter((s) => s.of > s.t.length);
  const panel = R.el("div", { class: "panel" + (options.wide ? " wide" : "") },
    R.el("div", { class: "chart-head" }, R.el("h3", { text: title + (options.unit ? ", " + options.unit : "") }), R.el("span", {}, whole, " ", log)),
    options.help ? R.help(options.help) : null,
    series.length > 1 && !options.noLegend ? R.seriesLegend(series) : null, box,
    thin.length ? R.el("div", { class: "muted small", text: `Thinned: ${thin.map((s) => `${R.number(s.t.length)} of ${R.number(s.of)} values`).join(", ")}; of each part of the time the least and the greatest stay.` }) : null,
    cap ? R.el("div", { class: "muted small", text: `${R.number(cap.above)} of the values lie above the axis.` }) : null);
  const chart = { panel, box, series, options, cursor: R.el("div", { class: "cursor", hidden: "" }) };
  chart.range = () => (chart.whole || chart.logged ? null : cap ? [0, cap.limit] : options.yMax ? [0, options.yMax] : null);
  chart.make = function () {
    const colours = series.map((s) => s.colour());
    chart.graph = new Dygraph(box, merged(series), {
      labels: ["t", ...series.map((_, i) => "s" + i)],
      colors: colours, dateWindow: R.time.now.slice(), connectSeparatedPoints: !options.stacked, legend: "never",
      strokeWidth: options.stacked ? 0.4 : 1.3, stackedGraph: Boolean(options.stacked), fillAlpha: 0.85,
      stackedGraphNaNFill: "none", drawPoints: Boolean(options.points) && series.every((s) => s.t.length <= 400), pointSize: 2.2, highlightCircleSize: 3, pixelRatio: Math.max(2, window.devicePixelRatio || 1),
      includeZero: !options.free, gridLineColor: R.css("--line"), axisLineColor: R.css("--line"), gridLineWidth: 0.6,
      valueRange: chart.range(), yRangePad: 4, rightGap: options.lines ? 44 : 8, animatedZooms: false, logscale: Boolean(chart.logged),
      axes: { x: { pixelsPerLabel: 70, axisLabelFormatter: (v) => R.number(v, 5) + " s" }, y: { axisLabelWidth: 46, axisLabelFormatter: (v) => R.short(v) } },
      underlayCallback: (context, area, graph) => drawLines(options.lines || [], context, area, graph),
      drawCallback: (graph, initial) => {
        labelLines(chart, graph);
        if (initial || R.time.busy) return;
        const [a, b] = graph.xAxisRange();
        if (Math.abs(a - R.time.now[0]) + Math.abs(b - R.time.now[1]) > 1e-9) R.time.set(a, b);
      },
      highlightCallback: (event, x) => chart.hover(event, x),
      unhighlightCallback: () => { R.hideTip(); R.time.point(null); },
      interactionModel: Object.assign({}, Dygraph.defaultInteractionModel, { dblclick: () => chart.reset() }),
    });
    box.append(chart.cursor);
  };
  chart.reset = function () {
    R.time.busy = true; // what this chart takes as its whole time is no wish
    chart.graph.resetZoom();
    chart.graph.updateOptions({ valueRange: chart.range() });
    R.time.busy = false;
    R.time.set(...R.time.full);
  };
  chart.hover = function (event, x) {
    R.time.point(x);
    const near = (R.time.now[1] - R.time.now[0]) / 40;
    const rows = options.hover ? options.hover(x) : series.map((s) => {
      const i = R.nearest(s.t, x);
      return i < 0 || Math.abs(s.t[i] - x) > Math.max(near, 1) ? null : [s.label, R.withUnit(s.v[i], options.unit), s.colour()];
    }).filter((row) => row);
    R.tip(event, R.number(x, 6) + "\u202fs", rows);
  };
  if (log)
    log.addEventListener("click", () => {
      chart.logged = !chart.logged;
      log.setAttribute("aria-pressed", String(chart.logged));
      chart.graph.updateOptions({ logscale: chart.logged, valueRange: chart.range() });
    });
  if (whole)
    whole.addEventListener("click", () => {
      chart.whole = !chart.whole;
      whole.setAttribute("aria-pressed", String(Boolean(chart.whole)));
      chart.graph.updateOptions({ valueRange: chart.range() });
    });
  R.time.charts.push(chart);
  return panel;
};
R.short = (v) => (Math.abs(v) >= 1e6 ? R.number(v / 1e6, 3) + " M" : Math.abs(v) >= 1e4 ? R.number(v / 1e3, 3) + " k" : R.number(v, 3));
R.seriesLegend = function (series) {
  const box = R.el("div", { class: "legend" });
  const paint = () => box.replaceChildren(...series.map((s) => R.el("span", {}, R.el("i", { class: "swatch", style: { background: s.colour() } }), s.label)));
  paint();
  R.redraws.push(paint);
  return box;
};
R.makeCharts = function () {
  for (const chart of R.time.charts) chart.make();
  R.redraws.push(() => {
    for (const chart of R.time.charts) {
      chart.graph.updateOptions({ colors: chart.series.map((s) => s.colour()), gridLineColor: R.css("--line"), axisLineColor: R.css("--line") }, true);
      chart.graph.resize();
      chart.graph.updateOptions({});
    }
  });
};

// dygraphs clears its canvases when a page takes its size on paper: a copy stays in front of them.
R.printCharts = function () {
  for (const chart of R.time.charts) {
    const drawn = [...chart.box.querySelectorAll("canvas:not(.print-copy)")];
    const copy = R.el("canvas", { class: "print-copy" });
    copy.width = drawn[0].width;
    copy.height = drawn[0].height;
    copy.style.width = drawn[0].style.width;
    copy.style.height = drawn[0].style.height;
    for (const canvas of drawn) copy.getContext("2d").drawImage(canvas, 0, 0);
    chart.box.append(copy);
  }
};

// The series of these names, of all runs. One run: a colour a series; several: a colour a run.
R.seriesOf = function (...names) {
  const out = [];
  R.runs.forEach((run, r) => names.forEach((name) => (run.series[name] || []).forEach((s) => {
    const k = out.length, many = (run.series[name] || []).length > 1;
    const label = R.several ? run.name + (names.length > 1 || many ? ", " + s.label : "") : s.label;
    out.push({ label, t: s.t, v: s.v, of: s.of, colour: () => R.colour(R.several ? r : k) });
  })));
  return out;
};
// A chart of them; null if there are none.
R.chartOf = function (title, names, options) {
  const series = R.seriesOf(...[].concat(names));
  return series.length ? R.chart(title, series, options || {}) : null;
};

R.photons = function () {
  const over = R.chartOf("Motion to photon", "motion_to_photon_ms", { unit: "ms", high: true, wide: true, log: true });
  const shapes = R.distribution("motion_to_photon_ms");
  if (!over && !shapes.length) return;
  R.section("photon", "Motion to photon",
    R.help("How old the head's pose is when a person sees the frame that was drawn for it: the lag that is felt when the head turns. Low and even is good; frames for which nothing was drawn have none."),
    R.el("div", { class: "grid" }, over, shapes));
};

R.delays = function () {
  const over = R.chartOf("Inter-frame delay", "inter_frame_ms", { unit: "ms", lines: R.hertz, high: true, wide: true, log: true });
  const shapes = R.distribution("inter_frame_ms", true);
  if (!over && !shapes.length) return;
  R.section("delay", "Inter-frame delay",
    R.help("Time from the end of a frame to the end of the next; frames of a picture that stood are left out. Below the dashed line of a display, each of its refreshes gets a new picture. All charts over time zoom together: drag to zoom, double-click to see all; the time counts from the first frame of this page."),
    R.el("div", { class: "grid" }, over, shapes));
};

R.overTime = function () {
  const measured = [
    R.chartOf("Update age", "update_age_ms", { unit: "ms", log: true, help: "How long ago the newest data in the picture were asked for. It grows until the next update arrives." }),
    R.chartOf("View update latency", "latency_ms", { unit: "ms", log: true, points: true, help: "How long each view took from the viewer's request until all of it was there." }),
    R.chartOf("View construction", "construction_ms", { unit: "ms", log: true, help: "How long the viewer needed to draw each frame from what it had." }),
    R.chartOf("View updates a second", "updates_per_s", { unit: "1/s", help: "How many requested views became complete in each second." }),
    ...(R.several
      ? [R.chartOf("Sampled", "generating_mb_s", { unit: "MB/s", help: "What the samplers made, before anything was left out or compressed." }),
         R.chartOf("Sent", "transfer_mb_s", { unit: "MB/s", help: "What went over the network to the viewers." }),
         R.chartOf("Added to the viewer's model", "consuming_mb_s", { unit: "MB/s", help: "What viewers put into their models, uncompressed." })]
      : [R.chartOf("Data rates", ["generating_mb_s", "transfer_mb_s", "consuming_mb_s"], { unit: "MB/s", log: true, help: "Sampled: what samplers made, uncompressed. Sent: what went over the network after leaving out what viewers have, and compression. Added: what viewers put into their models, uncompressed." })]),
    R.chartOf("Points cached", "points_cached", { help: "How many points the viewer held." }),
    R.chartOf("Points drawn", "points_drawn", { help: "How many of them each frame drew." }),
    R.chartOf("Head moved since the data were asked for", "view_error_mm", { unit: "mm", help: "How far the head is from where it was when the newest data in the picture were asked for. The larger, the more of the view may be missing at edges." }),
    R.chartOf("Head turned since the data were asked for", "view_error_deg", { unit: "degrees", help: "How much the head has turned since then." }),
    R.chartOf("Holes", "holes_percent", { unit: "% of object pixels", points: true, help: "Pixels that show the background, or something far behind, where the data have a surface." }),
    R.chartOf("PSNR against direct rendering", "psnr_db", { unit: "dB", points: true, free: true, help: "How like the picture is to one that was drawn from all data without a network. More is better; above 40 differences are hard to see." }),
  ].filter((c) => c);
  if (measured.length) R.section("time", "Over time", R.help("What went on while the run lasted, all on one time axis."), R.el("div", { class: "grid" }, measured));
};
