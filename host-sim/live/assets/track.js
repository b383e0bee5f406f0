// The track on a plain grid, north up.

const MOST = 4096;
const DEGREE = Math.PI / 180;
const RADIUS = 6378137;

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

/** 1, 2 or 5 times a power of ten, at least `least`. */
export function even(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((n) => n * power).find((step) => step >= least);
}

export class Track {
  constructor(canvas, scale) {
    this.canvas = canvas;
    this.scale = scale;
    this.clear();
    new ResizeObserver(() => { this.dirty = true; }).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { this.dirty = true; });
  }

  clear() {
    this.points = []; // metres east and north, and whether a new line begins there
    this.begins = true;
    this.origin = null;
    this.heading = null;
    this.dirty = true;
  }

  /** A position, deg, as metres east and north of the first one. */
  add([lat, lon], heading) {
    this.origin ??= [lat, lon];
    const [lat0, lon0] = this.origin;
    const turn = ((lon - lon0 + 540) % 360) - 180;
    const [east, north] = [turn * DEGREE * RADIUS * Math.cos(lat0 * DEGREE), (lat - lat0) * DEGREE * RADIUS];
    this.points.push([east, north, this.begins]);
    this.begins = false;
    if (this.points.length > MOST) this.points = this.points.filter(([, , begins], n) => n % 2 === 0 || begins);
    this.heading = heading;
    this.dirty = true;
  }

  /** The navigator has no position: it restarts somewhere else, so no line leads there. */
  gap() {
    this.begins = true;
  }

  /** Metres shown: centre, and how many to a pixel. */
  view(width, height) {
    const range = (axis) => {
      const all = this.points.map((point) => point[axis]);
      return [Math.min(0, ...all), Math.max(0, ...all)];
    };
    const [[west, east], [south, north]] = [range(0), range(1)];
    const metres = Math.max((east - west) / (width - 60), (north - south) / (height - 60), 0.05);
    return { x: (west + east) / 2, y: (south + north) / 2, metres };
  }

  draw() {
    if (!this.dirty || document.hidden) return;
    this.dirty = false;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    this.canvas.width = width * ratio;
    this.canvas.height = height * ratio;
    const ctx = this.canvas.getContext("2d");
    ctx.scale(ratio, ratio);
    const view = this.view(width, height);
    const at = ([x, y]) => [width / 2 + (x - view.x) / view.metres, height / 2 - (y - view.y) / view.metres];
    this.grid(ctx, view, at, width, height);
    if (!this.points.length) return;
    ctx.strokeStyle = colour("x");
    ctx.lineWidth = 2;
    ctx.beginPath();
    for (const point of this.points) point[2] ? ctx.moveTo(...at(point)) : ctx.lineTo(...at(point));
    ctx.stroke();
    ctx.fillStyle = colour("soft");
    const [x0, y0] = at(this.points[0]);
    ctx.fillRect(x0 - 4, y0 - 4, 8, 8);
    this.vehicle(ctx, at(this.points.at(-1)));
  }

  grid(ctx, view, at, width, height) {
    const step = even(view.metres * 80);
    const words = step >= 1000 ? `${step / 1000} km` : `${step} m`;
    const text = this.points.length ? `north up, one square is ${words}` : "north up";
    if (this.scale.textContent !== text) this.scale.textContent = text;
    ctx.strokeStyle = colour("grid");
    ctx.fillStyle = colour("soft");
    ctx.font = "11px system-ui";
    const label = (value) => (step >= 1000 ? `${value / 1000}` : `${value}`);
    const first = (centre, size) => Math.ceil((centre - (size / 2) * view.metres) / step) * step;
    for (let x = first(view.x, width); x < view.x + (width / 2) * view.metres; x += step) {
      const [px] = at([x, 0]);
      ctx.beginPath(); ctx.moveTo(px, 0); ctx.lineTo(px, height); ctx.stroke();
      ctx.fillText(label(x), px + 3, height - 4);
    }
    for (let y = first(view.y, height); y < view.y + (height / 2) * view.metres; y += step) {
      const [, py] = at([0, y]);
      ctx.beginPath(); ctx.moveTo(0, py); ctx.lineTo(width, py); ctx.stroke();
      ctx.fillText(label(y), 3, py - 3);
    }
  }

  /** Where it is, and where it points. */
  vehicle(ctx, [x, y]) {
    ctx.save();
    ctx.translate(x, y);
    ctx.rotate((this.heading ?? 0) * DEGREE);
    ctx.fillStyle = colour("y");
    ctx.beginPath();
    ctx.moveTo(0, -9); ctx.lineTo(6, 7); ctx.lineTo(0, 3); ctx.lineTo(-6, 7);
    ctx.closePath();
    ctx.fill();
    ctx.restore();
  }
}
