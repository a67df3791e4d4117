"use strict";
// Page: receives the snapshots, and fills heading, table and log.

/** Time without a snapshot after which the page says so, ms. */
const SILENT = 3000;

/** Time until a connection that was refused is tried again, ms. */
const AGAIN = 2000;

/** Largest number of log lines on the page. */
const LINES = 1000;

/** Age from which it is shown as old, s. */
const OLD = 5;

const map = new ChainMap(byId("canvas"));
const received = { snapshots: 0, first: 0, last: null, at: 0, source: null };

const number = (value, digits) => (typeof value === "number" ? value.toFixed(digits) : "–");

/** Formats the SIR of a hop: that of the model, and the measured one after a slash. */
const sirText = (model, measured) => (typeof measured === "number" ? `${number(model, 1)} / ${number(measured, 1)}` : number(model, 1));

/** Returns the distance of a relay from its agreed position, m. */
function off({ position, agreed }) {
  if (!position || !agreed) return null;
  const up = (position.altitude_m ?? 0) - (agreed.altitude_m ?? 0);
  return Math.hypot(position.x_m - agreed.x_m, position.y_m - agreed.y_m, up);
}

/** Returns the row of a relay: class, cells, and the classes of cells. */
function row(relay, hop) {
  const place = relay.position || {};
  const lost = relay.lost_neighbours.map((it) => `does not receive relay ${it}`);
  const remarks = [relay.hold_reason ? `waits: ${relay.hold_reason}` : "", ...lost].filter(Boolean).join("; ");
  const db = hop ? hopDb(hop) : null;
  return {
    kind: relay.condition || "",
    cells: [String(relay.number), relay.control || "–", relay.phase || "–", sirText(hop?.sir_db, hop?.measured_db), sirText(hop?.sir_back_db, hop?.measured_back_db), number(off(relay), 1), number(place.x_m, 1), number(place.y_m, 1), number(place.altitude_m, 1), number(relay.age_s, 1), remarks],
    kinds: { 3: sirClass(db), 4: sirClass(hop?.measured_back_db ?? hop?.sir_back_db), 9: relay.age_s >= OLD ? "old" : "" },
  };
}

/** Fills the table; only texts that have changed are written. */
function table({ relays, hops }) {
  const into = new Map(hops.map((hop) => [hop.to, hop]));
  const rows = [...relays].sort((one, other) => one.number - other.number).map((relay) => row(relay, into.get(String(relay.number))));
  if (into.has("Rx")) rows.push({ ...row({ number: "Rx", lost_neighbours: [] }, into.get("Rx")), kind: "" });
  // The column of the way back is there if it is known of any hop.
  const hasBack = hops.some((hop) => typeof (hop.sir_back_db ?? hop.measured_back_db) === "number");
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

function summary({ relays, hops }) {
  const lost = relays.filter(({ condition }) => condition === "lost").map((relay) => relay.number);
  const known = hops.map((hop) => ({ hop, db: hopDb(hop) })).filter(({ db }) => typeof db === "number").sort((one, other) => one.db - other.db);
  const worst = known.length ? `worst hop ${known[0].hop.from} to ${known[0].hop.to}: ${known[0].db.toFixed(1)} dB` : "no SIR known";
  return `${relays.length} relays, ${lost.length ? `lost: ${lost.join(", ")}` : "none lost"}; ${worst}`;
}

function say(id, text) {
  if (byId(id).textContent !== text) byId(id).textContent = text;
}

/** Shows a snapshot. A time that goes back is another flight. */
function show(snapshot) {
  if (received.last && snapshot.time_s < received.last.time_s) {
    map.forget();
    alarms.forget();
  }
  received.snapshots += 1;
  received.last = snapshot;
  received.at = performance.now();
  say("name", snapshot.name || "Relay chain");
  say("clock", typeof snapshot.time_s === "number" ? clock(snapshot.time_s) : "");
  const words = summary(snapshot);
  say("summary", words);
  const label = `Map of the chain: ${words}`;
  if (byId("canvas").getAttribute("aria-label") !== label) byId("canvas").setAttribute("aria-label", label);
  map.take(snapshot);
  table(snapshot);
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

/** Shows the state of the connection to the server. */
function connection() {
  const silent = performance.now() - received.at;
  const broken = received.at > 0 && silent > SILENT;
  const closed = received.source?.readyState !== EventSource.OPEN;
  say("connection", broken ? `no data for ${Math.floor(silent / 1000)} s${closed ? ": not connected to the server" : ""}` : closed ? "connecting" : "live");
  byId("connection").className = broken ? "broken" : "";
}

/** Opens the stream of snapshots. The browser opens it again after a fault, except after a refusal. */
function connect() {
  const source = new EventSource("/events");
  received.source = source;
  // The server sends all lines that it keeps on each connection.
  source.addEventListener("open", () => byId("lines").replaceChildren());
  source.addEventListener("snapshot", (event) => show(JSON.parse(event.data)));
  source.addEventListener("log", (event) => addLines(JSON.parse(event.data)));
  source.addEventListener("error", () => {
    if (source.readyState === EventSource.CLOSED) setTimeout(connect, AGAIN);
    connection();
  });
}

byId("closer").addEventListener("click", () => map.zoom(1.4));
byId("farther").addEventListener("click", () => map.zoom(1 / 1.4));
byId("fit").addEventListener("click", () => map.fit());
setInterval(connection, 500);
connect();
