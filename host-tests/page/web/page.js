"use strict";
// Page: connects the input, the runs and the pictures.

/** State of the page: the last completed run, and the errors of the next run, of the fields and of a drag. */
const shown = { run: null, asked: "", refused: "", fields: [], stopped: "", places: new Map(), frame: 0 };

const pictures = Object.fromEntries(Object.entries(VIEWS).map(([name, view]) => [name, new Picture(byId(name), view)]));

/** Returns the displayed relays: number, on or off, position agreed or not (`told`), and position, with x in the picture's coordinates. */
function relays() {
  const { run } = shown;
  const tick = player.now;
  if (!run) return [];
  const there = tick ? tick.relays : run.last;
  const one = ([relay, { on, place }]) => {
    // A relay without a position is drawn at its first one.
    const at = place || (run.first.get(relay) || {}).place;
    return at && { relay, on, told: Boolean(place), x: at[0] + run.tx, y: at[1], h: at[2] };
  };
  return [...there].map(one).filter(Boolean).sort((a, b) => a.x - b.x);
}

/** Returns the displayed SIRs of every hop to Rx (`there`) and, with a way back, toward Tx (`back`), and r. */
function ways() {
  const { report } = shown.run;
  const reverse = report.reverse || 0;
  if (player.now && !player.ended) return { there: player.now.sirs, back: player.now.backs, reverse };
  const kept = report.relays || [];
  const back = reverse > 0 ? [...kept.map((relay) => relay.sir_back), report.rx_sir_back] : [];
  return { there: [...kept.map((relay) => relay.sir), report.rx_sir], back, reverse };
}

/** Returns the displayed SIR of every hop that counts: the smaller one of both directions, the way back divided by r. */
function sirs() {
  const { there, back, reverse } = ways();
  return there.map((sir, hop) => (hop < back.length ? Math.min(sir, back[hop] / reverse) : sir));
}

/** Returns true if the run has the present input. */
const isOf = (run) => Boolean(run) && run.words === options() && run.toml === scenario();

/** Draws both views; `moved` replaces the positions of the relays during an animation. */
function draw(moved) {
  const all = moved || relays();
  const chain = all.filter((relay) => relay.on);
  const [tick, { run }] = [player.now, shown];
  const wanted = isOf(run);
  const values = run ? sirs() : [];
  const speaks = player.playing && tick ? tick.says : null;
  const drift = want.moving && tick && wanted ? SPEED * tick.at_s : 0;
  // Exactly one relay can be reached by Tab.
  const stop = all.some(({ relay }) => relay === hand.relay) ? hand.relay : (all[0] || {}).relay;
  const marks = new Map();
  if (wanted && values.length === chain.length + 1) {
    const { there, back } = ways();
    const worst = new Set(worstHops(values));
    values.forEach((value, hop) => {
      const isBack = hop < back.length && value < there[hop] * (1 - EQUAL);
      const kind = [worst.has(hop) ? "worst" : "", isBack ? "back" : ""].filter(Boolean).join(" ");
      if (kind) marks.set(hop, kind);
    });
  }
  chain.forEach((relay, at) => {
    if (!relay.told) for (const hop of [at, at + 1]) marks.set(hop, "waits");
  });
  const by = speaks ? chain.findIndex((relay) => relay.relay === speaks[0]) : -1;
  if (by >= 0 && speaks[1] !== 0) marks.set(by + (speaks[1] > 0 ? 1 : 0), "says");
  for (const [name, picture] of Object.entries(pictures)) {
    const active = name === "above";
    const second = (relay) => (active ? relay.y : relay.h);
    const knob = (id, label, [least, most]) => {
      if (!active) return {};
      const { x, words } = standing(id);
      return { tabindex: 0, role: "slider", "aria-label": label, "aria-valuemin": least, "aria-valuemax": most, "aria-valuenow": x, "aria-valuetext": words };
    };
    const [left, right] = picture.view.x;
    const crowded = picture.crowds(all.map((relay) => [relay.x, second(relay)]));
    picture.svg.classList.toggle("stale", !wanted);
    picture.frame();
    picture.chain([[want.tx, 0], ...chain.map((relay) => [relay.x, second(relay)]), [want.rx, 0]], marks);
    const jammer = [want.x + drift, active ? want.y : 0];
    const believed = tick && tick.believed && active && wanted ? tick.believed : null;
    picture.put([
      { id: "tx", shape: "site", active, at: [want.tx, 0], text: "Tx", side: "left", attributes: knob("tx", "Transmitter", [left + 40, want.rx - APART]) },
      { id: "rx", shape: "site", active, at: [want.rx, 0], text: "Rx", side: "right", attributes: knob("rx", "Receiver", [want.tx + APART, right - 40]) },
      ...(believed ? [{ id: "belief", shape: "belief", at: [believed[1] + run.tx, believed[2]], attributes: { "aria-hidden": "true" } }] : []),
      { id: "jammer", shape: "jammer", active, at: jammer, text: active ? "interferer" : "", side: "up", attributes: knob("jammer", "Interferer", [left + 20, right - 20]) },
      ...all.map((relay) => ({
        id: `relay${relay.relay}`, shape: "relay", active, at: [relay.x, second(relay)], text: crowded ? "" : String(relay.relay),
        kind: [relay.on ? "" : "off", relay.told ? "" : "waits", speaks && relay.relay === speaks[0] ? "says" : ""].join(" "),
        attributes: active ? { tabindex: relay.relay === stop ? 0 : -1, role: "switch", "aria-checked": !want.off.has(relay.relay), "aria-label": `Relay ${relay.relay}` } : {},
      })),
    ]);
  }
}

