// The walk from above, and pictures along it.
"use strict";

R.walk = function () {
  const runs = R.runs.map((run, i) => [run, i]).filter(([run]) => run.walk);
  const pictures = R.runs.filter((run) => run.pictures.shown.length || run.pictures.compared.length);
  if (!runs.length && !pictures.length) return;
  const section = R.section("walk", "The walk", R.help("Where the head went, and what it saw there."));
  if (runs.length) section.append(R.el("div", { class: "walk" }, R.map(runs), R.shownPictures()));
  else section.append(R.shownPictures());
  const compared = R.comparedPictures();
  if (compared) section.append(compared);
};

const MAP_COLOURS = {
  time: ["time", (w) => w.t, "s"], inter_frame_ms: ["inter-frame delay", (w) => w.inter_frame_ms, "ms"],
  update_age_ms: ["update age", (w) => w.update_age_ms, "ms"], view_error_deg: ["head turned since the data were asked for", (w) => w.view_error_deg, "degrees"],
  holes_percent: ["holes, where verified", null, "%"],
};

R.map = function (runs) {
  const choice = R.el("select", { class: "no-print" }, R.several ? R.el("option", { value: "run", text: "colour: run" }) : null,
    Object.entries(MAP_COLOURS).filter(([key]) => key !== "holes_percent" || runs.some(([run]) => run.series.holes_percent))
      .map(([key, [label]]) => R.el("option", { value: key, text: "colour: " + label })));
  const key = R.el("span", { class: "muted small" });
  let places = []; // [x, y, run, index] on the screen
  const canvas = R.canvas(430, (c, w, h) => {
    places = drawMap(c, w, h, runs, choice.value, key);
  });
  choice.addEventListener("change", () => canvas.redraw());
  R.time.listeners.push(() => canvas.redraw());
  R.highlightFrame = (run, t) => {
    canvas.redraw();
    const found = t === undefined ? null : places.filter((p) => p[2] === run).reduce((a, p) => (!a || Math.abs(run.walk.t[p[3]] - t) < Math.abs(run.walk.t[a[3]] - t) ? p : a), null);
    R.time.point(t === undefined ? null : t);
    if (!found) return;
    const c = canvas.getContext("2d");
    c.strokeStyle = R.css("--text");
    c.lineWidth = 2;
    c.beginPath();
    c.arc(found[0], found[1], 8, 0, 7);
    c.stroke();
  };
  canvas.addEventListener("mousemove", (e) => {
    const r = canvas.getBoundingClientRect(), x = e.clientX - r.left, y = e.clientY - r.top;
    let best = null, near = 14 * 14;
    for (const p of places) {
      const d = (p[0] - x) ** 2 + (p[1] - y) ** 2;
      if (d < near) (near = d), (best = p);
    }
    if (!best) { R.time.point(null); return R.hideTip(); }
    const [, , run, i] = best, m = run.walk;
    R.time.point(m.t[i]);
    R.tip(e, (R.several ? run.name + ", " : "") + R.number(m.t[i], 5) + "\u202fs", [
      ["frame", R.id(m.frame[i])], ["position", [m.x[i], m.y[i], m.z[i]].map((v) => R.number(v, 3)).join(", ") + "\u202fm"],
      ["inter-frame delay", R.withUnit(m.inter_frame_ms[i], "ms")], ["update age", R.withUnit(m.update_age_ms[i], "ms")], ["turned since the data were asked for", R.withUnit(m.view_error_deg[i], "degrees")]]);
  });
  canvas.addEventListener("mouseleave", () => { R.hideTip(); R.time.point(null); });
  const thin = runs.filter(([run]) => run.walk.of > run.walk.t.length);
  return R.el("div", { class: "panel" }, R.el("div", { class: "chart-head" }, R.el("h3", { text: "From above" }), choice), R.help("Where the head was in the room, and at which places things went well or badly. Numbers are the pictures beside."), canvas, key,
    thin.length ? R.el("div", { class: "muted small", text: `${thin.map(([run]) => `${run.walk.t.length} of ${R.number(run.walk.of)} poses`).join(", ")}: of each part the frame that came latest.` }) : null);
};

