// Every request of the model: enabled, or in words why not.

import { byId, make, mark, quoted, say, show } from "./dom.js";
import { received } from "./received.js";

const NO_REASON = new Map([
  [true, "Nothing holds it back."],
  [false, "No reason was given."],
  [null, "It is not known whether it is enabled."],
]);

class Request {
  constructor(event) {
    this.event = event;
    this.word = make("span", { class: "request-word" });
    this.why = make("bdi", { class: "request-why" });
    this.all = make("ul", { class: "whys" });
    this.key = null;
    this.element = make("li", { class: "request", "data-request": event, "data-enabled": "unknown" },
      make("details", {}, make("summary", {}, quoted(event, "request-name"), " ", this.word, " ", this.why), this.all));
  }

  /** @param {boolean | null} isEnabled null: not known. @param {string[]} why In sentences. */
  paint(isEnabled, why) {
    const key = JSON.stringify([isEnabled, why]);
    if (key === this.key) return;
    this.key = key;
    mark(this.element, "data-enabled", isEnabled ?? "unknown");
    say(this.word, isEnabled === null ? "? not known" : isEnabled ? "✓ enabled" : "✕ not now");
    say(this.why, why.join("; "));
    // The line stays when the reason goes: nothing jumps when a request becomes enabled and stops being so.
    if (why.length > 0) this.element.classList.add("has-why");
    const lines = why.length > 0 ? why : [NO_REASON.get(isEnabled)];
    this.all.replaceChildren(...lines.map((line) => make("li", {}, quoted(line))));
  }
}

/** @returns {{build: () => void, paint: () => void}} Functions that main.js calls. */
export function startRequests() {
  let requests = [];
  const filter = byId("requests-filter");
  const narrow = () => {
    const wanted = filter.value.trim().toLowerCase();
    for (const request of requests) show(request.element, request.event.toLowerCase().includes(wanted));
  };
  filter.addEventListener("input", narrow);

  return {
    build() {
      requests = (received.definition.requests ?? []).map((event) => new Request(event));
      byId("requests").replaceChildren(...requests.map((request) => request.element));
      show(byId("requests-none"), requests.length === 0);
      narrow();
    },
    paint() {
      const { update } = received;
      const enabled = new Set(update?.enabled ?? []);
      const disabled = new Map((update?.disabled ?? []).map((item) => [item.event, item.why ?? []]));
      let unknown = 0;
      for (const request of requests) {
        const { event } = request;
        const isEnabled = enabled.has(event) ? true : disabled.has(event) ? false : null;
        unknown += isEnabled === null;
        request.paint(isEnabled, isEnabled ? [] : (disabled.get(event) ?? []));
      }
      const words = `${enabled.size} of ${requests.length} enabled${unknown > 0 ? `, ${unknown} not known` : ""}`;
      say(byId("requests-count"), update === null ? "" : words);
    },
  };
}
