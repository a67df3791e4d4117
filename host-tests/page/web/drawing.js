"use strict";
// The two views, in metres. What is drawn here knows nothing of where the numbers come from.

/** What a view shows, m, and how its second axis is called. */
const VIEWS = {
  above: { x: [-250, 1250], y: [-440, 460], up: 1, ticks: [-400, -200, 0, 200] },
  side: { x: [-250, 1250], y: [-110, 330], up: -1, ticks: [0, 100, 200, 300] },
};

const SPACE = "http://www.w3.org/2000/svg";

/** An element of a picture with these attributes, and text in it. */
function element(name, attributes, text) {
  const made = document.createElementNS(SPACE, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

/** From metres to the picture: y is to the right of the line, which is down as seen from above, and height is up. */
function at(view, x, y) {
  return [x - view.x[0], view.up > 0 ? y - view.y[0] : view.y[1] - y];
}

/** The empty view: axes with their numbers. */
function frame(svg, view) {
  const [width, height] = [view.x[1] - view.x[0], view.y[1] - view.y[0]];
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.replaceChildren();
  for (let x = -200; x <= 1200; x += 200) {
    const [px] = at(view, x, 0);
    svg.append(element("line", { class: "grid", x1: px, x2: px, y1: 0, y2: height }));
    if (x < 1200) svg.append(element("text", { class: "tick", x: px + 6, y: height - 8 }, String(x)));
  }
  for (const y of view.ticks) {
    const [, py] = at(view, 0, y);
    svg.append(element("line", { class: "grid", x1: 0, x2: width, y1: py, y2: py }));
    svg.append(element("text", { class: "tick", x: 6, y: py - 6 }, String(y)));
  }
}

/** The hops through these points; the one with the least SIR stands out. */
function hops(svg, view, points, worst) {
  for (let hop = 1; hop < points.length; hop += 1) {
    const [x1, y1] = at(view, ...points[hop - 1]);
    const [x2, y2] = at(view, ...points[hop]);
    svg.append(element("line", { class: hop - 1 === worst ? "hop worst" : "hop", x1, y1, x2, y2 }));
  }
}

/** A sign that may be dragged or pressed, with a halo that shows where the keyboard is. */
function sign(svg, view, [x, y], kind, attributes, shape, text) {
  const group = element("g", { class: kind, ...attributes });
  group.append(element("circle", { class: "halo", r: kind.startsWith("relay") ? 17 : 34 }));
  group.append(shape);
  if (text !== undefined) group.append(element("text", { y: 6 }, text));
  place(group, view, [x, y]);
  svg.append(group);
  return group;
}

/** Puts a sign there; on a small screen it is larger, so that a finger finds it. */
function place(group, view, [x, y]) {
  const scale = window.innerWidth < 600 ? 1.7 : 1;
  group.setAttribute("transform", `translate(${at(view, x, y).join(" ")}) scale(${scale})`);
}

const SHAPES = {
  site: () => element("path", { d: "M0 -22 L20 16 L-20 16 Z" }),
  jammer: () => element("path", { d: "M-20 -20 L20 20 M20 -20 L-20 20 M-22 -16 L-16 -22 L22 16 L16 22 Z M16 -22 L22 -16 L-16 22 L-22 16 Z" }),
  belief: () => element("path", { d: "M-24 0 A24 24 0 1 0 24 0 A24 24 0 1 0 -24 0 M-8 0 L8 0 M0 -8 L0 8" }),
  relay: () => element("circle", { class: "drone", r: 14 }),
};
