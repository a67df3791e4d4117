"use strict";
// Map of the chain on a canvas. Metres: x from Tx to Rx is drawn to the right, y downward.

/** Limits of the SIR classes, dB. A class has a colour and a line style, and every hop a number. */
const FAIR_DB = 0;
const GOOD_DB = 3;

const sirClass = (db) => (typeof db !== "number" ? "unknown" : db >= GOOD_DB ? "good" : db >= FAIR_DB ? "fair" : "poor");

/** Formats a number with a fixed number of digits, without the sign of a rounded zero. */
const fixed = (value, digits) => value.toFixed(digits).replace(/^-(?=[0.]*$)/, "");

/** Line style of each SIR class: width and dashes, px. */
const STYLES = { good: [4, []], fair: [3, [8, 4]], poor: [4, [3, 3]], unknown: [1.5, []] };

/** SIR that counts for a hop toward Rx or back toward Tx, dB: the measured one, or else that of the model. */
const hopDb = (hop) => hop.measured_db ?? hop.sir_db;
const backDb = (hop) => hop.measured_back_db ?? hop.sir_back_db;

/** SIR of the worse direction of a hop that is known, dB; null if none is. */
function worseDb(hop) {
  const known = [hopDb(hop), backDb(hop)].filter((db) => typeof db === "number");
  return known.length ? Math.min(...known) : null;
}

/** Largest number of grid lines in each direction. */
const GRID_LINES = 200;

/** Number of new parts of ways beyond which all ways are drawn again. */
const MOST_PARTS = 4000;

/** Distance that a relay moves before the next point of its way is kept, m, and the largest number of points of a way. */
const WAY_STEP = 1;
const WAY_POINTS = 400;

/** Least distance of two relays on the screen for a number inside each symbol, px. */
const CROWDED = 24;

/** Largest number of relays whose numbers may be stacked above each other. */
const FEW = 20;

/** Distance from Rx at which it can be dragged, px. */
const GRIP = 22;

/** Age from which the map shows it beside a relay, s. */
const SHOWN_AGE = 2;

/** Age from which a place is marked, because the relay may be elsewhere by now, s. */
const BEHIND = 10;

/** Returns the age of a relay's place that may be behind, s; null if it is newer. It has grown by `silence` seconds. */
function behindFor({ position, age_s: age }, silence) {
  return position && typeof age === "number" && age + silence >= BEHIND ? age + silence : null;
}

/** Largest number of map tiles that are drawn, and of those that are kept. */
const MOST_TILES = 80;
const KEPT_TILES = 320;

/** Width of a tile on the screen from which those of the next zoom level are used, px. */
const TILE_WIDE = 360;

/** Opacity of the map tiles on a light and on a dark page, on which all else has to be read. */
const TILES_OPACITY = { light: 0.65, dark: 0.35 };

/** Conversion between latitude and longitude, degrees (WGS 84), and the metres of a chain, near its origin. */
class Earth {
  constructor([lat, lon], azimuth) {
    const turn = (azimuth * Math.PI) / 180;
    Object.assign(this, { lat, lon, sin: Math.sin(turn), cos: Math.cos(turn) });
  }

  /** Returns metres for a degree to the north and to the east, between the origin and a latitude. */
  scales(lat) {
    const middle = (((lat + this.lat) / 2) * Math.PI) / 180;
    const flat = 1 - 0.00669437999 * Math.sin(middle) ** 2;
    const degree = (6378137 * Math.PI) / 180 / Math.sqrt(flat);
    return [(degree * (1 - 0.00669437999)) / flat, degree * Math.cos(middle)];
  }

  metres([lat, lon]) {
    const [forNorth, forEast] = this.scales(lat);
    const [up, right] = [(lat - this.lat) * forNorth, (lon - this.lon) * forEast];
    // Half of the angle between north at the origin and north at the position.
    const angle = ((lon - this.lon) * Math.PI * Math.sin((lat * Math.PI) / 180)) / 360;
    const [north, east] = [up + right * angle, right - up * angle];
    return [east * this.sin + north * this.cos, east * this.cos - north * this.sin];
  }

