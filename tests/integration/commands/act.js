// A person on a report's page: hovers, drags, double-clicks. What came of it goes into attributes of the page.
(function() {
const told = document.documentElement.dataset, tip = document.getElementById('tooltip');
const at = (element, type, x, y) => {
  const box = element.getBoundingClientRect();
  const event = type.startsWith('pointer') ? PointerEvent : MouseEvent;
  element.dispatchEvent(new event(type, {
    clientX: box.left + x,
    clientY: box.top + y,
    screenX: box.left + x,
    screenY: box.top + y,
    bubbles: true,
    button: 0,
    view: window
  }));
};
const words = () => (tip.hidden ? '' : tip.textContent);
const chart = R.time.charts[0], surface = chart.graph.mouseEventElement_;
at(surface, 'mousemove', 300, 60);
told.chart = words();
told.cursors = String(R.time.charts.filter((c) => !c.cursor.hidden).length);
at(surface, 'mousedown', 200, 60);
at(surface, 'mousemove', 500, 62);
at(surface, 'mouseup', 500, 62);
told.zoomed = [...new Set(R.time.charts.map((c) => c.graph.xAxisRange().map((t) => t.toFixed(3)).join(' ')))].join('|');
at(surface, 'dblclick', 300, 60);
told.reset = [...new Set(R.time.charts.map((c) => c.graph.xAxisRange().map((t) => t.toFixed(3)).join(' ')))].join('|');
at(document.querySelector('#delay canvas.own'), 'mousemove', 250, 100);
told.histogram = words();
const map = document.querySelector('#walk canvas.own');
for (let x = 0; x < 500 && !told.map; x += 4)
  for (let y = 0; y < 430 && !told.map; y += 8) {
    at(map, 'mousemove', x, y);
    if (words().includes('position')) told.map = words();
  }
const dark = R.dark();
document.querySelector('.bar button').click();
told.toggled = String(R.dark() !== dark);
})();
