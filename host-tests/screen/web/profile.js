"use strict";
// Profile of the ground below the chain, with relays and hops at their heights.

/** Radius of the earth for radio waves, m: 4/3 of its own, so that a line of sight is straight. */
const EARTH_M = 8.5e6;

class Profile {
  /** `map` has the colours, the silence, and the writing of texts. */
  constructor(canvas, map) {
    Object.assign(this, { canvas, map, pen: canvas.getContext("2d"), snapshot: null, taken: [], pending: 0 });
    new ResizeObserver(() => this.request()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.request());
  }

  get width() { return this.canvas.clientWidth; }
  get height() { return this.canvas.clientHeight; }
  get colours() { return this.map.colours; }

  take(snapshot) {
    this.snapshot = snapshot;
    this.canvas.hidden = !snapshot.ground;
    if (snapshot.ground) this.describe();
    this.request();
  }

  request() {
    if (this.pending || this.canvas.hidden) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = 0;
      this.draw();
    });
  }

  /** Returns the height of the ground at `x` m from Tx; null beyond the line. */
  groundAt(x) {
    const { length_m: length, heights_m: heights } = this.snapshot.ground;
    const at = (x / length) * (heights.length - 1);
    if (!(at >= 0 && at <= heights.length - 1)) return null;
    const before = Math.min(Math.floor(at), heights.length - 2);
    return heights[before] + (at - before) * (heights[before + 1] - heights[before]);
  }

  /** Returns name, distance from Tx and height of the nodes whose places are known, and for relays their state. */
  nodes() {
    const { ground, relays } = this.snapshot;
    const ends = [["Tx", 0, ground.heights_m[0]], ["Rx", ground.length_m, ground.heights_m.at(-1)]];
    const known = relays.filter(({ position }) => typeof position?.altitude_m === "number");
    return [
      ...ends.map(([name, x, h]) => ({ name, x, h: h + ground.mast_m })),
      ...known.map((relay) => ({ name: String(relay.number), x: relay.position.x_m, h: relay.position.altitude_m, relay })),
    ];
  }

  /** Returns the height of a relay above the ground of the line as text. */
  aboveText({ x, h }) {
    const ground = this.groundAt(x);
    return ground === null ? "not between Tx and Rx" : `${(h - ground).toFixed(0)} m above ground`;
  }

  describe() {
    const relays = this.nodes().filter(({ relay }) => relay);
    const label = `Ground below the chain: ${relays.map((it) => `relay ${it.name} ${this.aboveText(it)}`).join(", ") || "no relay has a known height"}`;
    if (this.canvas.getAttribute("aria-label") !== label) this.canvas.setAttribute("aria-label", label);
  }

  draw() {
    const { canvas, pen, snapshot, colours } = this;
    const dense = window.devicePixelRatio || 1;
    const [wide, high] = [this.width, this.height].map((px) => Math.round(px * dense));
    if (!snapshot?.ground || wide === 0) return;
    if (canvas.width !== wide || canvas.height !== high) Object.assign(canvas, { width: wide, height: high });
    pen.setTransform(dense, 0, 0, dense, 0, 0);
    pen.clearRect(0, 0, this.width, this.height);
    pen.font = "12px system-ui, sans-serif";
    this.taken = [];
    const { length_m: length, heights_m: heights } = snapshot.ground;
    const nodes = this.nodes();
    // The earth rises between the ends of the line.
    const raised = ({ x, h }) => h + (x * (length - x)) / (2 * EARTH_M);
    const ground = heights.map((h, at) => ({ x: (at * length) / (heights.length - 1), h }));
    const all = [...ground, ...nodes].map(raised);
    const [least, most] = [Math.min(...all), Math.max(...all)];
    const [first, last] = [Math.min(0, ...nodes.map(({ x }) => x)), Math.max(length, ...nodes.map(({ x }) => x))];
    const scale = (this.height - 52) / Math.max(most - least, 20);
    const place = (it) => [60 + ((it.x - first) / (last - first)) * (this.width - 80), this.height - 12 - (raised(it) - least) * scale];
    this.scale(least, most, scale);
    pen.beginPath();
    const line = ground.map(place);
    pen.moveTo(line[0][0], this.height);
    for (const at of line) pen.lineTo(...at);
    pen.lineTo(line.at(-1)[0], this.height);
    pen.globalAlpha = 0.3;
    pen.fillStyle = colours.site;
    pen.fill();
    pen.globalAlpha = 1;
    this.trace(line, "site", 1.5);
    const at = new Map(nodes.map((it) => [it.name, place(it)]));
    for (const hop of snapshot.hops) {
      const kind = sirClass(worseDb(hop));
      if (at.has(hop.from) && at.has(hop.to)) this.trace([at.get(hop.from), at.get(hop.to)], kind, ...STYLES[kind]);
    }
    const crowded = nodes.length * CROWDED * 1.5 > this.width;
    for (const it of nodes) this.node(it, at.get(it.name), crowded);
    // Texts come last, so that no symbol is on them.
    for (const it of nodes) this.label(it, at.get(it.name), crowded);
  }

  trace(points, colour, width, dashes = []) {
    const { pen } = this;
    pen.beginPath();
    for (const at of points) pen.lineTo(...at);
    pen.strokeStyle = this.colours[colour];
    pen.lineWidth = width;
    pen.setLineDash(dashes);
    pen.stroke();
    pen.setLineDash([]);
  }

  /** Draws lines of equal height. */
  scale(least, most, scale) {
    const { pen } = this;
    const step = round125(Math.max(30 / scale, 1)) * (30 / scale > 1 ? 2 : 1);
    pen.fillStyle = this.colours.soft;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    const rows = Math.min(20, Math.floor((most - least) / step) + 1);
    for (let row = 0; row <= rows; row += 1) {
      const h = (Math.ceil(least / step) + row) * step;
      const y = this.height - 12 - (h - least) * scale;
      if (y < 8) return;
      this.trace([[44, y], [this.width, y]], "grid", 1);
      pen.fillText(`${h} m`, 42, y);
    }
  }

  node({ relay }, [x, y], crowded) {
    const { pen } = this;
    if (relay) {
      ChainMap.prototype.relay.call({ pen, colours: this.colours, taken: this.taken, silence: this.map.silence }, relay, [x, y], crowded);
      return;
    }
    pen.fillStyle = this.colours.site;
    pen.beginPath();
    for (const [dx, dy] of [[0, -7], [7, 6], [-7, 6]]) pen.lineTo(x + dx, y + dy);
    pen.fill();
    this.taken.push([x, y, 8, 8]);
  }

  label(it, [x, y], crowded) {
    const { pen } = this;
    const write = (text, colour, forced) => ChainMap.prototype.write.call(this, text, x, y - (crowded ? 12 : 18), colour, forced);
    if (!it.relay) {
      write(it.name, "site", true);
      return;
    }
    const isBehind = behindFor(it.relay, this.map.silence) !== null;
    const bad = ["lost", "fault"].includes(it.relay.condition);
    if (!crowded) {
      pen.font = "600 11px system-ui, sans-serif";
      pen.textAlign = "center";
      pen.textBaseline = "middle";
      pen.fillStyle = this.colours[isBehind ? "ink" : ["normal", "fault"].includes(it.relay.condition) ? "paper" : bad ? "poor" : "relay"];
      pen.fillText(it.name, x, y + 0.5);
      pen.font = "12px system-ui, sans-serif";
    }
    const above = this.aboveText(it);
    const texts = crowded ? [it.name] : [above, above.replace(" above ground", "")];
    texts.some((text) => write(text, bad ? "poor" : "relay"));
  }
}
