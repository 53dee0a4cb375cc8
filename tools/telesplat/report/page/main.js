// The page, from top to bottom.
"use strict";

R.header();
R.tiles();
R.notes();
R.sweep();
R.photons();
R.delays();
R.stages();
R.traces();
R.overTime();
R.walk();
R.measures();
R.allFigures();
R.about();
R.configuration();
R.errors();
document.getElementById("main").append(R.el("p", { class: "muted small", style: { marginTop: "30px" }, text: "Made by telesplat report, " + R.data.version + ". docs/metrics.md tells what each figure means." }));
R.nav.append(...R.sections.map(([id, title]) => R.el("a", { href: "#" + id, text: title })));

R.redraw();
R.makeCharts();

// Another width of the window: draw again, once it stays.
let resizing = 0;
window.addEventListener("resize", () => {
  clearTimeout(resizing);
  resizing = setTimeout(R.redraw, 150);
});

// Paper is light, and narrower than a screen.
let themeBefore = null;
window.addEventListener("beforeprint", () => {
  themeBefore = document.documentElement.dataset.theme;
  document.documentElement.classList.add("printing");
  R.setTheme("light");
  R.printCharts();
});
window.addEventListener("afterprint", () => {
  document.querySelectorAll(".print-copy").forEach((copy) => copy.remove());
  document.documentElement.classList.remove("printing");
  R.setTheme(themeBefore || "light");
});

document.documentElement.dataset.readyAfterMs = String(Math.round(performance.now()));
document.documentElement.dataset.ready = "yes";
