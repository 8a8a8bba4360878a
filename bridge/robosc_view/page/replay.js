// A recorded run: where it is, playing, speed, and going to another time.

import { byId, mark, say, show } from "./dom.js";
import { count, span } from "./format.js";
import { touch } from "./frame.js";
import { received } from "./received.js";

const SEEK_EVERY_MS = 100;

/** @param {(message: object) => void} send Sends a message. @returns {{build: () => void, paint: () => void}} */
export function startReplay(send) {
  const slider = byId("replay-time");
  const speed = byId("replay-speed");
  let isHeld = false;
  let seekTimer = null;

  const seek = () => {
    seekTimer = null;
    send({ type: "seek", time_s: received.definition.log.begin_s + Number(slider.value) });
  };
  slider.addEventListener("input", () => {
    isHeld = true;
    seekTimer ??= setTimeout(seek, SEEK_EVERY_MS);
    touch("position");
  });
  slider.addEventListener("change", () => {
    clearTimeout(seekTimer);
    seek();
    isHeld = false;
  });
  byId("replay-play").addEventListener("click", () => {
    send(received.position?.is_playing ? { type: "pause" } : { type: "play", speed: Number(speed.value) });
  });
  speed.addEventListener("change", () => {
    if (received.position?.is_playing) send({ type: "play", speed: Number(speed.value) });
  });

  return {
    build() {
      const { log } = received.definition;
      show(byId("replay"), Boolean(log));
      if (!log) return;
      slider.max = String(Math.max(log.end_s - log.begin_s, 0.01));
      slider.value = "0";
    },
    paint() {
      const log = received.definition?.log;
      if (!log) return;
      const { position } = received;
      if (position && !isHeld) slider.value = String(position.time_s - log.begin_s);
      const known = position?.speed;
      if (known && document.activeElement !== speed && [...speed.options].some((option) => Number(option.value) === known)) {
        speed.value = [...speed.options].find((option) => Number(option.value) === known).value;
      }
      const words = `${span(Number(slider.value))} of ${span(log.end_s - log.begin_s)}`;
      say(byId("replay-at"), `${words} · ${count(log.count, "entry", "entries")}`);
      mark(slider, "aria-valuetext", words);
      say(byId("replay-play"), position?.is_playing ? "Pause" : "Play");
    },
  };
}