  degrees([x, y]) {
    const near = this.near([x, y]);
    const [nearX, nearY] = this.metres(near);
    return this.near([2 * x - nearX, 2 * y - nearY]);
  }

  near([x, y]) {
    const [north, east] = [x * this.cos - y * this.sin, x * this.sin + y * this.cos];
    const lat = this.lat + north / this.scales(this.lat)[0];
    return [lat, this.lon + east / this.scales(lat)[1]];
  }
}

/** Column and row of a position among 2^zoom tiles, as fractions, and the position of a column and a row. */
function tileAt([lat, lon], count) {
  const angle = (lat * Math.PI) / 180;
  return [(lon / 360 + 0.5) * count, (0.5 - Math.asinh(Math.tan(angle)) / (2 * Math.PI)) * count];
}
const tileCorner = (x, y, count) => [(Math.atan(Math.sinh(Math.PI * (1 - (2 * y) / count))) * 180) / Math.PI, (x / count - 0.5) * 360];

/** Returns the largest of 1, 2 or 5 times a power of ten that is at most `most`. */
function round125(most) {
  const power = 10 ** Math.floor(Math.log10(most));
  return ([5, 2, 1].find((it) => it * power <= most) ?? 1) * power;
}

class ChainMap {
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext("2d");
    this.snapshot = null;
    /** Time since the last snapshot, s, by which all ages grow while none arrives. */
    this.silence = 0;
    this.ways = new Map();
    /** Picture of the ways as drawn so far, and the parts of ways that are not yet in it; `drawnFor` is the area that it shows. */
    this.trail = document.createElement("canvas").getContext("2d");
    this.newParts = [];
    this.drawnFor = "";
    /** Pictures of map tiles by their paths, and the picture of all of them together; `tilesFor` is the area that it shows. */
    this.tiles = new Map();
    this.ground = document.createElement("canvas").getContext("2d");
    this.tilesFor = "";
    /** Displayed area: centre in metres, and pixels per metre. While `fitted`, it contains everything. */
    this.view = { x: 500, y: 0, scale: 1 };
    this.fitted = true;
    this.bounds = null;
    this.pending = 0;
    this.frames = 0;
    this.hasTiles = false;
    this.fingers = new Map();
    /** Positions to which a preview would move the relays, x and y in m. */
    this.targets = [];
    /** Position to which Rx is being dragged; null otherwise. `canDrag` and `dragged` are those of the form. */
    this.receiver = null;
    this.canDrag = () => false;
    this.dragged = () => {};
    this.colours = {};
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.recolour());
    new ResizeObserver(() => this.request()).observe(canvas);
    this.listen();
    this.recolour();
  }

  recolour() {
    const style = getComputedStyle(document.documentElement);
    for (const name of ["ink", "paper", "soft", "line", "grid", "relay", "good", "fair", "poor", "site", "interferer"]) this.colours[name] = style.getPropertyValue(`--${name}`).trim();
    this.colours.unknown = this.colours.soft;
    this.tilesFor = "";
    this.request();
  }

  /** Shows a snapshot, and adds the relays' positions to their ways. */
  take(snapshot) {
    this.snapshot = snapshot;
    for (const { number, position } of snapshot.relays) {
      if (!position) continue;
      const way = this.ways.get(number) || [];
      this.ways.set(number, way);
      const last = way.at(-1);
      if (last && Math.hypot(position.x_m - last[0], position.y_m - last[1]) < WAY_STEP) continue;
      way.push([position.x_m, position.y_m]);
      if (last) this.newParts.push([last, way.at(-1)]);
      // A long way keeps every other of its older points.
      if (way.length > WAY_POINTS) this.ways.set(number, way.filter((_, at) => at % 2 === 0 || at > WAY_POINTS / 2));
    }
    // A hidden page is not drawn, so nothing would take the new parts away.
    if (document.hidden || this.newParts.length > MOST_PARTS) {
      this.newParts = [];
      this.drawnFor = "";
    }
    this.request();
  }

  forget() {
    this.ways.clear();
    this.drawnFor = "";
    this.fit();
  }

  request() {
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => {
      this.pending = 0;
      this.draw();
    });
  }

  fit() {
    this.fitted = true;
    this.bounds = null;
    this.request();
  }

  /** Zooms by a factor around a point of the canvas, px, or its centre. */
  zoom(factor, at = [this.width / 2, this.height / 2]) {
    const [x, y] = this.metres(at);
    this.fitted = false;
    this.view.scale = Math.min(50, Math.max(1e-4, this.view.scale * factor));
    const [nowX, nowY] = this.metres(at);
    this.move(x - nowX, y - nowY);
  }

  /** Moves the displayed area, m. */
  move(x, y) {
    this.fitted = false;
    this.view.x += x;
    this.view.y += y;
    this.request();
  }

  get width() { return this.canvas.clientWidth; }
  get height() { return this.canvas.clientHeight; }

  pixels(x, y) {
    return [(x - this.view.x) * this.view.scale + this.width / 2, (y - this.view.y) * this.view.scale + this.height / 2];
  }

  metres([px, py]) {
    return [(px - this.width / 2) / this.view.scale + this.view.x, (py - this.height / 2) / this.view.scale + this.view.y];
  }

  listen() {
    const { canvas, fingers } = this;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      const rx = this.snapshot?.rx;
      const [x, y] = rx ? this.pixels(rx.x_m, rx.y_m) : [];
      if (rx && this.canDrag() && Math.hypot(event.offsetX - x, event.offsetY - y) < GRIP) {
        this.receiver = [rx.x_m, rx.y_m];
        return;
      }
      fingers.set(event.pointerId, [event.offsetX, event.offsetY]);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (this.receiver) {
        this.receiver = this.metres([event.offsetX, event.offsetY]);
        this.dragged(this.receiver, false);
        this.request();
        return;
      }
      const before = fingers.get(event.pointerId);
      if (!before) return;
      const now = [event.offsetX, event.offsetY];
      const other = [...fingers].find(([id]) => id !== event.pointerId)?.[1];
      fingers.set(event.pointerId, now);
      if (other) {
        const apart = ([x, y]) => Math.hypot(x - other[0], y - other[1]) || 1;
        this.zoom(apart(now) / apart(before), other);
      } else {
        this.move((before[0] - now[0]) / this.view.scale, (before[1] - now[1]) / this.view.scale);
      }
    });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => {
      fingers.delete(event.pointerId);
      const to = this.receiver;
      this.receiver = null;
      if (to && end === "pointerup") this.dragged(to, true);
      this.request();
    });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY * 0.0015), [event.offsetX, event.offsetY]);
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const step = 60 / this.view.scale;
      const act = { ArrowLeft: () => this.move(-step, 0), ArrowRight: () => this.move(step, 0), ArrowUp: () => this.move(0, -step), ArrowDown: () => this.move(0, step), "+": () => this.zoom(1.4), "=": () => this.zoom(1.4), "-": () => this.zoom(1 / 1.4), 0: () => this.fit() }[event.key];
      if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      act();
    });
  }

  /** Chooses the displayed area so that everything is in it. It only grows, so that the map is steady while relays move. */
  adjust() {
    const { snapshot } = this;
    const points = [];
    const add = (at) => at && points.push([at.x_m, at.y_m]);
    [snapshot.tx, snapshot.rx, ...snapshot.relays.flatMap((it) => [it.position, it.agreed])].forEach(add);
    for (const { position, uncertainty_m: ring } of snapshot.interferers) {
      for (const side of [-1, 1]) points.push([position.x_m + side * (ring || 0), position.y_m + side * (ring || 0)]);
    }
    for (const area of snapshot.no_fly) points.push(...area);
    if (snapshot.geofence) {
      const { x_m: x, y_m: y } = snapshot.geofence;
      points.push([x[0], y[0]], [x[1], y[1]]);
    }
    const known = points.filter((at) => at.every(Number.isFinite));
    if (known.length === 0) return;
    if (this.bounds) known.push(...this.bounds);
    const [xs, ys] = [0, 1].map((axis) => known.map((at) => at[axis]));
    const [least, most] = [[Math.min(...xs), Math.min(...ys)], [Math.max(...xs), Math.max(...ys)]];
    // Bounds in steps, so that the area does not change with every metre that a relay moves outward.
    const step = round125(Math.max(most[0] - least[0], most[1] - least[1], 10) / 20);
    this.bounds = [least.map((at) => Math.floor(at / step) * step), most.map((at) => Math.ceil(at / step) * step)];
    const [[x0, y0], [x1, y1]] = this.bounds;
    const scale = Math.min((this.width - 90) / Math.max(x1 - x0, 50), (this.height - 130) / Math.max(y1 - y0, 20));
    this.view = { x: (x0 + x1) / 2, y: (y0 + y1) / 2, scale: Math.max(scale, 1e-4) };
  }

  draw() {
    const { canvas, pen, snapshot } = this;
    const dense = window.devicePixelRatio || 1;
    const [wide, high] = [this.width, this.height].map((px) => Math.round(px * dense));
    if (canvas.width !== wide || canvas.height !== high) Object.assign(canvas, { width: wide, height: high });
    pen.setTransform(dense, 0, 0, dense, 0, 0);
    pen.clearRect(0, 0, this.width, this.height);
    pen.font = "12px system-ui, sans-serif";
    pen.lineJoin = "round";
    this.taken = [];
    if (!snapshot || this.width === 0) return;
    if (this.fitted) this.adjust();
    this.drawTiles();
    this.grid();
    this.areas();
    this.drawWays();
    this.interferers();
    this.chain();
    this.north();
    this.frames += 1;
  }

  /** Draws a line through points in metres. */
  trace(points, colour, width, dashes = [], closed = false, pen = this.pen) {
    pen.beginPath();
    points.forEach(([x, y], at) => (at ? pen.lineTo(...this.pixels(x, y)) : pen.moveTo(...this.pixels(x, y))));
    if (closed) pen.closePath();
    pen.strokeStyle = this.colours[colour];
    pen.lineWidth = width;
    pen.setLineDash(dashes);
    pen.stroke();
    pen.setLineDash([]);
  }

  /** Writes text around a centre, px, with an outline that keeps it readable. Returns false where other text is, unless `forced`. */
  write(text, x, y, colour, forced = false) {
    const { pen } = this;
    const half = pen.measureText(text).width / 2 + 2;
    const box = [Math.min(Math.max(x, half + 2), this.width - half - 2), y, half, 8];
    const clash = ([otherX, otherY, otherHalf, otherHigh]) => Math.abs(otherX - box[0]) < otherHalf + half && Math.abs(otherY - y) < otherHigh + 7;
    if (!forced && this.taken.some(clash)) return false;
    this.taken.push(box);
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.lineWidth = 4;
    pen.strokeStyle = this.colours.paper;
    pen.strokeText(text, box[0], y);
    pen.fillStyle = this.colours[colour];
    pen.fillText(text, box[0], y);
    return true;
  }

  /** Draws the map tiles, if the program has any. Their picture is kept while the map shows the same area. */
  drawTiles() {
    const { canvas, ground, pen, view } = this;
    const { tiles, frame } = this.snapshot;
    this.hasTiles = Boolean(tiles && frame?.origin_deg && typeof frame.azimuth_deg === "number");
    if (!this.hasTiles) return;
    const area = [canvas.width, canvas.height, view.x, view.y, view.scale, frame.origin_deg, frame.azimuth_deg].join();
    if (area !== this.tilesFor) {
      this.tilesFor = area;
      Object.assign(ground.canvas, { width: canvas.width, height: canvas.height });
      const earth = new Earth(frame.origin_deg, frame.azimuth_deg);
      for (const [path, zoom, x, y] of this.seenTiles(earth, tiles.zooms)) {
        const picture = this.tile(path);
        if (picture.complete && picture.naturalWidth) this.drawTile(earth, picture, 2 ** zoom, x, y);
      }
    }
    pen.globalAlpha = TILES_OPACITY[matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"];
    pen.drawImage(ground.canvas, 0, 0, this.width, this.height);
    pen.globalAlpha = 1;
  }

  /** Returns path, zoom level, column and row of the tiles in the displayed area; none if there are too many. */
  seenTiles(earth, [least, most]) {
    const corners = [[0, 0], [this.width, 0], [0, this.height], [this.width, this.height]].map((at) => earth.degrees(this.metres(at)));
    const round = 40075017 * Math.cos((earth.lat * Math.PI) / 180);
    const zoom = Math.min(most, Math.max(least, Math.ceil(Math.log2((round * this.view.scale) / TILE_WIDE))));
    const count = 2 ** zoom;
    const at = corners.map((corner) => tileAt(corner, count));
    const [first, last] = [Math.min, Math.max].map((edge) => [0, 1].map((axis) => Math.min(count - 1, Math.max(0, Math.floor(edge(...at.map((it) => it[axis])))))));
    const [wide, high] = [0, 1].map((axis) => last[axis] - first[axis] + 1);
    if (!(wide * high <= MOST_TILES)) return [];
    return Array.from({ length: wide * high }, (_, index) => {
      const [x, y] = [first[0] + (index % wide), first[1] + Math.floor(index / wide)];
      return [`/tiles/${zoom}/${x}/${y}`, zoom, x, y];
    });
  }

  /** Returns the picture of a tile, which may still have to arrive. */
  tile(path) {
    const known = this.tiles.get(path);
    if (known) return known;
    if (this.tiles.size >= KEPT_TILES) this.tiles.delete(this.tiles.keys().next().value);
    const picture = new Image();
    this.tiles.set(path, picture);
    picture.addEventListener("load", () => {
      this.tilesFor = "";
      this.request();
    });
    picture.src = location.origin + path;
    return picture;
  }

  drawTile(earth, picture, count, x, y) {
    const { pen, ground } = this;
    const [[x0, y0], [x1, y1], [x2, y2]] = [[0, 0], [1, 0], [0, 1]].map(([dx, dy]) => this.pixels(...earth.metres(tileCorner(x + dx, y + dy, count))));
    const [wide, high] = [picture.naturalWidth, picture.naturalHeight];
    ground.setTransform(pen.getTransform());
    ground.transform((x1 - x0) / wide, (y1 - y0) / wide, (x2 - x0) / high, (y2 - y0) / high, x0, y0);
    // Half a pixel more hides the seams.
    const more = (0.5 * wide) / Math.hypot(x1 - x0, y1 - y0);
    ground.drawImage(picture, 0, 0, wide + more, high + more);
  }

  /** Writes a number of the grid, with an outline on map tiles. */
  gridNumber(text, x, y) {
    const { pen } = this;
    if (this.hasTiles) {
      pen.lineWidth = 3;
      pen.strokeStyle = this.colours.paper;
      pen.strokeText(text, x, y);
    }
    pen.fillText(text, x, y);
  }

  grid() {
    const { pen, view } = this;
    const step = round125(Math.max(90 / view.scale, 1e-3));
    const [left, top] = this.metres([0, 0]);
    const [right, bottom] = this.metres([this.width, this.height]);
    pen.fillStyle = this.colours.soft;
    pen.textBaseline = "middle";
    // Integers are counted: adding a step to a large coordinate might not change it.
    const lines = (from, to) => {
      const first = Math.ceil(from / step);
      return Array.from({ length: Math.min(GRID_LINES, Math.ceil(to / step) - first) }, (_, at) => (first + at) * step);
    };
    for (const x of lines(left, right)) {
      this.trace([[x, top], [x, bottom]], "grid", 1);
      const [px] = this.pixels(x, 0);
      pen.textAlign = "center";
      if (px > 40 && px < this.width - 20) this.gridNumber(String(Math.round(x)), px, 9);
    }
    for (const y of lines(top, bottom)) {
      this.trace([[left, y], [right, y]], "grid", 1);
      const [, py] = this.pixels(0, y);
      pen.textAlign = "left";
      if (py > 22 && py < this.height - 34) this.gridNumber(String(Math.round(y) || 0), 4, py);
    }
    // Scale bar.
    const [px, py] = [12, this.height - 12];
    const bar = round125(110 / view.scale);
    const wide = bar * view.scale;
    pen.strokeStyle = this.colours.ink;
    pen.lineWidth = 2;
    pen.beginPath();
    for (const [x, y] of [[px, py - 5], [px, py], [px + wide, py], [px + wide, py - 5]]) pen.lineTo(x, y);
    pen.stroke();
    this.write(bar >= 1000 ? `${bar / 1000} km` : `${bar} m`, px + wide / 2, py - 11, "ink", true);
  }

  north() {
    const azimuth = this.snapshot.frame?.azimuth_deg;
    const { pen } = this;
    const [x, y] = [this.width - 34, this.height - 42];
    if (typeof azimuth !== "number") return;
    const angle = (-azimuth * Math.PI) / 180;
    const [dx, dy] = [Math.cos(angle), Math.sin(angle)];
    pen.fillStyle = pen.strokeStyle = this.colours.ink;
    pen.lineWidth = 2;
    pen.beginPath();
    pen.moveTo(x - 10 * dx, y - 10 * dy);
    pen.lineTo(x + 8 * dx, y + 8 * dy);
    pen.stroke();
    pen.beginPath();
    pen.moveTo(x + 14 * dx, y + 14 * dy);
    pen.lineTo(x + 4 * dx - 5 * dy, y + 4 * dy + 5 * dx);
    pen.lineTo(x + 4 * dx + 5 * dy, y + 4 * dy - 5 * dx);
    pen.fill();
    this.write("N", x + 23 * dx, y + 23 * dy, "ink", true);
  }

  areas() {
    const { pen, snapshot } = this;
    const { geofence } = snapshot;
    if (geofence) {
      const { x_m: x, y_m: y } = geofence;
      const corners = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
      this.trace(corners, "site", 1.5, [10, 5], true);
      const [px, py] = this.pixels((x[0] + x[1]) / 2, y[1]);
      this.write("geofence", px, py + 34, "site");
    }
    for (const area of snapshot.no_fly) {
      this.trace(area, "poor", 2, [], true);
      pen.globalAlpha = 0.15;
      pen.fillStyle = this.colours.poor;
      pen.fill();
      pen.globalAlpha = 1;
      const middle = [0, 1].map((axis) => area.reduce((sum, at) => sum + at[axis], 0) / area.length);
      this.write("no fly", ...this.pixels(...middle), "poor");
    }
  }

  /** Draws the ways. Their picture is kept, and only new parts are added to it, while the map shows the same area. */
  drawWays() {
    const { canvas, pen, trail, view } = this;
    const area = [canvas.width, canvas.height, view.x, view.y, view.scale, this.colours.relay].join();
    if (area !== this.drawnFor) {
      this.drawnFor = area;
      Object.assign(trail.canvas, { width: canvas.width, height: canvas.height });
      trail.setTransform(pen.getTransform());
      trail.lineJoin = "round";
      this.newParts = [...this.ways.values()].filter((way) => way.length > 1);
    }
    for (const part of this.newParts) this.trace(part, "relay", 1, [], false, trail);
    this.newParts = [];
    pen.globalAlpha = 0.55;
    pen.drawImage(trail.canvas, 0, 0, this.width, this.height);
    pen.globalAlpha = 1;
  }

  interferers() {
    const { pen } = this;
    for (const { position, power_w: power, uncertainty_m: ring, is_estimated: estimated } of this.snapshot.interferers) {
      const [x, y] = this.pixels(position.x_m, position.y_m);
      pen.strokeStyle = this.colours.interferer;
      if (ring) {
        pen.lineWidth = 1.5;
        pen.setLineDash([4, 4]);
        pen.beginPath();
        pen.arc(x, y, Math.max(10, ring * this.view.scale), 0, 2 * Math.PI);
        pen.stroke();
        pen.setLineDash([]);
      }
      pen.lineWidth = 3;
      pen.beginPath();
      for (const [dx, dy] of [[7, 7], [7, -7]]) {
        pen.moveTo(x - dx, y - dy);
        pen.lineTo(x + dx, y + dy);
      }
      pen.stroke();
      const watts = typeof power === "number" ? `, ${Number(power.toPrecision(3))} W` : "";
      const words = ["interferer", estimated ? " (estimate)" : "", watts];
      // The text is shortened until there is room for it.
      [3, 2, 1].some((count) => this.write(words.slice(0, count).join(""), x, y + 18, "interferer"));
    }
  }

  /** Draws sites, hops and relays. */
  chain() {
    const { snapshot } = this;
    const places = new Map();
    if (snapshot.tx) places.set("Tx", snapshot.tx);
    if (snapshot.rx) places.set("Rx", snapshot.rx);
    for (const relay of snapshot.relays) if (relay.position) places.set(String(relay.number), relay.position);
    const at = new Map([...places].map(([name, place]) => [name, this.pixels(place.x_m, place.y_m)]));
    const drawn = snapshot.hops.filter((hop) => at.has(hop.from) && at.has(hop.to));
    for (const hop of drawn) {
      const kind = sirClass(worseDb(hop));
      const ends = [hop.from, hop.to].map((name) => places.get(name)).map((place) => [place.x_m, place.y_m]);
      this.trace(ends, kind, ...STYLES[kind]);
    }
    for (const { position, agreed } of snapshot.relays) this.planned(position, agreed);
    for (const name of ["Tx", "Rx"]) if (at.has(name)) this.site(name, at.get(name));
    for (const [x, y] of this.targets) this.trace([[x, y - 8 / this.view.scale], [x + 7 / this.view.scale, y + 6 / this.view.scale], [x - 7 / this.view.scale, y + 6 / this.view.scale]], "fair", 2, [], true);
    if (this.receiver) this.site("new Rx", this.pixels(...this.receiver));
    const line = [...at.values()].sort((one, other) => one[0] - other[0]);
    const gaps = line.slice(1).map(([x, y], index) => Math.hypot(x - line[index][0], y - line[index][1])).sort((one, other) => one - other);
    const crowded = gaps.length > 0 && gaps[Math.floor(gaps.length / 10)] < CROWDED;
    // Faults are drawn last, above the others; their numbers come first, so that no other text hides them.
    const urgent = ({ condition }) => (condition === "lost" || condition === "fault" ? 1 : 0);
    const relays = snapshot.relays.filter((relay) => places.has(String(relay.number))).sort((one, other) => urgent(one) - urgent(other));
    for (const relay of relays) this.relay(relay, at.get(String(relay.number)), crowded);
    for (const relay of [...relays].reverse()) this.label(relay, at.get(String(relay.number)), crowded);
    for (const relay of snapshot.relays) if (!relay.position && relay.agreed) this.unplaced(relay);
    // The worst hops are labelled first: toward Rx and back where there is room, or else by the worse direction.
    for (const hop of drawn.sort((one, other) => (worseDb(one) ?? 1e9) - (worseDb(other) ?? 1e9))) {
      const worse = worseDb(hop);
      if (worse === null) continue;
      const [[x1, y1], [x2, y2]] = [at.get(hop.from), at.get(hop.to)];
      const both = [hopDb(hop), backDb(hop)].map((db) => (typeof db === "number" ? fixed(db, 1) : "–"));
      const texts = typeof backDb(hop) === "number" ? [`${both.join(" / ")} dB`, `${fixed(worse, 1)} dB`] : [`${fixed(worse, 1)} dB`];
      texts.some((text) => this.write(text, (x1 + x2) / 2, (y1 + y2) / 2 + 16, sirClass(worse)));
    }
  }

  planned(position, agreed) {
    if (!agreed) return;
    const { pen } = this;
    const [x, y] = this.pixels(agreed.x_m, agreed.y_m);
    if (position) {
      const [nowX, nowY] = this.pixels(position.x_m, position.y_m);
      if (Math.hypot(nowX - x, nowY - y) < 6) return;
      this.trace([[position.x_m, position.y_m], [agreed.x_m, agreed.y_m]], "relay", 1, [2, 3]);
    }
    pen.strokeStyle = this.colours.relay;
    pen.lineWidth = 1.5;
    pen.beginPath();
    for (const [dx, dy] of [[0, -6], [6, 0], [0, 6], [-6, 0]]) pen.lineTo(x + dx, y + dy);
    pen.closePath();
    pen.stroke();
  }

  /** Labels the agreed position of a relay whose own position is unknown. The number is always there. */
  unplaced({ number, condition, agreed }) {
    const bad = condition === "lost" || condition === "fault";
    const [x, y] = this.pixels(agreed.x_m, agreed.y_m);
    const [colour, name] = [bad ? "poor" : "relay", bad ? `${number} ${condition}` : String(number)];
    const texts = [`${name}, position unknown`, `${name}, no position`];
    if (!texts.some((text) => [16, 31].some((up) => this.write(text, x, y - up, colour)))) this.write(name, x, y - 16, colour, true);
  }

  site(name, [x, y]) {
    const { pen } = this;
    pen.fillStyle = this.colours.site;
    pen.beginPath();
    for (const [dx, dy] of [[0, -9], [9, 7], [-9, 7]]) pen.lineTo(x + dx, y + dy);
    pen.fill();
    this.taken.push([x, y, 8, 8]);
    this.write(name, x, y - 18, "site", true);
  }

  relay(relay, [x, y], crowded) {
    const { pen } = this;
    const { condition } = relay;
    const [lost, fault] = [condition === "lost", condition === "fault"];
    const radius = crowded ? 4 : 10;
    pen.beginPath();
    if (fault) pen.rect(x - radius, y - radius, 2 * radius, 2 * radius);
    else pen.arc(x, y, radius, 0, 2 * Math.PI);
    // No hop is seen through a faded symbol.
    pen.fillStyle = this.colours.paper;
    pen.fill();
    if (behindFor(relay, this.silence) !== null) pen.globalAlpha = 0.4;
    pen.fillStyle = this.colours[condition === "normal" ? "relay" : fault ? "poor" : "paper"];
    pen.fill();
    pen.strokeStyle = this.colours[lost || fault ? "poor" : "relay"];
    pen.lineWidth = 2;
    pen.setLineDash(lost ? [3, 2] : []);
    pen.stroke();
    pen.setLineDash([]);
    pen.globalAlpha = 1;
    this.taken.push([x, y, radius, radius - 2]);
  }

  label(relay, [x, y], crowded) {
    const { pen } = this;
    const { number, condition, age_s: age } = relay;
    const isBehind = behindFor(relay, this.silence) !== null;
    const bad = condition === "lost" || condition === "fault";
    const colour = bad ? "poor" : "relay";
    const old = typeof age === "number" && age + this.silence >= SHOWN_AGE ? `${(age + this.silence).toFixed(0)} s ago` : "";
    const words = [bad ? condition : "", bad || isBehind || !crowded ? old : ""].filter(Boolean).join(", ");
    if (!crowded) {
      pen.font = "600 11px system-ui, sans-serif";
      pen.textAlign = "center";
      pen.textBaseline = "middle";
      pen.fillStyle = this.colours[isBehind ? "ink" : condition === "normal" || condition === "fault" ? "paper" : colour];
      pen.fillText(String(number), x, y + 0.5);
      pen.font = "12px system-ui, sans-serif";
    }
    const text = crowded ? `${number} ${words}`.trim() : words;
    if (!text) return;
    // The text is moved up until there is room for it: that of a fault more than others, and none among many relays.
    const steps = bad || isBehind ? 4 : this.snapshot.relays.length > FEW ? 1 : 3;
    const free = [0, 15, 30, 45].slice(0, steps).some((up) => this.write(text, x, y - (crowded ? 14 : 20) - up, colour));
    if (bad && !free) this.write(text, x, y - 14, colour, true);
  }
}
