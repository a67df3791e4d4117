"use strict";
// Page: receives the snapshots, and fills heading, table and log.

/** Time without a snapshot after which it is an alarm, and after which the page connects again, ms. */
const SILENT = 3000;
const STUCK = 10000;

/** Time until a connection that was refused is tried again, ms. */
const AGAIN = 2000;

/** Largest number of log lines on the page. */
const LINES = 1000;

/** Age from which it is shown as old, s. */
const OLD = 5;

/** True on the page of a recorded flight (uav-relay-replay), which has all its snapshots and no server. */
const isRecorded = byId("flight") !== null;

const map = new ChainMap(byId("canvas"));
const profile = new Profile(byId("profile"), map);
/** `at` is the time when the server wrote the last snapshot, and `age` how long before it was sent; both in ms. */
const received = { snapshots: 0, first: 0, last: null, at: 0, age: 0, source: null, tried: 0 };

const number = (value, digits) => (typeof value === "number" ? fixed(value, digits) : "–");

/** Formats the SIR of a hop: that of the model, and the measured one after a slash. */
const sirText = (model, measured) => (typeof measured === "number" ? `${number(model, 1)} / ${number(measured, 1)}` : number(model, 1));

/** Returns the distance of a relay from its agreed position, m; null if it or one of two altitudes is unknown. */
function off({ position, agreed }) {
  if (!position || !agreed) return null;
  if (typeof position.altitude_m !== typeof agreed.altitude_m) return null;
  const up = (position.altitude_m ?? 0) - (agreed.altitude_m ?? 0);
  return Math.hypot(position.x_m - agreed.x_m, position.y_m - agreed.y_m, up);
}

/** Returns the row of a relay: class, cells, and the classes of cells. Its age has grown by `silence` seconds. */
function row(relay, hop, silence) {
  const place = relay.position || {};
  const lost = relay.lost_neighbours.map((it) => `does not receive relay ${it}`);
  const behind = behindFor(relay, silence);
  const remarks = [behind === null ? "" : `position is ${behind.toFixed(0)} s old: the drone may be elsewhere`, relay.hold_reason ? `waits: ${relay.hold_reason}` : "", ...lost].filter(Boolean).join("; ");
  const db = hop ? hopDb(hop) : null;
  const age = typeof relay.age_s === "number" ? relay.age_s + silence : null;
  return {
    kind: relay.condition || "",
    cells: [String(relay.number), relay.control || "–", relay.phase || "–", sirText(hop?.sir_db, hop?.measured_db), sirText(hop?.sir_back_db, hop?.measured_back_db), number(off(relay), 1), number(place.x_m, 1), number(place.y_m, 1), number(place.altitude_m, 1), number(age, 1), remarks],
    kinds: { 3: sirClass(db), 4: sirClass(hop ? backDb(hop) : null), ...(behind === null ? {} : { 6: "behind", 7: "behind", 8: "behind" }), 9: age >= OLD ? "old" : "" },
  };
}

/** Fills the table; only texts that have changed are written. */
function table({ relays, hops }, silence = 0) {
  const into = new Map(hops.map((hop) => [hop.to, hop]));
  const rows = [...relays].sort((one, other) => one.number - other.number).map((relay) => row(relay, into.get(String(relay.number)), silence));
  if (into.has("Rx")) rows.push({ ...row({ number: "Rx", lost_neighbours: [] }, into.get("Rx"), silence), kind: "" });
  // The column of the way back is there if it is known of any hop.
  const hasBack = hops.some((hop) => typeof backDb(hop) === "number");
  byId("table").classList.toggle("one-way", !hasBack);
  const body = byId("rows");
  while (body.childElementCount > rows.length) body.lastChild.remove();
  while (body.childElementCount < rows.length) {
    const made = document.createElement("tr");
    rows[0].cells.forEach((_, at) => made.append(document.createElement(at ? "td" : "th")));
    made.firstChild.scope = "row";
    body.append(made);
  }
  rows.forEach(({ kind, cells, kinds }, at) => {
    const shown = body.children[at];
    if (shown.className !== kind) shown.className = kind;
    cells.forEach((text, column) => {
      const cell = shown.children[column];
      if (cell.textContent !== text) cell.textContent = text;
      const look = kinds[column] || "";
      if (cell.className !== look) cell.className = look;
    });
  });
}

