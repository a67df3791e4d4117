"use strict";
// The two views, in metres. This file does not depend on the simulator.

/** Ranges of the views, m, and the labels of the second axis: height, or y to the right of the line, which points down in the view from above. */
const VIEWS = {
  above: { x: [-250, 1250], y: [-440, 460], down: true, ticks: [-400, -200, 0, 200, 400] },
  side: { x: [-250, 1250], y: [-110, 340], down: false, ticks: [0, 100, 200, 300] },
};

const SPACE = "http://www.w3.org/2000/svg";

/** Creates an SVG element with these attributes and this text. */
function element(name, attributes, text) {
  const made = document.createElementNS(SPACE, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

const SHAPES = {
  site: () => [element("path", { d: "M0 -11 L10 8 L-10 8 Z" })],
  jammer: () => [element("path", { d: "M-8 -11 L0 -3 L8 -11 L11 -8 L3 0 L11 8 L8 11 L0 3 L-8 11 L-11 8 L-3 0 L-11 -8 Z" })],
  belief: () => [element("circle", { r: 13 }), element("path", { d: "M-5 0 L5 0 M0 -5 L0 5" })],
  relay: () => [element("circle", { class: "drone", r: 8 })],
};

/** Radius around a symbol within which it can be pressed, px. */
const REACH = { site: 20, jammer: 20, relay: 14, belief: 0 };

/** Minimum distance of neighbouring relays for a number in each, px. */
const CROWDED = 17;

/** View drawn into one SVG element. Symbols and hops are created once and then moved. */
class Picture {
  constructor(svg, view) {
    this.svg = svg;
    this.view = view;
    this.size = [view.x[1] - view.x[0], view.y[1] - view.y[0]];
    this.axes = element("g", { "aria-hidden": "true" });
    this.hops = element("g", { "aria-hidden": "true" });
    this.signs = new Map();
    this.unit = 1;
    svg.setAttribute("viewBox", `0 0 ${this.size.join(" ")}`);
    svg.replaceChildren(this.axes, this.hops);
  }

  /** Converts metres to coordinates of the picture. */
  at([x, y]) {
    return [x - this.view.x[0], this.view.down ? y - this.view.y[0] : this.view.y[1] - y];
  }

  /** Converts a position on the screen to metres. */
  metres(clientX, clientY) {
    const there = new DOMPoint(clientX, clientY).matrixTransform(this.svg.getScreenCTM().inverse());
    return [there.x + this.view.x[0], this.view.down ? there.y + this.view.y[0] : this.view.y[1] - there.y];
  }

  /** Measures the metres per pixel, so that symbols and letters have the same size on every screen. It forces a layout of the page, so it is
   * called once, before any change. */
  measure() {
    this.unit = this.size[0] / (this.svg.clientWidth || 850);
  }

  /** Draws the axes for the present size of the picture. */
  frame() {
    const { unit, size: [width, height] } = this;
    if (this.framed === unit) return;
    this.framed = unit;
    const every = unit > 2.6 ? 400 : 200;
    const made = [];
    for (let x = -200; x <= 1200; x += 200) {
      const [px] = this.at([x, 0]);
      made.push(element("line", { class: "grid", x1: px, x2: px, y1: 0, y2: height }));
      if (x % every === 0 && px > 16 * unit && px < width - 16 * unit) made.push(this.letters(String(x), px, height - 4 * unit, "tick middle"));
    }
    for (const y of this.view.ticks) {
      const [, py] = this.at([0, y]);
      made.push(element("line", { class: "grid", x1: 0, x2: width, y1: py, y2: py }));
      const above = py - 4 * unit;
      if (above > 12 * unit && above < height - 20 * unit) made.push(this.letters(String(y), 3 * unit, above, "tick"));
    }
    this.axes.replaceChildren(...made);
  }

  letters(text, x, y, kind) {
    return element("text", { class: kind, transform: `translate(${x} ${y}) scale(${this.unit})` }, text);
  }

  /** Draws the hops through these points. `marks` maps the number of a hop, from 0 at Tx, to a class. */
  chain(points, marks) {
    while (this.hops.childElementCount > Math.max(0, points.length - 1)) this.hops.lastChild.remove();
    while (this.hops.childElementCount < points.length - 1) this.hops.append(element("line", {}));
    [...this.hops.children].forEach((line, hop) => {
      const [x1, y1] = this.at(points[hop]);
      const [x2, y2] = this.at(points[hop + 1]);
      const now = { class: `hop ${marks.get(hop) || ""}`, x1, y1, x2, y2 };
      for (const [key, value] of Object.entries(now)) line.setAttribute(key, value);
    });
  }

  /** Draws the symbols, each with `id`, `shape`, `kind`, position `at`, attributes, and a text in or beside it. */
  put(signs) {
    const there = new Set(signs.map((sign) => sign.id));
    for (const [id, group] of this.signs) {
      if (there.has(id)) continue;
      group.remove();
      this.signs.delete(id);
    }
    for (const sign of signs) {
      let group = this.signs.get(sign.id);
      if (!group) {
        group = element("g", sign.active ? { id: sign.id } : {});
        group.append(element("circle", { class: "halo", r: REACH[sign.shape] }), ...SHAPES[sign.shape](), element("text", {}));
        this.signs.set(sign.id, group);
        this.svg.append(group);
      }
      const attributes = { class: `${sign.shape} ${sign.kind || ""}`, transform: `translate(${this.at(sign.at).join(" ")}) scale(${this.unit})`, ...sign.attributes };
      for (const [key, value] of Object.entries(attributes)) if (group.getAttribute(key) !== String(value)) group.setAttribute(key, value);
      const text = group.lastChild;
      if (text.textContent !== (sign.text || "")) text.textContent = sign.text || "";
      const [x, y, anchor] = { in: [0, 3.5, "middle"], left: [-14, 4, "end"], right: [14, 4, "start"], up: [0, -16, "middle"] }[sign.side || "in"];
      text.setAttribute("x", x);
      text.setAttribute("y", y);
      text.setAttribute("text-anchor", anchor);
    }
  }

  /** Returns true if symbols at these points are too close for a number in each. */
  crowds(points) {
    return points.some(([x, y], at) => at > 0 && Math.hypot(x - points[at - 1][0], y - points[at - 1][1]) < CROWDED * this.unit);
  }
}