function drawMap(c, w, h, runs, colouring, key) {
  c.clearRect(0, 0, w, h);
  const room = runs.map(([run]) => Number(((run.config || "").match(/^room_size = ([0-9.]+)/m) || [])[1])).find((v) => v > 0);
  const xs = [0], zs = [0];
  for (const [run] of runs) run.walk.x.forEach((x, i) => (xs.push(x), zs.push(run.walk.z[i])));
  if (room) xs.push(-room / 2, room / 2), zs.push(-room / 2, room / 2);
  const [x0, x1, z0, z1] = [Math.min(...xs), Math.max(...xs), Math.min(...zs), Math.max(...zs)];
  const margin = 26, scale = Math.min((w - 2 * margin) / Math.max(0.05, x1 - x0), (h - 2 * margin - 12) / Math.max(0.05, z1 - z0));
  const X = (x) => w / 2 + (x - (x0 + x1) / 2) * scale, Y = (z) => (h - 12) / 2 + (z - (z0 + z1) / 2) * scale;
  c.strokeStyle = R.css("--line");
  c.fillStyle = R.css("--muted");
  if (room) {
    c.setLineDash([5, 4]);
    c.strokeRect(X(-room / 2), Y(-room / 2), room * scale, room * scale);
    c.setLineDash([]);
  }
  c.textAlign = "center";
  c.fillText("+", X(0), Y(0) + 4);
  c.fillText(room ? `data, at most ${R.number(room)} m` : "data", X(0), Y(0) + 18);
  drawRuler(c, w, h, scale);
  const of = MAP_COLOURS[colouring], places = [];
  let low = Infinity, high = -Infinity;
  const values = runs.map(([run]) => (of ? mapValues(run, colouring) : []));
  // The slowest of a hundred do not take all of the scale.
  const known = values.flat().filter((v) => v !== null && isFinite(v)).sort((a, b) => a - b);
  if (known.length) (low = known[0]), (high = known[Math.floor((known.length - 1) * (colouring === "time" ? 1 : 0.98))]);
  runs.forEach(([run, r], k) => {
    const m = run.walk;
    m.t.forEach((t, i) => {
      const inside = t >= R.time.now[0] && t <= R.time.now[1], v = of ? values[k][i] : 0;
      c.globalAlpha = inside ? 1 : 0.12;
      c.fillStyle = !of ? R.colour(r) : v === null || !isFinite(v) ? R.css("--line") : R.scale((v - low) / (high - low || 1));
      c.beginPath();
      c.arc(X(m.x[i]), Y(m.z[i]), 2.6, 0, 7);
      c.fill();
      places.push([X(m.x[i]), Y(m.z[i]), run, i]);
    });
    c.globalAlpha = 1;
    drawMoments(c, run, X, Y);
  });
  key.replaceChildren(...(of ? [`${of[0]}: `, R.el("i", { class: "swatch", style: { background: R.scale(0) } }), R.withUnit(low, of[2], 3) + " to ", R.el("i", { class: "swatch", style: { background: R.scale(1), marginLeft: "5px" } }), R.withUnit(high, of[2], 3) + (colouring === "time" ? "" : " and above")] : [R.legendOfRuns()]));
  return places;
}

function mapValues(run, colouring) {
  if (colouring !== "holes_percent") return MAP_COLOURS[colouring][1](run.walk);
  const holes = (run.series.holes_percent || [])[0];
  const step = run.duration_s / Math.max(1, run.walk.t.length) + 0.02;
  return run.walk.t.map((t) => {
    if (!holes) return null;
    const i = R.nearest(holes.t, t);
    return i >= 0 && Math.abs(holes.t[i] - t) <= Math.max(step, 0.15) ? holes.v[i] : null;
  });
}

