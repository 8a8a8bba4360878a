// RoboSC in VS Code.

import * as vscode from "vscode";
import { explore } from "./explore";
import { generate } from "./generate";
import { LanguageServer } from "./languageServer";
import { Output } from "./output";
import { endPrograms } from "./programs";
import { concerns } from "./settings";
import { synthesize } from "./synthesize";
import { LiveViews } from "./visualize";

let server: LanguageServer | undefined;

/** The editor begins with the extension. */
export async function activate(context: vscode.ExtensionContext): Promise<void> {
  const output = new Output();
  const views = new LiveViews(output);
  const languageServer = new LanguageServer(output);
  server = languageServer;
  const commands: Record<string, (...given: unknown[]) => Promise<unknown>> = {
    synthesize: (model, target) => synthesize(output, model, target),
    generate: (model, target, folder) => generate(output, model, target, folder),
    explore: (model) => explore(output, model),
    showAutomata: async (model) => (await views.showAutomata(model)) !== undefined,
    visualize: async (running) => (await views.visualize(running)) !== undefined,
    restartServer: () => languageServer.restart(),
    showOutput: async () => output.channel.show(true),
  };
  for (const [name, command] of Object.entries(commands)) {
    const guarded = async (...given: unknown[]): Promise<unknown> => {
      try {
        return await command(...given);
      } catch (error) {
        // Not awaited: the message stays until somebody has read it.
        void output.fail((error as Error).message);
        return undefined;
      }
    };
    context.subscriptions.push(vscode.commands.registerCommand(`robosc.${name}`, guarded));
  }
  context.subscriptions.push(
    output,
    views,
    vscode.workspace.onDidChangeConfiguration((change) => {
      if (concerns(change, "programs", "libraryPaths", "interfacePaths", "synthesisSeconds")) {
        void languageServer.restart();
      }
    }),
    vscode.workspace.onDidChangeWorkspaceFolders(() => void languageServer.restart()),
    { dispose: endPrograms },
    // A folder that is trusted now may have programs of its own.
    vscode.workspace.onDidGrantWorkspaceTrust(() => void languageServer.restart()),
  );
  await languageServer.restart();
}

/** The editor ends. */
export function deactivate(): Promise<void> {
  return server?.stop() ?? Promise.resolve();
}
