// Panels of the live view: a page that `robosc view` serves, in a frame.

import type { ChildProcess, ChildProcessWithoutNullStreams } from "node:child_process";
import { randomBytes } from "node:crypto";
import * as vscode from "vscode";
import { escaped } from "./html";
import type { Output } from "./output";
import { start, whyNot } from "./programs";
import { setting } from "./settings";

const PATIENCE_MS = 5000;
const MOST_KEPT = 20_000;

/** Content that a panel shows. */
export interface Shown {
  title: string;
  /** Arguments of `robosc view`: what is looked at. */
  words: string[];
  /** The model, or whatever decides where the settings are taken from. */
  scope: vscode.Uri | undefined;
}

/** A panel, and the program whose page it shows. */
export class LivePanel {
  private readonly panel: vscode.WebviewPanel;
  private child: ChildProcess | undefined;
  private isClosed = false;

  /** The address that is framed; undefined until the program has printed it. */
  address: string | undefined;

  /** Called when the panel is closed. */
  onClosed: () => void = () => undefined;

  constructor(
    private readonly shown: Shown,
    private readonly output: Output,
  ) {
    this.panel = vscode.window.createWebviewPanel("robosc.live", shown.title, vscode.ViewColumn.Beside, {
      enableScripts: true,
      retainContextWhenHidden: true,
      localResourceRoots: [],
    });
    this.panel.onDidDispose(() => {
      this.isClosed = true;
      this.end();
      this.onClosed();
    });
    this.panel.webview.onDidReceiveMessage((message: unknown) => {
      if (Array.isArray(message) && this.child === undefined) {
        this.begin(message.filter((each): each is string => typeof each === "string"));
      }
    });
    this.ask();
  }

  /** Bring it to the front. */
  reveal(): void {
    this.panel.reveal();
  }

  close(): void {
    this.panel.dispose();
  }

  /** Ask for the pages around the frame, known inside it alone; then the page may be framed by these and no others. */
  private ask(): void {
    const nonce = randomBytes(16).toString("hex");
    this.panel.webview.html = html(
      `script-src 'nonce-${nonce}'`,
      `<p>The live view begins.</p><script nonce="${nonce}">
        acquireVsCodeApi().postMessage([location.origin, ...(location.ancestorOrigins ?? [])]);
      </script>`,
    );
  }

  private begin(around: string[]): void {
    const { words, scope, title } = this.shown;
    const framing = sources(around).flatMap((source) => ["--framed-by", source]);
    const own = setting<string[]>("view.arguments", [], scope);
    // Its input ends with this process, whatever becomes of it.
    const serving = ["view", "--address", "127.0.0.1:0", "--end-with-input"];
    let child: ChildProcessWithoutNullStreams;
    try {
      child = start("robosc", [...serving, ...framing, ...words, ...own], scope);
    } catch (error) {
      this.show((error as Error).message);
      return;
    }
    this.child = child;
    let printed = "";
    let line = "";
    const note = (data: Buffer): void => {
      printed = (printed + data.toString("utf8")).slice(-MOST_KEPT);
    };
    child.stderr.on("data", note);
    child.stdout.on("data", (data: Buffer) => {
      note(data);
      line += data.toString("utf8");
      const found = /\bhttps?:\/\/\S+(?=\s)/.exec(line);
      if (found !== null && this.address === undefined) {
        this.address = found[0];
        void this.frame(found[0], around);
      }
      line = line.slice(-MOST_KEPT);
    });
    const ended = (why: string): void => {
      if (this.child === child) {
        this.child = undefined;
        this.address = undefined;
        this.output.note(title, printed);
        this.show(why);
      }
    };
    child.on("error", (error) => ended(whyNot("robosc", error)));
    child.on("close", (status) => ended(printed.trim() || `robosc view ended with status ${status}`));
  }

  private async frame(address: string, around: string[]): Promise<void> {
    if (!(await isReached(address, around))) {
      this.end();
      this.show(
        `This editor does not reach ${address.replace(/\?.*$/s, "")} by that address, and the live view answers to no other. ` +
          "Forward its port without a change, or start robosc view where you can open its page.",
      );
    } else if (!this.isClosed) {
      const source = new URL(address).origin;
      const nonce = randomBytes(16).toString("hex");
      // The text behind the frame stays in sight until the page in it has reported itself.
      this.panel.webview.html = html(
        `frame-src ${source}; script-src 'nonce-${nonce}'`,
        `<p>The live view is at ${escaped(source)}.</p><p id="why" hidden>If it does not come, this editor does not
          reach that address: forward its port without a change.</p>
        <iframe src="${escaped(address)}" title="The live view" style="visibility: hidden"></iframe>
        <script nonce="${nonce}">
          const frame = document.querySelector("iframe");
          addEventListener("message", (message) => {
            if (message.source === frame.contentWindow && message.data === "robosc-live-view") {
              frame.style.visibility = "visible";
            }
          });
          setTimeout(() => (document.querySelector("#why").hidden = false), ${PATIENCE_MS});
        </script>`,
      );
    }
  }

  private show(why: string): void {
    if (this.isClosed) {
      return;
    }
    const nonce = randomBytes(16).toString("hex");
    this.panel.webview.html = html(
      `script-src 'nonce-${nonce}'`,
      `<p>The live view has ended:</p><pre>${escaped(why)}</pre><button>Start Again</button><script nonce="${nonce}">
        const api = acquireVsCodeApi();
        document.querySelector("button").addEventListener("click", () =>
          api.postMessage([location.origin, ...(location.ancestorOrigins ?? [])]));
      </script>`,
    );
  }

  private end(): void {
    const child = this.child;
    this.child = this.address = undefined;
    if (child !== undefined && child.exitCode === null) {
      child.kill();
      const timer = setTimeout(() => child.kill("SIGKILL"), PATIENCE_MS);
      child.once("close", () => clearTimeout(timer));
    }
  }
}

/**
 * Return true if the editor's window reaches an address of the machine on which its extensions run, as it stands.
 *
 * @param around origins of the pages around the frame: in a browser on that machine they are of that machine.
 */
async function isReached(address: string, around: string[]): Promise<boolean> {
  if (around.every((origin) => /^https?:/.test(origin) && isLoopback(new URL(origin).hostname))) {
    return true;
  }
  const outside = await vscode.env.asExternalUri(vscode.Uri.parse(address, true));
  const { hostname, port, pathname } = new URL(outside.toString(true));
  return isLoopback(hostname) && port === new URL(address).port && pathname === "/";
}

function isLoopback(host: string): boolean {
  return host === "localhost" || host === "[::1]" || /^127(\.\d{1,3}){3}$/.test(host);
}

/** Pages of these origins, as sources of a Content-Security-Policy: those of the editor itself by their scheme. */
export function sources(origins: string[]): string[] {
  const found = origins.map((origin) => (/^https?:/.test(origin) ? origin : origin.replace(/^([a-z][a-z0-9+.-]*:).*$/s, "$1")));
  return [...new Set(found)].filter((source) => /^[a-z][a-z0-9+.-]*:/.test(source));
}

function html(policy: string, body: string): string {
  return `<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; ${policy}">
<style>
  body { padding: 0 1rem; }
  pre { white-space: pre-wrap; }
  iframe { position: fixed; inset: 0; width: 100%; height: 100%; border: 0; }
</style>
</head>
<body>${body}</body>
</html>`;
}
