"use strict";
// Input: dragging, pressing, typing.

/** Maximum distance of a press from its handle, px, and the advantage of handles that can be dragged over relays. */
const NEAR = 22;
const DRAGGED = 6;

/** Movement from which a press is a drag, px. */
const STILL = 8;

/** Present press: the handle, its start, and true if it has become a drag of a relay. */
const hand = { holds: null, from: [0, 0], drags: false };

/** Connects the handles of `picture`, whose positions `signs()` returns. Calls `moved(id, x, y)` for a drag, `left()` at its end, `pressed(relay)` for a press of a relay, and `refused()` for a drag of a relay. */
function handle(picture, signs, { moved, pressed, left, refused }) {
  const { svg } = picture;
  const relays = () => signs().filter(({ relay }) => relay !== undefined);
  const isSign = (event) => event.target.closest("[role]") !== svg;
  // A finger on a handle drags it and does not scroll the page.
  svg.addEventListener("touchstart", (event) => {
    if (isSign(event)) event.preventDefault();
  }, { passive: false });
  svg.addEventListener("pointerdown", (event) => {
    if (!isSign(event)) return;
    event.preventDefault();
    // Of several handles close together the nearest one counts, not the one drawn last.
    const [x, y] = picture.metres(event.clientX, event.clientY);
    const far = (sign) => Math.hypot(sign.x - x, sign.y - y) / picture.unit - (sign.relay === undefined ? DRAGGED : 0);
    const nearest = signs().sort((a, b) => far(a) - far(b))[0];
    if (far(nearest) > NEAR) return;
    const { id } = nearest;
    turn(id);
    byId(id).focus({ preventScroll: true });
    Object.assign(hand, { holds: id, from: [event.clientX, event.clientY], drags: false });
    svg.setPointerCapture(event.pointerId);
  });
  svg.addEventListener("pointermove", (event) => {
    if (!hand.holds) return;
    const { clientX, clientY } = event;
    if (!hand.holds.startsWith("relay")) moved(hand.holds, ...picture.metres(clientX, clientY));
    else if (!hand.drags && Math.hypot(clientX - hand.from[0], clientY - hand.from[1]) > STILL) {
      hand.drags = true;
      refused();
    }
  });
  const released = (event) => {
    const held = hand.holds;
    hand.holds = null;
    if (!held) return;
    if (!held.startsWith("relay")) left();
    else if (event.type === "pointerup" && !hand.drags) pressed(Number(held.slice("relay".length)));
  };
  svg.addEventListener("pointerup", released);
  svg.addEventListener("pointercancel", released);
  svg.addEventListener("keydown", (event) => {
    const { id } = event.target;
    const step = event.shiftKey ? 50 : 10;
    const by = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, -step], ArrowDown: [0, step] }[event.key];
    if (id.startsWith("relay")) {
      if (event.key === " " || event.key === "Enter") pressed(Number(id.slice("relay".length)));
      else if (by) next(id, by[0] + by[1] > 0 ? 1 : -1);
      else return;
    } else {
      if (!by) return;
      moved(id, standing(id).x + by[0], want.y + by[1]);
      left();
    }
    event.preventDefault();
  });

  /** Makes this relay the only one that Tab reaches: otherwise up to a hundred relays would have to be passed. */
  function turn(id) {
    if (!id.startsWith("relay")) return;
    hand.relay = Number(id.slice("relay".length));
    for (const one of svg.querySelectorAll("[role=switch]")) one.setAttribute("tabindex", one.id === id ? 0 : -1);
  }

  function next(id, step) {
    const all = relays().map((relay) => relay.id);
    const there = all[all.indexOf(id) + step];
    if (!there) return;
    turn(there);
    byId(there).focus();
  }
}

/** Reads the form and returns an error line for each number out of its range. Valid fields are used. */
function read() {
  const lines = [];
  for (const key of ["uavs", "power", "reverse", "rx_w", "loss"]) {
    const field = byId(key);
    const good = field.value !== "" && field.checkValidity();
    field.setAttribute("aria-invalid", String(!good));
    if (good) want[key] = Number(field.value);
    else lines.push(`${field.parentElement.textContent.trim()} = ${field.value || "(empty)"}: must be within ${field.min} to ${field.max}`);
  }
  want.method = byId("method").value;
  want.listen = byId("listen").checked;
  want.moving = byId("moving").checked && want.listen;
  byId("moving").disabled = !want.listen;
  byId("rx_w").disabled = !(want.reverse > 0);
  return lines;
}
