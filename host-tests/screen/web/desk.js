"use strict";
// Form for a new mission, its preview, and the buttons that are held to upload it and to clear a lost relay. A page that only shows has no token, and no form.

/** Time for which the button has to be held, ms. */
const HOLD = 1000;

/** Largest delay of the timer of the button, ms: on a busier page the button may have been released before. */
const DELAY = 300;

/** Time in which a task has to be answered, ms. A request that the browser or a tunnel holds back is given up. */
const ANSWER = 4000;

/** `mine` is the number of the preview of the values in the form, or null; `turn` counts edits; `held` is the timer of the button; `refused` is the relay that could not be cleared. */
const desk = { token: null, state: {}, mine: null, turn: 0, held: 0, refused: 0, note: "" };

const metres = (value) => number(value, 1);

/** Sends a task. Returns the answer; a refusal is an error with the reason. */
async function post(path, body) {
  const headers = { "Content-Type": "application/json", "X-Relay-Token": desk.token };
  // The address of the page may contain the password, which `fetch` refuses; the origin does not.
  const signal = AbortSignal.timeout(ANSWER);
  const response = await fetch(location.origin + path, { method: "POST", headers, body: JSON.stringify(body), signal });
  const text = (await response.text()).trim();
  if (!response.ok) throw new Error(text || response.statusText);
  return JSON.parse(text);
}

/** Returns the values in the form; empty fields stay as flown. */
function values() {
  const pairs = [...new FormData(byId("form"))].map(([name, value]) => [name, value.trim()]);
  return Object.fromEntries(pairs.filter(([, value]) => value));
}

/** Returns the text about a task that has failed. */
const failure = (error) => (error.name === "TimeoutError" ? `No answer for ${ANSWER / 1000} s: the state after this text shows whether the station has started the task.` : `Refused: ${error.message}.`);

async function preview() {
  edited();
  const { turn } = desk;
  let number = null;
  let note = "";
  try {
    number = (await post("/preview", { ...values(), shown: desk.state.shown ?? "unknown" })).preview;
  } catch (error) {
    note = failure(error);
  }
  // An answer to earlier values is dropped.
  if (turn !== desk.turn) return;
  desk.mine = number;
  desk.note = note;
  describe();
}

async function upload() {
  const { number: preview, digest } = desk.state;
  try {
    await post("/upload", { preview, digest, time_s: received.last.time_s });
  } catch (error) {
    desk.note = failure(error);
  }
  describe();
}

/** Clears a lost relay at the station. */
async function clear(relay) {
  let text = "";
  try {
    await post("/clear", { relay, time_s: received.last.time_s });
  } catch (error) {
    text = `Relay ${relay} is not cleared. ${failure(error)}`;
    desk.refused = relay;
  }
  say("clear-state", text);
}

/** Forgets the preview of earlier values, or of another run of the program. */
function edited() {
  release(byId("hold"));
  desk.turn += 1;
  desk.mine = null;
  desk.note = "";
  describe();
}

/** Returns true if the form's own preview can be uploaded, and the page does not show an old state. */
const isReady = () => desk.mine !== null && desk.mine === desk.state.number && desk.state.stage === "ready" && !document.body.classList.contains("stale");

/** Takes the token and the state of the tasks from a snapshot. */
function takeDesk({ token, desk: state }) {
  desk.token = token;
  desk.state = state || {};
  byId("desk").hidden = !state;
  if (!token || !state) return;
  byId("form").hidden = Boolean(state.why);
  for (const it of document.querySelectorAll("#form .sited")) it.hidden = !state.sited;
  if (state.stage === "flown" && state.number === desk.mine) {
    // The values are flown now, and the line may be another.
    byId("form").reset();
    edited();
  }
  describe();
}

const listed = (numbers) => (numbers.length ? numbers.join(", ") : "none");

/** Returns the text about the newest preview or upload. */
function stateText({ why, number, stage, fault, version, adopted, arrived, relays }) {
  if (why) return `No uploads: ${why}.`;
  if (!stage) return "The values of empty fields do not change. Drag Rx on the map, or type values.";
  const what = number ? `Preview ${number}` : `Version ${version}`;
  const words = {
    asking: "asks the chain for its mission",
    computing: "is being computed",
    ready: `is ready: version ${version} of the mission`,
    checking: "asks the chain for its mission once more",
    uploading: `is being uploaded as version ${version}`,
    flown: `is flown as version ${version}`,
    failed: `has failed: ${fault}`,
    "dry run": "was computed, but not uploaded (dry run)",
  };
  const progress = stage === "uploading" || stage === "flown" ? `; adopted by ${adopted.length} of ${relays} relays (${listed(adopted)}); at their new positions: ${listed(arrived)}` : "";
  return `${what} ${words[stage]}${progress}`;
}

