// Light that fades: in a few steps, by one clock for the whole page, so that many lights cost no more than a few.

import { mark } from "./dom.js";

const STEPS = 6;
const STEP_MS = 300;

const lit = new Map();
let clock = null;

/** Lights an element up; it fades by itself. Whoever wants less motion sees it go out at once, without steps. */
export function light(element) {
  lit.set(element, STEPS);
  mark(element, "data-glow", STEPS);
  clock ??= setInterval(fade, STEP_MS);
}

function fade() {
  for (const [element, left] of lit) {
    if (left > 1) lit.set(element, left - 1);
    else lit.delete(element);
    mark(element, "data-glow", left - 1);
  }
  if (lit.size > 0) return;
  clearInterval(clock);
  clock = null;
}