/** Updates the texts beside the pictures. */
function tell() {
  complain([...shown.fields, shown.stopped, shown.refused]);
  const { run } = shown;
  if (!run) return;
  const tick = player.now;
  const values = sirs();
  byId("summary").setAttribute("aria-live", player.playing ? "off" : "polite");
  const chain = relays().filter((relay) => relay.on);
  byId("summary").textContent = tick && !player.ended ? moment(tick, Math.min(...values), chain) : summary(run.report);
  const both = ways();
  list(values.length === chain.length + 1 ? rows(both, ["Tx", ...chain.map((relay) => relay.relay), "Rx"]) : []);
  byId("ways").hidden = both.back.length === 0;
  byId("ways").textContent = `Two bars for each hop: toward Rx, and back to Tx. The way back needs only ${both.reverse} times the SIR, so the bar of the way back shows its SIR divided by ${both.reverse}. A dashed hop is worse on the way back.`;
  mark(tick ? tick.told : Infinity);
  byId("player").hidden = player.ticks.length < 2;
  byId("play").textContent = player.playing ? "Pause" : "Play";
  byId("time").max = Math.max(0, player.ticks.length - 1);
  byId("time").value = player.tick;
  byId("clock").textContent = tick ? `${tick.at_s.toFixed(tick.at_s < 10 ? 3 : 1)} s` : "";
  byId("time").setAttribute("aria-valuetext", byId("clock").textContent);
}

/** Returns the final state of the relays of a run without a film. */
function ended({ relays: kept, lost }) {
  const one = (on) => (relay) => [relay.index, { on, place: relay.x_m === undefined ? null : [relay.x_m, relay.y_m || 0, relay.h_m] }];
  return new Map([...kept.map(one(true)), ...(lost || []).map(one(false))]);
}

/** Shows the result of a run. After an error the last result stays visible. */
function take({ words, toml, tx, plays }, { text, took_ms }) {
  const told = JSON.parse(text);
  const { report, film } = told;
  window.last = { words, toml, text, told, took_ms, runs: ((window.last || {}).runs || 0) + 1 };
  shown.refused = told.wrong || "";
  byId("numbers").setAttribute("aria-busy", "false");
  if (report && report.relays && report.relays.length > 0) {
    const all = film ? ticks(film, report.timeline || []) : [];
    const last = all.length > 0 ? all[all.length - 1].relays : ended(report);
    const first = new Map();
    for (const { relays: now } of all) for (const [relay, { place }] of now) if (place && !first.has(relay)) first.set(relay, { place });
    shown.run = { words, toml, report, tx, first, last };
    player.take(all);
    happened(report.timeline || []);
    byId("command").textContent = `cargo chain --scenario page.toml ${words}`;
    byId("scenario").textContent = toml;
    if (plays !== undefined && all.length > 1 && !still()) {
      player.tick = Math.max(0, all.findIndex((tick) => tick.at_s >= plays));
      player.play();
    } else {
      glide();
    }
  }
  tell();
  draw();
}

