"use strict";
// What the user wants, the run that comes of it, and how both are shown.

const BEGINNING = { tx: 0, rx: 1000, x: 500, y: 400, power: 80, uavs: 8, method: "align", loss: 0, listen: false, moving: false };

/** When relays that are switched off fall silent, and how long relays listen, s. */
const SILENT_S = 20;
const LISTEN_S = 120;

/** How fast an interferer goes that moves, m/s. */
const SPEED = 3;

const want = { ...BEGINNING, off: new Set() };
const shown = { places: [], gliding: false, run: null, error: null, stand: null };
const byId = (id) => document.getElementById(id);

/** The command line of `cargo chain` for what is wanted, but for its scenario. */
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

/** A number as TOML has one of the kind that has a point. */
function real(number) {
  const text = String(number);
  return /[.e]/.test(text) ? text : `${text}.0`;
}

/** The scenario in which x begins at Tx. */
function scenario() {
  const joint = want.method === "joint";
  const lines = [
    "[geometry]", `distance_m = ${real(want.rx - want.tx)}`, "altitude_m = 20.0", "min_separation_m = 4.0",
    ...(want.method === "align" ? [] : ["altitude_min_m = 20.0", "altitude_max_m = 300.0"]),
    ...(joint ? ["lateral_min_m = -280.0", "lateral_max_m = 280.0"] : []),
    "[power]", "tx_w = 80.0", "uav_w = 1.0",
    "[[interferer]]", `power_w = ${real(want.power)}`, `x_m = ${real(want.x - want.tx)}`, `y_m = ${real(want.y)}`,
  ];
  if (want.listen) lines.push("[listen]", `following = ${want.moving}`);
  return `${lines.join("\n")}\n`;
}

/** Runs the chain for what is wanted. What cannot be run is said, and what was shown stays. */
function run() {
  const [words, toml] = [options(), scenario()];
  const begun = performance.now();
  let told;
  try {
    told = JSON.parse(wasm_bindgen.chain(words, toml));
  } catch (error) {
    told = { wrong: `the run ended early: ${error}`, stands: [] };
  }
  window.took_ms = performance.now() - begun;
  shown.error = told.wrong || null;
  const good = told.report && told.report.relays && told.report.relays.length > 0;
  if (good) shown.run = { words, toml, report: told.report, stands: told.stands, tx: want.tx };
  window.last = { words, toml, told };
  tell();
  if (good) {
    player();
    glide();
  }
  draw();
}

/** Places of all relays in the run, by number, in the world's x. */
function places() {
  if (!shown.run) return [];
  const { report, stands, tx } = shown.run;
  const stand = shown.stand === null ? null : stands[shown.stand];
  if (stand && stand.places.length === report.uavs) return stand.places.map(([x, y, h], at) => ({ relay: at + 1, x: x + tx, y, h, lost: false }));
  const one = (lost) => (relay) => ({ relay: relay.index, x: relay.x_m + tx, y: relay.y_m || 0, h: relay.h_m, lost });
  const all = [...(report.relays || []).map(one(false)), ...(report.lost || []).map(one(true))];
  return all.sort((a, b) => a.relay - b.relay);
}

/** The hop with the least SIR, from 0 at Tx. */
function worst() {
  const sirs = sir();
  return sirs.indexOf(Math.min(...sirs));
}

function sir() {
  const { report } = shown.run;
  return [...report.relays.map((relay) => relay.sir), report.rx_sir];
}

/** The time of the stand that is shown, s. */
function clock() {
  const stand = shown.stand === null || !shown.run ? null : shown.run.stands[shown.stand];
  return stand ? stand.at_s : 0;
}

