// The command Explore: the states of a robot under its supervisor, as a graph and as a table.

import { instance } from "@viz-js/viz";
import * as vscode from "vscode";
import { escaped, page } from "./html";
import { chosenModel, nameOf } from "./models";
import { type Output, reasonInJson } from "./output";
import { runShown } from "./programs";
import { searchArguments, setting } from "./settings";

/** Output of `robosc explore --json`. */
export interface Explored {
  initial: number;
  states: State[];
  /** Source state, event and target state of each. */
  transitions: [number, string, number][];
}

interface State {
  components: Record<string, string>;
  variables: Record<string, unknown>;
  communications: Record<string, string>;
  enabled: string[];
}

// A larger drawing is unreadable, and takes long.
const MOST_DRAWN = 60;
const MOST_ARROWS = 400;
const MOST_STATES = 2000;

/**
 * Show every state that a robot under its supervisor can be in.
 *
 * @param given the model; without it, the one that is being edited.
 * @returns the number of states; undefined where nothing is shown.
 */
export async function explore(output: Output, given: unknown): Promise<number | undefined> {
  const model = await chosenModel(given);
  if (model === undefined) {
    return undefined;
  }
  const title = `Exploring ${nameOf(model)}`;
  const limit = Math.max(1, Math.trunc(setting<number>("exploreLimit", MOST_STATES, model)));
  const words = ["explore", "--json", "--limit", String(limit), ...searchArguments(model), model.fsPath];
  const ended = await runShown(title, words, model);
  if (ended.status === null) {
    return undefined;
  }
  if (ended.status !== 0) {
    output.note(title, reasonInJson(ended));
    void output.fail(`${nameOf(model)}: ${reasonInJson(ended)}`);
    return undefined;
  }
  const explored = JSON.parse(ended.output) as Explored;
  const panel = vscode.window.createWebviewPanel(
    "robosc.explore",
    `States of ${nameOf(model)}`,
    vscode.ViewColumn.Beside,
    { enableScripts: false, enableFindWidget: true, localResourceRoots: [] },
  );
  panel.webview.html = await explorePage(nameOf(model), explored);
  return explored.states.length;
}

/** The page that shows the states of a robot. */
export async function explorePage(name: string, explored: Explored): Promise<string> {
  const { states, transitions, initial } = explored;
  const counted = `${states.length} state${states.length === 1 ? "" : "s"}, ${transitions.length} transition${
    transitions.length === 1 ? "" : "s"
  }; it begins in state ${initial}`;
  return page(
    `<h1>${escaped(name)} under its supervisor</h1><p>${counted}</p>${await drawing(explored)}${table(explored)}`,
  );
}

async function drawing(explored: Explored): Promise<string> {
  const arrows = merged(explored.transitions);
  if (explored.states.length > MOST_DRAWN || arrows.size > MOST_ARROWS) {
    return `<p>A drawing is made of at most ${MOST_DRAWN} states and ${MOST_ARROWS} arrows.</p>`;
  }
  const nodes = explored.states.map((state, number) => ({
    name: String(number),
    attributes: { label: `${number}\n${Object.values(state.components).join("\n")}`, URL: `#state-${number}` },
  }));
  const edges = [...arrows.values()].map(({ tail, head, events }) => ({
    tail: String(tail),
    head: String(head),
    attributes: { label: events.join("\n") },
  }));
  const viz = await instance();
  const svg = viz.renderString(
    {
      nodeAttributes: { shape: "box", style: "rounded", fontname: "sans-serif", fontsize: 11 },
      edgeAttributes: { fontname: "sans-serif", fontsize: 9 },
      graphAttributes: { bgcolor: "transparent" },
      nodes: [{ name: "start", attributes: { shape: "point" } }, ...nodes],
      edges: [{ tail: "start", head: String(explored.initial) }, ...edges],
    },
    { format: "svg", engine: "dot" },
  );
  // The document around it belongs to a file, not to a page.
  const size = `<label><input type="checkbox"> in its own size</label>`;
  return `<div class="drawing">${size}${svg.slice(svg.indexOf("<svg"))}</div>`;
}

interface Arrow {
  tail: number;
  head: number;
  events: string[];
}

/** One arrow for all events from one state to another. */
function merged(transitions: Explored["transitions"]): Map<string, Arrow> {
  const found = new Map<string, Arrow>();
  for (const [tail, event, head] of transitions) {
    const key = `${tail} ${head}`;
    const arrow = found.get(key) ?? { tail, head, events: [] };
    arrow.events.push(event);
    found.set(key, arrow);
  }
  return found;
}

function table({ states, transitions }: Explored): string {
  const leaving: string[][] = states.map(() => []);
  for (const [tail, event, head] of transitions) {
    leaving[tail]?.push(`<li>${escaped(event)} &rarr; <a href="#state-${head}">${head}</a></li>`);
  }
  const first = states[0];
  const names = first === undefined ? [] : Object.keys(values(first));
  const rows = states.map((state, number) => {
    const cells = Object.values(values(state)).map((value) => `<td>${escaped(String(value))}</td>`);
    return `<tr id="state-${number}"><th>${number}</th>${cells.join("")}<td><ul>${leaving[number]?.join("") ?? ""}</ul></td></tr>`;
  });
  const heads = names.map((name) => `<th>${escaped(name)}</th>`).join("");
  return `<table><thead><tr><th>state</th>${heads}<th>what can happen</th></tr></thead><tbody>${rows.join("")}</tbody></table>`;
}

/** All values of a state, by their names in the model. */
function values(state: State): Record<string, unknown> {
  return { ...state.components, ...state.variables, ...state.communications };
}
