// The model that a command is about.

import * as path from "node:path";
import * as vscode from "vscode";

export const LANGUAGE = "robosc";

const ATTEMPTS = 5;
const PAUSE_MS = 100;

/**
 * The model of a command, saved: the one it was given, else the one that is being edited.
 *
 * With it is saved what is open in the language: see `savedAll`.
 *
 * @returns undefined if there is none; the user has then seen a message.
 */
export async function chosenModel(given: unknown): Promise<vscode.Uri | undefined> {
  const active = vscode.window.activeTextEditor?.document;
  const uri = given instanceof vscode.Uri ? given : active?.languageId === LANGUAGE ? active.uri : undefined;
  if (uri === undefined) {
    void vscode.window.showErrorMessage("RoboSC: open a model (.rscd) first.");
    return undefined;
  }
  if (uri.scheme !== "file") {
    void vscode.window.showErrorMessage("RoboSC: save the model to a file first.");
    return undefined;
  }
  return (await savedAll()) ? uri : undefined;
}

/**
 * Save everything that is open in the language, since programs read what is saved and any of it may be a library.
 *
 * @returns true if it is saved; if not, the user has seen a message.
 */
export async function savedAll(): Promise<boolean> {
  for (const document of vscode.workspace.textDocuments) {
    if (document.languageId === LANGUAGE && document.isDirty && document.uri.scheme === "file") {
      if (!(await saved(document))) {
        void vscode.window.showErrorMessage(`RoboSC: ${nameOf(document.uri)} could not be saved.`);
        return false;
      }
    }
  }
  return true;
}

/**
 * Save a document, unless it is closed meanwhile.
 *
 * While the editor is saving it by itself, it says at once that it could not, though it has a moment later: so it is
 * asked a few times.
 */
async function saved(document: vscode.TextDocument): Promise<boolean> {
  for (let attempt = 0; attempt < ATTEMPTS; attempt += 1) {
    const isSaved = await document.save().then(undefined, () => false);
    if (isSaved || !document.isDirty || document.isClosed) {
      return true;
    }
    await new Promise((resolve) => setTimeout(resolve, PAUSE_MS));
  }
  return false;
}

/** A file's name without its folder. */
export function nameOf(uri: vscode.Uri): string {
  return path.basename(uri.fsPath);
}
