"use strict";
// Zooms the pictures and reads values from them. Each picture stands beside its data: panels with
// places in CSS pixels, axes and curves. The drawing has four units a pixel.
(() => {
  const UNITS = 4, NS = "http://www.w3.org/2000/svg", KEPT = 5;
  let clips = 0;

  const scale = (axis) => (axis.log ? Math.log10 : (v) => v);
  const back = (axis) => (axis.log ? (v) => 10 ** v : (v) => v);

  const node = (name, attributes, parent) => {
    const made = document.createElementNS(NS, name);
    for (const key in attributes) made.setAttribute(key, attributes[key]);
    parent.append(made);
    return made;
  };

  const number = (v) => {
    if (!Number.isFinite(v)) return "-";
    const size = Math.abs(v);
    const text = size !== 0 && (size < 1e-3 || size >= 1e6) ? v.toExponential(3) : String(Number(v.toPrecision(KEPT)));
    return text.replace("-", "\u2212");
  };

  // Round values between two ends.
  const ticks = (low, high, axis, most) => {
    const span = high - low, out = [];
    if (axis.log && span > 1.2) {
      for (let k = Math.ceil(low); k <= high; k += Math.max(1, Math.ceil(span / most))) out.push(k);
      return out;
    }
    const [from, to] = [back(axis)(low), back(axis)(high)];
    const raw = (to - from) / most, ten = 10 ** Math.floor(Math.log10(raw));
    const step = ten * [1, 2, 5, 10].find((f) => f * ten >= raw);
    for (let v = Math.ceil(from / step) * step; v <= to + 1e-9 * step; v += step) {
      out.push(scale(axis)(Math.abs(v) < 1e-9 * step ? 0 : v));
    }
    return out;
  };

  class Panel {
    constructor(svg, data) {
      this.data = data;
      const [x, y] = data.at, [w, h] = data.size;
      Object.assign(this, { x: x * UNITS, y: y * UNITS, w: w * UNITS, h: h * UNITS });
      this.over = node("g", {}, svg);
      this.cursor = node("g", { "pointer-events": "none" }, svg);
      this.reset();
    }

    reset() {
      const end = (axis) => [axis.low, axis.high].map(scale(axis));
      this.xs = end(this.data.x);
      this.ys = end(this.data.y);
      this.over.replaceChildren();
      this.zoomed = false;
    }

    holds(x, y) {
      return x >= this.x && x <= this.x + this.w && y >= this.y && y <= this.y + this.h;
    }

    px(v) { return this.x + ((scale(this.data.x)(v) - this.xs[0]) / (this.xs[1] - this.xs[0])) * this.w; }
    py(v) { return this.y + this.h - ((scale(this.data.y)(v) - this.ys[0]) / (this.ys[1] - this.ys[0])) * this.h; }
    at(x) { return this.xs[0] + ((x - this.x) / this.w) * (this.xs[1] - this.xs[0]); }
    up(y) { return this.ys[0] + ((this.y + this.h - y) / this.h) * (this.ys[1] - this.ys[0]); }

    zoom(xs, ys) {
      if (!(xs[1] - xs[0] > 1e-9 * (1 + Math.abs(xs[0])) && ys[1] - ys[0] > 0)) return;
      [this.xs, this.ys, this.zoomed] = [xs, ys, true];
      this.draw();
    }

    by(factor, x) {
      const middle = x ?? (this.xs[0] + this.xs[1]) / 2;
      const ends = this.xs.map((end) => middle + (end - middle) * factor);
      this.zoom(ends, this.fit(ends));
    }

    move(share) {
      const by = share * (this.xs[1] - this.xs[0]), ends = this.xs.map((end) => end + by);
      this.zoom(ends, this.fit(ends));
    }

    // The range of what is seen between two ends. A plan view keeps its own.
    fit(ends) {
      const s = [scale(this.data.x), scale(this.data.y)];
      let [low, high] = [Infinity, -Infinity];
      for (const curve of this.data.curves) {
        for (const [x, y] of curve.points) {
          if (x === null || y === null || s[0](x) < ends[0] || s[0](x) > ends[1]) continue;
          const v = s[1](y);
          if (Number.isFinite(v)) [low, high] = [Math.min(low, v), Math.max(high, v)];
        }
      }
      if (!(high > low)) return this.ys;
      const room = 0.05 * (high - low);
      return [low - room, high + room];
    }

    draw() {
      const g = this.over, { x, y, w, h } = this, id = `clip${clips++}`;
      g.replaceChildren();
      const paper = "fill:var(--paper)";
      node("rect", { x: x - 208, y: y - 24, width: 208, height: h + 48, style: paper }, g);
      node("rect", { x: x - 40, y: y + h, width: w + 100, height: 80, style: paper }, g);
      node("rect", { x, y, width: w, height: h, style: paper }, g);
      // the names at the ends of curves stand where the whole picture has them
      if (this.data.ends) node("rect", { x: x + w, y: y - 24, width: 600, height: h + 48, style: paper }, g);
      const text = { "font-size": 48, style: "fill:var(--soft)" };
      for (const v of ticks(...this.xs, this.data.x, 7)) {
        const at = x + ((v - this.xs[0]) / (this.xs[1] - this.xs[0])) * w;
        node("line", { x1: at, x2: at, y1: y, y2: y + h, style: "stroke:var(--grid);stroke-width:4" }, g);
        node("text", { ...text, x: at, y: y + h + 62, "text-anchor": "middle" }, g).textContent = number(back(this.data.x)(v));
      }
      for (const v of ticks(...this.ys, this.data.y, 6)) {
        const at = y + h - ((v - this.ys[0]) / (this.ys[1] - this.ys[0])) * h;
        node("line", { x1: x, x2: x + w, y1: at, y2: at, style: "stroke:var(--grid);stroke-width:4" }, g);
        node("text", { ...text, x: x - 20, y: at + 16, "text-anchor": "end" }, g).textContent = number(back(this.data.y)(v));
      }
      node("path", { d: `M${x},${y}V${y + h}H${x + w}`, style: "fill:none;stroke:var(--reference);stroke-width:4" }, g);
      node("rect", { x, y, width: w, height: h }, node("clipPath", { id }, g));
      const inner = node("g", { "clip-path": `url(#${id})` }, g);
      for (const curve of this.data.curves) this.curve(curve, inner);
    }

    curve(curve, parent) {
      const colour = `var(--${curve.colour})`;
      if (curve.radius) {
        for (const [x, y] of curve.points) {
          if (x === null || y === null) continue;
          node("circle", { cx: this.px(x), cy: this.py(y), r: curve.radius * UNITS, style: `fill:${colour}` }, parent);
        }
        return;
      }
      let d = "", pen = "M";
      for (const [x, y] of curve.points) {
        const at = x === null || y === null ? NaN : this.py(y);
        if (!Number.isFinite(at)) { pen = "M"; continue; }
        d += `${pen}${this.px(x).toFixed(1)},${at.toFixed(1)}`;
        pen = "L";
      }
      const dash = curve.dash ? `;stroke-dasharray:${curve.dash.map((l) => l * UNITS)}` : "";
      node("path", { d, style: `fill:none;stroke:${colour};stroke-width:${curve.width * UNITS}${dash}` }, parent);
    }

    // A cross at the values nearest to a place; gives them in words.
    read(x) {
      this.cursor.replaceChildren();
      const { data } = this, wanted = this.at(x), s = scale(data.x), found = new Map();
      for (const curve of data.curves) {
        if (curve.points.length < 3 && !curve.radius) continue;
        let best = null;
        for (const point of curve.points) {
          if (point[0] === null || point[1] === null) continue;
          const away = Math.abs(s(point[0]) - wanted);
          if (best === null || away < best.away) best = { away, point };
        }
        if (best) found.set(`${curve.name ?? ""}${curve.radius ? "" : " line"}${found.size}`, [curve, best.point]);
      }
      node("line", { x1: x, x2: x, y1: this.y, y2: this.y + this.h, style: "stroke:var(--ink);stroke-width:3;opacity:.6" }, this.cursor);
      const words = [];
      for (const [curve, [px, py]] of found.values()) {
        const [cx, cy] = [this.px(px), this.py(py)];
        if (this.holds(cx, cy)) node("circle", { cx, cy, r: 14, style: `fill:var(--${curve.colour})` }, this.cursor);
        if (curve.name) words.push(`${curve.name}${curve.radius ? " (dot)" : ""} ${number(py)}`);
        else words.push(number(py));
      }
      const title = data.title.length ? `${data.title.join(", ")}: ` : "";
      return `${title}${data.x.label || "x"} ${number(back(data.x)(wanted))}: ${[...new Set(words)].join(", ")}`;
    }
  }

  const start = (sheet) => {
    const svg = sheet.querySelector("svg"), json = sheet.querySelector("script");
    if (!svg || !json) return;
    const panels = JSON.parse(json.textContent).panels.map((data) => new Panel(svg, data));
    if (!panels.length) return;
    let now = panels[0], x = now.x + now.w / 2, drag = null;
    const tools = document.createElement("div"), said = document.createElement("output");
    tools.className = "tools";
    const button = (name, label, act) => {
      const made = document.createElement("button");
      made.type = "button";
      made.textContent = name;
      made.setAttribute("aria-label", label);
      made.addEventListener("click", act);
      tools.append(made);
    };
    const show = () => { said.textContent = now.read(x); };
    const zoom = (factor) => { now.by(factor, now.at(x)); show(); };
    const step = (share) => { x = Math.min(now.x + now.w, Math.max(now.x, x + share * now.w)); show(); };
    const reset = () => { panels.forEach((panel) => panel.reset()); show(); };
    const next = () => {
      now.cursor.replaceChildren();
      now = panels[(panels.indexOf(now) + 1) % panels.length];
      x = now.x + now.w / 2;
      show();
    };
    button("\u2190", "value further left", () => step(-0.02));
    button("\u2192", "value further right", () => step(0.02));
    button("+", "zoom in", () => zoom(0.5));
    button("\u2212", "zoom out", () => zoom(2));
    button("all", "whole picture", reset);
    if (panels.length > 1) button("next", "next panel", next);
    tools.append(said);
    sheet.append(tools);
    svg.setAttribute("tabindex", "0");
    const place = (event) => {
      const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
      return [at.x, at.y];
    };
    svg.addEventListener("pointermove", (event) => {
      const [px, py] = place(event);
      const over = panels.find((panel) => panel.holds(px, py));
      if (drag) {
        const wide = Math.abs(px - drag.at[0]), high = Math.abs(py - drag.at[1]);
        drag.box.setAttribute("x", Math.min(px, drag.at[0]));
        drag.box.setAttribute("y", Math.min(py, drag.at[1]));
        drag.box.setAttribute("width", wide);
        drag.box.setAttribute("height", high);
        return;
      }
      if (!over) return;
      if (over !== now) now.cursor.replaceChildren();
      [now, x] = [over, px];
      show();
    });
    svg.addEventListener("pointerdown", (event) => {
      if (event.pointerType !== "mouse" || event.button !== 0) return;
      const at = place(event), panel = panels.find((one) => one.holds(...at));
      if (!panel) return;
      event.preventDefault();
      svg.focus({ preventScroll: true });
      svg.setPointerCapture(event.pointerId);
      const box = node("rect", { style: "fill:var(--rnn);opacity:.15" }, svg);
      drag = { at, panel, box };
    });
    svg.addEventListener("pointerup", (event) => {
      if (!drag) return;
      const { at, panel, box } = drag, to = place(event);
      drag = null;
      box.remove();
      const [xs, ys] = [[at[0], to[0]], [at[1], to[1]]].map((ends) => ends.sort((a, b) => a - b));
      if (xs[1] - xs[0] < 24) return;
      const ends = xs.map((v) => panel.at(v));
      const flat = ys[1] - ys[0] < 24;
      panel.zoom(ends, flat ? panel.fit(ends) : [panel.up(ys[1]), panel.up(ys[0])]);
      show();
    });
    svg.addEventListener("dblclick", reset);
    const keys = {
      ArrowLeft: (shift) => (shift ? (now.move(-0.2), show()) : step(-0.01)),
      ArrowRight: (shift) => (shift ? (now.move(0.2), show()) : step(0.01)),
      "+": () => zoom(0.5), "-": () => zoom(2), 0: reset, Escape: reset, n: next,
    };
    svg.addEventListener("keydown", (event) => {
      const act = keys[event.key];
      if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      act(event.shiftKey);
    });
  };

  document.querySelectorAll(".plot .sheet").forEach(start);
})();
