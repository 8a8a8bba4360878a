"""Benchmark of the waiting time of an editor after a keystroke, and of the language server's memory after many.

A real server on its standard input and output, asked by pygls' client. The model is that of the benchmark of the
language. Each keystroke takes the first character of a name in the middle of the text, or puts it back; between two,
the server is given time to finish, as by somebody who types.
"""

import asyncio
import statistics
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from lsprotocol import types as lsp

from figures import text_table
from language import model_of
from support.editor import Editor, ProcessEditor

SIZES = (100, 1_000, 10_000)
NEIGHBOURS = 40
KEYSTROKES = 30
EDITS = 10_000
_TOGETHER = 100
AIM_MS = 100


def _resident_mb(pid: int) -> float:
    status = Path(f"/proc/{pid}/status").read_text()
    return int(next(line.split()[1] for line in status.splitlines() if line.startswith("VmRSS:"))) / 1024


def _typed(editor: Editor, name: str) -> tuple[int, str]:
    """Return the place to type at, and the word: a state that a transition goes to, in the middle of the text."""
    text = editor.texts[name]
    begin = text.index("goto ", len(text) // 2) + len("goto ")
    return begin, text[begin : begin + 1]


def _percentiles(samples_s: Sequence[float]) -> tuple[str, str]:
    ordered = sorted(samples_s)
    return f"{statistics.median(ordered) * 1e3:.1f}", f"{ordered[int(len(ordered) * 0.95)] * 1e3:.1f}"


def _measured(lines: int, neighbours: int = 0) -> tuple[str, ...]:
    with TemporaryDirectory() as folder, ProcessEditor(Path(folder), "--synthesis-seconds", "0") as editor:
        for number in range(neighbours):
            (Path(folder) / f"neighbour_{number}.rscd").write_text(model_of(lines))
        name = "model.rscd"
        editor.open(name, model_of(lines))
        editor.findings(name)
        at, first = _typed(editor, name)
        to_findings: list[float] = []
        to_completion: list[float] = []
        place = editor.document(name)
        for _ in range(KEYSTROKES):
            # It is wrong now, and right again.
            for begin, end, new in ((at, at + 1, ""), (at, at, first)):
                changes = editor.changes(name, (begin, end, new))
                start_s = time.perf_counter()
                editor.send(name, changes)
                editor.findings(name)
                to_findings.append(time.perf_counter() - start_s)
                editor.run(asyncio.sleep(to_findings[-1]))
            parameters = lsp.CompletionParams(place, editor.position(editor.texts[name], at))
            changes = editor.changes(name, (at, at + 1, first))
            start_s = time.perf_counter()
            editor.send(name, changes)
            found = editor.run(editor.client.text_document_completion_async(parameters))
            to_completion.append(time.perf_counter() - start_s)
            assert found.items
            editor.findings(name)
            editor.run(asyncio.sleep(to_findings[-1]))
        count = editor.texts[name].count("\n")
        beside = f" beside {neighbours} such files" if neighbours else ""
        return (
            f"{count:,}{beside}",
            *_percentiles(to_findings),
            *_percentiles(to_completion),
            f"{_resident_mb(editor.pid):.0f}",
        )


def _memory() -> str:
    """Return the memory of a server with a text of 1,000 lines, after many edits."""
    with TemporaryDirectory() as folder, ProcessEditor(Path(folder), "--synthesis-seconds", "0") as editor:
        name = "model.rscd"
        editor.open(name, model_of(1_000))
        editor.findings(name)
        at, first = _typed(editor, name)
        found = []
        pair = editor.changes(name, (at, at + 1, "")), editor.changes(name, (at, at, first))
        for number in range(EDITS // 2):
            for changes in pair:
                editor.send(name, changes)
            if not number % (_TOGETHER // 2):
                editor.findings(name)
            if number == EDITS // 20 or number == EDITS // 2 - 1:
                editor.findings(name)
                found.append(_resident_mb(editor.pid))
        return f"memory after {EDITS // 10:,} edits {found[0]:.1f} MB, after {EDITS:,} {found[1]:.1f} MB (1,000 lines)"


def table() -> str:
    """Milliseconds from a keystroke to its findings and to what is offered there, and memory."""
    header = ("lines", "findings, ms", "95 %", "completion, ms", "95 %", "memory, MB")
    rows = [*(_measured(size) for size in SIZES), _measured(1_000, NEIGHBOURS)]
    title = f"language server: from a keystroke (aim: under {AIM_MS} ms at 1,000 lines)"
    return f"{text_table(title, header, rows)}\n{_memory()}"
