// Curves over time, by uPlot. Each has add(...), clear() and draw(); draw does nothing when
// nothing has come.

/** Samples are shown for so long, s, and come at most so often in that time. */
const WINDOW = 30;
/** Most points of what changes slowly; then every second one goes. */
const MOST = 2048;
const AXES = ["x", "y", "z"];
/** Between two times on an axis, s: a fraction would repeat a label. */
const WHOLE = [1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1800, 3600, 7200, 18000];
/** The edge of a band. */
const HIDDEN = { stroke: "transparent", width: 0, points: { show: false } };

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const faint = (name) => `${colour(name)}33`;

function clock(seconds) {
  const s = Math.abs(Math.round(seconds));
  const two = (n) => String(n).padStart(2, "0");
  return `${Math.floor(s / 60)}:${two(s % 60)}`;
}

/** A plot whose series `make()` describes again in each colour scheme. */
class Plot {
  constructor(container, make, options = {}) {
    this.container = container;
    this.make = make;
    this.options = options;
    this.dirty = false;
    this.data = make().series.map(() => []);
    this.data.push([]);
    this.build();
    new ResizeObserver(() => this.resize()).observe(container);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.build());
  }

  size() {
    const width = Math.max(200, this.container.clientWidth);
    return { width, height: Math.max(60, this.container.clientHeight) };
  }

  resize() {
    this.plot.setSize(this.size());
  }

  build() {
    this.plot?.destroy();
    const { series, bands } = this.make();
    const axis = {
      stroke: colour("soft"), grid: { stroke: colour("grid"), width: 1 }, ticks: { stroke: colour("grid") },
      font: "12px system-ui",
    };
    const options = {
      ...this.size(), bands, series: [{}, ...series],
      scales: { x: { time: false }, y: this.options.y ?? {} },
      axes: [
        { ...axis, incrs: WHOLE, values: (_, ticks) => ticks.map(this.options.ticks === false ? () => "" : clock), size: this.options.ticks === false ? 8 : 34 },
        { ...axis, size: 62, space: 18 },
      ],
      legend: { show: false }, cursor: { drag: { x: true, y: false } },
    };
    this.plot = new uPlot(options, this.data, this.container);
  }

  clear() {
    this.data = this.data.map(() => []);
    this.dirty = true;
  }

  push(values) {
    if (this.data[0].length && values[0] < this.data[0].at(-1)) this.clear(); // the server has restarted
    values.forEach((value, index) => this.data[index].push(value ?? null));
    this.dirty = true;
  }

  draw() {
    if (!this.dirty || document.hidden) return;
    this.dirty = false;
    this.plot.setData(this.data);
  }
}

/** Raw and corrected samples of the axes from `first` on: a lane for each, in its own scale. */
export function samples(container, first) {
  const lanes = AXES.map((axis, k) => {
    const lane = container.appendChild(document.createElement("div"));
    lane.className = "plot";
    return new Plot(lane, () => ({
      series: [
        { stroke: colour(axis), width: 1, dash: [3, 3], points: { show: false } },
        { stroke: colour(axis), width: 1.6, points: { show: false } },
        HIDDEN, HIDDEN,
      ],
      bands: [{ series: [4, 3], fill: faint(axis) }],
    }), { ticks: k === AXES.length - 1 });
  });
  return {
    lanes,
    add(t, raw, corrected) {
      lanes.forEach((lane, k) => {
        const axis = first + k;
        lane.push([t, raw?.mean[axis], corrected.mean[axis], corrected.min[axis], corrected.max[axis]]);
        let old = 0;
        while (lane.data[0][old] < t - WINDOW) old += 1;
        if (old > 20) lane.data.forEach((column) => column.splice(0, old));
      });
    },
  };
}

/** Keeps a plot bounded: of too many points every second one goes. */
function halved(plot) {
  if (plot.data[0].length > MOST) plot.data = plot.data.map((column) => column.filter((_, n) => n % 2 === 0));
}

/** The range of estimates, of what is in force, and of the newest bands: the wide bands of the start may leave it. */
function span(data) {
  const last = data.map((column) => column.findLast((value) => value != null));
  const all = AXES.flatMap((_, k) => [...data[4 * k + 1], ...data[4 * k + 4], last[4 * k + 2], last[4 * k + 3]]);
  const known = all.filter((value) => value != null);
  if (!known.length) return [-1, 1];
  const [low, high] = known.reduce(([a, b], value) => [Math.min(a, value), Math.max(b, value)], [Infinity, -Infinity]);
  const room = 0.08 * (high - low) || 1;
  return [low - room, high + room];
}

/** Estimated errors with their standard deviations, and the correction in force. */
export function errors(container, first) {
  const plot = new Plot(container, () => ({
    series: AXES.flatMap((axis) => [
      { stroke: colour(axis), width: 1.6, points: { show: false } },
      HIDDEN, HIDDEN,
      { stroke: colour(axis), width: 1, dash: [5, 3], points: { show: false } },
    ]),
    bands: AXES.map((axis, k) => ({ series: [4 * k + 3, 4 * k + 2], fill: faint(axis) })),
  }), { y: { range: (plot) => span(plot.data) } });
  return Object.assign(plot, {
    add(t, estimate, sigma, force) {
      const values = [t];
      for (let axis = first; axis < first + 3; axis += 1) {
        const [e, s] = [estimate?.[axis], sigma?.[axis]];
        values.push(e, e == null ? null : e - s, e == null ? null : e + s, force?.[axis]);
      }
      this.push(values);
      halved(this);
    },
  });
}

/** How near the proof of each candidate is, of 100. */
export function proofs(container) {
  const names = Array.from({ length: 8 }, (_, k) => k);
  const plot = new Plot(container, () => ({
    series: names.map((k) => ({
      stroke: colour(`c${k}`), width: k === 0 ? 0.8 : 1.6, points: { show: false },
    })),
    bands: [],
  }), {
    y: { range: [0, 102] },
  });
  return Object.assign(plot, {
    add(t, of) {
      this.push([t, ...names.map((k) => of[k] ?? null)]);
      halved(this);
    },
  });
}
