// Drawing of what has changed, once a frame, however many messages have come since the last.

/** [subject, paint], in the order in which they are called. */
const painters = [];
const dirty = new Set();
let isAwaited = false;

/** Calls `paint` in the next frame after `subject` was touched; who is named first is called first. */
export function paints(subject, paint) {
  painters.push([subject, paint]);
}

const last = new Map();

/**
 * Calls `place` in this frame once everything is painted, for what asks where things stand or scrolls: the document then
 * lays itself out once a frame, not once a question.
 *
 * @param {object} owner Owner of `place`; its newest one alone is called.
 * @param {() => void} place Function to call.
 */
export function afterPainting(owner, place) {
  last.set(owner, place);
}

/** Note that these subjects have changed. */
export function touch(...subjects) {
  for (const subject of subjects) dirty.add(subject);
  if (!isAwaited) {
    isAwaited = true;
    requestAnimationFrame(paintAll);
  }
}

function paintAll() {
  isAwaited = false;
  const due = new Set(painters.filter(([subject]) => dirty.has(subject)).map(([, paint]) => paint));
  dirty.clear();
  for (const paint of due) attempt(paint);
  const places = [...last.values()];
  last.clear();
  for (const place of places) attempt(place);
}

function attempt(paint) {
  try {
    paint();
  } catch (error) {
    // One part that fails must not hold the state of the others.
    console.error(error);
  }
}
