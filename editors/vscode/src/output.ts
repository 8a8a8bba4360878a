// The channel where programs' own words are shown.

import * as vscode from "vscode";
import type { Ended } from "./programs";

const SHOW = "Show Output";
const PROBLEMS = "Show Problems";

/** The output channel of the extension. */
export class Output {
  readonly channel = vscode.window.createOutputChannel("RoboSC");

  /** Write down what a program was asked, and what it has said. */
  note(title: string, ...texts: string[]): void {
    this.channel.appendLine(`== ${title}`);
    for (const text of texts) {
      if (text.trim() !== "") {
        this.channel.appendLine(text.trimEnd());
      }
    }
    this.channel.appendLine("");
  }

  /** Show an error message, with buttons that lead to more. */
  async fail(message: string): Promise<void> {
    const chosen = await vscode.window.showErrorMessage(`RoboSC: ${message}`, SHOW, PROBLEMS);
    if (chosen === SHOW) {
      this.channel.show(true);
    } else if (chosen === PROBLEMS) {
      await vscode.commands.executeCommand("workbench.actions.view.problems");
    }
  }

  dispose(): void {
    this.channel.dispose();
  }
}

/** The line in which a program says why it failed: the last one after findings or a usage text, else the first one. */
export function reason(ended: Ended): string {
  const lines = (ended.errors.trim() || ended.output.trim()).split("\n");
  const line = / (error|warning|note): |^usage: /.test(lines[0] ?? "") ? lines.at(-1) : lines[0];
  return line?.replace(/^robosc: /, "").trim() || `it ended with status ${ended.status}`;
}

/** The same as `reason`, for a program that answers in JSON. */
export function reasonInJson(ended: Ended): string {
  try {
    const found = JSON.parse(ended.output) as { error?: { message: string }; reason?: string; errors?: number };
    const errors = found.errors === 1 ? "1 error" : `${found.errors} errors`;
    return found.error?.message ?? (found.reason || (found.errors ? errors : reason(ended)));
  } catch {
    return reason(ended);
  }
}
