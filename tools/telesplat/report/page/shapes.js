// Distributions of frames' delays: histogram and cumulative, over a logarithmic scale of milliseconds.
"use strict";

const BINS_PER_OCTAVE = 16;
R.edge = (bin) => Math.pow(2, bin / BINS_PER_OCTAVE);

// Which runs have it, and the part of the scale that they need: from a little below the least to above the greatest.
function extent(spreads) {
  const least = Math.min(...spreads.map((s) => s.quantiles[Math.min(2, s.quantiles.length - 1)][0]), 10);
  const most = Math.max(...spreads.map((s) => s.max), 20);
  return [Math.max(0.1, least * 0.85), most * 1.1];
}

// A plot whose x is logarithmic; draw(context, x(ms), y(share), area), hover(ms) gives rows.
function logPlot(title, help, [low, high], top, yLabel, lines, draw, hover) {
  const height = 236, left = 46, bottom = 24, right = 10, above = 20;
  let width = 0;
  const span = Math.log(high / low);
  const x = (ms) => left + (Math.log(Math.max(low, ms) / low) / span) * (width - left - right);
  const y = (v) => above + (1 - v / top) * (height - bottom - above);
  const canvas = R.canvas(height, (c, w) => {
    width = w;
    c.clearRect(0, 0, w, height);
    c.fillStyle = R.css("--muted");
    c.strokeStyle = R.css("--line");
    c.lineWidth = 0.7;
    c.textAlign = "right";
    for (const v of R.ticks(0, top, 4)) {
      c.beginPath();
      c.moveTo(left, y(v));
      c.lineTo(w - right, y(v));
      c.stroke();
      c.fillText(yLabel(v), left - 5, y(v) + 4);
    }
    c.textAlign = "center";
    for (let power = -1; power < 5; ++power)
      for (const f of span > 5 ? [1, 3] : [1, 2, 5]) {
        const ms = f * Math.pow(10, power);
        if (ms < low || ms > high) continue;
        c.beginPath();
        c.moveTo(x(ms), height - bottom);
        c.lineTo(x(ms), height - bottom + 4);
        c.stroke();
        c.fillText(R.number(ms) + (x(ms) < w - 60 ? "" : " ms"), Math.min(x(ms), w - 24), height - 7);
      }
    draw(c, x, y);
    c.strokeStyle = c.fillStyle = R.css("--mark");
    c.setLineDash([4, 4]);
    c.lineWidth = 1;
    // Above the picture; where there is no room the middle one goes without.
    const narrow = x(1000 / 60) - x(1000 / 90) < 110, none = x(1000 / 60) - x(1000 / 90) < 50;
    for (const line of lines) {
      if (line.x < low || line.x > high) continue;
      c.beginPath();
      c.moveTo(x(line.x), above);
      c.lineTo(x(line.x), height - bottom);
      c.stroke();
      if (line.hz === 72 && none) continue;
      c.textAlign = !narrow || line.hz === 72 ? "center" : line.hz === 90 ? "right" : "left";
      c.fillText(narrow && line.hz !== 60 ? String(line.hz) : line.label, x(line.x), above - 5);
    }
    c.setLineDash([]);
  });
  canvas.addEventListener("mousemove", (e) => {
    const at = (e.clientX - canvas.getBoundingClientRect().left - left) / (width - left - right);
    if (at < 0 || at > 1) return R.hideTip();
    const ms = low * Math.exp(at * span);
    const [head, rows] = hover(ms);
    R.tip(e, head, rows);
  });
  canvas.addEventListener("mouseleave", R.hideTip);
  return R.el("div", { class: "panel" }, R.el("h3", { text: title }), R.help(help), canvas);
}

// key: of run.spreads. refreshes: its frames are held against those of displays.
R.distribution = function (key, refreshes) {
  const runs = R.runs.map((run, i) => [run, i]).filter(([run]) => run.spreads[key]);
  if (!runs.length) return [];
  const spreads = runs.map(([run]) => run.spreads[key]), lines = refreshes ? R.hertz : [];
  const range = extent(spreads);
  const shares = spreads.map((s) => new Map(s.bins.map(([bin, count]) => [bin, count / s.n])));
  const top = Math.max(...shares.map((m) => Math.max(...m.values())));
  const histogram = logPlot("Distribution", "Which delays are usual: the higher a bar, the more frames took that long.", range, top * 1.05, (v) => R.percent(v, 2), lines,
    (c, x, y) => shares.forEach((bins, k) => {
      c.fillStyle = c.strokeStyle = R.colour(runs[k][1]);
      for (const [bin, share] of bins) {
        const from = x(R.edge(bin)), to = x(R.edge(bin + 1));
        c.globalAlpha = spreads.length > 1 ? 0.35 : 0.8;
        c.fillRect(from, y(share), Math.max(1, to - from - 0.5), y(0) - y(share));
        c.globalAlpha = 1;
        c.fillRect(from, y(share), Math.max(1, to - from - 0.5), 1.5);
      }
    }),
    (ms) => {
      const bin = Math.floor(Math.log2(ms) * BINS_PER_OCTAVE);
      return [`${R.number(R.edge(bin), 3)} to ${R.number(R.edge(bin + 1), 3)}\u202fms`,
        shares.map((bins, k) => [runs[k][0].name, R.percent(bins.get(bin) || 0), R.colour(runs[k][1])])];
    });
  const shareUpTo = (s, ms) => {
    const i = R.lastUpTo(s.quantiles.map((q) => q[0]), ms);
    if (i < 0) return 0;
    const [a, p] = s.quantiles[i], next = s.quantiles[i + 1];
    return next && next[0] > a ? p + ((ms - a) / (next[0] - a)) * (next[1] - p) : p;
  };
  const cumulative = logPlot("Share of frames at most as slow", "The farther left the curve rises, the faster the frames; where it reaches 95 % is the p95.", range, 1, (v) => R.percent(v, 3), lines,
    (c, x, y) => spreads.forEach((s, k) => {
      c.strokeStyle = R.colour(runs[k][1]);
      c.lineWidth = 1.8;
      c.beginPath();
      c.moveTo(x(range[0]), y(0));
      for (const [ms, share] of s.quantiles) c.lineTo(x(ms), y(share));
      c.lineTo(x(range[1]), y(1));
      c.stroke();
    }),
    (ms) => [`at most ${R.number(ms, 3)}\u202fms`, spreads.map((s, k) => [runs[k][0].name, R.percent(shareUpTo(s, ms), 4), R.colour(runs[k][1])])]);
  const hertz = refreshes ? ["60", "72", "90"] : [];
  const rows = runs.map(([run, i], k) => R.el("tr", {},
    R.el("td", {}, R.several ? R.runSwatch(i) : null, R.several ? run.name : "frames"),
    hertz.map((hz) => R.el("td", { class: "number", text: R.percent(spreads[k].within[hz], 4) })),
    ["median", "p95", "p99", "max", "sd"].map((q) => R.el("td", { class: "number", text: R.withUnit(spreads[k][q], "ms") }))));
  const table = R.el("div", { class: "panel wide" },
    R.table([{ text: "" }, ...hertz.map((hz) => ({ text: "within " + hz + " Hz", number: true })), ...["median", "p95", "p99", "longest", "standard deviation"].map((q) => ({ text: q, number: true }))], rows),
    refreshes ? R.el("p", { class: "muted small", text: "Within: the delay is at most 5 % longer than the period of such a display (16.7, 13.9, 11.1 ms)." }) : null);
  return [histogram, cumulative, table];
};
