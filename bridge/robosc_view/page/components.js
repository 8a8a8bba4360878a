// A card for each component: its graph, its variables, and its messages, services and actions.

import { byId, make, mark, quoted, say, show } from "./dom.js";
import { count, value } from "./format.js";
import { afterPainting } from "./frame.js";
import { Graph } from "./graph.js";
import { isAutomata, received, under } from "./received.js";

const SERVED = new Set(["service", "action"]);
const WIDE_PX = 430;
const LEAST_SCALE = 0.75;
const NO_BEHAVIOUR = "No behaviour of its own.";
const TOO_LARGE = "Its graph is too large to be drawn.";
const LEFT_OUT = "It is not drawn: the automata before it are as much as can be drawn.";
const KINDS = { __proto__: null, controllable: "controllable", uncontrollable: "uncontrollable", silent: "silent" };

class Card {
  constructor(component, communications, index, enlarge) {
    const id = `component-${index}`;
    this.component = component;
    this.state = make("bdi", { class: "card-state" });
    this.graph = component.graph ? new Graph(component.name, component.graph, id) : null;
    // Small print helps nobody: a wide graph takes the room of two cards.
    const isWide = (component.graph?.width ?? 0) > WIDE_PX;
    this.frame = make("div", { class: "card-graph" });
    this.variables = new Map();
    this.variablesList = make("dl", { class: "variables", hidden: true });
    this.places = new Map();
    this.element = make("article", { class: isWide ? "card is-wide" : "card", "aria-labelledby": id, "data-component": component.name },
      this.headline(id, enlarge), this.frame, this.variablesList, this.communicationsList(communications));
    this.scrolls = (component.graph?.width ?? 0) * LEAST_SCALE > WIDE_PX;
    if (this.graph) {
      this.graph.element.style.minWidth = `${component.graph.width * LEAST_SCALE}px`;
      this.frame.append(this.graph.element);
      this.element.append(transitionsTable(component.graph));
    } else {
      this.frame.remove();
      this.note = make("p", { class: "quiet" }, NO_BEHAVIOUR);
      this.element.append(this.note);
    }
  }

  headline(id, enlarge) {
    const parts = [make("h3", { id }, quoted(this.component.name)), this.state];
    if (this.component.role) parts.splice(1, 0, make("span", { class: "quiet" }, this.component.role));
    if (this.graph) {
      const button = make("button", { type: "button", class: "plain icon", "aria-label": `Enlarge the graph of ${this.component.name}` }, "⤢");
      button.addEventListener("click", () => enlarge(this, button));
      parts.push(button);
    }
    return make("div", { class: "card-head" }, ...parts);
  }

  communicationsList(communications) {
    const list = make("ul", { class: "communications" });
    for (const item of communications) {
      const place = SERVED.has(item.kind) ? make("span", { class: "place", "data-place": "" }) : null;
      const mapped = [item.identifier, item.channel && `channel ${item.channel}`].filter(Boolean).join(", ");
      const line = make("li", { title: mapped || null },
        make("span", { class: "what" }, item.kind), " ", quoted(item.name), ...(place ? [" ", place] : []));
      if (place) this.places.set(item.name, place);
      list.append(line);
    }
    return list;
  }

  paint(shown, places, cancelling) {
    const state = shown?.state ?? null;
    say(this.state, state ?? (this.graph ? "not known" : ""));
    if (this.graph && state !== this.graph.active) this.setActive(state);
    if (this.note) say(this.note, state === null ? NO_BEHAVIOUR : this.component.is_left_out ? LEFT_OUT : TOO_LARGE);
    this.paintVariables(shown?.variables ?? {});
    for (const [name, place] of this.places) {
      // Asking for a cancel ends nothing: the action is executing until its goal has ended.
      const location = cancelling.has(name) ? "cancelling" : under(places, name) ?? "not known";
      say(place, location);
      mark(place, "data-place", location);
    }
  }

  setActive(state) {
    this.graph.setActive(state);
    const share = this.graph.activeShare;
    if (!this.scrolls || share === null) return;
    afterPainting(this, () => {
      const { scrollWidth, clientWidth } = this.frame;
      this.frame.scrollLeft = share * scrollWidth - clientWidth / 2;
    });
  }

