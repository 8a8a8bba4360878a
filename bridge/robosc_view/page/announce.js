// Announcements of a screen reader: the latest of what matters, never a flood.

import { byId, say } from "./dom.js";

const SHORTEST_MS = 1500;

let waiting = new Map();
let timer = null;
let saidMs = -Infinity;

/**
 * Says a sentence as soon as it is time to; a newer one about the same subject takes its place.
 *
 * @param {string} subject Subject that it is about.
 * @param {string} sentence Sentence to say.
 */
export function announce(subject, sentence) {
  waiting.delete(subject);
  waiting.set(subject, sentence);
  timer ??= setTimeout(sayAll, Math.max(saidMs + SHORTEST_MS - performance.now(), 50));
}

function sayAll() {
  timer = null;
  saidMs = performance.now();
  say(byId("polite"), [...waiting.values()].join(" "));
  waiting = new Map();
}
