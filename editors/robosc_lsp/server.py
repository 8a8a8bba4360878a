"""The features of the language server.

All features use the current texts of `Project`. Findings are published after each edit, after a pause as long as the
last analysis, so that typing is never delayed. Synthesis runs in a separate process, from half a second after the last
edit until the next one.
"""

import asyncio
import contextlib
import logging
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from lsprotocol import types as lsp
from pygls.exceptions import (
    JsonRpcException,
    JsonRpcInvalidParams,
    JsonRpcInvalidRequest,
    JsonRpcServerNotInitialized,
)
from pygls.lsp.server import LanguageServer
from pygls.protocol import LanguageServerProtocol, lsp_method
from pygls.protocol.json_rpc import JsonRPCNotification
from pygls.uris import to_fs_path

from robosc import __version__
from robosc.editing.completion import Candidate, complete
from robosc.editing.definitions import Definition, DefinitionKind
from robosc.editing.findings import no_supervisor
from robosc.editing.fixes import Fix, fixes
from robosc.editing.hover import holder_of, hover_text
from robosc.editing.outline import folds, parts
from robosc.errors import Diagnostic, LanguageError, RelatedPlace, Severity
from robosc.formatting import format_text
from robosc.language.bundle import SUFFIX
from robosc.language.interfaces import INTERFACE_KINDS
from robosc.language.words import spelled
from robosc.source import Bundle, Location, SourceFile
from robosc_lsp.convert import (
    COMPLETIONS,
    SYMBOLS,
    TOKEN_MODIFIERS,
    TOKEN_TYPES,
    diagnostics,
    semantic_tokens,
    symbol,
)
from robosc_lsp.messages import SynthesisResponse
from robosc_lsp.project import MAXIMUM_FILES, Analysis, Project, place_of
from robosc_lsp.synthesis_queue import SynthesisQueue, run_synthesis

_LOG = logging.getLogger(__name__)

_SYNTHESIS_PAUSE_S = 0.5
_SYNTHESIS_LIMIT_S = 60.0
_LONGEST_PAUSE_S = 1.0
_MOST_SYMBOLS = 500
_LONGEST_NAME = 255
_FIX_TIME_S = 0.3


class _Protocol(LanguageServerProtocol):
    """Protocol that leaves texts to `Project`, since pygls splits lines differently.

    Handlers of notifications are plain functions: pygls never releases the futures of asynchronous ones. Every request
    gets a response, also those that pygls only logs: with wrong parameters, before `initialize`, after `shutdown`.
    """

    _is_initialized = False

    def structure_message(self, data: dict[str, Any]) -> Any:
        """Return the message of JSON data; a request with wrong parameters is answered, and ignored from then on."""
        try:
            return super().structure_message(data)
        except JsonRpcException as error:
            if "method" not in data or not isinstance(data.get("id"), int | str):
                raise
            self._send_response(data["id"], error=error.to_response_error())
            return JsonRPCNotification(method="$/answered", jsonrpc=self.VERSION, params=None)

    def handle_message(self, message: Any) -> None:
        """Handle a message, unless it is a request that comes too early or too late, which is refused."""
        method, is_request = getattr(message, "method", None), hasattr(message, "id") and hasattr(message, "method")
        if is_request and not self._is_initialized and method != lsp.INITIALIZE:
            self._send_response(message.id, error=JsonRpcServerNotInitialized().to_response_error())
        elif is_request and self._shutdown:
            self._send_response(message.id, error=JsonRpcInvalidRequest().to_response_error())
        else:
            self._is_initialized = self._is_initialized or method == lsp.INITIALIZE
            super().handle_message(message)

    @lsp_method(lsp.TEXT_DOCUMENT_DID_OPEN)
    def lsp_text_document__did_open(self, params: lsp.DidOpenTextDocumentParams) -> None:
        self.fm.features[lsp.TEXT_DOCUMENT_DID_OPEN](params)

    @lsp_method(lsp.TEXT_DOCUMENT_DID_CHANGE)
    def lsp_text_document__did_change(self, params: lsp.DidChangeTextDocumentParams) -> None:
        self.fm.features[lsp.TEXT_DOCUMENT_DID_CHANGE](params)

    @lsp_method(lsp.TEXT_DOCUMENT_DID_CLOSE)
    def lsp_text_document__did_close(self, params: lsp.DidCloseTextDocumentParams) -> None:
        self.fm.features[lsp.TEXT_DOCUMENT_DID_CLOSE](params)


