// Workflow timelines, as figures 6.1 to 6.3 of the thesis: who did what when, from trace.json.
"use strict";

const ROLES = ["viewer", "packer", "sampler", "data", "master", ""];
const LANES = ["display", "update", "receive", "epochs"];
const SPAN_HUES = { "display frame": 214, "wait for update": 45, "view update": 262, view: 262, decode: 178, insert: 150, pack: 22, plan: 330, settle: 55, sample: 128, encode: 90, "add chunks": 195, "add voxels": 195, lease: 240, "epoch held": 0, fetch: 195, publish: 10 };
// Names of spans, in the order in which a view update meets them.
const SPAN_WORDS = {
  "view update": "from a viewer's request until the whole view is there", view: "a view, from its turn at the master until it is complete", lease: "a sampler has this tile to do",
  plan: "the packer finds out which rays of a view are needed", "plan of extra rays": "the packer looks for rays worth casting beyond what the view asked for", "add chunks": "a sampler builds what it needs to cast rays into new data", "add voxels": "a sampler takes new voxels in", "arrange voxels": "a sampler orders its voxels for the direction of view",
  sample: "a sampler casts the rays of a tile", encode: "a sampler compresses what it sampled", pack: "the packer drops what viewers have and compresses the rest",
  settle: "the packer adds what it has sent to its own copy of the model", decode: "a viewer unpacks what came", insert: "a viewer adds it to its model", refine: "points that were sent with small errors become exact",
  "display frame": "a viewer draws a frame", "wait for update": "a viewer waits before it draws, as its coupling asks", "epoch held": "a viewer shows the old scene until the new one covers the view",
};
const ROW = 17, GUTTER = 148, AXIS = 22, STRIP = 16, MOST_SUB_ROWS = 8;

function spanColour(name) {
  let hue = SPAN_HUES[name];
  if (hue === undefined) hue = [...name].reduce((h, ch) => (h * 31 + ch.charCodeAt(0)) % 360, 7);
  return `hsl(${hue} ${R.dark() ? 45 : 55}% ${R.dark() ? 48 : 66}%)`;
}

// Events of each lane in rows in which they do not overlap.
function layOut(trace) {
  const order = trace.lanes.map((lane, i) => ({ ...lane, i, events: [], rows: 1 }));
  let begin = 0;
  trace.begin.forEach((d, k) => {
    begin += d;
    order[trace.lane[k]].events.push({ begin, end: begin + trace.duration[k], k });
  });
  const rank = (list, v) => (list.indexOf(v) < 0 ? list.length : list.indexOf(v));
  const lanes = order.filter((lane) => lane.events.length);
  lanes.sort((a, b) => rank(ROLES, a.role) - rank(ROLES, b.role) || a.process.localeCompare(b.process, "en", { numeric: true }) || rank(LANES, a.lane) - rank(LANES, b.lane) || a.tid - b.tid);
  let top = 0;
  for (const lane of lanes) {
    const ends = [];
    for (const e of lane.events) {
      let row = ends.findIndex((end) => end <= e.begin + 1);
      if (row < 0) row = ends.length < MOST_SUB_ROWS ? ends.length : MOST_SUB_ROWS - 1;
      ends[row] = Math.max(ends[row] || -Infinity, e.end);
      e.row = row;
    }
    lane.rows = Math.max(1, ends.length);
    lane.top = top;
    top += lane.rows * ROW + 5;
  }
  return { lanes, height: top };
}

// A few hundred ms in the middle of the run, around one or two view updates.
function firstView(trace, lanes) {
  const windows = trace.windows, [a, b] = windows[Math.floor(windows.length / 2)] || [0, 1e6], middle = (a + b) / 2;
  const updates = lanes.flatMap((lane) => lane.events).filter((e) => trace.names[trace.name[e.k]] === "view update" && e.begin < b && e.end > a);
  updates.sort((p, q) => Math.abs(p.begin - middle) - Math.abs(q.begin - middle));
  let length = 400e3, from = middle - length / 2;
  if (updates.length) {
    const e = updates[0];
    length = Math.max(80e3, Math.min(900e3, 2.2 * (e.end - e.begin)));
    from = e.begin - length * 0.12;
  }
  return [from, from + length];
}

class Timeline {
  constructor(run, index) {
    this.run = run, this.trace = run.trace, this.index = index;
    Object.assign(this, layOut(this.trace));
    this.whole = [Math.min(0, ...this.trace.windows.map((w) => w[0])), Math.max(run.duration_s * 1e6, ...this.trace.windows.map((w) => w[1]))];
    this.home = firstView(this.trace, this.lanes);
    this.view = this.home.slice();
    this.canvas = R.canvas(() => AXIS + STRIP + this.height + 4, (c, w, h) => this.draw(c, w, h));
    this.where = R.el("span", { class: "muted small" });
    this.listen();
  }

