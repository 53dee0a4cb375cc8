// The runs of a sweep: a row a configuration, and a small plot a figure. A configuration has the colour of its run below.
"use strict";

R.sweep = function () {
  const s = R.data.sweep;
  if (!s) return;
  const values = (c, kind) => c.runs.map((run) => run.figures[kind.key]).filter((v) => v !== undefined).sort((a, b) => a - b);
  const kinds = R.data.figures.filter((kind) => (kind.table === "tile" || ["age_p95", "ssim"].includes(kind.key)) && s.configurations.some((c) => values(c, kind).length));
  const median = (v) => (v[(v.length - 1) >> 1] + v[v.length >> 1]) / 2;
  const swatch = (c) => (c.shown === undefined ? null : R.runSwatch(c.shown));
  const name = (c) => c.values.join(", ") || c.name;

  const cell = (c, kind) => {
    const v = values(c, kind);
    if (!v.length) return R.el("td", { class: "number", text: "-" });
    const range = R.number(v[0]) === R.number(v[v.length - 1]) ? "" : ` (${R.number(v[0], 3)} to ${R.number(v[v.length - 1], 3)})`;
    const d = s.differences.find((x) => x.configuration === c.name && x.path === kind.path), differs = d && d.p < 0.05;
    const noisy = c.noisy.split(" ").includes(kind.path);
    const title = d ? `${R.signed(d.mean * kind.scale)} (${R.signed(d.low * kind.scale)} to ${R.signed(d.high * kind.scale)}) from the first, p ${R.number(d.p, 2)}` : null;
    return R.el("td", { class: "number" + (differs ? " better" : noisy ? " differs" : ""), title, text: R.number(median(v)) + range + (differs ? " *" : "") + (noisy ? " !" : "") });
  };
  const rows = s.configurations.map((c) => R.el("tr", {},
    c.values.map((v, i) => R.el("td", {}, i === 0 ? swatch(c) : null, v)),
    R.el("td", { class: "number", text: `${c.runs.filter((run) => run.state === "done").length}/${c.runs.length}` }), kinds.map((kind) => cell(c, kind))));
  const head = [...s.flags.map((text) => ({ text })), { text: "runs", number: true }, ...kinds.map((kind) => ({ text: kind.label + (kind.unit ? ", " + kind.unit : ""), number: true }))];

  const failed = s.configurations.flatMap((c) => c.runs.filter((run) => run.state === "failed").map((run) => `${name(c)}, run ${run.repetition}: ${run.reason}`));
  R.section("sweep", "The sweep",
    R.help("Median of the runs of each configuration, and the least and the most. *: differs from the first configuration (Welch's t test over the runs, p raised after Holm, below 0.05); point at a value for the difference and its 95 % interval. !: the runs differ by more than 10 %, the machine was too noisy to tell smaller differences. Below, the first run of each configuration is laid over the others."),
    failed.length ? R.el("div", { class: "notes" }, "Failed:", R.el("ul", {}, failed.map((text) => R.el("li", { text })))) : null,
    R.el("div", { class: "panel" }, R.table(head, rows)),
    R.el("div", { class: "grid", style: { marginTop: "14px" } }, kinds.map((kind) => plotOfFigure(kind, s.configurations, (c) => values(c, kind), median, name))));
};

// A column a configuration: a dot a run, a bar at the median.
function plotOfFigure(kind, configurations, values, median, name) {
  const all = configurations.flatMap(values), high = Math.max(...all, 0), free = ["psnr", "ssim"].includes(kind.key);
  const low = free ? Math.min(...all) : 0, top = high + (high - low || 1) * 0.08, left = 52, bottom = 22, height = 150;
  let width = 0;
  const canvas = R.canvas(height, (c, w) => {
    width = w;
    c.clearRect(0, 0, w, height);
    const y = (v) => 6 + (1 - (v - low) / (top - low)) * (height - bottom - 6), each = (w - left) / configurations.length;
    c.textAlign = "right";
    for (const v of R.ticks(low, top, 3)) {
      c.fillStyle = R.css("--line");
      c.fillRect(left, y(v), w - left, 0.6);
      c.fillStyle = R.css("--muted");
      c.fillText(R.short(v), left - 5, y(v) + 4);
    }
    c.textAlign = "center";
    configurations.forEach((one, i) => {
      const v = values(one), x = left + (i + 0.5) * each, letters = Math.floor(each / 6.4), text = name(one);
      c.fillStyle = R.css("--muted");
      if (letters > 3) c.fillText(text.length > letters ? text.slice(0, letters - 1) + "\u2026" : text, x, height - 6);
      if (!v.length) return;
      c.fillStyle = one.shown === undefined ? R.css("--muted") : R.colour(one.shown);
      const half = Math.min(16, each / 3);
      c.fillRect(x - half, y(median(v)) - 1, 2 * half, 2);
      for (const value of v) {
        c.beginPath();
        c.arc(x, y(value), 2.8, 0, 7);
        c.fill();
      }
    });
  });
  canvas.addEventListener("mousemove", (e) => {
    const i = Math.floor(((e.clientX - canvas.getBoundingClientRect().left - left) / (width - left)) * configurations.length);
    if (i < 0 || i >= configurations.length) return R.hideTip();
    R.tip(e, name(configurations[i]), values(configurations[i]).map((v) => ["", R.withUnit(v, kind.unit)]));
  });
  canvas.addEventListener("mouseleave", R.hideTip);
  return R.el("div", { class: "panel" }, R.el("h3", { text: kind.label + (kind.unit ? ", " + kind.unit : "") }), kind.meaning ? R.help(kind.meaning) : null, canvas);
}
