// Does in the editor what a user would: orders come as files, one after the other, and what came of each is written
// beside it.

const fs = require("node:fs");
const path = require("node:path");
const vscode = require("vscode");

const LIMIT_MS = 120_000;
const folder = process.env.ROBOSC_TRIAL;

exports.activate = () => {
  if (folder !== undefined) {
    void follow();
  }
};

/** Carry out orders as they come: each is one JSON file, answered by another one. */
async function follow() {
  for (let number = 0; ; number += 1) {
    const order = await appeared(path.join(folder, `order-${number}.json`));
    let answer;
    try {
      answer = { value: (await limited(steps[order.step](order.given ?? {}))) ?? null };
    } catch (error) {
      answer = { error: String(error?.stack ?? error) };
    }
    const file = path.join(folder, `answer-${number}.json`);
    fs.writeFileSync(`${file}.part`, JSON.stringify(answer));
    fs.renameSync(`${file}.part`, file);
  }
}

function appeared(file) {
  return new Promise((resolve) => {
    const timer = setInterval(() => {
      if (fs.existsSync(file)) {
        clearInterval(timer);
        resolve(JSON.parse(fs.readFileSync(file, "utf8")));
      }
    }, 50);
  });
}

function limited(promise) {
  return new Promise((resolve, reject) => {
    const timer = setTimeout(() => reject(new Error(`nothing within ${LIMIT_MS} ms`)), LIMIT_MS);
    Promise.resolve(promise).then(resolve, reject).finally(() => clearTimeout(timer));
  });
}

/** Return the answer to a question, once the answer is as it is wanted. */
async function once(ask, isWanted) {
  const end = Date.now() + LIMIT_MS;
  for (;;) {
    const found = await ask();
    if (isWanted(found)) {
      return found;
    }
    if (Date.now() > end) {
      throw new Error(`never as wanted; the last answer: ${JSON.stringify(found)}`);
    }
    await new Promise((resolve) => setTimeout(resolve, 50));
  }
}

function execute(command, ...given) {
  return vscode.commands.executeCommand(command, ...given);
}

function place(document, text, after = 0) {
  const offset = document.getText().indexOf(text);
  if (offset < 0) {
    throw new Error(`'${text}' is not in the text`);
  }
  return document.positionAt(offset + after);
}

function plain(content) {
  return typeof content === "string" ? content : content.value;
}

function revived(value) {
  if (typeof value === "string" && value.startsWith("file:")) {
    return vscode.Uri.file(value.slice("file:".length));
  }
  if (value !== null && typeof value === "object" && !Array.isArray(value)) {
    return Object.fromEntries(Object.entries(value).map(([key, each]) => [key, revived(each)]));
  }
  return value;
}

const beside = [];