  panel() {
    const t = this.trace;
    const button = (text, title, act) => R.el("button", { text, title, onclick: act });
    const windows = R.el("select", { onchange: (e) => this.go(e.target.value) }, R.el("option", { value: "", text: t.all ? "all of the run" : "parts of the run in this page" }),
      t.all ? [] : t.windows.map(([a, b], i) => R.el("option", { value: String(i), text: `at ${R.number((a + b) / 2e6, 4)} s (${R.number((b - a) / 1e6, 3)} s)` })));
    const tools = R.el("div", { class: "tools no-print" }, button("\u2212", "show more time", () => this.zoom(1.6)), button("+", "show less time", () => this.zoom(1 / 1.6)),
      button("\u25c0", "earlier", () => this.pan(-0.5)), button("\u25b6", "later", () => this.pan(0.5)), button("reset", "back to the middle of the run", () => this.show(...this.home)), t.all ? null : windows, this.where);
    const told = t.all ? "" : `This page holds ${R.number(t.begin.length)} of ${R.number(t.of)} spans: those of ${t.windows.length} parts of the run, evenly chosen (shaded above the timeline). `;
    const damage = (t.whole ? "" : "trace.json ends in the middle; what could be read is shown. ") + (t.left_out ? `${R.number(t.left_out)} spans that make no sense or are too many are left out. ` : "") + (t.open ? `${R.number(t.open)} spans have no end and are left out.` : "");
    return R.el("div", { class: "panel", style: { marginBottom: "12px" } },
      R.el("div", { class: "chart-head" }, R.el("h3", {}, R.several ? R.runSwatch(this.index) : null, (R.several ? this.run.name + ", " : "") + (R.fact(this.run, "coupling") ? R.fact(this.run, "coupling") + " coupling" : "all processes")), tools),
      this.canvas, told || damage ? R.el("div", { class: "muted small", text: told + damage }) : null);
  }

  x(us) { return GUTTER + ((us - this.view[0]) / (this.view[1] - this.view[0])) * (this.width - GUTTER - 4); }
  us(x) { return this.view[0] + ((x - GUTTER) / (this.width - GUTTER - 4)) * (this.view[1] - this.view[0]); }

  show(from, to) {
    const least = 200, most = (this.whole[1] - this.whole[0]) * 1.05, middle = (from + to) / 2, length = Math.max(least, Math.min(most, to - from));
    this.view = [middle - length / 2, middle + length / 2];
    this.canvas.redraw();
  }
  zoom(factor, at) {
    const m = at === undefined ? (this.view[0] + this.view[1]) / 2 : at;
    this.show(m - (m - this.view[0]) * factor, m + (this.view[1] - m) * factor);
  }
  pan(share) {
    const d = share * (this.view[1] - this.view[0]);
    this.show(this.view[0] + d, this.view[1] + d);
  }
  go(which) {
    if (which === "") return this.show(...this.whole);
    const [a, b] = this.trace.windows[Number(which)];
    this.show(a, b);
  }

  // ---- drawing ----

  draw(c, w, h) {
    this.width = w;
    c.clearRect(0, 0, w, h);
    this.drawStrip(c, w);
    this.drawAxis(c, w, h);
    for (const lane of this.lanes) this.drawLane(c, w, lane);
    this.drawDelays(c);
    this.where.textContent = `${R.number(this.view[0] / 1e6, 6)} s, ${R.withUnit((this.view[1] - this.view[0]) / 1e3, "ms", 3)} wide`;
  }

  // The whole run, the parts that are here, and where we look.
  drawStrip(c, w) {
    const at = (us) => GUTTER + ((us - this.whole[0]) / (this.whole[1] - this.whole[0])) * (w - GUTTER - 4);
    c.fillStyle = R.css("--faint");
    c.fillRect(GUTTER, 2, w - GUTTER - 4, STRIP - 7);
    c.fillStyle = R.css("--line");
    for (const [a, b] of this.trace.windows) c.fillRect(at(a), 2, Math.max(2, at(b) - at(a)), STRIP - 7);
    c.fillStyle = R.css("--accent");
    c.fillRect(at(this.view[0]), 2, Math.max(3, at(this.view[1]) - at(this.view[0])), STRIP - 7);
    c.fillStyle = R.css("--muted");
    c.textAlign = "left";
    c.fillText("whole run", 2, 11);
  }

