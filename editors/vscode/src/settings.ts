// The settings of the user, and the places of the programs of RoboSC.

import { existsSync } from "node:fs";
import { homedir } from "node:os";
import * as path from "node:path";
import * as vscode from "vscode";

const SECTION = "robosc";
const IN_ENVIRONMENT = process.platform === "win32" ? path.join(".venv", "Scripts") : path.join(".venv", "bin");

/** A setting, as it holds for a file; the standard one where it is of another kind, since settings are written by hand. */
export function setting<T extends string | number | string[]>(name: string, standard: T, scope?: vscode.Uri): T {
  const found = vscode.workspace.getConfiguration(SECTION, scope).get<unknown>(name);
  const isRight = Array.isArray(standard)
    ? Array.isArray(found) && found.every((each) => typeof each === "string")
    : typeof found === typeof standard;
  return isRight ? (found as T) : standard;
}

/** Return true if a change of settings concerns one of these. */
export function concerns(change: vscode.ConfigurationChangeEvent, ...names: string[]): boolean {
  return names.some((name) => change.affectsConfiguration(`${SECTION}.${name}`));
}

/** The folders of the editor that a file is in, or all of them. */
function folders(scope?: vscode.Uri): vscode.Uri[] {
  const all = (vscode.workspace.workspaceFolders ?? []).map((folder) => folder.uri);
  if (scope === undefined) {
    return all;
  }
  const holder = vscode.workspace.getWorkspaceFolder(scope);
  return holder === undefined ? all.slice(0, 1) : [holder.uri];
}

/**
 * The folder where programs work: that of a file.
 *
 * Not one that is not trusted, where Python or a shell may look for more.
 */
export function workingFolder(scope?: vscode.Uri): string {
  return (vscode.workspace.isTrusted ? folders(scope)[0]?.fsPath : undefined) ?? homedir();
}

/** A path as it was set: `~` is the home. */
function expanded(text: string): string {
  return /^~(?=$|[\\/])/.test(text) ? path.join(homedir(), text.slice(1)) : text;
}

/** A program of RoboSC: its path, or how it is called if it is nowhere. */
export interface Program {
  command: string;
  isThere: boolean;
}

/**
 * Find a program of RoboSC: where the setting says, in the environment of the folder, or on `PATH`.
 *
 * A folder that is not trusted has no say: neither its settings (see package.json) nor what is in it.
 */
export function program(name: string, scope?: vscode.Uri): Program {
  const file = process.platform === "win32" ? `${name}.exe` : name;
  const within = vscode.workspace.isTrusted ? folders(scope).map((folder) => folder.fsPath) : [];
  const set = setting<string>("programs", "", scope).trim();
  if (set !== "") {
    // A relative one begins in a folder, and so only in one that is trusted.
    const places = path.isAbsolute(expanded(set)) ? [expanded(set)] : within.map((folder) => path.resolve(folder, set));
    const files = places.map((place) => path.join(place, file));
    return firstOf(files, files[0] ?? path.join(set, file));
  }
  const searched = (process.env["PATH"] ?? "").split(path.delimiter).filter((folder) => path.isAbsolute(folder));
  const environments = within.map((folder) => path.join(folder, IN_ENVIRONMENT));
  return firstOf([...environments, ...searched].map((folder) => path.join(folder, file)), name);
}

function firstOf(places: string[], otherwise: string): Program {
  const found = places.find((place) => existsSync(place));
  return { command: found ?? otherwise, isThere: found !== undefined };
}

/**
 * The folders with libraries and with ROS packages, as arguments of any program of RoboSC.
 *
 * Relative ones begin in the open folder, and are meant for those that have them.
 */
export function searchArguments(scope?: vscode.Uri): string[] {
  return [...searched("-L", "libraryPaths", scope), ...searched("-I", "interfacePaths", scope)];
}

function searched(option: string, name: string, scope?: vscode.Uri): string[] {
  const around = folders(scope);
  const found = (around.length > 0 ? around : [vscode.Uri.file(homedir())]).flatMap((folder) =>
    setting<string[]>(name, [], folder)
      .map(expanded)
      .filter((each) => path.isAbsolute(each) || existsSync(path.resolve(folder.fsPath, each)))
      .map((each) => path.resolve(folder.fsPath, each)),
  );
  return [...new Set(found)].flatMap((folder) => [option, folder]);
}
