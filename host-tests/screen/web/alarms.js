"use strict";
// Alarms: order, acknowledgement on this page, sound and title.

const URGENCY = ["critical", "warning", "notice"];

/** Symbol of each urgency, beside its colour. */
const MARKS = { critical: "▲", warning: "◆", notice: "●" };

/** Periods of the sound for the most urgent alarm that is not acknowledged, ms. A notice is silent. */
const SOUNDS = { critical: 1500, warning: 5000 };

const byId = (id) => document.getElementById(id);

/** Formats a time of the flight. */
function clock(time_s) {
  if (typeof time_s !== "number") return "–";
  const whole = Math.floor(time_s);
  const two = (number) => String(number).padStart(2, "0");
  return `${two(Math.floor(whole / 3600))}:${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}`;
}

const alarms = {
  all: [],
  /** Alarm of the page itself that no data arrive; it is kept until it is acknowledged. Its numbers are below 0. */
  silence: null,
  silences: 0,
  acknowledged: new Set(),
  announced: new Set(),
  shown: "",
  audio: null,
  sounded: 0,

  take(all) {
    this.all = all;
    // The text about a refusal is out of date without the alarm.
    if (!all.some(({ lost, cleared_s: cleared }) => lost === desk.refused && cleared === null)) say("clear-state", "");
    byId("no-alarms").textContent = "No alarm.";
    this.show();
  },

  /** Forgets the alarms of another run of the program. */
  forget() {
    this.acknowledged.clear();
    this.announced.clear();
    this.silence = null;
    this.all = [];
  },

  /** Begins or ends the alarm that no data arrive, at a time of the flight. */
  silent(is, time_s) {
    if (is === (this.silence?.cleared_s === null)) return;
    if (is) {
      this.silences += 1;
      this.silence = { number: -this.silences, urgency: "critical", text: "no data: the page shows an old state", time_s, cleared_s: null };
    } else {
      this.silence.cleared_s = time_s ?? this.silence.time_s ?? 0;
    }
    this.show();
  },

  /** Alarms that the operator has not acknowledged, the most urgent and newest first. */
  get open() { return this.sorted().filter(({ number }) => !this.acknowledged.has(number)); },

  /** Open alarms that last: only these sound and are in the title. */
  get lasting() { return this.open.filter(({ cleared_s: cleared }) => cleared === null); },

  sorted() {
    const rank = (alarm) => URGENCY.indexOf(alarm.urgency);
    return [...(this.silence ? [this.silence] : []), ...this.all].sort((one, other) => rank(one) - rank(other) || (one.cleared_s !== null) - (other.cleared_s !== null) || other.time_s - one.time_s || other.number - one.number);
  },

  acknowledge(numbers) {
    for (const number of numbers) this.acknowledged.add(number);
    this.show();
  },

  show() {
    const visible = this.sorted().filter(({ number, cleared_s: cleared }) => cleared === null || !this.acknowledged.has(number));
    const open = this.open;
    const { lasting, lasting: [first] } = this;
    document.title = first ? `${MARKS[first.urgency]} ${lasting.length > 1 ? `(${lasting.length}) ` : ""}${first.text}` : byId("name").textContent;
    this.announce(open);
    const state = JSON.stringify([Boolean(desk.token), visible.map((alarm) => [alarm, this.acknowledged.has(alarm.number)])]);
    // A button that is held stays.
    if (state === this.shown || byId("alarm-list").querySelector(".held")) return;
    this.shown = state;
    byId("no-alarms").hidden = visible.length > 0;
    byId("acknowledge-all").disabled = open.length === 0;
    const focused = document.activeElement?.dataset?.alarm;
    byId("alarm-list").replaceChildren(...visible.map((alarm) => this.item(alarm)));
    if (focused) (document.querySelector(`[data-alarm="${focused}"]`) || byId("acknowledge-all")).focus();
  },

  item(alarm) {
    const { number, urgency, text, time_s: begun, cleared_s: cleared, lost } = alarm;
    const made = (name, content, kind = "") => Object.assign(document.createElement(name), { textContent: content, className: kind });
    const item = made("li", "", `${urgency} ${cleared === null ? "" : "past"}`);
    const words = made("span", "");
    words.append(made("b", `${MARKS[urgency]} ${urgency} `), text);
    const state = cleared === null ? "" : `, ended at ${clock(cleared)}`;
    item.append(words, made("span", `since ${clock(begun)}${state}${this.acknowledged.has(number) ? ", acknowledged" : ""}`, "when"));
    if (!this.acknowledged.has(number)) {
      const button = made("button", "Acknowledge");
      button.type = "button";
      button.dataset.alarm = number;
      button.setAttribute("aria-label", `Acknowledge: ${text}`);
      button.addEventListener("click", () => this.acknowledge([number]));
      item.append(button);
    }
    if (typeof lost === "number" && cleared === null && desk.token) {
      const button = made("button", `Hold for 1 s to clear relay ${lost}`);
      button.type = "button";
      button.title = "Removes the relay from this page until it reports again. The neighbours still keep clear of its drone.";
      button.dataset.clear = lost;
      holdable(button, () => () => !document.body.classList.contains("stale"), () => clear(lost));
      item.append(button);
    }
    return item;
  },

  /** Passes the texts of new alarms to screen readers. */
  announce(open) {
    const fresh = open.filter(({ number }) => !this.announced.has(number));
    if (fresh.length === 0) return;
    for (const { number } of fresh) this.announced.add(number);
    byId("announced").textContent = fresh.map(({ urgency, text }) => `${urgency}: ${text}`).join(". ");
  },

  /** Sounds if an open alarm lasts and it is time. Browsers allow sound only after a click. */
  sound(now) {
    const period = SOUNDS[this.lasting[0]?.urgency];
    if (!this.audio || !period || now - this.sounded < period) return;
    this.sounded = now;
    const start = this.audio.currentTime;
    for (const [at, hertz] of [[0, 880], [0.2, 660]]) {
      const [tone, volume] = [this.audio.createOscillator(), this.audio.createGain()];
      tone.frequency.value = hertz;
      volume.gain.setValueAtTime(0.25, start + at);
      volume.gain.exponentialRampToValueAtTime(0.001, start + at + 0.18);
      tone.connect(volume).connect(this.audio.destination);
      tone.start(start + at);
      tone.stop(start + at + 0.18);
    }
  },

  toggleSound() {
    if (this.audio) this.audio.close();
    this.audio = this.audio ? null : new AudioContext();
    const button = byId("sound");
    button.setAttribute("aria-pressed", String(this.audio !== null));
    button.textContent = this.audio ? "Sound: on" : "Sound: off";
  },
};

byId("sound").addEventListener("click", () => alarms.toggleSound());
byId("acknowledge-all").addEventListener("click", () => alarms.acknowledge(alarms.open.map(({ number }) => number)));
setInterval(() => alarms.sound(performance.now()), 100);
