// Pages of panels.

const STYLE = `
  body { padding: 0 1rem 1rem; }
  h1 { font-size: 1.3em; font-weight: 600; }
  table { border-collapse: collapse; margin-top: 1rem; }
  th, td { border: 1px solid var(--vscode-panel-border, #8884); padding: 0.15rem 0.5rem; text-align: left; vertical-align: top; }
  tr:target > th { background: var(--vscode-editor-findMatchHighlightBackground, #fa03); }
  ul { margin: 0; padding: 0; list-style: none; }
  .drawing { overflow: auto; }
  .drawing svg { max-width: 100%; height: auto; }
  .drawing:has(:checked) svg { max-width: none; }
  .drawing text { fill: var(--vscode-editor-foreground); }
  .drawing path, .drawing polygon, .drawing ellipse { stroke: var(--vscode-editor-foreground); }
  .drawing polygon, .drawing ellipse { fill: var(--vscode-editor-foreground); }
  .drawing .node path, .drawing .node polygon { fill: none; }
`;

const ENTITIES: Record<string, string> = { "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "'": "&#39;" };

/** A text inside a page. */
export function escaped(text: string): string {
  return text.replace(/[&<>"']/g, (character) => ENTITIES[character] ?? character);
}

/** A page without scripts, that loads nothing. */
export function page(body: string): string {
  return `<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'">
<style>${STYLE}</style>
</head>
<body>${body}</body>
</html>`;
}
