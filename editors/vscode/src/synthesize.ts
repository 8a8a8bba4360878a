// The command Synthesize.

import { mkdtemp, readFile, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import * as path from "node:path";
import * as vscode from "vscode";
import { chosenModel, nameOf } from "./models";
import { type Output, reason } from "./output";
import { type Ended, runShown } from "./programs";
import { searchArguments } from "./settings";

const SAVE = "Save Supervisor...";
const SHOW = "Show Output";
const SUFFIX = ".rsup";

/**
 * Synthesize the supervisor of a model, and offer to keep it.
 *
 * @param given the model; without it, the one that is being edited.
 * @param target the file in which the supervisor is kept, without asking.
 * @returns true if there is a supervisor; undefined where nothing was done.
 */
export async function synthesize(output: Output, given: unknown, target: unknown): Promise<boolean | undefined> {
  const model = await chosenModel(given);
  if (model === undefined) {
    return undefined;
  }
  const title = `Synthesizing ${nameOf(model)}`;
  const { ended, supervisor } = await made(title, model);
  output.note(title, ended.output, ended.errors);
  if (ended.status === null) {
    return undefined;
  }
  if (supervisor === undefined) {
    void output.fail(`${nameOf(model)}: ${reason(ended)}`);
    return false;
  }
  if (target instanceof vscode.Uri) {
    await vscode.workspace.fs.writeFile(target, supervisor);
  } else {
    // The command ends with the supervisor, not with the user's look at the message.
    offer(output, model, supervisor, ended.output).catch((error: Error) => output.fail(error.message));
  }
  return true;
}

/** The output of synthesis, and the supervisor if there is one. */
async function made(title: string, model: vscode.Uri): Promise<{ ended: Ended; supervisor?: Uint8Array }> {
  const folder = await mkdtemp(path.join(tmpdir(), "robosc-"));
  try {
    const file = path.join(folder, `supervisor${SUFFIX}`);
    const ended = await runShown(title, ["synth", ...searchArguments(model), "-o", file, model.fsPath], model);
    return ended.status === 0 ? { ended, supervisor: await readFile(file) } : { ended };
  } finally {
    await rm(folder, { recursive: true, force: true });
  }
}

async function offer(output: Output, model: vscode.Uri, supervisor: Uint8Array, summary: string): Promise<void> {
  const [first = "a supervisor exists"] = summary.split("\n");
  const chosen = await vscode.window.showInformationMessage(`RoboSC: ${first}`, SAVE, SHOW);
  if (chosen === SHOW) {
    output.channel.show(true);
  } else if (chosen === SAVE) {
    const target = await vscode.window.showSaveDialog({
      defaultUri: vscode.Uri.file(model.fsPath.replace(/\.rscd$/, "") + SUFFIX),
      filters: { "Supervisor of RoboSC": [SUFFIX.slice(1)] },
    });
    if (target !== undefined) {
      await vscode.workspace.fs.writeFile(target, supervisor);
    }
  }
}
