"use strict";
// Texts beside the pictures.

const byId = (id) => document.getElementById(id);

const decibels = (linear) => `${(10 * Math.log10(linear)).toFixed(2)} dB`;

/** Returns the words for the direction that limits a chain of both directions. */
const limitedBy = (direction) => ({ forward: "limited by the direction to Rx", backward: "limited by the direction back to Tx", both: "limited by both directions" })[direction];

function summary(report) {
  if (report.sir === undefined) return "The relays have not agreed on positions.";
  const share = report.share_of_optimum === undefined ? "" : ` ${(100 * report.share_of_optimum).toFixed(1)} % of the best SIR possible if the interferer were known.`;
  const ways = report.reverse === undefined ? "" : `, ${limitedBy(report.worst_direction)},`;
  return `Worst hop: SIR ${report.sir.toPrecision(5)} (${decibels(report.sir)})${ways} with ${report.relays.length} relays; ${report.messages} messages, ${report.bytes} bytes, ${report.virtual_s.toFixed(3)} s of virtual time.${share}`;
}

/** Returns the summary of a tick before the last one. */
function moment(tick, worst, chain) {
  const told = chain.filter((relay) => relay.told).length;
  const sir = told < chain.length ? `${told} of ${chain.length} relays have an agreed position` : `worst hop: SIR ${worst.toPrecision(5)} (${decibels(worst)})`;
  return `At ${tick.at_s.toFixed(3)} s: ${sir}; ${tick.messages} messages.`;
}

/** Hops whose SIR exceeds the least by no more than this share are equal to it: their differences are those of the method's tolerance. */
const EQUAL = 1e-3;

/** Returns the indices of the worst hops: none where all hops are equal. */
function worstHops(sirs) {
  const bound = Math.min(...sirs) * (1 + EQUAL);
  const worst = [...sirs.keys()].filter((hop) => sirs[hop] <= bound);
  return worst.length < sirs.length ? worst : [];
}

/** Returns the rows of the list: name, SIR, the SIR that counts (`counted`), and true for the way back. `nodes` names Tx, the relays and Rx. */
function rows({ there, back, reverse }, nodes) {
  const all = [];
  there.forEach((sir, hop) => {
    all.push({ name: `to ${nodes[hop + 1]}`, sir, counted: sir, isBack: false });
    if (hop < back.length) all.push({ name: `back to ${nodes[hop]}`, sir: back[hop], counted: back[hop] / reverse, isBack: true });
  });
  return all;
}

/** Fills the list of SIRs and marks the worst ones; bars have the length of the SIR that counts. */
function list(told) {
  const counted = told.map((row) => row.counted);
  const [most, worst] = [Math.max(...counted), new Set(worstHops(counted))];
  const all = byId("hops");
  while (all.childElementCount > told.length) all.lastChild.remove();
  while (all.childElementCount < told.length) {
    const item = document.createElement("li");
    item.append(...["span", "i", "span"].map((kind) => document.createElement(kind)));
    all.append(item);
  }
  [...all.children].forEach((item, at) => {
    const [name, bar, number] = item.children;
    const row = told[at];
    name.textContent = row.name;
    bar.style.width = `${(100 * row.counted) / most}%`;
    const kind = row.isBack ? "back" : "";
    name.className = number.className = kind;
    bar.className = [kind, worst.has(at) ? "worst" : ""].filter(Boolean).join(" ");
    number.textContent = `${row.sir.toPrecision(5)}, ${decibels(row.sir)}`;
  });
}

/** Phrases for the kinds of events that need more words beside a relay's number. */
const PHRASES = {
  "silent": "went silent",
  "switched on": "rebooted",
  "does not receive": "does not receive relay",
  "receives again": "receives again relay",
  "told to leave": "permits to leave, outside of the chain: relay",
  "may leave": "has permission to leave",
  "mission mismatch": "received another mission from relay",
  "duplicate index": "found another node with the number",
  "lost": "lost relay",
  "found": "became a neighbour of relay",
  "no quorum": "too few relays receive each other (no quorum), position held",
  "view accepted": "agreed which relays form the chain",
  "lease expired": "last agreement on positions expired, setpoint kept until the next one",
  "not received by": "is not received by relay",
  "sensor off": "ignores faulty interference measurements of relay",
  "converged": "agreed on a position",
  "infeasible": "found no positions with a usable SIR at every hop, keeps its position",
  "new estimate": "has a new estimate of the interferer",
  "interferer unclear": "the interference measurements fit no single interferer",
};

/** Fills the list of events. */
function happened(timeline) {
  byId("happened").hidden = timeline.length === 0;
  byId("events").replaceChildren(...timeline.map((event) => {
    const item = document.createElement("li");
    const who = event.relay === 0 ? "Tx" : `relay ${event.relay}`;
    const other = event.other === undefined ? "" : ` ${event.other}`;
    const relays = event.relays === undefined ? "" : `, ${event.relays} relays`;
    item.textContent = `${event.at_s.toFixed(3)} s: ${who}: ${PHRASES[event.what] || event.what}${other}${relays}`;
    return item;
  }));
}

/** Marks the first `told` events as past, and scrolls to the last of them. */
function mark(told) {
  const [box, items] = [byId("events"), byId("events").children];
  [...items].forEach((item, at) => item.classList.toggle("coming", at >= told));
  const last = items[told - 1];
  if (last) box.scrollTop = last.offsetTop - box.offsetTop - box.clientHeight / 2;
}

/** Shows error lines; hides the box if there are none. */
function complain(lines) {
  const box = byId("wrong");
  const text = lines.filter((line) => line).join("\n");
  if (box.textContent !== text) box.textContent = text;
  box.hidden = text === "";
}