function summary({ relays, hops, chain_size: size }) {
  const lost = relays.filter(({ condition }) => condition === "lost").map((relay) => relay.number);
  const ways = hops.flatMap((hop) => [{ from: hop.from, to: hop.to, db: hopDb(hop) }, { from: hop.to, to: hop.from, db: backDb(hop) }]);
  const [first] = ways.filter(({ db }) => typeof db === "number").sort((one, other) => one.db - other.db);
  const worst = first ? `worst hop ${first.from} to ${first.to}: ${fixed(first.db, 1)} dB` : "no SIR known";
  const all = size ? `${size.present} relays in the chain, ${size.meant} are meant to fly; fleet of ${relays.length}` : `${relays.length} relays`;
  return `${all}, ${lost.length ? `lost: ${lost.join(", ")}` : "none lost"}; ${worst}`;
}

function say(id, text) {
  if (byId(id).textContent !== text) byId(id).textContent = text;
}

/** Shows a snapshot. Another run of the program numbers its alarms and relays anew. */
function show(snapshot) {
  if (received.last && snapshot.run !== received.last.run) {
    map.forget();
    alarms.forget();
    edited();
  }
  received.snapshots += 1;
  received.last = snapshot;
  received.at = performance.now() - received.age;
  say("name", snapshot.name || "Relay chain");
  say("clock", typeof snapshot.time_s === "number" ? clock(snapshot.time_s) : "");
  const words = summary(snapshot);
  say("summary", words);
  say("attribution", (snapshot.tiles?.attribution && `Map: ${snapshot.tiles.attribution}`) || "");
  const label = `Map of the chain: ${words}`;
  if (byId("canvas").getAttribute("aria-label") !== label) byId("canvas").setAttribute("aria-label", label);
  map.take(snapshot);
  profile.take(snapshot);
  table(snapshot);
  takeDesk(snapshot);
  alarms.take(snapshot.alarms);
  received.first ||= performance.now();
  connection();
}

function addLines(lines) {
  const made = lines.map(({ time_s: time, text }) => {
    const item = document.createElement("li");
    item.append(Object.assign(document.createElement("time"), { textContent: clock(time) }), text);
    return item;
  });
  const all = byId("lines");
  all.prepend(...made.reverse());
  while (all.childElementCount > LINES) all.lastChild.remove();
}

/** Shows the state of the connection to the server, and lets all ages grow while no snapshot arrives. */
function connection() {
  if (isRecorded) return;
  const now = performance.now();
  const silent = now - received.at;
  const broken = received.last !== null && silent > SILENT;
  const closed = received.source?.readyState !== EventSource.OPEN;
  // Screen readers announce the state only; the seconds are beside it.
  const state = received.last === null ? "no data yet" : broken ? "no data" : closed ? "connecting" : "live";
  say("state", `${state}${closed && state.startsWith("no data") ? ", not connected to the server" : ""}`);
  say("seconds", broken ? ` for ${Math.floor(silent / 1000)} s` : "");
  byId("connection").className = broken ? "broken" : "";
  if (document.body.classList.toggle("stale", broken)) describe();
  const silence = broken ? silent / 1000 : 0;
  if (silence !== map.silence) {
    map.silence = silence;
    map.request();
    profile.request();
    table(received.last, silence);
  }
  if (received.last) alarms.silent(broken, received.last.time_s);
  // A connection can be dead without an error, for example after the computer was suspended.
  if (now - Math.max(received.at, received.tried) > STUCK) connect();
}

/** Opens the stream of snapshots in place of an earlier one. The browser opens it again after a fault, except after a refusal. */
function connect() {
  received.source?.close();
  const source = new EventSource("/events");
  Object.assign(received, { source, tried: performance.now() });
  // The server sends all lines that it keeps on each connection.
  source.addEventListener("open", () => byId("lines").replaceChildren());
  source.addEventListener("age", (event) => { received.age = Number(event.data); });
  source.addEventListener("snapshot", (event) => show(JSON.parse(event.data)));
  source.addEventListener("log", (event) => addLines(JSON.parse(event.data)));
  source.addEventListener("error", () => {
    if (source.readyState === EventSource.CLOSED) setTimeout(() => received.source === source && connect(), AGAIN);
    connection();
  });
}

byId("closer").addEventListener("click", () => map.zoom(1.4));
byId("farther").addEventListener("click", () => map.zoom(1 / 1.4));
byId("fit").addEventListener("click", () => map.fit());
if (!isRecorded) {
  setInterval(connection, 500);
  // The first snapshot is drawn after the first paint of the page. A hidden page is not painted.
  const begin = () => received.source || connect();
  document.addEventListener("DOMContentLoaded", () => {
    requestAnimationFrame(() => setTimeout(begin));
    setTimeout(begin, 500);
  });
}