// Where the head looked, and the numbers of the pictures.
function drawMoments(c, run, X, Y) {
  const m = run.walk;
  run.pictures.shown.forEach((p, n) => {
    if (p.t === undefined) return;
    const i = R.nearest(m.t, p.t), x = X(m.x[i]), y = Y(m.z[i]);
    c.strokeStyle = c.fillStyle = R.css("--text");
    c.lineWidth = 1.2;
    c.beginPath();
    c.moveTo(x, y);
    c.lineTo(x + 15 * m.ahead_x[i], y + 15 * m.ahead_z[i]);
    c.stroke();
    c.textAlign = "center";
    if (!R.several) c.fillText(String(n + 1), x - 12 * m.ahead_x[i], y - 12 * m.ahead_z[i] + 4);
  });
}

function drawRuler(c, w, h, scale) {
  const metres = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100].find((m) => m * scale > 50) || 200;
  c.strokeStyle = c.fillStyle = R.css("--muted");
  c.lineWidth = 1.5;
  c.beginPath();
  c.moveTo(10, h - 8);
  c.lineTo(10 + metres * scale, h - 8);
  c.stroke();
  c.textAlign = "left";
  c.fillText(R.number(metres) + " m", 14 + metres * scale, h - 4);
}

R.picture = (run, p, caption) =>
  R.el("figure", { onmouseenter: () => R.highlightFrame && run.walk && R.highlightFrame(run, p.t), onmouseleave: () => R.highlightFrame && run.walk && R.highlightFrame(run) },
    R.el("img", { src: p.src, alt: caption }), R.el("figcaption", { text: caption }));

R.shownPictures = function () {
  const box = R.el("div", {});
  R.runs.forEach((run, r) => {
    if (R.several) box.append(R.el("h3", {}, R.runSwatch(r), run.name));
    if (!run.pictures.shown.length) return box.append(R.el("p", { class: "muted", text: "The run kept no pictures of what it displayed." }));
    const shown = R.several ? run.pictures.shown.filter((_, i) => i % 2 === 0).slice(0, 6) : run.pictures.shown;
    box.append(R.el("div", { class: "pictures", style: { marginBottom: "10px" } },
      shown.map((p) => R.picture(run, p, `${R.several ? "" : run.pictures.shown.indexOf(p) + 1 + ": "}${p.t === undefined ? "" : R.number(p.t, 4) + " s, "}frame ${p.frame}`))));
    const left = run.pictures.of - run.pictures.shown.length;
    const note = (left > 0 ? `${run.pictures.shown.length} of ${run.pictures.of} pictures, evenly chosen. ` : "") +
      (run.pictures.compared.length ? "As displayed; references are kept of the worst, the median and the last verified frame alone (below)." : "As displayed; the run kept no reference pictures (it had no --verify).");
    box.append(R.el("p", { class: "muted small", text: note }));
  });
  return box;
};

R.comparedPictures = function () {
  // Of several runs those of one name stand side by side.
  const names = [...new Set(["worst", "median", "last"].concat(R.runs.flatMap((run) => run.pictures.compared.map((p) => p.name))))];
  const boxes = names.flatMap((name) => R.runs.flatMap((run, r) => run.pictures.compared.filter((p) => p.name === name).map((p) =>
    R.el("div", { class: "panel" },
      R.el("h3", {}, R.several ? R.runSwatch(r) : null, (R.several ? run.name + ": " : "") + p.name + " verified frame" + (p.t === undefined ? "" : `, ${R.number(p.t, 4)} s`) + `, frame ${p.frame}`),
      R.el("div", { class: "three" }, ["reference (direct rendering)", "as displayed", "difference, 4 times"].map((t) => R.el("span", { text: t }))),
      R.el("figure", {}, R.el("img", { src: p.src, alt: p.name + " verified frame beside its reference" }))))));
  return boxes.length ? R.el("div", {}, R.el("h3", { style: { marginTop: "16px" }, text: "Beside the reference" }), R.el("div", { class: "compared" + (R.several ? " pairs" : "") }, boxes)) : null;
};
