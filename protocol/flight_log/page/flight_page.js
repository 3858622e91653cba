"use strict";
// The page of a flight: unpacks what it is made of, and moves one cursor through the 3-D view and all charts.

async function unpacked(id) {
  const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
}

async function run(id) {
  const script = document.createElement("script");
  script.textContent = await unpacked(id);
  document.head.append(script);
}

const NARROW = 600; // [px]
const dark = matchMedia("(prefers-color-scheme: dark)");
const charts = [...document.querySelectorAll(".chart")];

function ink(isDark) {
  for (const chart of charts) Plotly.relayout(chart, { "font.color": isDark ? "#e4e6e8" : "#222" });
}

// The line of the time that is shown, over all plots of a chart.
class Cursor {
  constructor(chart) {
    this.chart = chart;
    this.line = document.createElement("div");
    this.line.className = "cursor";
    chart.append(this.line);
  }

  show(time) {
    const areas = [...this.chart.querySelectorAll(".nsewdrag")].map((area) => area.getBoundingClientRect());
    const [from, to] = this.chart.layout.xaxis.range, share = (time - from) / (to - from), around = this.chart.getBoundingClientRect();
    const top = Math.min(...areas.map((area) => area.top)), bottom = Math.max(...areas.map((area) => area.bottom));
    const place = { left: areas[0].left - around.left + share * areas[0].width, top: top - around.top, height: bottom - top };
    this.line.style.display = share >= 0 && share <= 1 ? "block" : "none";
    for (const [side, pixels] of Object.entries(place)) this.line.style[side] = `${pixels}px`;
  }
}

async function drawPage() {
  if (charts.length) await run("plotly");
  const figures = JSON.parse(await unpacked("charts"));
  for (const [k, chart] of charts.entries())
    if (chart.clientWidth < NARROW) figures[k].layout.annotations = []; // names of jumps would cover each other
  await Promise.all(charts.map((chart, k) =>
    Plotly.newPlot(chart, figures[k].data, figures[k].layout, { displaylogo: false, responsive: true })));
  ink(dark.matches);
  dark.addEventListener("change", () => ink(dark.matches));
  addEventListener("beforeprint", () => ink(false));
  addEventListener("afterprint", () => ink(dark.matches));
  const motion = JSON.parse(await unpacked("motion"));
  if (motion === null) return;
  await run("view-scripts");
  const view = flightView(document.getElementById("view"));
  if (view === null) return;
  window.shownFlight = view;
  const cursors = charts.map((chart) => new Cursor(chart));
  const showTime = (time) => cursors.forEach((cursor) => cursor.show(time));
  view.onTime = showTime;
  view.load(motion);
  for (const chart of charts) {
    chart.on("plotly_hover", ({ points }) => view.isPlaying || view.seek(points[0].x));
    chart.on("plotly_click", ({ points }) => view.seek(points[0].x));
    chart.on("plotly_afterplot", () => showTime(view.time));
  }
  for (const cell of document.querySelectorAll(".events td.n"))
    cell.addEventListener("click", () => view.seek(parseFloat(cell.textContent)));
  const asked = new URLSearchParams(location.hash.slice(1)); // such as #time=83.5&camera=side
  if (asked.has("time")) view.seek(Number(asked.get("time")));
  if (asked.has("camera")) view.look(asked.get("camera"));
}

drawPage();
