// Freshness of what is shown: whether it is so now. If not, the whole page says so, and says how old it is.

import { announce } from "./announce.js";
import { SILENT_MS } from "./connection.js";
import { byId, mark, say, show } from "./dom.js";
import { ago } from "./format.js";
import { ageS, received } from "./received.js";

const OLD_S = 2;

/** On the page, and before a graph in full size, which covers it. */
const PLACES = ["stale", "large-stale"];

const SENTENCES = {
  connecting: () => "Connecting to the server.",
  lost: () => "Connection lost: nothing shown here is live.",
  full: () => "The server is full: close other pages, or open the address with the token, which has places of its own.",
  silent: () => "The server is silent: nothing shown here is live.",
  gone: () => `The source is lost: ${received.gone ?? "no reason was given"}`,
  old: () => "The bridge's loop hangs: nothing shown here is live.",
};
const WORDS = { connecting: "connecting", lost: "no connection", full: "full", silent: "silent", gone: "source lost", old: "hangs", waiting: "waiting" };

/** One of the names above; "waiting": connected, without a definition yet; "live". */
function freshness(connection) {
  if (!connection.isOpen && connection.isFull) return "full";
  if (!connection.isOpen) return received.definition === null ? "connecting" : "lost";
  if (connection.silenceMs > SILENT_MS) return "silent";
  if (received.gone !== null) return "gone";
  if (received.definition === null) return "waiting";
  return received.definition.source === "bridge" && ageS() > OLD_S ? "old" : "live";
}

/**
 * Keeps the page true about its age.
 *
 * @param {() => {isOpen: boolean, isFull: boolean, silenceMs: number}} connection The connection.
 * @returns {() => string} To be called when something may have changed and several times a second; what it is now.
 */
export function startFreshness(connection) {
  let last = "connecting";
  return () => {
    const now = freshness(connection());
    mark(document.documentElement, "data-freshness", now);
    const isStale = now in SENTENCES;
    const what = isStale ? SENTENCES[now]() : "";
    const age = isStale && received.update !== null ? `The state below is ${ago(ageS())} old.` : "";
    for (const place of PLACES) {
      show(byId(place), isStale);
      say(byId(`${place}-what`), what);
      say(byId(`${place}-age`), age);
    }
    say(byId("link-word"), now === "live" ? liveWord() : WORDS[now]);
    if (now === "live" && last !== "live") announce("link", "Connected.");
    last = now;
    return now;
  };
}

function liveWord() {
  if (received.definition.source === "log") return "recorded";
  if (received.definition.source === "model") return "by hand";
  if (received.update === null) return "connected";
  return received.definition.source === "ros2" && ageS() > OLD_S ? `live, last change ${ago(ageS())} ago` : "live";
}