class Server(LanguageServer):
    """Language server for one editor.

    Args:
        library_paths: Additional folders with libraries.
        interface_paths: Folders with ROS packages, searched before those of the environment.
        synthesis_s: Time limit of background synthesis in seconds; 0: no synthesis.
    """

    def __init__(
        self,
        library_paths: Sequence[Path] = (),
        interface_paths: Sequence[Path] = (),
        synthesis_s: float = _SYNTHESIS_LIMIT_S,
    ) -> None:
        super().__init__(
            "robosc-lsp",
            __version__,
            text_document_sync_kind=lsp.TextDocumentSyncKind.Incremental,
            protocol_cls=_Protocol,
        )
        self.project = Project(lsp.PositionEncodingKind.Utf16)
        self._library_paths, self._interface_paths = tuple(library_paths), tuple(interface_paths)
        self._synthesis_s = synthesis_s
        self._versions: dict[str, int] = {}
        self._outcomes: dict[str, tuple[str, SynthesisResponse]] = {}
        self._analysis_task: asyncio.Task[None] | None = None
        self._syntheses: dict[str, tuple[str, asyncio.Task[None]]] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._last_analysis_s = 0.0
        self._queue = SynthesisQueue()

    # Texts

    def initialize(self, parameters: lsp.InitializeParams) -> None:
        """Take over the capabilities and folders of the editor."""
        uris = [folder.uri for folder in parameters.workspace_folders or ()]
        if not uris and parameters.root_uri:
            uris = [parameters.root_uri]
        paths = _paths(uris)
        encoding = self.workspace.position_encoding or lsp.PositionEncodingKind.Utf16
        self.project = Project(encoding, paths)
        self.project.library_paths = self._library_paths
        self.project.interface_paths = (*self._interface_paths, *self.project.interface_paths)

    def change_folders(self, added: Sequence[str], removed: Sequence[str]) -> None:
        """Change the workspace folders."""
        gone = _paths(removed)
        self.project.folders = [path for path in self.project.folders if path not in gone] + _paths(added)

    def opened(self, document: lsp.TextDocumentItem) -> None:
        """Open a file."""
        self._versions[document.uri] = document.version
        self._queue.prefer(document.uri)
        self.project.open(document.uri, document.text)
        self.schedule_analysis()

    def changed(
        self,
        document: lsp.VersionedTextDocumentIdentifier,
        changes: Sequence[lsp.TextDocumentContentChangeEvent],
    ) -> None:
        """Edit a file, and cancel its synthesis."""
        self._versions[document.uri] = document.version
        self._queue.prefer(document.uri)
        self._stop(document.uri)
        self.project.edit(document.uri, changes)
        self.schedule_analysis()

    def closed(self, uri: str) -> None:
        """Close a file, and clear its findings."""
        self.project.close(uri)
        self._versions.pop(uri, None)
        self._outcomes.pop(uri, None)
        self._queue.forget(uri)
        self._stop(uri)
        self.text_document_publish_diagnostics(lsp.PublishDiagnosticsParams(uri, []))
        self.schedule_analysis()

    def schedule_analysis(self) -> None:
        """Schedule the analysis of all open files."""
        if self._analysis_task is None or self._analysis_task.done():
            self._analysis_task = asyncio.get_running_loop().create_task(self._analyse_all())

    async def _analyse_all(self) -> None:
        # A pause as long as the last analysis, so that several edits are analysed together.
        await asyncio.sleep(min(self._last_analysis_s, _LONGEST_PAUSE_S))
        begun_s = time.monotonic()
        for uri in self.project.open_uris:
            try:
                analysis = self.project.analysis(uri)
                if analysis is not None:
                    self._publish(uri, analysis)
                    self._begin_synthesis(uri, analysis)
            except Exception:
                # An internal error must not prevent the analysis of other files.
                _LOG.exception("analysis of %s failed", uri)
        self._last_analysis_s = time.monotonic() - begun_s

    def _publish(self, uri: str, analysis: Analysis) -> None:
        items = diagnostics(analysis, self.project, (*self._findings(analysis), *self._accepted(analysis)))
        self.text_document_publish_diagnostics(
            lsp.PublishDiagnosticsParams(uri, items, version=self._versions.get(uri))
        )

    def _findings(self, analysis: Analysis) -> tuple[Diagnostic, ...]:
        found = (item for item in self._from_synthesis(analysis) if item.accepted is None)
        return (*analysis.inspected.checked.diagnostics, *found)

    def _accepted(self, analysis: Analysis) -> tuple[Diagnostic, ...]:
        """The findings that the file itself accepts."""
        found = (item for item in self._from_synthesis(analysis) if item.accepted is not None)
        return tuple(
            item
            for item in (*analysis.inspected.checked.accepted, *found)
            if item.location is not None and item.location.file == analysis.file
        )

    # Synthesis

    def outcome(self, analysis: Analysis) -> SynthesisResponse | None:
        """Return the result of synthesis for the current text; None: not available yet."""
        known = self._outcomes.get(analysis.uri)
        if known is None or analysis.bundle is None or known[0] != analysis.bundle.digest:
            return None
        return known[1]

    def _from_synthesis(self, analysis: Analysis) -> tuple[Diagnostic, ...]:
        """Those findings, also the accepted ones, that the checks have not reported."""
        found = self.outcome(analysis)
        if found is None:
            return ()
        checked = analysis.inspected.checked
        known = {*checked.diagnostics, *checked.accepted}
        items = [
            Diagnostic(
                Severity(item.severity),
                item.code,
                item.message,
                item.location,
                item.fix,
                tuple(RelatedPlace(*place) for place in item.related),
                item.accepted,
            )
            for item in found.findings
        ]
        items = [item for item in items if item not in known]
        if found.reason and analysis.whole is not None:
            items.append(no_supervisor(found.reason, analysis.whole.definition.location))
        return tuple(items)

    def _begin_synthesis(self, uri: str, analysis: Analysis) -> None:
        bundle = analysis.bundle
        if uri in self._syntheses and bundle is not None and self._syntheses[uri][0] == bundle.digest:
            return
        self._stop(uri)
        if (
            self._synthesis_s > 0
            and bundle is not None
            and analysis.inspected.checked.model is not None
            and self.outcome(analysis) is None
        ):
            task = asyncio.get_running_loop().create_task(self._synthesize(uri, analysis, bundle))
            self._syntheses[uri] = bundle.digest, task
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    def _stop(self, uri: str) -> None:
        if uri in self._syntheses:
            self._syntheses.pop(uri)[1].cancel()

    async def _synthesize(self, uri: str, analysis: Analysis, bundle: Bundle) -> None:
        await asyncio.sleep(_SYNTHESIS_PAUSE_S)
        async with self._queue.slot(uri):
            self._outcomes[uri] = bundle.digest, await run_synthesis(bundle, self._synthesis_s)
        self._publish(uri, analysis)
        capabilities = self.client_capabilities.workspace
        lens = capabilities.code_lens if capabilities is not None else None
        if lens is not None and lens.refresh_support:
            with contextlib.suppress(Exception):  # The editor may have exited, or refuse.
                await self.workspace_code_lens_refresh_async(None)

    async def watch(self) -> None:
        """Ask the editor to report file changes by other programs."""
        capabilities = self.client_capabilities.workspace
        watched = capabilities.did_change_watched_files if capabilities is not None else None
        if watched is not None and watched.dynamic_registration:
            suffixes = (SUFFIX, *(f".{kind}" for kind in INTERFACE_KINDS))
            watchers = [lsp.FileSystemWatcher(f"**/*{suffix}") for suffix in suffixes]
            options = lsp.DidChangeWatchedFilesRegistrationOptions(watchers)
            registration = lsp.Registration("watched-files", lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES, options)
            await self.client_register_capability_async(lsp.RegistrationParams([registration]))

    async def finish(self) -> None:
        """Cancel analysis and synthesis, and wait for their processes to end."""
        if self._analysis_task is not None:
            self._analysis_task.cancel()
        for uri in tuple(self._syntheses):
            self._stop(uri)
        if self._tasks:
            await asyncio.wait(self._tasks)

    # Names

    def named(self, uri: str, position: lsp.Position) -> tuple[Analysis, Location, Definition] | None:
        """Return the name at a position; None: there is no known name."""
        analysis = self.project.analysis(uri)
        if analysis is None:
            return None
        line, column = analysis.text.line_and_column(analysis.text.offset(position))
        found = analysis.names.at(analysis.file, line, column)
        return None if found is None else (analysis, *found)

    def everywhere(self, analysis: Analysis, definition: Definition, *, declared: bool) -> list[lsp.Location]:
        """Return all uses of a definition in all files."""
        home = place_of(analysis, self.project, definition.location)
        if home is None:
            return []
        found: dict[tuple[str, int, int], lsp.Location] = {}
        for other in (analysis, *self.project.analyses()):
            there = next(
                (
                    item
                    for item in other.names.definitions.values()
                    if item.name == definition.name
                    and item.kind is definition.kind
                    and place_of(other, self.project, item.location) == home
                ),
                None,
            )
            for use in other.names.uses(there) if there is not None else ():
                place = place_of(other, self.project, use)
                if place is not None:
                    found[place.uri, place.range.start.line, place.range.start.character] = place
        places = [found[key] for key in sorted(found)]
        return [home, *places] if declared else places

    def renamed(self, uri: str, position: lsp.Position, name: str) -> lsp.WorkspaceEdit | None:
        """Return the edits that rename a definition in all files.

        Raises:
            JsonRpcInvalidParams: The name is invalid, or the rename would change the meaning of other names.
        """
        found = self.named(uri, position)
        if found is None:
            return None
        wanted = name.removeprefix("^")
        if not (wanted.isascii() and wanted.isidentifier()) or len(wanted) > _LONGEST_NAME:
            raise JsonRpcInvalidParams(
                f"'{name}' is not a valid name: use letters, digits and '_', and no digit at the start"
            )
        analysis, _, definition = found
        if wanted == definition.name:
            return lsp.WorkspaceEdit(changes={})
        self._require_visible_uses(analysis, definition)
        changes: dict[str, list[lsp.TextEdit]] = {}
        for place in self.everywhere(analysis, definition, declared=True):
            changes.setdefault(place.uri, []).append(lsp.TextEdit(place.range, spelled(wanted)))
        changed = self.project.with_edits(changes)
        for other in self.project.analyses():
            if changes.keys() & set(other.uris.values()):
                after = changed.analysis(other.uri)
                if after is None or after.errors > other.errors or after.names.pattern() != other.names.pattern():
                    raise JsonRpcInvalidParams(f"'{name}' already has another meaning in {other.file}")
        return lsp.WorkspaceEdit(changes=changes)

    def _require_visible_uses(self, analysis: Analysis, definition: Definition) -> None:
        """Do nothing if all uses of a definition are known.

        Raises:
            JsonRpcInvalidParams: Its name occurs in an invalid part of a text.
        """
        home = place_of(analysis, self.project, definition.location)
        is_shared = analysis.whole is not None and analysis.whole.definition.kind is DefinitionKind.LIBRARY
        for other in (analysis, *self.project.analyses()):
            is_here = home is not None and home.uri in other.uris.values()
            # Errors may also hide an import from the file with the definition.
            if other.errors and (is_here or is_shared or definition.location.file != analysis.file):
                for place in other.names.not_understood(SourceFile(other.file, other.text.text), definition.name):
                    line = other.text.range_of(place).start.line + 1
                    name = other.file or unquote(other.uri.rpartition("/")[2])
                    raise JsonRpcInvalidParams(
                        f"'{definition.name}' occurs in line {line} of {name}, where errors hide its meaning: "
                        "fix them first"
                    )
        if self.project.has_too_many_files():
            raise JsonRpcInvalidParams(
                f"the editor's folders hold more than {MAXIMUM_FILES} models, and '{definition.name}' may occur in any "
                "of them: open a smaller folder"
            )
        for path in self.project.unreadable():
            if definition.name.encode() in path.read_bytes():
                raise JsonRpcInvalidParams(f"'{definition.name}' occurs in {path.name}, which is not UTF-8")

    def hover(self, uri: str, position: lsp.Position) -> lsp.Hover | None:
        """Return the hover text for the name at a position."""
        found = self.named(uri, position)
        if found is None:
            return None
        analysis, place, definition = found
        outcome = self.outcome(analysis)
        text = hover_text(
            definition,
            analysis.inspected,
            self._declaration(analysis, definition),
            self._holders(analysis, definition),
            {} if outcome is None else outcome.added,
        )
        return lsp.Hover(lsp.MarkupContent(lsp.MarkupKind.Markdown, text), analysis.text.range_of(place))

    def _declaration(self, analysis: Analysis, definition: Definition) -> str:
        """Return the text of a definition, or its line if it is in another file."""
        if definition.location.file == analysis.file and analysis.whole is not None:
            for part in parts(analysis.whole):
                if part.definition.location == definition.location and part is not analysis.whole:
                    return analysis.text.text[part.begin : part.end]
            return analysis.text.text.split("\n")[definition.location.line - 1].strip()
        file = analysis.bundle.file(definition.location.file) if analysis.bundle is not None else None
        return "" if file is None else file.line(definition.location.line).strip()

    def _holders(self, analysis: Analysis, definition: Definition) -> list[str]:
        """Return the holder of each use of a definition: a part of this file, or another file."""
        found = []
        for use in analysis.names.uses(definition):
            holder = (
                holder_of(analysis.inspected.parsed, analysis.text.begin_of(use)) if use.file == analysis.file else ""
            )
            found.append(holder or use.file)
        if analysis.whole is not None and analysis.whole.definition.kind is DefinitionKind.LIBRARY:
            own = set(analysis.uris.values())
            places = self.everywhere(analysis, definition, declared=False)
            found += [unquote(place.uri.rpartition("/")[2]) for place in places if place.uri not in own]
        return found

    def completions(self, uri: str, position: lsp.Position) -> lsp.CompletionList:
        """Return the completions that can be written at a position."""
        analysis = self.project.analysis(uri)
        if analysis is None:
            return lsp.CompletionList(is_incomplete=False, items=[])
        offset = analysis.text.offset(position)
        begin, found = complete(analysis.text.text, offset, analysis.inspected, lambda: self.project.surroundings(uri))
        where = analysis.text.range(begin, offset)
        items = [_completion(item, number, where) for number, item in enumerate(found)]
        return lsp.CompletionList(is_incomplete=False, items=items)

    def actions(self, uri: str, where: lsp.Range, kinds: Sequence[str] | None = None) -> list[lsp.CodeAction]:
        """Return the fixes of the findings in a range, each tried before it is offered.

        Those that are not tried within a time limit come without their edit, which `resolved` adds; an editor that
        cannot ask for it later gets a log message.

        Args:
            uri: URI of the file.
            where: The range.
            kinds: Requested kinds of actions; None: all.
        """
        analysis = self.project.analysis(uri)
        if analysis is None or (kinds is not None and not {"", lsp.CodeActionKind.QuickFix.value} & set(kinds)):
            return []
        findings = self._findings(analysis)
        actions: list[lsp.CodeAction] = []
        until_s = time.monotonic() + _FIX_TIME_S
        is_tried, untried = False, 0
        for item, shown in zip(findings, diagnostics(analysis, self.project, findings), strict=True):
            if item.location is None or item.location.file != analysis.file or not _touch(shown.range, where):
                continue
            # Try at least one, even on a slow machine.
            is_late = is_tried and time.monotonic() > until_s
            is_tried = is_first = True
            if is_late and not self._resolves_edits:
                untried += 1
                continue
            for fix in self._fixes(analysis, item):
                action = lsp.CodeAction(
                    fix.title, kind=lsp.CodeActionKind.QuickFix, diagnostics=[shown], is_preferred=is_first
                )
                if is_late:
                    action.data = {"uri": uri, "finding": _key(item), "title": fix.title}
                else:
                    changes = self._changes(analysis, item, fix)
                    if not self._is_fixed(analysis, item, changes):
                        continue
                    action.edit = lsp.WorkspaceEdit(changes=changes)
                actions.append(action)
                is_first = False
        if untried:
            more = f"{untried} finding{'' if untried == 1 else 's'} of this range"
            self._log(f"{more} not tried for fixes within {_FIX_TIME_S} s; ask at one of them alone")
        return actions

    def resolved(self, action: lsp.CodeAction) -> lsp.CodeAction:
        """Return an action with its edit, if it still fixes its finding in the current text; else without one."""
        data = action.data if isinstance(action.data, dict) else {}
        uri = data.get("uri")
        analysis = self.project.analysis(uri) if isinstance(uri, str) else None
        for item in self._findings(analysis) if analysis is not None else ():
            if analysis is None or item.location is None or _key(item) != data.get("finding"):
                continue
            for fix in self._fixes(analysis, item):
                changes = self._changes(analysis, item, fix)
                if fix.title == data.get("title") and self._is_fixed(analysis, item, changes):
                    return lsp.CodeAction(
                        action.title,
                        kind=action.kind,
                        diagnostics=action.diagnostics,
                        is_preferred=action.is_preferred,
                        edit=lsp.WorkspaceEdit(changes=changes),
                        data=action.data,
                    )
        self._log(f"{action.title}: this does not fix the finding in the current text")
        return action

    @property
    def _resolves_edits(self) -> bool:
        """True if the editor asks for the edit of an action when it is chosen."""
        document = self.client_capabilities.text_document
        actions = document.code_action if document is not None else None
        support = actions.resolve_support if actions is not None and actions.data_support else None
        return support is not None and "edit" in support.properties

    def _log(self, message: str) -> None:
        self.window_log_message(lsp.LogMessageParams(lsp.MessageType.Info, message))

    def _fixes(self, analysis: Analysis, found: Diagnostic) -> tuple[Fix, ...]:
        place = found.location
        if place is None:
            return ()
        return fixes(found, analysis.text.line_of(place), lambda: analysis.text.behind_line_of(place))

    def _changes(self, analysis: Analysis, found: Diagnostic, fix: Fix) -> dict[str, Sequence[lsp.TextEdit]]:
        """Return the edits of a fix: another name of a property is written wherever the property is named."""
        place = analysis.text.range_of(fix.location)
        if found.code in ("unknown-field", "needless-property"):
            try:
                renamed = self.renamed(analysis.uri, place.start, fix.text)
            except JsonRpcInvalidParams:
                return {}
            return {} if renamed is None or renamed.changes is None else dict(renamed.changes)
        more = [lsp.TextEdit(analysis.text.range_of(other), text) for other, text in fix.more]
        return {analysis.uri: [lsp.TextEdit(place, fix.text), *more]}

    def _is_fixed(self, analysis: Analysis, found: Diagnostic, changes: Mapping[str, Iterable[lsp.TextEdit]]) -> bool:
        """Return True if some edits remove a finding and do not increase the number of findings."""
        after = self.project.with_edits(changes).analysis(analysis.uri) if changes else None
        if after is None:
            return False
        # Syntax errors hide other errors: compare only syntax errors, unless there are none.
        first, second = analysis.inspected.parsed.diagnostics, after.inspected.parsed.diagnostics
        if not first and not second:
            first, second = analysis.inspected.checked.diagnostics, after.inspected.checked.diagnostics
        there = {(item.code, item.message, item.location) for item in second}
        return len(second) <= len(first) and (found.code, found.message, found.location) not in there

    def lenses(self, uri: str) -> list[lsp.CodeLens]:
        """Return the code lens of a robot: states of the controlled system, and events with added conditions."""
        analysis = self.project.analysis(uri)
        if analysis is None or analysis.whole is None:
            return []
        if analysis.whole.definition.kind is not DefinitionKind.ROBOT:
            return []
        outcome = self.outcome(analysis)
        if outcome is None:
            if analysis.inspected.checked.model is None:
                return []
            title = "synthesis is running" if self._synthesis_s > 0 else "synthesis is disabled"
        elif outcome.unknown:
            title = outcome.unknown
        elif outcome.reason:
            title = "no supervisor"
        else:
            added = sum(condition != "true" for condition in outcome.added.values())
            events = f"{added} event{'' if added == 1 else 's'}"
            states = f"{outcome.states:,} state{'' if outcome.states == 1 else 's'}"
            title = f"{states}, supervisor adds conditions to {events if added else 'no event'}"
        where = analysis.text.range_of(analysis.whole.definition.location)
        return [lsp.CodeLens(where, command=lsp.Command(title, ""))]