/** Returns the worst SIRs of a mission: toward Rx, and back if known. */
function worstText(sirs) {
  if (!sirs) return "unknown";
  const [there, back] = sirs.map((db) => (typeof db === "number" ? `${fixed(db, 1)} dB` : null));
  return back ? `${there ?? "–"} toward Rx, ${back} back` : there ?? "unknown";
}

/** Shows the state, the preview, and the positions on the map; only what has changed is written. */
function describe() {
  const { state } = desk;
  say("desk-state", [desk.note, stateText(state)].filter(Boolean).join(" "));
  byId("hold").disabled = !isReady();
  if (!isReady()) release(byId("hold"));
  const shown = state.preview;
  const key = shown ? JSON.stringify([state.number, state.stage, shown]) : "";
  if (key === desk.shown) return;
  desk.shown = key;
  const lines = shown ? shown.changes.map(({ value, old, new: now }) => `${value}: ${old} → ${now}`) : [];
  if (shown?.moves) {
    lines.push(`worst hop: ${worstText(shown.worst_before)} → ${worstText(shown.worst_after)}`);
    for (const { relay, metres: way, from, to } of shown.moves) lines.push(`relay ${relay} moves ${metres(way)} m: x ${metres(from.x_m)}, y ${metres(from.y_m)}, h ${metres(from.h_m)} → x ${metres(to.x_m)}, y ${metres(to.y_m)}, h ${metres(to.h_m)}`);
  } else if (shown && state.stage !== "computing") {
    lines.push("the moves of the relays cannot be computed in advance");
  }
  byId("changes").replaceChildren(...lines.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  // An uploaded mission may have another line, and the map other coordinates.
  map.targets = state.stage === "ready" ? shown.targets : [];
  byId("previewed").hidden = !map.targets.length;
  map.request();
}

/** Ends the holding of a button; without an argument that of any button. */
function release(button) {
  const held = document.querySelector(".held");
  if (button && button !== held) return;
  clearTimeout(desk.held);
  desk.held = 0;
  held?.classList.remove("held");
}

/** Lets a button do `act` after it was held. `begin` returns a function that has to return true at both ends of that time. */
function holdable(button, begin, act) {
  const hold = () => {
    const isReady = begin();
    if (!isReady() || desk.held) return;
    button.classList.add("held");
    const begun = performance.now();
    desk.held = setTimeout(() => {
      const isHeld = button.classList.contains("held");
      release();
      if (isHeld && isReady() && performance.now() - begun < HOLD + DELAY) act();
    }, HOLD);
  };
  button.addEventListener("pointerdown", (event) => event.button === 0 && event.isPrimary && hold());
  for (const end of ["pointerup", "pointerleave", "pointercancel", "blur", "keyup"]) button.addEventListener(end, () => release(button));
  button.addEventListener("contextmenu", (event) => event.preventDefault());
  button.addEventListener("keydown", (event) => {
    if (event.key !== " " && event.key !== "Enter") return;
    event.preventDefault();
    if (!event.repeat) hold();
  });
}

/** A drag of Rx fills the form; a mission without sites can only move it along the line. */
map.dragged = ([x, y], isDone) => {
  const field = byId("form").elements.receiver;
  field.value = `${metres(x)},${desk.state.sited ? metres(y) : 0}`;
  edited();
  if (isDone) preview();
};
map.canDrag = () => desk.token && !byId("desk").hidden && byId("desk").open && !desk.state.why;

byId("form").addEventListener("submit", (event) => {
  event.preventDefault();
  preview();
});
byId("form").addEventListener("input", edited);
holdable(byId("hold"), () => {
  const { number, digest } = desk.state;
  return () => isReady() && number === desk.state.number && digest === desk.state.digest;
}, upload);
for (const [target, end] of [[window, "blur"], [document, "visibilitychange"]]) target.addEventListener(end, () => release());
