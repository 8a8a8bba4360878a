"""Conversion of findings, symbols and tokens to values of the protocol."""

from collections.abc import Iterable

from lsprotocol import types as lsp

from robosc.editing.definitions import DefinitionKind
from robosc.editing.outline import Part
from robosc.errors import Diagnostic, Severity
from robosc_lsp.project import Analysis, Project, place_of
from robosc_lsp.texts import Text

SEVERITIES = {
    Severity.ERROR: lsp.DiagnosticSeverity.Error,
    Severity.WARNING: lsp.DiagnosticSeverity.Warning,
    Severity.NOTE: lsp.DiagnosticSeverity.Information,
}
SYMBOLS = {
    DefinitionKind.ROBOT: lsp.SymbolKind.Module,
    DefinitionKind.LIBRARY: lsp.SymbolKind.Package,
    DefinitionKind.COMPONENT: lsp.SymbolKind.Class,
    DefinitionKind.INCOMING: lsp.SymbolKind.Event,
    DefinitionKind.OUTGOING: lsp.SymbolKind.Event,
    DefinitionKind.SERVICE: lsp.SymbolKind.Function,
    DefinitionKind.ACTION: lsp.SymbolKind.Method,
    DefinitionKind.INTERFACE: lsp.SymbolKind.Interface,
    DefinitionKind.OBJECT: lsp.SymbolKind.Struct,
    DefinitionKind.PROPERTY: lsp.SymbolKind.Property,
    DefinitionKind.ENUM: lsp.SymbolKind.Enum,
    DefinitionKind.ENUM_VALUE: lsp.SymbolKind.EnumMember,
    DefinitionKind.CONSTANT: lsp.SymbolKind.Constant,
    DefinitionKind.STATE: lsp.SymbolKind.EnumMember,
    DefinitionKind.VARIABLE: lsp.SymbolKind.Variable,
    DefinitionKind.ELEMENT: lsp.SymbolKind.Variable,
    DefinitionKind.MISSION: lsp.SymbolKind.Object,
}
COMPLETIONS = {
    DefinitionKind.ROBOT: lsp.CompletionItemKind.Module,
    DefinitionKind.LIBRARY: lsp.CompletionItemKind.Module,
    DefinitionKind.COMPONENT: lsp.CompletionItemKind.Class,
    DefinitionKind.INCOMING: lsp.CompletionItemKind.Event,
    DefinitionKind.OUTGOING: lsp.CompletionItemKind.Event,
    DefinitionKind.SERVICE: lsp.CompletionItemKind.Function,
    DefinitionKind.ACTION: lsp.CompletionItemKind.Method,
    DefinitionKind.INTERFACE: lsp.CompletionItemKind.Interface,
    DefinitionKind.OBJECT: lsp.CompletionItemKind.Struct,
    DefinitionKind.PROPERTY: lsp.CompletionItemKind.Property,
    DefinitionKind.ENUM: lsp.CompletionItemKind.Enum,
    DefinitionKind.ENUM_VALUE: lsp.CompletionItemKind.EnumMember,
    DefinitionKind.CONSTANT: lsp.CompletionItemKind.Constant,
    DefinitionKind.STATE: lsp.CompletionItemKind.EnumMember,
    DefinitionKind.VARIABLE: lsp.CompletionItemKind.Variable,
    DefinitionKind.ELEMENT: lsp.CompletionItemKind.Variable,
    DefinitionKind.MISSION: lsp.CompletionItemKind.Reference,
}

TOKEN_TYPES = (
    "namespace",
    "class",
    "event",
    "function",
    "method",
    "interface",
    "struct",
    "property",
    "enum",
    "enumMember",
    "variable",
)
TOKEN_MODIFIERS = ("declaration", "readonly")
_TOKENS = {
    DefinitionKind.ROBOT: "namespace",
    DefinitionKind.LIBRARY: "namespace",
    DefinitionKind.COMPONENT: "class",
    DefinitionKind.INCOMING: "event",
    DefinitionKind.OUTGOING: "event",
    DefinitionKind.SERVICE: "function",
    DefinitionKind.ACTION: "method",
    DefinitionKind.INTERFACE: "interface",
    DefinitionKind.OBJECT: "struct",
    DefinitionKind.PROPERTY: "property",
    DefinitionKind.ENUM: "enum",
    DefinitionKind.ENUM_VALUE: "enumMember",
    DefinitionKind.CONSTANT: "variable",
    DefinitionKind.STATE: "enumMember",
    DefinitionKind.VARIABLE: "variable",
    DefinitionKind.ELEMENT: "variable",
    DefinitionKind.MISSION: "class",
}


def diagnostics(analysis: Analysis, project: Project, found: Iterable[Diagnostic]) -> list[lsp.Diagnostic]:
    """Convert the findings of a file with their fixes; findings of other files are shown at its start.

    What the text accepts is a hint, with the reason in place of a fix.
    """
    return [_diagnostic(analysis, project, item) for item in found]


def _diagnostic(analysis: Analysis, project: Project, item: Diagnostic) -> lsp.Diagnostic:
    text, here, is_open = analysis.text, analysis.file, item.accepted is None
    is_here = item.location is not None and item.location.file in ("", here)
    where = text.range_of(item.location) if item.location is not None and is_here else text.range(0, 0)
    message = item.message if is_here or item.location is None else f"{item.location}: {item.message}"
    related = [
        lsp.DiagnosticRelatedInformation(found, place.message)
        for place in item.related
        if (found := place_of(analysis, project, place.location)) is not None
    ]
    return lsp.Diagnostic(
        where,
        f"{message}\n{item.fix if is_open else f'accepted: {item.accepted}'}",
        severity=SEVERITIES[item.severity] if is_open else lsp.DiagnosticSeverity.Hint,
        code=item.code,
        source="robosc",
        related_information=related or None,
    )


def symbol(part: Part, text: Text) -> lsp.DocumentSymbol:
    """Convert a part with its nested parts."""
    definition = part.definition
    return lsp.DocumentSymbol(
        # Editors refuse empty names.
        definition.name or str(definition.kind),
        SYMBOLS[definition.kind],
        text.range(part.begin, part.end),
        text.range_of(definition.location),
        detail=str(definition.kind),
        children=[symbol(inner, text) for inner in part.parts],
    )


def semantic_tokens(analysis: Analysis) -> list[int]:
    """Encode every name of a file with its kind, in the relative positions of the protocol."""
    data: list[int] = []
    line = column = 0
    for place, definition in analysis.names.occurrences(analysis.file):
        where = analysis.text.range_of(place)
        begin, length = where.start, where.end.character - where.start.character
        is_same = begin.line == line
        modifiers = (place == definition.location) | (definition.kind is DefinitionKind.CONSTANT) << 1
        data += (
            begin.line - line,
            begin.character - column if is_same else begin.character,
            length,
            TOKEN_TYPES.index(_TOKENS[definition.kind]),
            int(modifiers),
        )
        line, column = begin.line, begin.character
    return data