  drawAxis(c, w, h) {
    c.textAlign = "center";
    c.lineWidth = 0.7;
    for (const ms of R.ticks(this.view[0] / 1e3, this.view[1] / 1e3, (w - GUTTER) / 110)) {
      const x = this.x(ms * 1e3);
      if (x < GUTTER) continue;
      c.strokeStyle = R.css("--line");
      c.beginPath();
      c.moveTo(x, STRIP + AXIS - 5);
      c.lineTo(x, h);
      c.stroke();
      c.fillStyle = R.css("--muted");
      if (x > GUTTER + 24 && x < w - 30) c.fillText((ms / 1e3).toFixed(this.view[1] - this.view[0] < 2e4 ? 4 : 3) + " s", x, STRIP + 11);
    }
  }

  drawLane(c, w, lane) {
    const top = STRIP + AXIS + lane.top;
    c.strokeStyle = R.css("--line");
    c.lineWidth = 0.7;
    c.beginPath();
    c.moveTo(0, top - 2.5);
    c.lineTo(w, top - 2.5);
    c.stroke();
    c.fillStyle = R.css("--text");
    c.textAlign = "left";
    const text = [lane.process, lane.lane].filter((s) => s).join(" ");
    let fitting = text;
    while (fitting.length > 1 && c.measureText(fitting + "\u2026").width > GUTTER - 8) fitting = fitting.slice(0, -1);
    c.fillText(fitting === text || c.measureText(text).width <= GUTTER - 8 ? text : fitting + "\u2026", 2, top + 12);
    c.save();
    c.beginPath();
    c.rect(GUTTER, top - 2, w - GUTTER, lane.rows * ROW + 4);
    c.clip();
    const marked = this.marked, lastX = new Array(lane.rows).fill(-1);
    for (const e of lane.events) {
      if (e.end < this.view[0] || e.begin > this.view[1]) continue;
      const x0 = Math.max(GUTTER - 2, this.x(e.begin)), x1 = Math.min(w, this.x(e.end));
      // What is narrower than half a pixel and stands where something stands already is not drawn again.
      if (x1 < lastX[e.row] + 0.5 && !marked) continue;
      lastX[e.row] = x1;
      const name = this.trace.names[this.trace.name[e.k]], y = top + e.row * ROW;
      c.globalAlpha = marked && !this.alike(e.k) ? 0.35 : 1;
      c.fillStyle = spanColour(name);
      c.fillRect(x0, y, Math.max(1, x1 - x0 - 0.4), ROW - 3);
      c.globalAlpha = 1;
      if (x1 - x0 > 34) this.label(c, name, e, x0, x1, y);
    }
    c.restore();
  }

  label(c, name, e, x0, x1, y) {
    const ids = ["request", "frame", "tile"].map((k) => [k, this.trace[k][e.k]]).filter(([, v]) => v >= 0).map(([k, v]) => k + " " + v).join(", ");
    c.fillStyle = R.dark() ? "#f4f7fb" : "#10202e";
    c.textAlign = "left";
    const room = Math.floor((x1 - x0 - 6) / 6);
    const text = ids && name.length + ids.length + 2 <= room ? name + ": " + ids : name;
    if (text.length <= room) c.fillText(text, x0 + 3, y + 11);
    else if (room > 4) c.fillText(text.slice(0, room - 1) + "\u2026", x0 + 3, y + 11);
  }

  // The inter-frame delay between the ends of two displayed frames, as the thesis marks it.
  drawDelays(c) {
    const lane = this.lanes.find((l) => l.lane === "display");
    if (!lane) return;
    const frames = lane.events.filter((e) => this.trace.names[this.trace.name[e.k]] === "display frame" && e.end > this.view[0] && e.end < this.view[1]);
    if (frames.length < 2 || frames.length > 40) return;
    const y = STRIP + AXIS + lane.top + ROW - 2;
    c.strokeStyle = c.fillStyle = R.css("--mark");
    c.lineWidth = 1.2;
    for (let i = 1; i < frames.length; ++i) {
      const a = this.x(frames[i - 1].end), b = this.x(frames[i].end);
      c.beginPath();
      c.moveTo(a + 1, y);
      c.lineTo(b - 1, y);
      c.moveTo(b - 0.5, y - 4);
      c.lineTo(b - 0.5, y + 3);
      c.stroke();
    }
  }

  // ---- hovering ----