const still = () => matchMedia("(prefers-reduced-motion: reduce)").matches;

/** Animates the relays from the displayed positions to those of the run. */
function glide() {
  const from = shown.places;
  const to = relays();
  shown.places = new Map(to.map((relay) => [relay.relay, relay]));
  cancelAnimationFrame(shown.frame);
  shown.frame = 0;
  if (still() || hand.holds || to.some((relay) => !from.has(relay.relay))) return;
  const begun = performance.now();
  const turn = (now) => {
    const part = Math.min(1, (now - begun) / 300);
    const mix = (a, b) => a + (b - a) * part;
    const between = (relay) => {
      const was = from.get(relay.relay);
      return { ...relay, x: mix(was.x, relay.x), y: mix(was.y, relay.y), h: mix(was.h, relay.h) };
    };
    draw(to.map(between));
    shown.frame = part < 1 ? requestAnimationFrame(turn) : 0;
  };
  shown.frame = requestAnimationFrame(turn);
}

/** Returns options and scenario of the present input, for comparisons. */
const wish = () => `${options()}\n${scenario()}`;

/** Starts a run of the present input; plays it from `plays` seconds on, if given. */
function run(plays) {
  shown.asked = wish();
  engine.ask({ words: options(), toml: scenario(), tx: want.tx, film: !hand.holds, plays });
  byId("numbers").setAttribute("aria-busy", "true");
  tell();
  draw();
}

player.seen = () => {
  tell();
  draw();
};
engine.answered = take;

byId("time").addEventListener("input", (event) => {
  player.stop();
  player.seek(Number(event.target.value));
});
byId("play").addEventListener("click", () => {
  if (player.playing) player.stop();
  else player.play();
  player.seen();
});
/** Returns the handles of the view from above. */
const signs = () => [
  ...relays().map((relay) => ({ ...relay, id: `relay${relay.relay}` })),
  { id: "tx", x: want.tx, y: 0 }, { id: "rx", x: want.rx, y: 0 }, { id: "jammer", x: want.x, y: want.y },
];

handle(pictures.above, signs, {
  moved(id, x, y) {
    player.take([]);
    shown.stopped = move(id, x, y);
    run();
  },
  left: () => run(),
  refused() {
    shown.stopped = "Relays cannot be dragged: they choose their own positions. Press a relay to switch it off.";
    tell();
  },
  pressed(relay) {
    if (!want.off.delete(relay)) want.off.add(relay);
    shown.stopped = "";
    run(want.off.size > 0 ? SILENT_S - 0.1 : undefined);
  },
});

/** Reads the form. A browser reports one edit twice, on input and on change: the second one starts no run. */
function typed() {
  shown.fields = read();
  shown.stopped = "";
  if (shown.asked === wish()) tell();
  else run();
}
byId("controls").addEventListener("input", typed);
byId("controls").addEventListener("change", typed);
byId("controls").addEventListener("submit", (event) => event.preventDefault());
byId("controls").addEventListener("reset", () => {
  Object.assign(want, BEGINNING);
  want.off.clear();
  setTimeout(typed, 0);
});
new ResizeObserver(() => {
  for (const picture of Object.values(pictures)) picture.measure();
  draw();
}).observe(byId("above"));

byId("moving").disabled = true;
for (const picture of Object.values(pictures)) picture.measure();
// The page contains the result of the first run, so that it is visible before the code is loaded.
take({ words: options(), toml: scenario(), tx: want.tx }, { text: byId("first").textContent, took_ms: 0 });

/** Loads the code and starts the first run; called at the end of the page. */
function begin() {
  engine.load(byId("code").textContent.trim()).then(() => {
    window.ready = true;
    run(0);
  }).catch((error) => {
    shown.refused = `the code of the page cannot be loaded: ${error}`;
    tell();
  });
}
