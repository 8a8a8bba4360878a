// The command Generate.

import * as vscode from "vscode";
import { chosenModel, nameOf } from "./models";
import { type Output, reason, reasonInJson } from "./output";
import { run, runShown } from "./programs";
import { searchArguments } from "./settings";

const SHOW = "Show Output";
const REVEAL = "Show Folder";
const OVERWRITE = "Overwrite";
const ALL = "all";
const FORCE = "--force";
const REFUSED = 1;

interface Target {
  name: string;
  description: string;
}

/**
 * Generate what runs the supervisor of a model.
 *
 * @param given the model; without it, the one that is being edited.
 * @param target the target to generate, without asking.
 * @param folder the folder to generate into, without asking.
 * @returns the files; undefined where nothing was written.
 */
export async function generate(
  output: Output,
  given: unknown,
  target: unknown,
  folder: unknown,
): Promise<string[] | undefined> {
  const model = await chosenModel(given);
  if (model === undefined) {
    return undefined;
  }
  const name = typeof target === "string" ? target : await chosenTarget(model);
  if (name === undefined) {
    return undefined;
  }
  const where = folder instanceof vscode.Uri ? folder : await chosenFolder(model);
  if (where === undefined) {
    return undefined;
  }
  const title = `Generating ${name} of ${nameOf(model)}`;
  const words = ["generate", "--json", ...searchArguments(model), "--target", name, "-o", where.fsPath, model.fsPath];
  let ended = await runShown(title, words, model);
  if (ended.status === REFUSED && reasonInJson(ended).includes(FORCE)) {
    const message = `RoboSC: ${reasonInJson(ended)}`;
    const detail = "Files there were changed since they were generated, or are not of RoboSC. They would be lost.";
    if ((await vscode.window.showWarningMessage(message, { modal: true, detail }, OVERWRITE)) !== OVERWRITE) {
      return undefined;
    }
    ended = await runShown(title, [...words, FORCE], model);
  }
  if (ended.status === null) {
    return undefined;
  }
  if (ended.status !== 0) {
    output.note(title, reasonInJson(ended));
    void output.fail(`${nameOf(model)}: ${reasonInJson(ended)}`);
    return undefined;
  }
  const { files } = JSON.parse(ended.output) as { files: string[] };
  output.note(title, files.join("\n"));
  void report(output, files, where);
  return files;
}

async function report(output: Output, files: string[], where: vscode.Uri): Promise<void> {
  const many = files.length === 1 ? "1 file" : `${files.length} files`;
  const there = vscode.workspace.asRelativePath(where);
  const chosen = await vscode.window.showInformationMessage(`RoboSC: ${many} in ${there}`, REVEAL, SHOW);
  if (chosen === SHOW) {
    output.channel.show(true);
  } else if (chosen === REVEAL) {
    const inside = vscode.workspace.getWorkspaceFolder(where) !== undefined;
    await vscode.commands.executeCommand(inside ? "revealInExplorer" : "revealFileInOS", where);
  }
}

/** The targets that can be generated, and the one for all of them. */
export async function targets(scope: vscode.Uri): Promise<Target[]> {
  const ended = await run("robosc", ["generate", "--list-targets", "--json"], scope);
  if (ended.status !== 0) {
    throw new Error(reason(ended));
  }
  const found = JSON.parse(ended.output) as { targets: Target[] };
  return [...found.targets, { name: ALL, description: "everything that can be generated of this model" }];
}

async function chosenTarget(model: vscode.Uri): Promise<string | undefined> {
  const items = targets(model).then((found) =>
    found.map(({ name, description }) => ({ label: name, detail: description })),
  );
  const chosen = await vscode.window.showQuickPick(items, { title: "What to generate", matchOnDetail: true });
  return chosen?.label;
}

async function chosenFolder(model: vscode.Uri): Promise<vscode.Uri | undefined> {
  const [chosen] =
    (await vscode.window.showOpenDialog({
      title: "Folder to generate into",
      openLabel: "Generate Here",
      canSelectFiles: false,
      canSelectFolders: true,
      defaultUri: vscode.workspace.getWorkspaceFolder(model)?.uri ?? vscode.Uri.joinPath(model, ".."),
    })) ?? [];
  return chosen;
}
