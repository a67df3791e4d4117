"use strict";
// What a hand does: it drags, presses, types.

/** How far from a sign a press still means it, px; and how much nearer than others those count that are dragged. */
const NEAR = 22;
const DRAGGED = 6;

/** A press that moves farther than this is a drag, px. */
const STILL = 8;

/** What is held, where the press began, and whether it has become a drag of a relay. */
const hand = { holds: null, from: [0, 0], drags: false };

/** The handles of `picture`: `signs()` are where; `moved(id, x, y)` when one is put somewhere, `pressed(relay)` when a relay is, `left()` when one is let go, `refused()` when a relay is dragged. */
function handle(picture, signs, { moved, pressed, left, refused }) {
  const { svg } = picture;
  const relays = () => signs().filter(({ relay }) => relay !== undefined);
  const isSign = (event) => event.target.closest("[role]") !== svg;
  // A finger on a sign drags that, and does not scroll the page.
  svg.addEventListener("touchstart", (event) => {
    if (isSign(event)) event.preventDefault();
  }, { passive: false });
  svg.addEventListener("pointerdown", (event) => {
    if (!isSign(event)) return;
    event.preventDefault();
    // Where signs are crowded the nearest is meant, and not the one that was drawn last.
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

  /** The relay that Tab comes to: one of them, or it would take a hundred of them to get past. */
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

/** Takes over what stands in the form: a number that is out of its range is said until it is mended, the others count. */
function read() {
  const lines = [];
  for (const key of ["uavs", "power", "loss"]) {
    const field = byId(key);
    const good = field.value !== "" && field.checkValidity();
    field.setAttribute("aria-invalid", String(!good));
    if (good) want[key] = Number(field.value);
    else lines.push(`${field.parentElement.textContent.trim()} ${field.value || "(nothing)"}: must be within ${field.min} to ${field.max}`);
  }
  want.method = byId("method").value;
  want.listen = byId("listen").checked;
  want.moving = byId("moving").checked && want.listen;
  byId("moving").disabled = !want.listen;
  return lines;
}
