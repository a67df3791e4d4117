"use strict";
// A run from its beginning to its end, tick by tick.

/** How long all of it takes, and one tick at least and at most, ms; and how much longer one in which something happened. */
const PLAYED = { all: 10_000, least: 25, most: 120, pause: 450 };

/** Frames before a moment in which the chain changes are ticks of their own for so long, s; so many at most. */
const BEFORE = 0.7;
const FRAMES = 400;

/** What is played: for each tick its time, how the relays are, the SIRs, and who speaks. */
function ticks(film, timeline) {
  const moving = film.stands.filter((stand) => stand.relays.some(([, , place]) => place)).map((stand) => stand.at_s);
  let coming = 0;
  const spoken = [];
  for (const [sent, [at_s, relay, to]] of film.sent.entries()) {
    while (coming < moving.length && moving[coming] < at_s) coming += 1;
    if (coming < moving.length && moving[coming] - at_s < BEFORE && spoken.length < FRAMES) spoken.push({ at_s, says: [relay, to], messages: sent + 1 });
  }
  const all = [...film.stands, ...spoken].sort((a, b) => a.at_s - b.at_s);
  let [relays, sirs, messages, believed] = [new Map(), [], 0, null];
  let told = 0;
  return all.map((change) => {
    if (change.relays) {
      if (change.relays.length > 0) {
        relays = new Map(relays);
        for (const [relay, on, place] of change.relays) relays.set(relay, { on, place });
      }
      [sirs, believed] = [change.sirs, change.believed || null];
    }
    messages = Math.max(messages, change.messages);
    const before = told;
    while (told < timeline.length && timeline[told].at_s <= change.at_s) told += 1;
    return { at_s: change.at_s, relays, sirs, messages, believed, says: change.says || null, told, happens: told > before };
  });
}

const player = {
  ticks: [], tick: 0, timer: null,
  /** Called when another tick is to be seen. */
  seen: () => {},

  get playing() { return this.timer !== null; },
  get now() { return this.ticks[this.tick] || null; },
  get ended() { return this.tick >= this.ticks.length - 1; },

  /** Takes another run, and stands at its end. */
  take(all) {
    this.stop();
    this.ticks = all;
    this.tick = Math.max(0, all.length - 1);
  },

  seek(tick) {
    this.tick = tick;
    this.seen();
  },

  /** Plays from here, or from its beginning once it has ended. */
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
