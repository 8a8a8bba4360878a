// Goals and missions of a strategy, and what it assumes of the surroundings: what is true, since when not, which visits
// were made, and what is approached.

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

/** The visits of a mission, under what is said of it as a whole. */
class Mission {
  constructor(name, visits) {
    this.where = make("span", { class: "mission-where" });
    this.rounds = make("span", { class: "quiet" });
    const title = make("h3", {}, "Mission ", quoted(name));
    this.element = make("div", { class: "mission", "data-name": name },
      title, make("p", {}, this.where, " ", this.rounds), make("ul", { class: "goals-list" }, ...visits));
  }

  paint(mission, words) {
    say(this.where, whereOf(mission, words));
    say(this.rounds, mission.rounds === 1 ? "1 round made" : `${mission.rounds} rounds made`);
  }
}

const named = (visit, title) => `visit ${visit} of ${title}`;

/** Where a mission is, in words. */
function whereOf(mission, words) {
  if (mission.visit === 0) return "not asked for";
  const title = `mission ${mission.name}`;
  const at = (visit, of) => `at visit ${visit}, ${words.get(named(visit, of)) ?? ""}`;
  const parts = [mission.is_round ? "every visit is true" : at(mission.visit, title)];
  mission.detours.forEach((visit, place) => {
    const detour = `detour ${place + 1}`;
    if (visit > 0) parts.push(`${detour} under way, ${at(visit, `${detour} of ${title}`)}`);
  });
  return parts.join("; ");
}

function wordOfVisit(visit, isNow, since, next) {
  if (visit.is_met) return "made in this round";
  if (isNow) return `now${since}`;
  if (visit.unmet_s !== null) return `wanted${since}`;
  return next.has(visit.name) ? "after the detour" : "";
}

/** Names of the visits that missions are at while a detour is under way. */
function waiting(missions) {
  return new Set(missions
    .filter(({ visit, is_round, detours }) => visit > 0 && !is_round && detours.some((at) => at > 0))
    .map(({ name, visit }) => named(visit, `mission ${name}`)));
}

/** True if nothing is to be done for any goal or visit. */
const isIdle = (aims) => aims.every((aim) => aim.unmet_s === null && (aim.is_met || aim.mission !== null));

const idleWords = (aims) => (aims.some(({ mission }) => mission !== null)
  ? "No goal or visit is left: nothing is requested." : "All goals are true: nothing is requested.");

/** @returns {{build: () => void, paint: () => void}} Functions that main.js calls. */
export function startGoals() {
  let known = "";
  let items = new Map();
  let missions = new Map();
  let before = null;

  const build = (progress) => {
    items = new Map();
    const elements = (found) => found.map((item) => {
      const made = new Item(item);
      items.set(item.name, made);
      return made.element;
    });
    byId("goals-aims").replaceChildren(...elements(progress.aims.filter(({ mission }) => mission === null)));
    byId("goals-assumptions").replaceChildren(...elements(progress.assumptions));
    const names = new Set(progress.aims.map(({ mission }) => mission).filter((name) => name !== null));
    missions = new Map([...names].map((name) => [
      name, new Mission(name, elements(progress.aims.filter(({ mission }) => mission === name)))]));
    byId("goals-missions").replaceChildren(...[...missions.values()].map(({ element }) => element));
    show(byId("goals-owed-title"), progress.assumptions.length > 0);
  };

  const announceChanges = (progress) => {
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
    // A log says what is approached, and requests as events of their own.
    if (isReplay()) return approached === null ? "" : `The strategy approaches ${approached}.`;
    if (!is_followed) return "Another policy than the strategy decides.";
    if (approached === null) return isIdle(aims) ? idleWords(aims) : "";
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
      const next = waiting(progress.missions);
      for (const aim of progress.aims) {
        // A visit may have been made since the last decision, or may not be asked for any more.
        const isWanted = aim.mission === null || aim.unmet_s !== null || isReplay();
        const isNow = isWanted && aim.name === progress.approached;
        const state = aim.is_met ? "met" : isNow ? "now" : "unmet";
        const sign = { met: "✓", now: "▶", unmet: "○" }[state];
        const since = aim.unmet_s === null ? "" : `, for ${duration(aim.unmet_s)}`;
        const word = aim.mission === null ? wordOf(aim, isNow, since) : wordOfVisit(aim, isNow, since, next);
        items.get(aim.name).paint(state, sign, word, counted(aim.times));
      }
      const words = new Map(progress.aims.map((aim) => [aim.name, aim.words]));
      for (const mission of progress.missions) missions.get(mission.name)?.paint(mission, words);
      for (const item of progress.assumptions) {
        const isLate = progress.overdue.includes(item.name);
        const state = isLate ? "overdue" : item.is_met ? "met" : item.unmet_s === null ? "unknown" : "owed";
        const word = item.unmet_s === null ? (item.is_met ? "met" : "") : `has been owed for ${duration(item.unmet_s)}`;
        items.get(item.name).paint(state, { met: "✓", owed: "…", overdue: "▲", unknown: "" }[state], word, "");
      }
      const goals = progress.aims.filter(({ mission }) => mission === null);
      const isKnown = goals.length > 0 && goals.every((goal) => goal.is_met || goal.unmet_s !== null);
      const met = goals.filter((goal) => goal.is_met).length;
      say(byId("goals-count"), isKnown ? `${met} of ${goals.length} true` : "");
      say(byId("goals-choice"), choice(progress));
      announceChanges(progress);
    },
  };
}
