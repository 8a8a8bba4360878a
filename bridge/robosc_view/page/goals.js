// Goals of a strategy and what it assumes of the surroundings: what is true, since when not, and what is approached.

import { announce } from "./announce.js";
import { byId, make, mark, quoted, say, show } from "./dom.js";
import { isReplay, received } from "./received.js";

const LONG_S = 60;

class Item {
  constructor(item) {
    this.sign = make("span", { class: "sign", "aria-hidden": "true" });
    this.word = make("span", { class: "goal-word" });
    this.times = make("span", { class: "quiet" });
    this.element = make("li", { class: "goal", "data-name": item.name },
      this.sign, make("span", {}, make("strong", {}, quoted(item.name)), " ", this.word, " ", this.times,
        make("span", { class: "goal-words" }, quoted(item.words))));
  }

  paint(state, sign, word, times) {
    mark(this.element, "data-state", state);
    say(this.sign, sign);
    say(this.word, word);
    say(this.times, times);
  }
}

/** Time in words that change once in a second, and once in a minute where it is long. */
function duration(seconds) {
  if (seconds < LONG_S) return `${Math.floor(seconds)} s`;
  return seconds < LONG_S * LONG_S ? `${Math.floor(seconds / LONG_S)} min` : `${Math.floor(seconds / LONG_S / LONG_S)} h`;
}

const counted = (times) => (times === 1 ? "reached once" : `reached ${times} times`);

function wordOf(aim, isNow, since) {
  if (aim.is_met) return "true";
  if (isNow) return `now${since}`;
  return aim.unmet_s === null ? "" : `not yet${since}`;
}

/** @returns {{build: () => void, paint: () => void}} Functions that main.js calls. */
export function startGoals() {
  let known = "";
  let items = new Map();
  let before = null;

  const build = (progress) => {
    items = new Map();
    for (const [id, found] of [["goals-aims", progress.aims], ["goals-assumptions", progress.assumptions]]) {
      byId(id).replaceChildren(...found.map((item) => {
        const made = new Item(item);
        items.set(item.name, made);
        return made.element;
      }));
    }
    show(byId("goals-owed-title"), progress.assumptions.length > 0);
  };

  const tell = (progress) => {
    const now = { approached: progress.approached, overdue: new Set(progress.overdue) };
    if (before !== null) {
      if (now.approached !== before.approached) {
        announce("goal", now.approached === null ? "No goal is approached." : `Approached now: ${now.approached}.`);
      }
      for (const name of now.overdue) {
        if (!before.overdue.has(name)) announce(name, `${name} is owed for too long.`);
      }
      for (const name of before.overdue) if (!now.overdue.has(name)) announce(name, `${name} is met again.`);
    }
    before = now;
  };

  const choice = ({ aims, is_followed, approached, chosen }) => {
    // A log tells what is approached, and requests as events of their own.
    if (isReplay()) return approached === null ? "" : `The strategy approaches ${approached}.`;
    if (!is_followed) return "Another policy than the strategy decides.";
    if (approached === null) return aims.every((aim) => aim.is_met) ? "All goals are true: nothing is requested." : "";
    return chosen === null ? `The strategy waits, for ${approached}.` : `The strategy requests ${chosen}, for ${approached}.`;
  };

  return {
    build() {
      known = "";
      before = null;
    },
    paint() {
      const progress = received.update?.progress ?? null;
      show(byId("goals"), progress !== null);
      if (progress === null) {
        before = null;
        return;
      }
      const names = JSON.stringify([...progress.aims, ...progress.assumptions].map(({ name, words }) => [name, words]));
      if (names !== known) {
        known = names;
        build(progress);
      }
      for (const aim of progress.aims) {
        const isNow = aim.name === progress.approached;
        const state = aim.is_met ? "met" : isNow ? "now" : "unmet";
        const sign = { met: "✓", now: "▶", unmet: "○" }[state];
        const since = aim.unmet_s === null ? "" : `, for ${duration(aim.unmet_s)}`;
        items.get(aim.name).paint(state, sign, wordOf(aim, isNow, since), counted(aim.times));
      }
      for (const item of progress.assumptions) {
        const isLate = progress.overdue.includes(item.name);
        const state = isLate ? "overdue" : item.is_met ? "met" : item.unmet_s === null ? "unknown" : "owed";
        const word = item.unmet_s === null ? (item.is_met ? "met" : "") : `has been owed for ${duration(item.unmet_s)}`;
        items.get(item.name).paint(state, { met: "✓", owed: "…", overdue: "▲", unknown: "" }[state], word, "");
      }
      const isKnown = progress.aims.every((aim) => aim.is_met || aim.unmet_s !== null);
      const met = progress.aims.filter((aim) => aim.is_met).length;
      say(byId("goals-count"), isKnown ? `${met} of ${progress.aims.length} true` : "");
      say(byId("goals-choice"), choice(progress));
      tell(progress);
    },
  };
}
