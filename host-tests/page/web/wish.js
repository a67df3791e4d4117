"use strict";
// Input of the user, as options and a scenario of `cargo chain`.

const BEGINNING = { tx: 0, rx: 1000, x: 500, y: 400, power: 80, reverse: 0, rx_w: 80, uavs: 8, method: "align", loss: 0, listen: false, moving: false };

/** Time at which relays that are switched off become silent, and duration of the measurements, s. */
const SILENT_S = 20;
const LISTEN_S = 120;

/** Speed of a moving interferer toward Rx, m/s. */
const SPEED = 3;

/** Distance from the line, m, beyond which a drag of Tx or Rx is refused with an explanation. */
const BESIDE = 60;

/** Minimum distance of Tx and Rx, m. */
const APART = 50;

const want = { ...BEGINNING, off: new Set() };

/** Returns the options of `cargo chain`, without the scenario. */
function options() {
  const words = [`--uavs ${want.uavs}`, `--method ${want.method}`];
  if (want.loss > 0) words.push(`--loss ${want.loss / 100}`);
  for (const relay of [...want.off].sort((a, b) => a - b)) if (relay <= want.uavs) words.push(`--kill ${relay}@${SILENT_S}`);
  if (want.listen) {
    words.push(`--listen --listen-for ${LISTEN_S}`);
    if (want.moving) words.push(`--move-interferer ${SPEED},0`);
  }
  return words.join(" ");
}

/** Formats a number as a TOML float. */
function real(number) {
  const text = String(number);
  return /[.e]/.test(text) ? text : `${text}.0`;
}

/** Returns the scenario, whose x begins at Tx. */
function scenario() {
  const joint = want.method === "joint";
  const lines = [
    "[geometry]", `distance_m = ${real(want.rx - want.tx)}`, "altitude_m = 20.0", "min_separation_m = 4.0",
    ...(want.method === "align" ? [] : ["altitude_min_m = 20.0", "altitude_max_m = 300.0"]),
    ...(joint ? ["lateral_min_m = -280.0", "lateral_max_m = 280.0"] : []),
    "[power]", "tx_w = 80.0", "uav_w = 1.0", ...(want.reverse > 0 ? [`rx_w = ${real(want.rx_w)}`] : []),
    "[[interferer]]", `power_w = ${real(want.power)}`, `x_m = ${real(want.x - want.tx)}`, `y_m = ${real(want.y)}`,
  ];
  if (want.reverse > 0) lines.push("[link]", `reverse = ${real(want.reverse)}`);
  if (want.listen) lines.push("[listen]", `following = ${want.moving}`);
  return `${lines.join("\n")}\n`;
}

/** Moves a handle to whole metres within its range. Returns the reason if it could not follow the drag, otherwise "". */
function move(id, x, y) {
  const [[left, right], [top, bottom]] = [VIEWS.above.x, VIEWS.above.y];
  const ranges = {
    tx: [[left + 40, want.rx - APART], [0, 0]],
    rx: [[want.tx + APART, right - 40], [0, 0]],
    jammer: [[left + 20, right - 20], [top + 20, bottom - 50]],
  };
  const [there, ranged] = [[Math.round(x), Math.round(y)], ranges[id]];
  const [nx, ny] = there.map((number, axis) => Math.min(ranged[axis][1], Math.max(ranged[axis][0], number)));
  if (id === "jammer") [want.x, want.y] = [nx, ny];
  else want[id] = nx;
  const near = id === "tx" ? there[0] > ranged[0][1] : id === "rx" && there[0] < ranged[0][0];
  if (near) return `Tx and Rx: must be at least ${APART} m apart`;
  if (id !== "jammer" && Math.abs(there[1]) > BESIDE) return "Tx and Rx cannot leave the line: drag them along it.";
  return nx === there[0] && (id !== "jammer" || ny === there[1]) ? "" : "The picture ends here: nothing can be dragged beyond it.";
}

/** Returns the x of a handle, and its position as a text. */
function standing(id) {
  const x = { tx: want.tx, rx: want.rx, jammer: want.x }[id];
  return { x, words: id === "jammer" ? `x ${x} m, y ${want.y} m` : `x ${x} m` };
}