def _paths(uris: Sequence[str]) -> list[Path]:
    return [Path(path) for uri in uris if uri.startswith("file:") and (path := to_fs_path(uri))]


def _key(found: Diagnostic) -> str:
    """Text by which a finding is known again after it went to the editor and back."""
    return f"{found.location} {found.code} {found.message}"


def _touch(first: lsp.Range, second: lsp.Range) -> bool:
    def key(position: lsp.Position) -> tuple[int, int]:
        return position.line, position.character

    return key(first.start) <= key(second.end) and key(second.start) <= key(first.end)


def _completion(item: Candidate, number: int, where: lsp.Range) -> lsp.CompletionItem:
    kind = lsp.CompletionItemKind.Keyword if item.kind is None else COMPLETIONS[item.kind]
    return lsp.CompletionItem(
        item.text,
        kind=kind,
        detail=item.detail or None,
        preselect=item.is_wanted or None,
        # Keep our order: candidates of the required type first, keywords last.
        sort_text=f"{number:05}",
        filter_text=item.text,
        text_edit=lsp.TextEdit(where, item.text),
    )


def make_server(
    library_paths: Sequence[Path] = (),
    interface_paths: Sequence[Path] = (),
    synthesis_s: float = _SYNTHESIS_LIMIT_S,
) -> Server:
    """A server with all its features; see `Server`."""
    server = Server(library_paths, interface_paths, synthesis_s)
    feature = server.feature

    @feature(lsp.INITIALIZE)
    def initialize(parameters: lsp.InitializeParams) -> None:
        server.initialize(parameters)

    @feature(lsp.INITIALIZED)
    async def initialized(_: lsp.InitializedParams) -> None:
        await server.watch()

    @feature(lsp.WORKSPACE_DID_CHANGE_WORKSPACE_FOLDERS)
    def did_change_folders(parameters: lsp.DidChangeWorkspaceFoldersParams) -> None:
        server.change_folders(
            [folder.uri for folder in parameters.event.added], [folder.uri for folder in parameters.event.removed]
        )

    @feature(lsp.SHUTDOWN)
    async def shutdown(_: None) -> None:
        await server.finish()

    @feature(lsp.TEXT_DOCUMENT_DID_OPEN)
    def did_open(parameters: lsp.DidOpenTextDocumentParams) -> None:
        server.opened(parameters.text_document)

    @feature(lsp.TEXT_DOCUMENT_DID_CHANGE)
    def did_change(parameters: lsp.DidChangeTextDocumentParams) -> None:
        server.changed(parameters.text_document, parameters.content_changes)

    @feature(lsp.TEXT_DOCUMENT_DID_CLOSE)
    def did_close(parameters: lsp.DidCloseTextDocumentParams) -> None:
        server.closed(parameters.text_document.uri)

    @feature(lsp.TEXT_DOCUMENT_DID_SAVE)
    def did_save(_: lsp.DidSaveTextDocumentParams) -> None:
        server.project.reread()
        server.schedule_analysis()

    @feature(lsp.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    def did_change_files(_: lsp.DidChangeWatchedFilesParams) -> None:
        server.project.reread()
        server.schedule_analysis()

    @feature(lsp.TEXT_DOCUMENT_HOVER)
    def hover(parameters: lsp.HoverParams) -> lsp.Hover | None:
        return server.hover(parameters.text_document.uri, parameters.position)

    @feature(lsp.TEXT_DOCUMENT_COMPLETION, lsp.CompletionOptions(trigger_characters=[".", " ", ":", "{", ","]))
    def completion(parameters: lsp.CompletionParams) -> lsp.CompletionList:
        return server.completions(parameters.text_document.uri, parameters.position)

    @feature(lsp.TEXT_DOCUMENT_DEFINITION)
    def definition(parameters: lsp.DefinitionParams) -> lsp.Location | None:
        found = server.named(parameters.text_document.uri, parameters.position)
        return None if found is None else place_of(found[0], server.project, found[2].location)

    @feature(lsp.TEXT_DOCUMENT_REFERENCES)
    def references(parameters: lsp.ReferenceParams) -> list[lsp.Location]:
        found = server.named(parameters.text_document.uri, parameters.position)
        if found is None:
            return []
        return server.everywhere(found[0], found[2], declared=parameters.context.include_declaration)

    @feature(lsp.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
    def highlight(parameters: lsp.DocumentHighlightParams) -> list[lsp.DocumentHighlight]:
        uri = parameters.text_document.uri
        found = server.named(uri, parameters.position)
        if found is None:
            return []
        analysis, _, definition = found
        places = [definition.location, *analysis.names.uses(definition)]
        return [lsp.DocumentHighlight(analysis.text.range_of(each)) for each in places if each.file == analysis.file]

    @feature(lsp.TEXT_DOCUMENT_PREPARE_RENAME)
    def prepare_rename(parameters: lsp.PrepareRenameParams) -> lsp.PrepareRenamePlaceholder | None:
        found = server.named(parameters.text_document.uri, parameters.position)
        if found is None:
            return None
        return lsp.PrepareRenamePlaceholder(found[0].text.range_of(found[1]), found[2].name)

    @feature(lsp.TEXT_DOCUMENT_RENAME, lsp.RenameOptions(prepare_provider=True))
    def rename(parameters: lsp.RenameParams) -> lsp.WorkspaceEdit | None:
        return server.renamed(parameters.text_document.uri, parameters.position, parameters.new_name)

    @feature(lsp.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def document_symbol(parameters: lsp.DocumentSymbolParams) -> list[lsp.DocumentSymbol]:
        analysis = server.project.analysis(parameters.text_document.uri)
        return [] if analysis is None or analysis.whole is None else [symbol(analysis.whole, analysis.text)]

    @feature(lsp.WORKSPACE_SYMBOL)
    def workspace_symbol(parameters: lsp.WorkspaceSymbolParams) -> list[lsp.WorkspaceSymbol]:
        wanted = parameters.query.casefold()
        found = []
        for analysis in server.project.analyses():
            for part in parts(analysis.whole) if analysis.whole is not None else ():
                item = part.definition
                if _is_in_order(wanted, item.name.casefold()):
                    where = lsp.Location(analysis.uri, analysis.text.range_of(item.location))
                    found.append(
                        lsp.WorkspaceSymbol(where, item.name, SYMBOLS[item.kind], container_name=item.owner or None)
                    )
        return found[:_MOST_SYMBOLS]

    @feature(
        lsp.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL,
        lsp.SemanticTokensLegend(list(TOKEN_TYPES), list(TOKEN_MODIFIERS)),
    )
    def tokens(parameters: lsp.SemanticTokensParams) -> lsp.SemanticTokens:
        analysis = server.project.analysis(parameters.text_document.uri)
        return lsp.SemanticTokens([] if analysis is None else semantic_tokens(analysis))

    @feature(lsp.TEXT_DOCUMENT_FOLDING_RANGE)
    def folding(parameters: lsp.FoldingRangeParams) -> list[lsp.FoldingRange]:
        text = server.project.text(parameters.text_document.uri)
        if text is None:
            return []
        found = []
        for begin, end, is_comment in folds(text.text):
            first, last = text.position(begin).line, text.position(end).line
            kind = lsp.FoldingRangeKind.Comment if is_comment else lsp.FoldingRangeKind.Region
            # The line of the closing brace stays visible.
            last -= not is_comment
            if last > first:
                found.append(lsp.FoldingRange(first, last, kind=kind))
        return found

    @feature(lsp.TEXT_DOCUMENT_FORMATTING)
    def formatting(parameters: lsp.DocumentFormattingParams) -> list[lsp.TextEdit]:
        text = server.project.text(parameters.text_document.uri)
        if text is None:
            return []
        try:
            formatted = format_text(text.text)
        except LanguageError:
            return []  # The findings are shown instead.
        return [] if formatted == text.text else [lsp.TextEdit(text.whole, formatted)]

    @feature(
        lsp.TEXT_DOCUMENT_CODE_ACTION,
        lsp.CodeActionOptions(code_action_kinds=[lsp.CodeActionKind.QuickFix], resolve_provider=True),
    )
    def code_action(parameters: lsp.CodeActionParams) -> list[lsp.CodeAction]:
        return server.actions(parameters.text_document.uri, parameters.range, parameters.context.only)

    @feature(lsp.CODE_ACTION_RESOLVE)
    def code_action_resolve(action: lsp.CodeAction) -> lsp.CodeAction:
        return server.resolved(action)

    @feature(lsp.TEXT_DOCUMENT_CODE_LENS)
    def code_lens(parameters: lsp.CodeLensParams) -> list[lsp.CodeLens]:
        return server.lenses(parameters.text_document.uri)

    return server


def _is_in_order(wanted: str, name: str) -> bool:
    """Return True if a name has the characters that are wanted, in their order."""
    rest = iter(name)
    return all(character in rest for character in wanted)


__all__ = ["Server", "make_server"]