  paintVariables(variables) {
    const names = Object.keys(variables);
    if (names.length !== this.variables.size || names.some((name) => !this.variables.has(name))) {
      this.variables = new Map(names.map((name) => [name, make("bdi")]));
      this.variablesList.replaceChildren(
        ...names.map((name) => make("div", {}, make("dt", {}, quoted(name)), make("dd", {}, this.variables.get(name)))),
      );
      show(this.variablesList, names.length > 0);
    }
    for (const name of names) say(this.variables.get(name), value(variables[name]));
  }
}

function transitionsTable(graph) {
  const rows = graph.edges.map((edge) =>
    make("tr", {}, ...[edge.from, edge.label || "–", KINDS[edge.kind] ?? "", edge.to].map((cell) => make("td", {}, quoted(cell)))));
  const heads = ["From", "Event", "Kind", "To"].map((word) => make("th", { scope: "col" }, word));
  return make("details", { class: "transitions" },
    make("summary", {}, `${count(graph.edges.length, "transition", "transitions")} as a table`),
    make("div", { class: "scroll", tabindex: "0", role: "region", "aria-label": "Transitions" },
      make("table", {}, make("thead", {}, make("tr", {}, ...heads)), make("tbody", {}, ...rows))));
}

/** @returns {object} Functions that main.js calls. */
export function startComponents() {
  let cards = new Map();
  let taken = new Map();
  /** True if the transitions that were marked as the last ones are so no more, before those in `taken`. */
  let isLastForgotten = false;
  const { enlarge, close } = startLarge();
  const filter = byId("components-filter");

  const narrow = () => {
    const wanted = filter.value.trim().toLowerCase();
    let shown = 0;
    for (const [name, card] of cards) {
      const fits = name.toLowerCase().includes(wanted);
      show(card.element, fits);
      shown += fits;
    }
    say(byId("components-count"), shown === cards.size ? String(cards.size) : `${shown} of ${cards.size}`);
    show(byId("cards-none"), shown === 0 && cards.size > 0);
  };
  filter.addEventListener("input", narrow);

  /** Forgets what was taken so far: it is not what was taken last, and what was is not known. */
  const forget = () => {
    taken = new Map();
    isLastForgotten = true;
  };

  return {
    build() {
      close();
      const { components = [], communications = [] } = received.definition;
      const byComponent = Map.groupBy(communications, (item) => item.component);
      cards = new Map(components.map((item, i) => [item.name, new Card(item, byComponent.get(item.name) ?? [], i, enlarge)]));
      say(byId("components-title"), isAutomata() ? "Automata" : "Components");
      byId("cards").replaceChildren(...[...cards.values()].map((card) => card.element));
      narrow();
    },
    paint() {
      const components = received.update?.components ?? {};
      const places = received.update?.communications ?? {};
      const cancelling = new Set(received.update?.cancelling);
      const last = received.update?.last ?? null;
      for (const [name, card] of cards) {
        card.paint(under(components, name), places, cancelling);
        if (isLastForgotten) card.graph?.setLast();
        if (taken.has(name)) card.graph?.take(taken.get(name));
        // After a jump, a recorded run may be anywhere, and the entries in between were not sent.
        if (last !== null) card.graph?.setLast(under(last, name));
      }
      taken = new Map();
      isLastForgotten = false;
    },
    forget,
    /** Entries, before which others were lost. */
    take(entries, lost) {
      if (lost > 0) forget();
      for (const entry of entries) {
        if (entry.kind === "restart") forget();
        for (const { component, id } of entry.transitions ?? []) {
          const ids = taken.get(component) ?? [];
          // People see no more than this of transitions between two frames.
          if (ids.length >= 64) ids.shift();
          ids.push(id);
          taken.set(component, ids);
        }
      }
    },
  };
}

/** A graph in full size. The drawing itself moves there and back, so that it goes on living; so does what is said. */
function startLarge() {
  const dialog = byId("large");
  let origin = null;
  const said = byId("polite");
  const home = said.parentNode;
  const putBack = () => {
    if (origin === null) return;
    const { card, button } = origin;
    origin = null;
    home.append(said);
    card.frame.append(card.graph.element);
    button.focus();
  };
  const close = () => {
    dialog.close();
    // The event comes later.
    putBack();
  };
  byId("large-close").addEventListener("click", close);
  dialog.addEventListener("close", putBack);
  return {
    enlarge(card, button) {
      origin = { card, button };
      say(byId("large-title"), card.component.name);
      byId("large-body").replaceChildren(card.graph.element);
      // A screen reader reads nothing of what the dialog covers.
      dialog.append(said);
      dialog.showModal();
    },
    close,
  };
}
