"use strict";
// Playback of a run, tick by tick.

/** Duration of the playback, minimum and maximum of a tick, and duration of a tick with an event, ms. */
const PLAYED = { all: 10_000, least: 25, most: 120, pause: 450 };

/** Time before a change of the chain in which each frame is a tick of its own, s, and the maximum number of such ticks. */
const BEFORE = 0.7;
const FRAMES = 400;

/** Returns the ticks of a playback: time, states of the relays, SIRs of both directions, and sender of a frame. */
function ticks(film, timeline) {
  const moving = film.stands.filter((stand) => stand.relays.some(([, , place]) => place)).map((stand) => stand.at_s);
  let coming = 0;
  const spoken = [];
  for (const [sent, [at_s, relay, to]] of film.sent.entries()) {
    while (coming < moving.length && moving[coming] < at_s) coming += 1;
    if (coming < moving.length && moving[coming] - at_s < BEFORE && spoken.length < FRAMES) spoken.push({ at_s, says: [relay, to], messages: sent + 1 });
  }
  const all = [...film.stands, ...spoken].sort((a, b) => a.at_s - b.at_s);
  let [relays, sirs, backs, messages, believed] = [new Map(), [], [], 0, null];
  let told = 0;
  return all.map((change) => {
    if (change.relays) {
      if (change.relays.length > 0) {
        relays = new Map(relays);
        for (const [relay, on, place] of change.relays) relays.set(relay, { on, place });
      }
      [sirs, backs, believed] = [change.sirs, change.backs || [], change.believed || null];
    }
    messages = Math.max(messages, change.messages);
    const before = told;
    while (told < timeline.length && timeline[told].at_s <= change.at_s) told += 1;
    return { at_s: change.at_s, relays, sirs, backs, messages, believed, says: change.says || null, told, happens: told > before };
  });
}

const player = {
  ticks: [], tick: 0, timer: null,
  /** Callback after each change of the displayed tick. */
  seen: () => {},

  get playing() { return this.timer !== null; },
  get now() { return this.ticks[this.tick] || null; },
  get ended() { return this.tick >= this.ticks.length - 1; },

  /** Replaces the run, and shows its end. */
  take(all) {
    this.stop();
    this.ticks = all;
    this.tick = Math.max(0, all.length - 1);
  },

  seek(tick) {
    this.tick = tick;
    this.seen();
  },

  /** Plays from the present tick, or from the beginning after the end. */
  play() {
    if (this.ended) this.tick = 0;
    const each = Math.min(PLAYED.most, Math.max(PLAYED.least, PLAYED.all / Math.max(1, this.ticks.length)));
    const turn = () => {
      if (this.ended) {
        this.stop();
        this.seen();
        return;
      }
      this.tick += 1;
      this.timer = setTimeout(turn, this.now.happens ? PLAYED.pause : each);
      this.seen();
    };
    this.timer = setTimeout(turn, each);
    this.seen();
  },

  stop() {
    clearTimeout(this.timer);
    this.timer = null;
  },
};
