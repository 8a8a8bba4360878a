// A model that is played with: its events as buttons, their data and outcomes, undo and redo, chance, kept runs, a link.

import { announce } from "./announce.js";
import { byId, make, mark, quoted, say, show } from "./dom.js";
import { count } from "./format.js";
import { isAutomata, isModel, received, under } from "./received.js";

/** The part of an address that holds a model: its language, where that is not RoboSC's, and the model. */
const IN_LINK = /^#model(?:\.(\w+))?=(.*)$/;
const FILTERED_FROM = 12;
const LEADS = { __proto__: null, step: "", choose: "Which?", unknown: "Unknown:", finding: "Found:", changed: "Saved:", wrong: "Not done:" };

/** One event: a button, a field for each part of its data, and why it cannot happen. */
class PlayEvent {
  constructor({ event, controllable, fields }, send) {
    this.event = event;
    this.fields = fields.map((field) => new Field(event, field));
    const kind = controllable ? "controllable" : "uncontrollable";
    this.button = make("button", { type: "submit", class: `happen is-${kind}` },
      make("span", { class: `mark is-${kind}`, "aria-hidden": "true" }, controllable ? "◆" : "○"), " ", quoted(event));
    this.why = make("p", { class: "play-why" });
    this.ways = make("div", { class: "play-ways buttons", role: "group", "aria-label": `What ${event} leads to`, hidden: true });
    this.form = make("form", { class: "play-event", "data-event": event },
      this.button, ...this.fields.map((field) => field.element), this.why, this.ways);
    this.send = send;
    this.form.addEventListener("submit", (submitted) => {
      submitted.preventDefault();
      // The keyboard, too, can only have happen what can.
      if (this.button.getAttribute("aria-disabled") !== "true") send({ type: "event", line: this.line() });
    });
  }

  /** The event as a line of a file of events. */
  line() {
    const known = this.fields.map((field) => [field.path, field.json()]).filter(([, json]) => json !== null);
    return known.length > 0 ? `${this.event} ${nested(known)}` : this.event;
  }

  /** @param {string[] | undefined} why Reasons why it cannot happen. @param {object | null} choice Choice that is open. */
  paint(why, choice) {
    // Not "disabled": then it could not be reached, and its reason not be read.
    mark(this.button, "aria-disabled", why !== undefined);
    say(this.why, (why ?? []).join("; "));
    show(this.why, why !== undefined);
    const ways = choice?.event === this.event ? choice.ways : [];
    this.ways.replaceChildren(...ways.map((label, way) => {
      const button = make("button", { type: "button", class: "plain" }, quoted(label));
      button.addEventListener("click", () => {
        // This one goes, and the focus with it.
        this.button.focus();
        this.send({ type: "event", line: choice.line, way });
      });
      return button;
    }));
    show(this.ways, ways.length > 0);
  }
}

/** A part of the data of an event; nothing in it, where that may be, is unknown, or of automata any value. */
class Field {
  constructor(event, { path, type, choices, is_boolean: isBoolean, is_required: isRequired }) {
    this.path = path;
    this.isBoolean = isBoolean;
    this.isChoice = choices.length > 0;
    const name = path.join(".") || "value";
    const label = `${name} of ${event}`;
    const nothing = isAutomata() ? "any" : "unknown";
    const options = choices.map((choice) => make("option", { value: choice }, choice));
    if (!isRequired) options.unshift(make("option", { value: "" }, nothing));
    this.input = this.isChoice
      ? make("select", { "aria-label": label }, ...options)
      : make("input", { type: "text", required: isRequired, placeholder: isRequired ? null : nothing, "aria-label": label, autocomplete: "off", size: 9 });
    this.element = make("label", { class: "play-field", title: `${name}: ${type}` }, quoted(name), this.input);
  }

  /** The value as JSON; null: it is unknown. */
  json() {
    const text = this.input.value.trim();
    if (text === "") return null;
    if (this.isChoice && !this.isBoolean) return JSON.stringify(text);
    if (["NaN", "Infinity", "-Infinity"].includes(text)) return text;
    try {
      return JSON.stringify(JSON.parse(text));
    } catch {
      // A word is a text: so in files of events, too.
      return JSON.stringify(text);
    }
  }
}

const KEPT = "robosc-page";

/** Name of this tab, which a reload keeps. */
function pageName() {
  const made = [...crypto.getRandomValues(new Uint8Array(16))].map((byte) => byte.toString(16).padStart(2, "0")).join("");
  try {
    const name = sessionStorage.getItem(KEPT) ?? made;
    sessionStorage.setItem(KEPT, name);
    return name;
  } catch {
    return made;
  }
}

