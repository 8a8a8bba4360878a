// The commands Show Automata and Visualize Running Controller.

import * as vscode from "vscode";
import { LivePanel, type Shown } from "./live";
import { LANGUAGE, chosenModel, nameOf, savedAll } from "./models";
import type { Output } from "./output";
import { searchArguments } from "./settings";

const SOURCES = {
  bridge: { label: "A bridge", detail: "by its gRPC service, as robosc-bridge serves it" },
  ros2: { label: "A ROS 2 node", detail: "by its topic /state; rclpy must be where robosc is installed" },
  log: { label: "An event log", detail: "which is replayed" },
} as const;

/** The controller that is looked at, where nobody is to be asked. */
export type Running =
  | { source: "bridge"; address: string }
  | { source: "ros2"; namespace?: string; model?: vscode.Uri }
  | { source: "log"; log: vscode.Uri; model: vscode.Uri };

/** The panels that are open. */
export class LiveViews {
  private readonly open = new Map<string, LivePanel>();

  constructor(private readonly output: Output) {}

  /** Show a model's automata; a panel that does so already comes to the front. */
  async showAutomata(given: unknown): Promise<LivePanel | undefined> {
    const model = await chosenModel(given);
    if (model === undefined) {
      return undefined;
    }
    const words = ["--model", model.fsPath, ...searchArguments(model)];
    return this.show({ title: `Automata of ${nameOf(model)}`, words, scope: model });
  }

  /** Show a controller that runs, or has run. */
  async visualize(given: unknown): Promise<LivePanel | undefined> {
    const running = isRunning(given) ? given : await chosenRunning();
    if (running === undefined || !(await savedAll())) {
      return undefined;
    }
    if (running.source === "bridge") {
      return this.show({ title: running.address, words: ["--bridge", running.address], scope: undefined });
    }
    const { model } = running;
    const modelWords = model === undefined ? [] : ["--model", model.fsPath, ...searchArguments(model)];
    if (running.source === "ros2") {
      const { namespace = "" } = running;
      const words = ["--ros2", ...(namespace === "" ? [] : ["--namespace", namespace]), ...modelWords];
      return this.show({ title: `${namespace.replace(/\/*$/, "")}/state`, words, scope: model });
    }
    return this.show({ title: nameOf(running.log), words: ["--log", running.log.fsPath, ...modelWords], scope: model });
  }

  dispose(): void {
    for (const panel of [...this.open.values()]) {
      panel.close();
    }
  }

  private show(shown: Shown): LivePanel {
    const key = JSON.stringify(shown.words);
    const there = this.open.get(key);
    if (there !== undefined) {
      there.reveal();
      return there;
    }
    const made = new LivePanel(shown, this.output);
    this.open.set(key, made);
    made.onClosed = () => this.open.delete(key);
    return made;
  }
}

function isRunning(given: unknown): given is Running {
  const source = (given as { source?: unknown } | undefined)?.source;
  return typeof source === "string" && Object.hasOwn(SOURCES, source);
}

async function chosenRunning(): Promise<Running | undefined> {
  const items = Object.entries(SOURCES).map(([source, item]) => ({ ...item, source: source as Running["source"] }));
  const chosen = await vscode.window.showQuickPick(items, { title: "What runs the controller" });
  if (chosen?.source === "bridge") {
    const address = await vscode.window.showInputBox({
      title: "Address of the bridge",
      value: "127.0.0.1:50061",
      validateInput: (text) => (/^\S+:\d+$/.test(text.trim()) ? undefined : "HOST:PORT, such as robot:50061"),
    });
    return address === undefined ? undefined : { source: "bridge", address: address.trim() };
  }
  if (chosen?.source === "ros2") {
    const namespace = await vscode.window.showInputBox({
      title: "Namespace of the node",
      prompt: "What stands before /state; empty: nothing",
    });
    if (namespace === undefined) {
      return undefined;
    }
    const model = await modelOf("Without a model, the page cannot show which requests are enabled", true);
    return { source: "ros2", namespace: namespace.trim(), ...(model === undefined ? {} : { model }) };
  }
  if (chosen?.source === "log") {
    const [log] =
      (await vscode.window.showOpenDialog({ title: "Event log", filters: { "Event log": ["jsonl"], "All files": ["*"] } })) ??
      [];
    const model = log === undefined ? undefined : await modelOf("The model of the log", false);
    return log === undefined || model === undefined ? undefined : { source: "log", log, model };
  }
  return undefined;
}

/** The model of a controller: the one that is being edited, or another. */
async function modelOf(title: string, isOptional: boolean): Promise<vscode.Uri | undefined> {
  const active = vscode.window.activeTextEditor?.document;
  const own = active?.languageId === LANGUAGE && active.uri.scheme === "file" ? active.uri : undefined;
  const items = [
    ...(own === undefined ? [] : [{ label: nameOf(own), choose: () => Promise.resolve<vscode.Uri | undefined>(own) }]),
    { label: "Another model or supervisor...", choose: askForModel },
    ...(isOptional ? [{ label: "None", choose: () => Promise.resolve(undefined) }] : []),
  ];
  const chosen = await vscode.window.showQuickPick(items, { title });
  return chosen?.choose();
}

async function askForModel(): Promise<vscode.Uri | undefined> {
  const found = await vscode.window.showOpenDialog({
    title: "Model or supervisor",
    filters: { "Models and supervisors": ["rscd", "rsup"] },
  });
  return found?.[0];
}
