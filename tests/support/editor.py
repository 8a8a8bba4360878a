"""An editor without a screen: it speaks to the language server as editors do, in its own process or over a pipe.

What it knows of texts and positions is its own, slow and obvious: it cuts texts in the units of the protocol.
"""

import asyncio
import os
import re
import signal
import socket
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from threading import Event
from types import TracebackType
from typing import Any, Self

from lsprotocol import types as lsp
from pygls.io_ import run_async
from pygls.lsp.client import LanguageClient
from pygls.protocol import default_converter

from robosc import __version__
from robosc_lsp.command import parser
from robosc_lsp.server import make_server

LIMIT_S = 120.0
"""Time after which nothing is expected to come any more, however slow the machine is, in seconds."""

_UNITS = {"utf-8": ("utf-8", 1), "utf-16": ("utf-16-le", 2), "utf-32": ("utf-32-le", 4)}


def line_begins(text: str) -> list[int]:
    """The offset of each line's begin, as the protocol ends lines."""
    return [0, *(found.end() for found in re.finditer(r"\r\n|\r|\n", text))]


def position_of(text: str, offset: int, encoding: str = "utf-16") -> lsp.Position:
    """The position of an offset."""
    codec, size = _UNITS[encoding]
    line = sum(begin <= offset for begin in line_begins(text)) - 1
    before = text[line_begins(text)[line] : offset]
    return lsp.Position(line, len(before.encode(codec)) // size)


def offset_of(text: str, position: lsp.Position, encoding: str = "utf-16") -> int:
    """The offset of a position that is in the text."""
    codec, size = _UNITS[encoding]
    begin = line_begins(text)[position.line]
    taken = text[begin:].encode(codec)[: position.character * size]
    return begin + len(taken.decode(codec))


def part_of(text: str, where: lsp.Range) -> str:
    """Return the text in a range."""
    return text[offset_of(text, where.start) : offset_of(text, where.end)]


def with_edits(text: str, edits: Sequence[lsp.TextEdit]) -> str:
    """A text after edits that do not overlap."""
    for edit in sorted(edits, key=lambda edit: (edit.range.start.line, edit.range.start.character), reverse=True):
        text = text[: offset_of(text, edit.range.start)] + edit.new_text + text[offset_of(text, edit.range.end) :]
    return text


_converter = cache(default_converter)
"""Converter of messages to their meaning: it keeps nothing, and a new one would learn all of the protocol again."""


class Editor:
    """An editor that works on a folder, with a server in this process.

    Leaving its block ends it, and it must end well. The two exchange the bytes of the protocol over a pair of
    sockets. While the test does not wait, none of them runs.

    Args:
        folder: Folder with the files.
        options: Options of the server's command line; a synthesis may take any time unless they say otherwise.
        encodings: Encodings in which it can count columns, in its order.
        resolves_edits: True if it asks for the edit of an action when it is chosen.
    """

    def __init__(
        self, folder: Path, *options: str, encodings: Sequence[str] = ("utf-16",), resolves_edits: bool = False
    ) -> None:
        self.folder = folder
        self.texts: dict[str, str] = {}
        self.reports: dict[str, lsp.PublishDiagnosticsParams] = {}
        self.faults: list[str] = []
        self.logged: list[str] = []
        self._resolves_edits = resolves_edits
        self.lenses_refreshed = 0
        self.watched: list[lsp.Registration] = []
        # A synthesis leaves the processor to everybody else, and so may take long where others have much to do.
        is_said = "--synthesis-seconds" in options
        self._options = options if is_said else (*options, "--synthesis-seconds", "100000")
        self._encodings = [lsp.PositionEncodingKind(item) for item in encodings]
        self._versions: dict[str, int] = {}
        self._runner = asyncio.Runner()
        self._news = asyncio.Event()
        self.client = LanguageClient("editor", __version__, converter_factory=_converter)
        self._listen()

    def _listen(self) -> None:
        @self.client.feature(lsp.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)  # type: ignore[untyped-decorator]
        def findings(report: lsp.PublishDiagnosticsParams) -> None:
            self.reports[report.uri] = report
            self._news.set()

        @self.client.feature(lsp.WORKSPACE_CODE_LENS_REFRESH)  # type: ignore[untyped-decorator]
        def refresh(_: None) -> None:
            self.lenses_refreshed += 1
            self._news.set()

        @self.client.feature(lsp.CLIENT_REGISTER_CAPABILITY)  # type: ignore[untyped-decorator]
        def register(asked: lsp.RegistrationParams) -> None:
            self.watched += asked.registrations
            self._news.set()

        @self.client.feature(lsp.WINDOW_SHOW_MESSAGE)  # type: ignore[untyped-decorator]
        def fault(message: lsp.ShowMessageParams) -> None:
            self.faults.append(message.message)

        @self.client.feature(lsp.WINDOW_LOG_MESSAGE)  # type: ignore[untyped-decorator]
        def log(message: lsp.LogMessageParams) -> None:
            self.logged.append(message.message)

    def run(self, coroutine: Any) -> Any:
        """Wait for something, at most `LIMIT_S`."""

        async def limited() -> Any:
            async with asyncio.timeout(LIMIT_S):
                return await coroutine

        return self._runner.run(limited())

    async def _start(self) -> None:
        arguments = parser().parse_args(self._options)
        self.server = make_server(arguments.library_path, arguments.interface_path, arguments.synthesis_seconds)
        ours, its = socket.socketpair()
        reader, self._writer = await asyncio.open_connection(sock=ours)
        self._served = asyncio.create_task(self._serve(*await asyncio.open_connection(sock=its)))
        self.client.protocol.set_writer(self._writer)
        self.client._async_tasks.append(
            asyncio.create_task(run_async(self.client._stop_event, reader, self.client.protocol))
        )

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> int:
        """The status that the server ends with."""
        self.server.protocol.set_writer(writer)
        try:
            await run_async(Event(), reader, self.server.protocol, error_handler=self.server.report_server_error)
        except SystemExit as end:
            return int(end.code or 0)
        finally:
            writer.close()
        return 0

    async def _ended(self) -> None:
        """Wait for the end of the server, which has been asked to."""
        status = await self._served
        await self.client.stop()  # type: ignore[no-untyped-call]
        self._writer.close()
        await self._writer.wait_closed()
        assert status == 0 and not self.faults, (status, self.faults)

    def __enter__(self) -> Self:
        self.run(self._start())
        capabilities = lsp.ClientCapabilities(
            general=lsp.GeneralClientCapabilities(position_encodings=self._encodings),
            workspace=lsp.WorkspaceClientCapabilities(
                code_lens=lsp.CodeLensWorkspaceClientCapabilities(refresh_support=True),
                did_change_watched_files=lsp.DidChangeWatchedFilesClientCapabilities(dynamic_registration=True),
                workspace_folders=True,
            ),
            text_document=lsp.TextDocumentClientCapabilities(
                publish_diagnostics=lsp.PublishDiagnosticsClientCapabilities(related_information=True),
                document_symbol=lsp.DocumentSymbolClientCapabilities(hierarchical_document_symbol_support=True),
                code_action=lsp.CodeActionClientCapabilities(
                    data_support=True, resolve_support=lsp.ClientCodeActionResolveOptions(["edit"])
                )
                if self._resolves_edits
                else None,
            ),
        )
        folders = [lsp.WorkspaceFolder(self.folder.as_uri(), self.folder.name)]
        parameters = lsp.InitializeParams(capabilities, root_uri=self.folder.as_uri(), workspace_folders=folders)
        self.initialized = self.run(self.client.initialize_async(parameters))
        self.encoding = lsp.PositionEncodingKind(self.initialized.capabilities.position_encoding).value
        self.client.initialized(lsp.InitializedParams())
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if self._is_running():
                self.run(self.client.shutdown_async(None))
                self.client.exit(None)
                self.run(self._ended())
        finally:
            self._runner.close()

    def _is_running(self) -> bool:
        return True

    # Texts

    def uri(self, name: str) -> str:
        """The URI of a file of the folder."""
        return (self.folder / name).as_uri() if ":" not in name else name

    def document(self, name: str) -> lsp.TextDocumentIdentifier:
        """Return the identifier of a file."""
        return lsp.TextDocumentIdentifier(self.uri(name))

    def save(self, name: str, text: str) -> None:
        """Write a file, and report it as an editor does that watches files."""
        path = self.folder / name
        kind = lsp.FileChangeType.Changed if path.exists() else lsp.FileChangeType.Created
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8", newline="")
        self.client.workspace_did_change_watched_files(
            lsp.DidChangeWatchedFilesParams([lsp.FileEvent(self.uri(name), kind)])
        )

    def open(self, name: str, text: str) -> None:
        """Show a file, whatever is saved."""
        self.texts[name] = text
        self._versions[name] = 1
        item = lsp.TextDocumentItem(self.uri(name), "robosc", 1, text)
        self.client.text_document_did_open(lsp.DidOpenTextDocumentParams(item))

    def edit(self, name: str, *edits: tuple[int, int, str]) -> None:
        """Replace what stands between offsets, one edit after the other, in one message."""
        self.send(name, self.changes(name, *edits))

    def changes(self, name: str, *edits: tuple[int, int, str]) -> list[lsp.TextDocumentContentChangeEvent]:
        """Edits of what is shown, in the words of the protocol; to be sent."""
        changes: list[lsp.TextDocumentContentChangeEvent] = []
        for begin, end, new in edits:
            text = self.texts[name]
            where = lsp.Range(self.position(text, begin), self.position(text, end))
            changes.append(lsp.TextDocumentContentChangePartial(text=new, range=where))
            self.texts[name] = text[:begin] + new + text[end:]
        return changes

    def replace(self, name: str, text: str) -> None:
        """Give the whole text anew."""
        self.texts[name] = text
        self.send(name, [lsp.TextDocumentContentChangeWholeDocument(text)])

    def send(self, name: str, changes: list[lsp.TextDocumentContentChangeEvent]) -> None:
        """Report changes."""
        self._versions[name] += 1
        document = lsp.VersionedTextDocumentIdentifier(self._versions[name], self.uri(name))
        self.client.text_document_did_change(lsp.DidChangeTextDocumentParams(document, changes))

    def close(self, name: str) -> None:
        """Show a file no more."""
        del self.texts[name], self._versions[name]
        self.client.text_document_did_close(lsp.DidCloseTextDocumentParams(self.document(name)))

    def position(self, text: str, offset: int) -> lsp.Position:
        """The position of an offset, in what columns are counted in here."""
        return position_of(text, offset, self.encoding)

    def at(self, name: str, words: str) -> lsp.TextDocumentPositionParams:
        """The place of the `|` in some words, which stand once in the file as it is shown."""
        text = self.texts[name]
        plain = words.replace("|", "")
        assert text.count(plain) == 1, f"{plain!r} stands {text.count(plain)} times there"
        offset = text.index(plain) + words.index("|")
        return lsp.TextDocumentPositionParams(self.document(name), self.position(text, offset))

    def where(self, name: str, words: str) -> lsp.Location:
        """The place of what stands between two `|` in some words, which stand once in the file as it is shown."""
        begin, end = words.index("|"), words.rindex("|") - 1
        text = self.texts[name]
        plain = words.replace("|", "")
        assert text.count(plain) == 1, f"{plain!r} stands {text.count(plain)} times there"
        at = text.index(plain)
        where = lsp.Range(self.position(text, at + begin), self.position(text, at + end))
        return lsp.Location(self.uri(name), where)

    # Messages that it receives

    def until(self, condition: Callable[[], bool]) -> None:
        """Wait until the server has sent something."""

        async def wait() -> None:
            while not condition():
                self._news.clear()
                await self._news.wait()

        self.run(wait())

    def findings(
        self, name: str, such: Callable[[list[lsp.Diagnostic]], bool] = lambda found: True
    ) -> list[lsp.Diagnostic]:
        """Return the findings in the text as it is shown, once they are reported and as wanted."""
        uri = self.uri(name)

        def is_reported() -> bool:
            report = self.reports.get(uri)
            return report is not None and report.version == self._versions[name] and such(list(report.diagnostics))

        self.until(is_reported)
        return list(self.reports[uri].diagnostics)

    def codes(self, name: str, such: Callable[[list[str]], bool] = lambda codes: True) -> list[str]:
        """The codes of what is found; see `findings`."""
        found = self.findings(name, lambda found: such([str(item.code) for item in found]))
        return [str(item.code) for item in found]


class ProcessEditor(Editor):
    """The same with a server that is a process of its own, on its standard streams."""

    async def _start(self) -> None:
        command = (sys.executable, "-P", "-m", "robosc_lsp.command", "--stdio", *self._options)
        await self.client.start_io(*command, cwd=self.folder)

    async def _ended(self) -> None:
        process = self._process
        try:
            status = await process.wait()
            assert process.stderr is not None
            assert status == 0 and not self.faults, (await process.stderr.read(), self.faults)
        finally:
            await self.client.stop()  # type: ignore[no-untyped-call]

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            super().__exit__(kind, error, trace)
        finally:
            with suppress(ProcessLookupError):
                self._process.kill()

    def _is_running(self) -> bool:
        return self._process.returncode is None

    @property
    def _process(self) -> asyncio.subprocess.Process:
        process = self.client._server
        assert process is not None
        return process

    @property
    def pid(self) -> int:
        """The server's process."""
        return self._process.pid

    def kill(self, number: signal.Signals) -> None:
        """End the server by a signal."""

        async def end() -> None:
            os.kill(self.pid, number)
            await self._process.wait()
            with suppress(RuntimeError):  # That it has ended.
                await self.client.stop()  # type: ignore[no-untyped-call]

        self.run(end())
