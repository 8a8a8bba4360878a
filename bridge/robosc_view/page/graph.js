// A component's automaton as a drawing: its active state, and the transitions it has just taken.

import { draw, say } from "./dom.js";
import { head, rounded, route } from "./geometry.js";
import { light } from "./glow.js";

const SIGNS = { __proto__: null, controllable: "◆ ", uncontrollable: "○ ", silent: "" };

export class Graph {
  /** @param {string} name Of the component. @param {object} graph Its layout. @param {string} id Prefix of ids. */
  constructor(name, graph, id) {
    this.name = name;
    this.layout = graph;
    this.states = new Map();
    this.edges = new Map();
    this.active = null;
    this.last = null;
    this.title = draw("title", { id: `${id}-title` }, `Automaton of ${name}`);
    this.words = draw("desc", { id: `${id}-words` });
    const lines = draw("g");
    const labels = draw("g");
    const boxes = new Map(graph.states.map((state) => [state.name, state]));
    for (const edge of graph.edges) this.addEdge(edge, boxes, lines, labels);
    this.element = draw(
      "svg",
      {
        class: "graph", role: "img", viewBox: `0 0 ${graph.width} ${graph.height}`, width: graph.width, height: graph.height,
        "aria-labelledby": `${id}-title`, "aria-describedby": `${id}-words`,
      },
      this.title, this.words, lines, ...graph.states.map((state) => this.stateOf(state)), labels,
    );
  }

  addEdge(edge, boxes, lines, labels) {
    const source = boxes.get(edge.from);
    const target = boxes.get(edge.to);
    if (!source || !target) return;
    const points = route(edge.points ?? [], source, target);
    const path = rounded(points);
    const halo = draw("path", { class: "edge-halo", d: path });
    const line = draw("g", { class: `edge is-${edge.kind}`, "data-id": edge.id }, halo,
      draw("path", { class: `edge-line is-${edge.kind}`, d: path }),
      draw("path", { class: `edge-head is-${edge.kind}`, d: head(points) }));
    const label = draw("text", { class: `edge-label is-${edge.kind}`, x: edge.label_x, y: edge.label_y },
      draw("tspan", { class: "mark" }, SIGNS[edge.kind] ?? ""), draw("tspan", {}, edge.label ?? ""));
    lines.append(line);
    labels.append(label);
    this.edges.set(edge.id, { edge, line, label, halo });
  }

  stateOf(state) {
    const { x, y, width, height } = state;
    const box = (inset, name) => draw("rect", {
      class: name, x: x - width / 2 + inset, y: y - height / 2 + inset, width: width - 2 * inset, height: height - 2 * inset,
      rx: Math.max(9 - inset, 2),
    });
    const group = draw("g", { class: "state", "data-state": state.name }, box(0, "state-box"));
    if (state.is_marked) group.append(box(3.5, "state-inner"));
    if (state.is_initial) group.append(draw("path", { class: "state-initial", d: initialArrow(x - width / 2, y) }));
    group.append(draw("text", { class: "state-name", x, y }, state.name));
    this.states.set(state.name, group);
    return group;
  }

  /** Position of the active state along the drawing, from 0 to 1; null: nowhere. */
  get activeShare() {
    const state = this.layout.states.find(({ name }) => name === this.active);
    return state ? state.x / this.layout.width : null;
  }

  /** Lights the active state. */
  setActive(name) {
    if (name === this.active) return;
    this.states.get(this.active)?.classList.remove("is-active");
    this.states.get(name)?.classList.add("is-active");
    this.active = name;
    say(this.words, this.describe());
  }

  /** Lights transitions that were taken since the last frame; the newest stays marked. */
  take(ids) {
    for (const id of new Set(ids)) {
      const found = this.edges.get(id);
      if (found) light(found.halo);
    }
    const newest = this.edges.get(ids[ids.length - 1]);
    if (!newest) return;
    this.markLast(newest);
    say(this.words, this.describe());
  }

  /** Marks the transition that was taken last, whatever was marked before; undefined: none is known. */
  setLast(id) {
    const found = this.edges.get(id) ?? null;
    if (found === this.last) return;
    this.markLast(found);
    say(this.words, this.describe());
  }

  markLast(found) {
    if (found === this.last) return;
    for (const part of [this.last?.line, this.last?.label]) part?.classList.remove("is-last");
    for (const part of [found?.line, found?.label]) part?.classList.add("is-last");
    this.last = found;
  }

  describe() {
    const edge = this.last?.edge;
    const now = this.active === null ? "The active state is not known." : `Active state: ${this.active}.`;
    const last = edge ? ` Last transition: ${edge.label || "silent"}, from ${edge.from} to ${edge.to}.` : "";
    return `${this.layout.states.length} states, ${this.layout.edges.length} transitions. ${now}${last}`;
  }
}

const initialArrow = (x, y) => `M${x - 16} ${y}H${x - 2}M${x - 7} ${y - 4}L${x - 2} ${y}L${x - 7} ${y + 4}`;
