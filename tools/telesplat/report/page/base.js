// What all parts of the page use: elements, numbers, colours, the tooltip, the time that charts show.
"use strict";
const R = {};

R.data = JSON.parse(document.getElementById("data").textContent);
R.runs = R.data.runs;
R.several = R.runs.length > 1;

// An element. Text from the data goes in as text only, never as HTML.
R.el = function (tag, attributes, ...children) {
  const out = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes || {})) {
    if (value === undefined || value === null || value === false) continue;
    if (key === "text") out.textContent = value;
    else if (key === "style") Object.assign(out.style, value);
    else if (key.startsWith("on")) out.addEventListener(key.slice(2), value);
    else out.setAttribute(key, value);
  }
  for (const child of children.flat())
    if (child !== null && child !== undefined) out.append(child);
  return out;
};

// ---- numbers ----

R.number = function (v, digits) {
  if (v === null || v === undefined || !isFinite(v)) return "-";
  const size = Math.abs(v);
  if (size >= 1e5) return Math.round(v).toLocaleString("en-US").replace(/,/g, "\u202f");
  if (size === 0) return "0";
  const wanted = digits || 4;
  const places = Math.max(0, Math.min(6, wanted - 1 - Math.floor(Math.log10(size))));
  return String(Number(v.toFixed(places)));
};
R.withUnit = (v, unit, digits) =>
  v === null || v === undefined || !isFinite(v) ? "-" : R.number(v, digits) + (unit ? "\u202f" + unit : "");
R.signed = (v, digits) => (v > 0 ? "+" : v < 0 ? "\u2212" : "\u00b1") + R.number(Math.abs(v), digits);
R.percent = (share, digits) => (share === null || share === undefined ? "-" : R.number(100 * share, digits || 3) + "\u202f%");

// The last index whose value is at most x; -1: none. Values rise.
R.lastUpTo = function (values, x) {
  let low = 0, high = values.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (values[middle] <= x) low = middle + 1;
    else high = middle;
  }
  return low - 1;
};
R.nearest = function (values, x) {
  const i = R.lastUpTo(values, x);
  if (i < 0) return values.length ? 0 : -1;
  return i + 1 < values.length && values[i + 1] - x < x - values[i] ? i + 1 : i;
};

// ---- colours ----

const RUN_COLOURS = {
  light: ["#2563c9", "#d9730d", "#14866d", "#b5368a", "#7a55c7", "#0e8aa8", "#8f6a00", "#c43c3c", "#4d6b1f", "#5b6474", "#a04bd0", "#006d5b"],
  dark: ["#6ea8fe", "#ffa24d", "#4fd1a5", "#f080c0", "#b79bff", "#4fc3e0", "#e0b84a", "#ff8078", "#a8cf6a", "#a8b3c4", "#d694ff", "#5fd0bb"],
};
R.dark = () => document.documentElement.dataset.theme === "dark";
R.colour = (i) => RUN_COLOURS[R.dark() ? "dark" : "light"][i % 12];
R.css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// Network blue, queues orange, work green: of `n` of a group the i-th.
R.stageColour = function (group, i, n) {
  const at = n > 1 ? i / (n - 1) : 0.5;
  const [from, to] = { network: [205, 262], queue: [14, 50], work: [92, 182] }[group] || [0, 0];
  const light = (R.dark() ? 56 : 48) + (i % 2 ? 9 : -5);
  return `hsl(${from + at * (to - from)} ${group === "work" ? 48 : 72}% ${light}%)`;
};

// From dark blue over green to yellow (viridis, at 9 places).
const SCALE = [[68, 1, 84], [72, 40, 120], [62, 74, 137], [49, 104, 142], [38, 130, 142], [31, 158, 137], [53, 183, 121], [110, 206, 88], [253, 231, 37]];
R.scale = function (share) {
  const at = Math.max(0, Math.min(1, isFinite(share) ? share : 0)) * (SCALE.length - 1);
  const i = Math.min(SCALE.length - 2, Math.floor(at)), f = at - i;
  return "rgb(" + SCALE[i].map((c, k) => Math.round(c + f * (SCALE[i + 1][k] - c))).join(",") + ")";
};

// ---- the theme: as the system has it, until somebody chooses ----

R.redraws = []; // called when colours or widths have changed
R.redraw = () => R.redraws.forEach((draw) => draw());
R.setTheme = function (theme) {
  document.documentElement.dataset.theme = theme;
  R.redraw();
};
const systemIsDark = window.matchMedia("(prefers-color-scheme: dark)");
document.documentElement.dataset.theme = systemIsDark.matches ? "dark" : "light";
systemIsDark.addEventListener("change", (e) => R.setTheme(e.matches ? "dark" : "light"));

// ---- tooltip ----

R.tip = function (event, head, rows) {
  const box = document.getElementById("tooltip");
  box.replaceChildren(
    R.el("div", { class: "head", text: head }),
    ...rows.map(([what, value, colour]) =>
      R.el("div", { class: "row" },
        R.el("span", {}, colour ? R.el("i", { class: "swatch", style: { background: colour } }) : null, what),
        R.el("span", { text: value }))));
  box.hidden = false;
  const x = event.clientX + 16, y = event.clientY + 14;
  box.style.left = Math.min(x, window.innerWidth - box.offsetWidth - 8) + "px";
  box.style.top = (y + box.offsetHeight > window.innerHeight ? event.clientY - box.offsetHeight - 10 : y) + "px";
};
R.hideTip = () => (document.getElementById("tooltip").hidden = true);

// ---- canvases of our own ----

// A canvas as wide as its parent; draw(context, width, height) in CSS pixels.
R.canvas = function (height, draw) {
  const out = R.el("canvas", { class: "own" });
  out.redraw = function () {
    const width = out.parentElement ? out.parentElement.clientWidth : 0;
    const sides = out.parentElement ? getComputedStyle(out.parentElement) : null;
    const inner = sides ? width - parseFloat(sides.paddingLeft) - parseFloat(sides.paddingRight) : 0;
    if (inner < 10) return;
    const high = typeof height === "function" ? height() : height, ratio = Math.max(2, window.devicePixelRatio || 1);
    out.width = Math.round(inner * ratio);
    out.height = Math.round(high * ratio);
    out.style.height = high + "px";
    const context = out.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.font = "11.5px system-ui, 'DejaVu Sans', sans-serif";
    draw(context, inner, high);
  };
  R.redraws.push(out.redraw);
  return out;
};

// Round numbers from low to high, about `count` of them.
R.ticks = function (low, high, count) {
  const rough = (high - low) / Math.max(1, count), power = Math.pow(10, Math.floor(Math.log10(rough)));
  const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= rough) || power;
  const out = [];
  for (let v = Math.ceil(low / step) * step; v <= high + step * 1e-9; v += step) out.push(Number(v.toPrecision(12)));
  return out;
};

R.section = function (id, title, ...children) {
  const out = R.el("section", { id }, R.el("h2", { text: title }), ...children);
  document.getElementById("main").append(out);
  R.sections.push([id, title]);
  return out;
};
R.sections = [];
// A sentence that says what a part of the page shows.
R.help = (text) => R.el("p", { class: "muted help", text });
R.legendOfRuns = () =>
  R.el("div", { class: "legend" }, R.runs.map((run, i) => R.el("span", {}, R.runSwatch(i), run.name)));
R.runSwatch = function (i) {
  const out = R.el("i", { class: "swatch" });
  const paint = () => (out.style.background = R.colour(i));
  paint();
  R.redraws.push(paint);
  return out;
};
