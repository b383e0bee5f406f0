// Curves over time, by uPlot. Each has add(...), clear() and draw(); draw does nothing when
// nothing has come.

/** Samples are shown for so long, s, and come at most so often in that time. */
const WINDOW = 30;
/** Most points of what changes slowly; then every second one goes. */
const MOST = 2048;
const AXES = ["x", "y", "z"];
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
    return { width, height: Math.max(120, this.container.clientHeight) };
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
      scales: { x: { time: false, range: this.options.x }, y: this.options.y ?? {} },
      axes: [
        { ...axis, values: (_, ticks) => ticks.map(clock) },
        { ...axis, size: 62 },
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

/** Raw and corrected samples of three axes from `first` on. */
export function samples(container, first) {
  const plot = new Plot(container, () => ({
    series: AXES.flatMap((axis) => [
      { stroke: colour(axis), width: 1, dash: [3, 3], points: { show: false } },
      { stroke: colour(axis), width: 1.6, points: { show: false } },
      HIDDEN, HIDDEN,
    ]),
    bands: AXES.map((axis, k) => ({ series: [4 * k + 4, 4 * k + 3], fill: faint(axis) })),
  }), { x: (_, _low, high) => [Math.max(0, (high ?? 0) - WINDOW), Math.max(high ?? 0, WINDOW)] });
  return Object.assign(plot, {
    add(t, raw, corrected) {
      const values = [t];
      for (let axis = first; axis < first + 3; axis += 1) {
        values.push(raw?.mean[axis], corrected.mean[axis], corrected.min[axis], corrected.max[axis]);
      }
      this.push(values);
      let old = 0;
      while (this.data[0][old] < t - WINDOW) old += 1;
      if (old > 20) this.data.forEach((column) => column.splice(0, old));
    },
  });
}

/** Keeps a plot bounded: of too many points every second one goes. */
function halved(plot) {
  if (plot.data[0].length > MOST) plot.data = plot.data.map((column) => column.filter((_, n) => n % 2 === 0));
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
  }));
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