/** Draws both views, with the relays where `moved` says. */
function draw(moved) {
  const all = moved || places();
  const chain = all.filter((relay) => !relay.lost);
  const stands = shown.stand !== null;
  const bad = shown.run && !stands ? worst() : -1;
  const jammer = [want.x + (stands && want.moving ? SPEED * clock() : 0), want.y];
  const focused = document.activeElement && document.activeElement.id;
  for (const [name, view] of Object.entries(VIEWS)) {
    const svg = byId(name);
    const second = (relay) => (name === "above" ? relay.y : relay.h);
    frame(svg, view);
    hops(svg, view, [[want.tx, 0], ...chain.map((relay) => [relay.x, second(relay)]), [want.rx, 0]], bad);
    const active = name === "above";
    const handle = (id, label, x) => (active ? { id, tabindex: 0, role: "slider", "aria-label": label, "aria-valuenow": Math.round(x), "aria-valuetext": `${Math.round(x)} m` } : {});
    sign(svg, view, [want.tx, 0], "site", handle("tx", "Transmitter", want.tx), SHAPES.site(), undefined).append(element("text", { x: -16, y: 48 }, "Tx"));
    sign(svg, view, [want.rx, 0], "site", handle("rx", "Receiver", want.rx), SHAPES.site(), undefined).append(element("text", { x: -16, y: 48 }, "Rx"));
    const stand = stands ? shown.run.stands[shown.stand] : null;
    const believed = stand && stand.believed;
    if (believed && active) sign(svg, view, [believed[1] + shown.run.tx, believed[2]], "belief", {}, SHAPES.belief());
    sign(svg, view, [jammer[0], active ? jammer[1] : 0], "jammer", handle("jammer", "Interferer", jammer[0]), SHAPES.jammer()).append(element("text", { x: 30, y: 10 }, active ? "interferer" : ""));
    const crowded = all.some((relay, at) => at > 0 && Math.hypot(relay.x - all[at - 1].x, second(relay) - second(all[at - 1])) < 24);
    for (const relay of all) {
      const press = active ? { id: `relay${relay.relay}`, tabindex: 0, role: "switch", "aria-checked": !want.off.has(relay.relay), "aria-label": `Relay ${relay.relay}` } : {};
      sign(svg, view, [relay.x, second(relay)], want.off.has(relay.relay) ? "relay off" : "relay", press, SHAPES.relay(), crowded ? undefined : String(relay.relay));
    }
  }
  if (focused && byId(focused) && document.activeElement !== byId(focused)) byId(focused).focus();
}

/** From the places that are shown to those of the run. */
function glide() {
  const [from, to] = [shown.places, places()];
  shown.places = to;
  cancelAnimationFrame(glide.frame || 0);
  shown.gliding = false;
  if (from.length !== to.length || matchMedia("(prefers-reduced-motion: reduce)").matches) return;
  shown.gliding = true;
  const begun = performance.now();
  const turn = (now) => {
    const part = Math.min(1, (now - begun) / 350);
    const mix = (a, b) => a + (b - a) * part;
    draw(to.map((relay, at) => ({ ...relay, x: mix(from[at].x, relay.x), y: mix(from[at].y, relay.y), h: mix(from[at].h, relay.h) })));
    shown.gliding = part < 1;
    if (part < 1) glide.frame = requestAnimationFrame(turn);
  };
  glide.frame = requestAnimationFrame(turn);
}

/** What is said beside the pictures. */
function tell() {
  byId("wrong").hidden = !shown.error;
  byId("wrong").textContent = shown.error || "";
  if (!shown.run) return;
  const { report, words, toml } = shown.run;
  const db = (linear) => (10 * Math.log10(linear)).toFixed(2);
  byId("summary").textContent = report.sir === undefined ? "No agreement." :
    `Worst hop: SIR ${report.sir.toPrecision(5)} (${db(report.sir)} dB) with ${report.relays.length} relays; ${report.messages} messages, ${report.bytes} bytes, ${report.virtual_s.toFixed(3)} s of virtual time.`
    + (report.share_of_optimum === undefined ? "" : ` ${(100 * report.share_of_optimum).toFixed(1)} % of the best, with everything known.`);
  const sirs = sir();
  const most = Math.max(...sirs);
  const least = Math.min(...sirs);
  byId("hops").replaceChildren(...sirs.flatMap((value, at) => {
    const [name, bar, number] = ["span", "i", "span"].map((kind) => document.createElement(kind));
    name.textContent = at < report.relays.length ? `to ${report.relays[at].index}` : "to Rx";
    bar.style.width = `${(100 * value) / most}%`;
    if (value === least) bar.className = "worst";
    number.textContent = `${value.toPrecision(5)}, ${db(value)} dB`;
    return [name, bar, number];
  }));
  byId("events").replaceChildren(...(report.timeline || []).map((moment) => {
    const item = document.createElement("li");
    const who = moment.relay === 0 ? "Tx" : `relay ${moment.relay}`;
    item.textContent = `${moment.at_s.toFixed(3)} s: ${who} ${moment.what}${moment.other === undefined ? "" : ` ${moment.other}`}${moment.relays === undefined ? "" : `, ${moment.relays} relays`}`;
    return item;
  }));
  byId("command").textContent = `cargo chain --scenario page.toml ${words}`;
  byId("scenario").textContent = toml;
}

/** The time of a run in which relays listen: it is played from its beginning. */
function player() {
  const { stands } = shown.run;
  byId("player").hidden = stands.length === 0;
  clearInterval(player.timer);
  shown.stand = stands.length === 0 ? null : stands.length - 1;
  byId("time").max = Math.max(0, stands.length - 1);
  byId("time").value = shown.stand ?? 0;
  byId("clock").textContent = stands.length === 0 ? "" : `${clock().toFixed(0)} s`;
  byId("play").textContent = "Play";
}

function seek(stand) {
  shown.stand = stand;
  byId("time").value = stand;
  byId("clock").textContent = `${clock().toFixed(0)} s`;
  draw();
}

