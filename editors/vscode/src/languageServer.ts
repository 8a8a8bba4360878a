// The language server: started, ended, and started again with other settings or after it has failed.

import type { ChildProcess } from "node:child_process";
import * as vscode from "vscode";
import { CloseAction, ErrorAction, LanguageClient, type LanguageClientOptions, State } from "vscode-languageclient/node";
import { LANGUAGE } from "./models";
import { type Output, reason } from "./output";
import { INSTALL, run, start } from "./programs";
import { searchArguments, setting } from "./settings";

const HOW = "How to Install";
const SETTINGS = "Open Settings";
const AGAIN = "Start Again";
const PATIENCE_MS = 60_000;
const MOST_FAILURES = 4;
const WITHIN_MS = 180_000;
const MOST_SECONDS = 100_000;

/** The client of `robosc-lsp`. */
export class LanguageServer {
  private client: LanguageClient | undefined;
  private child: ChildProcess | undefined;
  private turn: Promise<void> = Promise.resolve();
  private failures: number[] = [];

  constructor(private readonly output: Output) {}

  /** Start it, or start it again. */
  restart(): Promise<void> {
    this.failures = [];
    return this.again();
  }

  stop(): Promise<void> {
    return this.next(() => this.end());
  }

  private again(): Promise<void> {
    return this.next(async () => {
      await this.end();
      try {
        await this.begin();
      } catch (error) {
        await this.end();
        void this.reportFailure((error as Error).message);
      }
    });
  }

  /** One after the other: a server that begins cannot be ended. */
  private next(step: () => Promise<void>): Promise<void> {
    this.turn = this.turn.then(step, step);
    return this.turn;
  }

  private async begin(): Promise<void> {
    const seconds = Math.min(Math.max(0, setting<number>("synthesisSeconds", 60)), MOST_SECONDS);
    const words = [...searchArguments(), "--synthesis-seconds", String(seconds)];
    // The check prints in one sentence why the server cannot start. A client only sees that a server has ended.
    const checked = await run("robosc-lsp", [...words, "--check"], undefined);
    if (checked.status !== 0) {
      this.output.note("robosc-lsp", checked.output, checked.errors);
      throw new Error(reason(checked));
    }
    let hasFailed = false;
    const options: LanguageClientOptions = {
      documentSelector: [
        { language: LANGUAGE, scheme: "file" },
        { language: LANGUAGE, scheme: "untitled" },
      ],
      initializationFailedHandler: () => false,
      errorHandler: {
        error: () => ({ action: ErrorAction.Continue, handled: true }),
        // It is started again here, and not by its client, which nobody could end while it does so.
        closed: () => {
          if (client === this.client && !hasFailed) {
            hasFailed = true;
            void this.failed();
          }
          return { action: CloseAction.DoNotRestart, handled: true };
        },
      },
      middleware: {
        // A lens shows a result of synthesis, so it leads there.
        provideCodeLenses: async (document, token, next) =>
          (await next(document, token))?.map((lens) => {
            const title = lens.command?.title ?? "";
            const found = { title, command: "robosc.synthesize", arguments: [document.uri] };
            return new vscode.CodeLens(lens.range, found);
          }),
      },
    };
    const server = async (): Promise<ChildProcess> => {
      this.child = start("robosc-lsp", words, undefined);
      return this.child;
    };
    const client = new LanguageClient("robosc", "RoboSC Language Server", server, options);
    try {
      await within(client.start(), PATIENCE_MS);
    } catch (error) {
      client.dispose().catch(() => undefined);
      throw error;
    }
    this.client = client;
  }

  private async end(): Promise<void> {
    const { client, child } = this;
    this.client = this.child = undefined;
    if (client !== undefined && client.state === State.Running) {
      await client.stop().catch(() => undefined);
    }
    await client?.dispose().catch(() => undefined);
    child?.kill("SIGKILL");
  }

  /** It has ended by itself: start it again, unless it does so all the time. */
  private async failed(): Promise<void> {
    const now = Date.now();
    this.failures = [...this.failures.filter((before) => now - before < WITHIN_MS), now];
    if (this.failures.length <= MOST_FAILURES) {
      await this.again();
    } else {
      const message = "RoboSC: the language server ends again and again.";
      if ((await vscode.window.showErrorMessage(message, AGAIN)) === AGAIN) {
        await this.restart();
      }
    }
  }

  private async reportFailure(why: string): Promise<void> {
    const chosen = await vscode.window.showErrorMessage(`RoboSC: no language server: ${why}`, HOW, SETTINGS);
    if (chosen === SETTINGS) {
      await vscode.commands.executeCommand("workbench.action.openSettings", "robosc.programs");
    } else if (chosen === HOW) {
      await vscode.window.showInformationMessage(`RoboSC: ${INSTALL}`, {
        modal: true,
        detail: "Into .venv of the folder that is open, or anywhere on PATH; or set robosc.programs to where it is.",
      });
    }
  }
}

/** The result of a promise, if that takes no longer than a time. */
async function within<T>(promise: Promise<T>, limitMs: number): Promise<T> {
  let timer: NodeJS.Timeout | undefined;
  const late = new Promise<never>((_, reject) => {
    timer = setTimeout(() => reject(new Error(`no answer within ${limitMs / 1000} s`)), limitMs);
  });
  return Promise.race([promise, late]).finally(() => clearTimeout(timer));
}