  alike(k) {
    const t = this.trace, m = this.marked.k;
    if (t.request[m] < 0 && t.frame[m] < 0) return true;
    if (t.request[m] >= 0 && t.request[k] >= 0) return t.request[k] === t.request[m];
    // Of displayed frames the number is another than that of sampled ones.
    const shown = (i) => ["display frame", "wait for update"].includes(t.names[t.name[i]]);
    if (t.frame[m] < 0 || t.frame[k] !== t.frame[m] || shown(m) !== shown(k)) return false;
    return t.tile[m] < 0 || t.tile[k] < 0 || t.tile[k] === t.tile[m];
  }
  at(x, y) {
    const us = this.us(x), slack = (this.view[1] - this.view[0]) / (this.width - GUTTER) * 1.5;
    const lane = this.lanes.find((l) => y >= STRIP + AXIS + l.top && y < STRIP + AXIS + l.top + l.rows * ROW);
    if (!lane || x < GUTTER) return null;
    const row = Math.floor((y - STRIP - AXIS - lane.top) / ROW);
    let found = null;
    for (const e of lane.events) if (e.row === row && e.begin - slack <= us && e.end + slack >= us && (!found || e.end - e.begin <= found.end - found.begin)) found = e;
    return found ? { e: found, lane, k: found.k } : null;
  }

  listen() {
    const place = (e) => { const r = this.canvas.getBoundingClientRect(); return [e.clientX - r.left, e.clientY - r.top]; };
    let drag = null;
    this.canvas.tabIndex = 0;
    this.canvas.style.cursor = "grab";
    this.canvas.addEventListener("pointerdown", (e) => {
      const [x, y] = place(e);
      if (y < STRIP && x > GUTTER) {
        const at = this.whole[0] + ((x - GUTTER) / (this.width - GUTTER - 4)) * (this.whole[1] - this.whole[0]), half = (this.view[1] - this.view[0]) / 2;
        return this.show(at - half, at + half);
      }
      drag = { x, view: this.view.slice() };
      this.canvas.setPointerCapture(e.pointerId);
    });
    this.canvas.addEventListener("pointerup", () => (drag = null));
    this.canvas.addEventListener("pointermove", (e) => {
      const [x, y] = place(e);
      if (drag) {
        const d = ((drag.x - x) / (this.width - GUTTER)) * (drag.view[1] - drag.view[0]);
        return this.show(drag.view[0] + d, drag.view[1] + d);
      }
      const found = this.at(x, y), before = this.marked;
      this.marked = found;
      if ((found && found.k) !== (before && before.k)) this.canvas.redraw();
      found ? this.tell(e, found) : R.hideTip();
    });
    this.canvas.addEventListener("pointerleave", () => { this.marked = null; this.canvas.redraw(); R.hideTip(); });
    this.canvas.addEventListener("dblclick", () => this.show(...this.home));
    // The wheel scrolls the page unless the timeline was clicked, or Ctrl is held.
    this.canvas.addEventListener("wheel", (e) => {
      if (!e.ctrlKey && document.activeElement !== this.canvas) return;
      e.preventDefault();
      this.zoom(e.deltaY > 0 ? 1.25 : 0.8, this.us(place(e)[0]));
    }, { passive: false });
  }
  tell(event, { e, lane, k }) {
    const t = this.trace;
    const ids = ["request", "frame", "tile"].filter((what) => t[what][k] >= 0).map((what) => [what, R.id(t[what][k])]);
    R.tip(event, t.names[t.name[k]], [["who", [lane.process, lane.lane].filter((s) => s).join(" ")], ...ids, ["begins", (e.begin / 1e6).toFixed(6) + "\u202fs"], ["lasts", R.withUnit((e.end - e.begin) / 1e3, "ms")]]);
  }
}

// Of several runs the first views are equally long, so that they compare.
R.sameScale = function (lines) {
  const length = Math.max(0, ...lines.filter((line) => line).map((line) => line.home[1] - line.home[0]));
  for (const line of lines)
    if (line) {
      line.home = [line.home[0], line.home[0] + length];
      line.view = line.home.slice();
    }
  return lines;
};

R.timelines = function () {
  const lines = R.runs.map((run, i) => (run.trace.why ? null : new Timeline(run, i)));
  R.section("timeline", "Workflow timeline",
    R.help("Who did what when: a row for each process, a bar for each thing it did. Drag to move; buttons, or the wheel after a click, zoom; a double-click goes back. Pointing at a bar tells its times and marks what belongs to the same request or tile."),
    R.el("details", { class: "muted" }, R.el("summary", { text: "What the bars are" }), R.el("dl", { class: "words" },
      Object.entries(SPAN_WORDS).filter(([name]) => R.runs.some((run) => (run.trace.names || []).includes(name))).flatMap(([name, words]) => [R.el("dt", { text: name }), R.el("dd", { text: words })])),
      R.el("p", { text: "The yellow line below the frames goes from the end of one to the end of the next: the inter-frame delay." })),
    R.sameScale(lines).map((line, i) => (line ? line.panel() : R.el("div", { class: "notes", text: (R.several ? R.runs[i].name + ": " : "") + "no timeline: " + R.runs[i].trace.why }))));
};