/** JSON of the parts of some data, each with its path and its own JSON. */
function nested(parts) {
  if (parts.length === 1 && parts[0][0].length === 0) return parts[0][1];
  const below = Map.groupBy(parts, ([path]) => path[0]);
  const items = [...below].map(([name, inner]) => `${JSON.stringify(name)}:${nested(inner.map(([path, json]) => [path.slice(1), json]))}`);
  return `{${items.join(",")}}`;
}

/**
 * @param {(message: object) => boolean} send Sends a message; false: there is no connection.
 * @param {string} token Token that a model of a link needs.
 * @returns {object} Functions that main.js calls.
 */
export function startPlay(send, token) {
  let events = [];
  let walks = 0;
  const report = (kind, lines) => {
    const place = byId("play-report");
    mark(place, "data-kind", kind);
    const lead = LEADS[kind] ? [make("strong", {}, LEADS[kind]), " "] : [];
    // New elements, so that a sentence that is reported twice is shown and read twice.
    place.replaceChildren(...lines.map((line, i) => make("p", {}, ...(i === 0 ? lead : []), quoted(line))));
    if (lines.length > 0) announce("play", [LEADS[kind], ...lines].join(" "));
  };
  const want = (message) => {
    const isSent = send(message);
    if (!isSent) report("wrong", ["there is no connection"]);
    return isSent;
  };

  for (const type of ["undo", "redo"]) byId(`play-${type}`).addEventListener("click", () => want({ type }));
  byId("play-wait").addEventListener("click", () => want({ type: "wait" }));
  const beginning = byId("play-beginning");
  byId("play-restart").addEventListener("click", () =>
    want(beginning.hidden ? { type: "restart" } : { type: "restart", beginning: beginning.selectedIndex }));
  const filter = byId("play-filter");
  const narrow = () => {
    const wanted = filter.hidden ? "" : filter.value.trim().toLowerCase();
    for (const item of events) show(item.form, item.event.toLowerCase().includes(wanted));
  };
  filter.addEventListener("input", narrow);
  for (const form of ["log", "test"]) byId(`play-${form}`).addEventListener("click", () => want({ type: "save", form }));
  const walk = (untilFinding) => {
    const seed = walks;
    walks += 1;
    const steps = untilFinding ? 1000 : Math.min(Math.max(Math.trunc(Number(byId("play-steps").value)) || 1, 1), 5000);
    // The walk through a large system takes its time.
    if (want({ type: "walk", steps, seed, until_finding: untilFinding })) report("step", ["chance goes on…"]);
  };
  byId("play-walk").addEventListener("click", () => walk(false));
  byId("play-finding").addEventListener("click", () => walk(true));
  byId("play-link").addEventListener("click", async () => {
    const { language, link } = received.definition.play;
    const address = `${location.origin}/#model${isAutomata() ? `.${language}` : ""}=${link}`;
    history.replaceState(null, "", address);
    try {
      await navigator.clipboard.writeText(address);
      report("step", ["the link to this model is copied: it holds all of it"]);
    } catch {
      report("step", ["the link to this model is in the address of this page: it holds all of it"]);
    }
  });
  window.addEventListener("keydown", (event) => {
    if (!isModel() || !(event.ctrlKey || event.metaKey) || event.altKey || event.target.closest("input")) return;
    const key = event.key.toLowerCase();
    const type = key === "z" ? (event.shiftKey ? "redo" : "undo") : key === "y" ? "redo" : "";
    if (type === "") return;
    event.preventDefault();
    want({ type });
  });

  /** Goals that are being cancelled: asking ends nothing, and the world chooses how each ends. */
  let ends = "";
  const paintEnds = (found) => {
    const place = byId("play-ends");
    show(place, found.length > 0);
    // Buttons stay, and the focus with them, as long as they say the same.
    if (JSON.stringify(found) === ends) return;
    ends = JSON.stringify(found);
    place.replaceChildren(...found.map(({ action, ways }) => {
      const buttons = ways.map(([label, event]) => {
        const button = make("button", { type: "button", class: "plain", title: event }, label);
        button.addEventListener("click", () => want({ type: "event", line: event }));
        return button;
      });
      return make("div", { class: "play-ways buttons", role: "group", "aria-label": `How the cancelled goal of ${action} ends` },
        make("span", {}, "The goal of ", quoted(action), " is being cancelled. It ends"), ...buttons);
    }));
  };

  let isLinkOpened = false;
  /** Number of the state that the run has begun in, as the server sent it; a person's later choice stays. */
  let begun = null;
  let isResumed = false;
  return {
    build() {
      const { play } = received.definition;
      show(byId("play"), Boolean(play));
      show(byId("requests-panel"), !play);
      if (!play) return;
      const before = new Map(events.map((item) => [item.event, item]));
      events = play.events.map((item) => new PlayEvent(item, want));
      for (const item of events) {
        // Entered values stay, as far as there is a field for them.
        const old = before.get(item.event)?.fields ?? [];
        for (const field of item.fields) {
          const was = old.find((other) => String(other.path) === String(field.path) && other.isChoice === field.isChoice);
          if (was) field.input.value = was.input.value;
        }
      }
      const own = new Set(play.events.filter((item) => item.controllable).map((item) => item.event));
      for (const [place, isOwn] of [["play-own", true], ["play-world", false]]) {
        const forms = events.filter((item) => own.has(item.event) === isOwn).map((item) => item.form);
        byId(place).replaceChildren(...(forms.length > 0 ? forms : [make("p", { class: "quiet" }, "Nothing.")]));
      }
      say(byId("play-own-title"), isAutomata() ? "Controllable events" : "The controller may");
      say(byId("play-world-title"), isAutomata() ? "Uncontrollable events" : "The world may");
      show(filter, events.length > FILTERED_FROM);
      narrow();
      beginning.replaceChildren(...play.beginnings.map((label) => make("option", {}, label)));
      show(beginning, play.beginnings.length > 0);
      // Against the surroundings a person has the part of the controller only.
      const isOpposed = play.goals.length > 0;
      for (const id of ["play-wait", "play-opposition"]) show(byId(id), isOpposed);
      for (const id of ["play-finding", "play-world", "play-world-title"]) show(byId(id), !isOpposed);
      byId("play-goals").replaceChildren(...play.goals.map((text) => make("li", {}, quoted(text), ": ", make("strong", { class: "play-goal" }))));
      begun = null;
      for (const form of ["log", "test"]) show(byId(`play-${form}`), play.forms.includes(form));
      show(byId("play-link"), play.link !== null);
      show(byId("play-keep"), play.forms.length > 0 || play.link !== null);
      const [, language, packed] = (isLinkOpened ? null : IN_LINK.exec(location.hash)) ?? [];
      isLinkOpened = true;
      if (!packed) return;
      // A page that is loaded again goes on with what it did, and does not open the link again.
      history.replaceState(null, "", location.pathname);
      if (packed !== play.link) want({ type: "model", packed, language, token });
    },
    paint() {
      const { run } = received;
      if (run === null) return;
      for (const item of events) item.paint(under(run.blocked, item.event), run.choice);
      if (run.beginning !== begun) beginning.selectedIndex = run.beginning;
      begun = run.beginning;
      for (const type of ["undo", "redo"]) {
        const button = byId(`play-${type}`);
        button.disabled = run[type] === "";
        mark(button, "title", run[type]);
      }
      paintEnds(run.ends ?? []);
      if (run.opposition) {
        const { goals, denied, denied_next: next, assumptions } = run.opposition;
        const kept = assumptions.map((times, i) => `assumption ${i + 1} came true ${count(times, "time", "times")}`);
        const limit = next.length > 0 ? `; if it comes true, ${next.join(" or ")}.` : ", whatever you do.";
        const what = denied === null ? "Silent steps do not end." : `The surroundings deny ${denied}${limit}`;
        say(byId("play-denied"), kept.length > 0 ? `${what} They keep to what is assumed: ${kept.join(", ")}.` : what);
        byId("play-goals").querySelectorAll(".play-goal").forEach((place, i) => say(place, goals[i]));
      }
      say(byId("play-count"), `${count(run.steps, "event", "events")}${run.is_marked ? " · marked" : ""}`);
    },
    /** Goes on from the run of an earlier page once a definition has come. */
    defined(definition) {
      if (!definition.play || isResumed) return;
      isResumed = true;
      send({ type: "resume", page: pageName() });
    },
    disconnected() {
      isResumed = false;
    },
    /** Report of what was just done. */
    reported: ({ kind, lines }) => kind !== "" && report(kind, lines),
    refused: ({ what, why }) => report("wrong", [`${what}: ${why}`]),
    saved({ name, text }) {
      const link = make("a", { href: URL.createObjectURL(new Blob([text], { type: "text/plain" })), download: name });
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
      report("step", [`${name} was saved${name.endsWith(".py") ? ": it belongs into the folder of the model" : ""}`]);
    },
  };
}