byId("time").addEventListener("input", (event) => seek(Number(event.target.value)));
byId("play").addEventListener("click", () => {
  clearInterval(player.timer);
  if (byId("play").textContent === "Pause") {
    byId("play").textContent = "Play";
    return;
  }
  byId("play").textContent = "Pause";
  const last = shown.run.stands.length - 1;
  seek(shown.stand >= last ? 0 : shown.stand);
  player.timer = setInterval(() => {
    if (shown.stand >= last) {
      clearInterval(player.timer);
      byId("play").textContent = "Play";
      return;
    }
    seek(shown.stand + 1);
  }, 80);
});

/** As near as it may be. */
const within = (number, least, most) => Math.min(most, Math.max(least, number));

/** Puts a handle to whole metres that it may be at. */
function move(id, x, y) {
  const [left, right] = VIEWS.above.x;
  const [top, bottom] = VIEWS.above.y;
  if (id === "tx") want.tx = within(Math.round(x), left + 40, want.rx - 50);
  if (id === "rx") want.rx = within(Math.round(x), want.tx + 50, right - 40);
  if (id === "jammer") [want.x, want.y] = [within(Math.round(x), left + 20, right - 20), within(Math.round(y), top + 20, bottom - 50)];
}

/** The next run, once the browser has drawn the last one. */
function soon() {
  if (soon.asked) return;
  soon.asked = true;
  requestAnimationFrame(() => {
    soon.asked = false;
    run();
  });
}

const above = byId("above");

/** Where a pointer is on the line, m. */
function point(event) {
  const there = new DOMPoint(event.clientX, event.clientY).matrixTransform(above.getScreenCTM().inverse());
  return [there.x + VIEWS.above.x[0], there.y + VIEWS.above.y[0]];
}

let held = null;
above.addEventListener("pointerdown", (event) => {
  const group = event.target.closest("[tabindex]");
  if (!group) return;
  event.preventDefault();
  // Where relays are crowded the nearest is meant, and not the one that was drawn last.
  const [x, y] = point(event);
  const far = (relay) => Math.hypot(relay.x - x, relay.y - y);
  const id = group.id.startsWith("relay") ? `relay${places().sort((a, b) => far(a) - far(b))[0].relay}` : group.id;
  byId(id).focus();
  held = { id };
  above.setPointerCapture(event.pointerId);
});
above.addEventListener("pointermove", (event) => {
  if (!held || held.id.startsWith("relay")) return;
  move(held.id, ...point(event));
  soon();
});
above.addEventListener("pointerup", () => {
  if (held && held.id.startsWith("relay")) press(held.id);
  held = null;
});
above.addEventListener("pointercancel", () => { held = null; });
above.addEventListener("keydown", (event) => {
  const { id } = event.target;
  if (id.startsWith("relay")) {
    if (event.key !== " " && event.key !== "Enter") return;
    press(id);
  } else {
    const step = event.shiftKey ? 50 : 10;
    const by = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] }[event.key];
    if (!by) return;
    const x = { tx: want.tx, rx: want.rx, jammer: want.x }[id];
    move(id, x + by[0], want.y + by[1]);
    soon();
  }
  event.preventDefault();
});

/** Switches a relay off, or on again. */
function press(id) {
  const relay = Number(id.slice("relay".length));
  if (!want.off.delete(relay)) want.off.add(relay);
  run();
}

/** Takes over what stands in the form; a number that is out of its range is said, and the last one stays. */
function read() {
  shown.error = null;
  for (const [id, key] of [["uavs", "uavs"], ["power", "power"], ["loss", "loss"]]) {
    const field = byId(id);
    if (field.value !== "" && field.checkValidity()) {
      want[key] = Number(field.value);
    } else {
      const name = field.parentElement.textContent.trim();
      byId("wrong").hidden = false;
      byId("wrong").textContent = `${name} ${field.value || "(nothing)"}: must be within ${field.min} to ${field.max}`;
      return;
    }
  }
  want.method = byId("method").value;
  want.listen = byId("listen").checked;
  want.moving = byId("moving").checked && want.listen;
  byId("moving").disabled = !want.listen;
  run();
}

byId("controls").addEventListener("change", read);
byId("controls").addEventListener("submit", (event) => event.preventDefault());
byId("controls").addEventListener("reset", () => {
  Object.assign(want, BEGINNING);
  want.off.clear();
  setTimeout(read, 0);
});

byId("moving").disabled = true;
draw();
// First the picture, then the code: it is there before anybody can take hold of anything.
requestAnimationFrame(() => setTimeout(() => {
  wasm_bindgen({ module_or_path: fetch(`data:application/wasm;base64,${CODE}`) }).then(() => {
    run();
    window.ready = true;
  }).catch((error) => {
    shown.error = `the code of the page cannot be loaded: ${error}`;
    tell();
  });
}));
