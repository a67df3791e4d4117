"use strict";
// Recorded flight: time bar, and the snapshots of the file in place of a server's.

/** Times faster than the flight. */
const SPEEDS = [0.5, 1, 2, 5, 10, 20, 50];

const flight = JSON.parse(byId("flight").textContent);
/** `step` is the number of the snapshot that `state` has; `time` is in s of the flight. */
const replay = { time: 0, step: -1, state: {}, lines: 0, speed: 1, playing: false, ticked: 0 };

/** Returns `base` with the changes of a snapshot. The changes of an object or an array are an object of changed values. */
function changed(base, change) {
  if (base === null || typeof base !== "object" || change === null || typeof change !== "object") return change;
  for (const [key, value] of Object.entries(change)) {
    if (key === "#") base.length = value;
    else base[key] = key in base ? changed(base[key], value) : value;
  }
  return base;
}

/** Returns a copy of the state at a time: ages count from the times of the reports. */
function snapshotAt(time) {
  const relays = replay.state.relays.map(({ at_s: at, ...relay }) => ({ ...relay, age_s: at === null ? null : Math.max(0, time - at) }));
  return structuredClone({ ...replay.state, relays, time_s: time });
}

/** Shows the flight at a time. Earlier snapshots are applied in their order, so that the map has the ways flown until then. */
function seek(time) {
  replay.time = Math.min(Math.max(time, 0), flight.duration);
  const last = flight.steps.length - 1;
  const isEnd = replay.time >= flight.duration;
  // The last snapshot is at the end, whatever the period.
  const step = isEnd ? last : Math.min(Math.floor(replay.time / flight.period + 1e-6), last);
  if (step < replay.step) {
    Object.assign(replay, { step: -1, state: {}, lines: 0 });
    map.ways.clear();
    Object.assign(map, { newParts: [], drawnFor: "" });
    byId("lines").replaceChildren();
  }
  if (step !== replay.step) {
    while (replay.step < step) {
      replay.step += 1;
      replay.state = changed(replay.state, structuredClone(flight.steps[replay.step]));
      map.take(replay.state);
    }
    const now = Math.min(step * flight.period, flight.duration);
    show(snapshotAt(now));
    const until = flight.log.filter(({ time_s: at }) => at <= now).length;
    addLines(flight.log.slice(Math.max(replay.lines, until - LINES), until));
    replay.lines = until;
  }
  byId("bar").value = isEnd ? byId("bar").max : String(replay.time);
  const shown = clock(replay.time);
  if (byId("bar").getAttribute("aria-valuetext") !== shown) {
    byId("bar").setAttribute("aria-valuetext", shown);
    byId("now").textContent = `${shown} of ${clock(flight.duration)}`;
  }
  byId("cursor")?.setAttribute("transform", `translate(${44 + (replay.time / Math.max(flight.duration, 1)) * 946} 0)`);
}

function play(is) {
  if (is && replay.time >= flight.duration) seek(0);
  replay.playing = is;
  replay.ticked = performance.now();
  byId("play").textContent = is ? "Pause" : "Play";
  if (is) requestAnimationFrame(tick);
}

function tick(now) {
  if (!replay.playing) return;
  const passed = Math.max(0, now - replay.ticked) / 1000;
  replay.ticked = now;
  seek(replay.time + passed * replay.speed);
  if (replay.time >= flight.duration) play(false);
  else requestAnimationFrame(tick);
}

function faster(by) {
  const index = SPEEDS.indexOf(replay.speed) + by;
  replay.speed = SPEEDS[Math.min(Math.max(index, 0), SPEEDS.length - 1)];
  byId("speed").textContent = `${replay.speed} ×`;
}

const KEYS = { " ": () => play(!replay.playing), j: () => seek(replay.time - 10), l: () => seek(replay.time + 10), ",": () => faster(-1), ".": () => faster(1) };

document.addEventListener("keydown", (event) => {
  const act = KEYS[event.key.toLowerCase()];
  if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
  // The space bar presses a button that has the focus.
  if (event.key === " " && event.target instanceof HTMLButtonElement) return;
  event.preventDefault();
  act();
});
document.addEventListener("click", ({ target }) => {
  const time = target.dataset?.time;
  if (time !== undefined) seek(Number(time));
});
byId("bar").max = String((flight.steps.length - 1) * flight.period);
byId("bar").step = String(flight.period);
byId("bar").addEventListener("input", () => seek(Number(byId("bar").value)));
byId("play").addEventListener("click", () => play(!replay.playing));
byId("slower").addEventListener("click", () => faster(-1));
byId("faster").addEventListener("click", () => faster(1));
for (const { time_s: time, urgency, text } of flight.alarms) {
  const mark = Object.assign(document.createElement("button"), { type: "button", className: urgency, textContent: MARKS[urgency], title: `${clock(time)} ${text}` });
  mark.dataset.time = String(time);
  mark.setAttribute("aria-label", `${clock(time)} ${urgency}: ${text}`);
  mark.style.left = `${Math.min((100 * time) / Math.max(flight.duration, 1), 100)}%`;
  byId("marks").append(mark);
}
const begin = flight.begin < 1e8 ? "virtual time 0" : new Date(flight.begin * 1000).toISOString().replace("T", " ").replace(/\..*/, " UTC");
byId("begin").textContent = begin;
say("state", `recorded flight, from ${begin}`);
seek(0);
