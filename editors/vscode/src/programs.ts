// Programs of RoboSC that run and end.

import { type ChildProcess, type ChildProcessWithoutNullStreams, spawn } from "node:child_process";
import * as path from "node:path";
import * as vscode from "vscode";
import { program, workingFolder } from "./settings";

/** Command by which a user gets what the extension needs. */
export const INSTALL = "pip install 'robosc-VERSION-py3-none-any.whl[lsp,view]'";

/** Outcome of a program that has ended. */
export interface Ended {
  /** Its exit status; null where a signal or the user has ended it. */
  status: number | null;
  output: string;
  errors: string;
}

/** The environment of a program: nothing of the editor's own, no colours, UTF-8, and no code from where it works. */
export function environment(): NodeJS.ProcessEnv {
  const found: NodeJS.ProcessEnv = { ...process.env, NO_COLOR: "1", PYTHONIOENCODING: "utf-8" };
  delete found["ELECTRON_RUN_AS_NODE"];
  // An entry that is empty or relative means the folder that a program works in, before the libraries of Python.
  const searched = (found["PYTHONPATH"] ?? "").split(path.delimiter).filter((folder) => path.isAbsolute(folder));
  delete found["PYTHONPATH"];
  return searched.length === 0 ? found : { ...found, PYTHONPATH: searched.join(path.delimiter) };
}

const running = new Set<ChildProcess>();

/** End what is still running. */
export function endPrograms(): void {
  for (const child of running) {
    child.kill();
  }
}

/**
 * Start a program of RoboSC, which is ended with the extension at the latest.
 *
 * @param scope the model that it is about.
 * @throws Error where it is not there.
 */
export function start(name: string, words: string[], scope: vscode.Uri | undefined): ChildProcessWithoutNullStreams {
  const { command, isThere } = program(name, scope);
  if (!isThere) {
    throw new Error(`'${command}' is not there: install it by "${INSTALL}", or set robosc.programs.`);
  }
  const child = spawn(command, words, { cwd: workingFolder(scope), env: environment(), stdio: "pipe" });
  running.add(child);
  const forget = (): void => void running.delete(child);
  child.on("error", forget);
  child.on("close", forget);
  // A program that has ended reads nothing; its end is reported by `close`.
  child.stdin.on("error", () => undefined);
  return child;
}

/** The reason why a program could not be started, in one sentence. */
export function whyNot(name: string, error: Error): string {
  return `'${name}' cannot be started: ${error.message}`;
}

/**
 * Run a program to its end, without input.
 *
 * @param scope the model that it is about.
 * @param token ends it early.
 * @throws Error where it cannot be started.
 */
export function run(
  name: string,
  words: string[],
  scope: vscode.Uri | undefined,
  token?: vscode.CancellationToken,
): Promise<Ended> {
  return new Promise((resolve, reject) => {
    const child = start(name, words, scope);
    child.stdin.end();
    const output: Buffer[] = [];
    const errors: Buffer[] = [];
    const cancelled = token?.onCancellationRequested(() => child.kill());
    child.stdout.on("data", (data: Buffer) => output.push(data));
    child.stderr.on("data", (data: Buffer) => errors.push(data));
    child.on("error", (error) => {
      cancelled?.dispose();
      reject(new Error(whyNot(name, error)));
    });
    child.on("close", (status) => {
      cancelled?.dispose();
      resolve({
        status: token?.isCancellationRequested ? null : status,
        output: Buffer.concat(output).toString("utf8"),
        errors: Buffer.concat(errors).toString("utf8"),
      });
    });
  });
}

/** Run `robosc` while the editor shows that it does; the user can end it. */
export function runShown(title: string, words: string[], scope: vscode.Uri): Thenable<Ended> {
  return vscode.window.withProgress(
    { location: vscode.ProgressLocation.Notification, title, cancellable: true },
    (_, token) => run("robosc", words, scope, token),
  );
}
