// What has changed is drawn once a frame, however many messages have come since the last.

/** [subject, paint], in the order in which they are called. */
const painters = [];
const dirty = new Set();
let isAwaited = false;

/** Calls `paint` in the next frame after `subject` was touched; who is named first is called first. */
export function paints(subject, paint) {
  painters.push([subject, paint]);
}

/** Something about these subjects has changed. */
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
  for (const paint of due) {
    try {
      paint();
    } catch (error) {
      // One part that fails must not hold the state of the others.
      console.error(error);
    }
  }
}
