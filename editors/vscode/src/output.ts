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

  /** Tell that something went wrong, and where more is told. */
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

/** The line in which a program says why it failed: its first one, after findings or how it is used its last one. */
export function reason(ended: Ended): string {
  const lines = (ended.errors.trim() || ended.output.trim()).split("\n");
  const told = / (error|warning|note): |^usage: /.test(lines[0] ?? "") ? lines.at(-1) : lines[0];
  return told?.replace(/^robosc: /, "").trim() || `it ended with status ${ended.status}`;
}

/** As `reason`, of a program that answers in JSON. */
export function reasonInJson(ended: Ended): string {
  try {
    const told = JSON.parse(ended.output) as { error?: { message: string }; reason?: string; errors?: number };
    const errors = told.errors === 1 ? "1 error" : `${told.errors} errors`;
    return told.error?.message ?? (told.reason || (told.errors ? errors : reason(ended)));
  } catch {
    return reason(ended);
  }
}
