#include "tools/telesplat/sweep/page_parts.h"

namespace telesplat::launcher {

const char* page_style() {
  return R"css(
:root { color-scheme: light dark; --ink: #1d2129; --faint: #69707d; --grid: #dde1e7; --paper: #fff; --warn: #b42318;
  --c0: #2f6fde; --c1: #d9642b; --c2: #2c9b6a; --c3: #a24bc9; --c4: #c8981a; --c5: #0f98a8; --c6: #c43b6d; --c7: #6b7280 }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e4e7ec; --faint: #98a1b0; --grid: #343a46; --paper: #15181d; --warn: #ff8a7a;
    --c0: #6ea3ff; --c1: #ff9a66; --c2: #5fd0a0; --c3: #cf8df0; --c4: #ecc450; --c5: #4fd0df; --c6: #f47fa8; --c7: #a7afbd }
}
@media print { :root { --ink: #000; --paper: #fff; --grid: #ccc } section.figure { break-inside: avoid } }
body { font: 14px/1.45 system-ui, sans-serif; color: var(--ink); background: var(--paper); margin: 24px auto;
  max-width: 1200px; padding: 0 20px }
h1 { font-size: 22px; margin: 0 0 8px } h2 { font-size: 17px; margin: 26px 0 6px } h3 { font-size: 14px; margin: 12px 0 2px }
small { color: var(--faint); font-weight: normal }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 2px 16px; margin: 0 } dt { color: var(--faint) }
dd { margin: 0; overflow-wrap: anywhere }
#noise li, #failed li, td.noisy { color: var(--warn) }
.figures { display: flex; flex-wrap: wrap; gap: 4px 36px }
.row { display: flex; flex-wrap: wrap; gap: 6px 18px } .wide { overflow-x: auto }
svg { max-width: 100%; height: auto } svg text { font: 11px system-ui, sans-serif; fill: var(--faint) }
svg .t { fill: var(--ink) } svg .n { text-anchor: end } svg .k { text-anchor: middle } svg .g { stroke: var(--grid) }
.l { fill: none; stroke: currentColor; stroke-width: 1.6 } .w { fill: none; stroke: currentColor; stroke-width: 1.2 }
.p .b + .w { stroke: var(--ink) }
.p circle { fill: currentColor } .p .b { fill: currentColor; opacity: .75 } .p .h { fill: transparent }
.noisy .w { stroke-dasharray: 3 2 } .p:hover .b, .p:focus .b { opacity: 1 } .p:focus { outline: none }
.c0 { color: var(--c0) } .c1 { color: var(--c1) } .c2 { color: var(--c2) } .c3 { color: var(--c3) }
.c4 { color: var(--c4) } .c5 { color: var(--c5) } .c6 { color: var(--c6) } .c7 { color: var(--c7) }
.legend { margin: 4px 0 } .legend span { margin-right: 12px } .legend i { display: inline-block; width: 10px; height: 10px;
  background: currentColor; border-radius: 2px; margin-right: 5px }
table { border-collapse: collapse; font-variant-numeric: tabular-nums } th, td { padding: 3px 9px; text-align: right;
  border-bottom: 1px solid var(--grid) } td.f { white-space: nowrap } th { color: var(--faint); font-weight: 600 }
.differs { font-weight: 700 } section.figure { max-width: 100% } section.figure p { color: var(--faint); max-width: 60em;
  margin: 0 0 2px; font-size: 12.5px } .f { text-align: left } a { color: var(--c0) }
#tip { position: fixed; pointer-events: none; white-space: pre; background: var(--ink); color: var(--paper); padding: 5px 9px;
  border-radius: 4px; font-size: 12px; z-index: 9 }
)css";
}

const char* page_script() {
  return R"js(
const tip = document.getElementById("tip");
function show(event) {
  const mark = event.target.closest("[data-tip]");
  tip.hidden = !mark;
  if (!mark) return;
  tip.textContent = mark.dataset.tip;
  const box = mark.getBoundingClientRect();
  const x = event.clientX || box.right, y = event.clientY || box.top;
  tip.style.left = Math.min(x + 14, innerWidth - tip.offsetWidth - 6) + "px";
  tip.style.top = Math.max(6, Math.min(y - tip.offsetHeight - 8, innerHeight - tip.offsetHeight - 6)) + "px";
}
for (const name of ["pointermove", "pointerdown", "focusin"]) document.addEventListener(name, show);
)js";
}

}  // namespace telesplat::launcher