const steps = {
  async open({ file }) {
    const document = await vscode.workspace.openTextDocument(vscode.Uri.file(file));
    await vscode.window.showTextDocument(document, vscode.ViewColumn.One);
    return { language: document.languageId };
  },

  /** The codes of the findings in a file, once one of them is (or none of them is) a certain one. */
  async findings({ file, until }) {
    const uri = vscode.Uri.file(file);
    const codes = () => vscode.languages.getDiagnostics(uri).map((each) => String(each.code?.value ?? each.code));
    return once(codes, (found) => (until === null ? found.length === 0 : found.includes(until)));
  },

  async replace({ file, text, by }) {
    const document = await vscode.workspace.openTextDocument(vscode.Uri.file(file));
    const edit = new vscode.WorkspaceEdit();
    edit.replace(document.uri, new vscode.Range(place(document, text), place(document, text, text.length)), by);
    return vscode.workspace.applyEdit(edit);
  },

  async hover({ file, text, until }) {
    const document = await vscode.workspace.openTextDocument(vscode.Uri.file(file));
    const ask = async () => {
      const found = await execute("vscode.executeHoverProvider", document.uri, place(document, text, 1));
      return found.flatMap((hover) => hover.contents.map(plain)).join("\n");
    };
    return once(ask, (found) => found.includes(until));
  },

  async completions({ file, text }) {
    const document = await vscode.workspace.openTextDocument(vscode.Uri.file(file));
    const where = place(document, text, text.length);
    const found = await execute("vscode.executeCompletionItemProvider", document.uri, where);
    return found.items.map((item) => (typeof item.label === "string" ? item.label : item.label.label));
  },

  async definition({ file, text }) {
    const document = await vscode.workspace.openTextDocument(vscode.Uri.file(file));
    const found = await execute("vscode.executeDefinitionProvider", document.uri, place(document, text, 1));
    const { uri, targetUri, range, targetRange } = found[0];
    return { file: (uri ?? targetUri).fsPath, line: (range ?? targetRange).start.line };
  },

  async rename({ file, text, name }) {
    const document = await vscode.workspace.openTextDocument(vscode.Uri.file(file));
    const edit = await execute("vscode.executeDocumentRenameProvider", document.uri, place(document, text, 1), name);
    return edit.entries().map(([uri, edits]) => ({ file: uri.fsPath, edits: edits.length }));
  },

  async symbols({ file }) {
    const name = (symbol) => [symbol.name, symbol.children.map(name)];
    return (await execute("vscode.executeDocumentSymbolProvider", vscode.Uri.file(file))).map(name);
  },

  async tokens({ file }) {
    const uri = vscode.Uri.file(file);
    const { tokenTypes } = await execute("vscode.provideDocumentSemanticTokensLegend", uri);
    const { data } = await execute("vscode.provideDocumentSemanticTokens", uri);
    return Array.from({ length: data.length / 5 }, (_, number) => tokenTypes[data[5 * number + 3]]);
  },

  async format({ file }) {
    const uri = vscode.Uri.file(file);
    const edits = await execute("vscode.executeFormatDocumentProvider", uri, { tabSize: 4, insertSpaces: true });
    const edit = new vscode.WorkspaceEdit();
    edit.set(uri, edits ?? []);
    await vscode.workspace.applyEdit(edit);
    return (await vscode.workspace.openTextDocument(uri)).getText();
  },

  /** The lens over a robot, once synthesis has told. */
  async lens({ file, until }) {
    const ask = () => execute("vscode.executeCodeLensProvider", vscode.Uri.file(file), 10);
    const found = await once(ask, (lenses) => lenses.some((lens) => lens.command?.title.includes(until)));
    return found.map(({ command }) => ({ title: command.title, command: command.command }));
  },

  async isDirty({ file }) {
    return (await vscode.workspace.openTextDocument(vscode.Uri.file(file))).isDirty;
  },

  /** Run a command; texts of the shape `file:PATH` are given as addresses of files. */
  async command({ name, given = [] }) {
    return execute(name, ...given.map(revived));
  },

  /** Run a command that asks something: what it returns tells `besides`. */
  async commandBeside({ name, given = [] }) {
    beside.push(execute(name, ...given.map(revived)));
  },

  async besides() {
    return Promise.all(beside.splice(0));
  },

  async commands() {
    return (await vscode.commands.getCommands(true)).filter((name) => name.startsWith("robosc."));
  },

  async tabs() {
    return vscode.window.tabGroups.all.flatMap((group) => group.tabs.map((tab) => tab.label));
  },

  async closeTab({ label }) {
    const tabs = vscode.window.tabGroups.all.flatMap((group) => group.tabs);
    return vscode.window.tabGroups.close(tabs.filter((tab) => tab.label === label));
  },

  /** Set something for the folder, or for the user wherever he works; nothing sets it back. */
  async set({ name, value, everywhere }) {
    const { Global, Workspace } = vscode.ConfigurationTarget;
    await vscode.workspace.getConfiguration().update(name, value ?? undefined, everywhere ? Global : Workspace);
  },
};
