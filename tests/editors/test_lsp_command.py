"""The language server as a program: how it starts, and that it ends with its editor."""

import gc
import io
import json
import os
import re
import signal
import subprocess
import sys
import tracemalloc
from pathlib import Path
from typing import Any

import pytest
from lsprotocol import types as lsp

from robosc import __version__
from robosc_lsp import synthesizer
from robosc_lsp.messages import SynthesisRequest
from robosc_lsp.server import make_server
from support.background import children_of, has_ended, is_running
from support.editor import LIMIT_S, Editor, ProcessEditor
from support.hostile_models import bounded_products, products
from support.waiting import eventually, wait_until

COMMAND = (sys.executable, "-m", "robosc_lsp.command")

LONG = products()
"""Synthesis of it takes longer than users wait."""


def run(*arguments: str, given: bytes = b"") -> subprocess.CompletedProcess[bytes]:
    return subprocess.run([*COMMAND, *arguments], input=given, capture_output=True, timeout=LIMIT_S, check=False)


def message(**content: object) -> bytes:
    body = json.dumps({"jsonrpc": "2.0", **content}).encode()
    return b"Content-Length: %d\r\n\r\n" % len(body) + body


def test_help_and_version_are_printed() -> None:
    done = run("--help")
    assert done.returncode == 0 and b"--synthesis-seconds" in done.stdout
    assert run("--version").stdout.decode().strip() == f"robosc-lsp {__version__}"


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (("--synthesis-seconds", "-1"), "--synthesis-seconds"),
        (("--synthesis-seconds", "nan"), "--synthesis-seconds"),
        (("--log-file", "/nowhere/at/all/log"), "/nowhere/at/all/log"),
        (("file.rscd",), "file.rscd"),
    ],
)
def test_wrong_arguments_are_one_error(arguments: tuple[str, ...], why: str) -> None:
    done = run(*arguments)
    assert done.returncode == 2 and not done.stdout
    assert why in done.stderr.decode() and "Traceback" not in done.stderr.decode()


def test_whether_it_can_be_started_is_reported() -> None:
    done = run("--library-path", "/nowhere/at/all", "--check")
    assert done.returncode == 0 and done.stdout.decode() == f"robosc-lsp {__version__} can be started\n"


def test_a_folder_that_is_not_there_holds_no_libraries(tmp_path: Path) -> None:
    with Editor(tmp_path, "--library-path", str(tmp_path / "later")) as editor:
        editor.open("robot.rscd", "robot R { component C from Parts import C }")
        assert "unknown-name" in editor.codes("robot.rscd", lambda codes: bool(codes))
        editor.save("later/parts.rscd", "library Parts { component C { } }")
        assert editor.codes("robot.rscd", lambda codes: codes == ["empty-model"])


@pytest.mark.parametrize(("arguments", "missing"), [((), "pygls"), (("--check",), "lsprotocol")])
def test_without_its_libraries_it_says_how_to_get_them(
    tmp_path: Path, arguments: tuple[str, ...], missing: str
) -> None:
    (tmp_path / missing).mkdir()
    (tmp_path / missing / "__init__.py").write_text(f"raise ModuleNotFoundError(name={missing!r})")
    done = subprocess.run(
        [*COMMAND, *arguments],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        input=b"",
        capture_output=True,
        timeout=LIMIT_S,
        check=False,
    )
    assert done.returncode == 1
    assert done.stderr.decode() == "robosc-lsp: the language server needs pygls: pip install 'robosc[lsp]'\n"


def test_it_ends_when_its_input_does() -> None:
    assert run().returncode == 0


class Written(io.BytesIO):
    """Output of the server, which can still be read when the server has closed it."""

    def close(self) -> None:
        pass


@pytest.mark.parametrize(
    "given",
    [
        b"nonsense\r\n\r\n",
        b"Content-Length: 5\r\n\r\n{not}",
        b"Content-Length: 99999\r\n\r\n{}",
        b"Content-Length: 2\r\n\r\n[]",
        message(id=1, method="textDocument/hover", params={}),
        message(id=1, method="initialize", params={"capabilities": 7}),
        message(method="textDocument/didChange", params={"textDocument": {"uri": 3}}),
        message(id=1, method="no/such/thing"),
    ],
)
def test_nonsense_is_survived(given: bytes) -> None:
    shutdown = message(id=98, method="initialize", params={"capabilities": {}, "processId": None, "rootUri": None})
    given += shutdown + message(id=99, method="shutdown") + message(method="exit")
    written = Written()
    make_server().start_io(io.BytesIO(given), written)
    answered = b'"id": 99' in written.getvalue()
    # The rest is taken for its body there.
    assert answered == (b"99999" not in given), written.getvalue()


INITIALIZE: dict[str, Any] = {"capabilities": {}, "processId": None, "rootUri": None}
PLACE = {"textDocument": {"uri": "file:///a.rscd"}, "position": {"line": 0, "character": 0}}


def test_every_request_gets_a_response() -> None:
    given = [
        message(id=1, method="textDocument/hover", params=PLACE),
        message(id=2, method="initialize", params=INITIALIZE),
        message(id="three", method="textDocument/hover", params={}),
        message(id=4, method="textDocument/hover", params=PLACE),
        message(id=5, method="shutdown"),
        message(id=6, method="textDocument/hover", params=PLACE),
        message(method="exit"),
    ]
    written = Written()
    make_server().start_io(io.BytesIO(b"".join(given)), written)
    bodies = re.findall(rb"\r\n\r\n({.*?})(?=Content-Length|$)", written.getvalue(), re.DOTALL)
    responses = {found["id"]: found for found in map(json.loads, bodies) if "id" in found}
    codes = {name: found.get("error", {}).get("code") for name, found in responses.items()}
    assert codes == {1: -32002, 2: None, "three": -32602, 4: None, 5: None, 6: -32600}


def synthesis_of(editor: ProcessEditor) -> int:
    """The process that synthesizes for an editor's server, once it is there."""
    (child,) = wait_until(lambda: children_of(editor.pid))
    return child


def test_an_edit_ends_the_process_of_a_synthesis(tmp_path: Path) -> None:
    with ProcessEditor(tmp_path) as editor:
        editor.open("long.rscd", LONG)
        child = synthesis_of(editor)
        editor.edit("long.rscd", (0, 0, " "))
        assert eventually(lambda: not is_running(child))
        other = synthesis_of(editor)
    assert not is_running(other)


def test_nothing_of_the_folder_that_is_edited_is_run(tmp_path: Path) -> None:
    for module in ("asyncio", "msgspec", "robosc"):
        (tmp_path / f"{module}.py").write_text("import pathlib; pathlib.Path('was_run').touch(); raise SystemExit")
    with ProcessEditor(tmp_path) as editor:
        editor.open("small.rscd", "robot R { }")
        editor.until(lambda: editor.lenses_refreshed > 0)
        parameters = lsp.CodeLensParams(editor.document("small.rscd"))
        (lens,) = editor.run(editor.client.text_document_code_lens_async(parameters))
        assert lens.command.title == "1 state, supervisor adds conditions to no event"
    assert not (tmp_path / "was_run").exists()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_synthesis_ends_with_its_server(tmp_path: Path, number: signal.Signals) -> None:
    with ProcessEditor(tmp_path) as editor:
        editor.open("long.rscd", LONG)
        child = synthesis_of(editor)
        editor.kill(number)
        assert eventually(lambda: has_ended(child))


def test_a_synthesis_that_takes_too_long_is_given_up(tmp_path: Path) -> None:
    with ProcessEditor(tmp_path, "--synthesis-seconds", "0.5") as editor:
        editor.open("long.rscd", LONG)
        parameters = lsp.CodeLensParams(editor.document("long.rscd"))
        editor.until(lambda: editor.lenses_refreshed > 0)
        # Its process is there for too short a time to be looked for.
        assert children_of(editor.pid) == []
        (lens,) = editor.run(editor.client.text_document_code_lens_async(parameters))
        assert lens.command.title == "synthesis exceeds the time limit of 0.5 s"
        assert "no-supervisor" not in editor.codes("long.rscd")


def test_a_synthesis_takes_no_more_memory_than_it_may(monkeypatch: pytest.MonkeyPatch) -> None:
    request = SynthesisRequest(("small.rscd", bounded_products(4)), ())
    assert synthesizer.outcome(request).states
    monkeypatch.setattr(synthesizer, "_MOST_NODES", 10)
    outcome = synthesizer.outcome(request)
    assert "memory" in outcome.unknown and not outcome.reason and outcome.states is None


def test_nothing_is_kept_of_edits(tmp_path: Path) -> None:
    with Editor(tmp_path, "--synthesis-seconds", "0") as editor:
        editor.open("small.rscd", "robot R { }")

        def kept_after(count: int) -> int:
            for _ in range(count):
                editor.send("small.rscd", editor.changes("small.rscd", (0, 0, " ")))
                editor.send("small.rscd", editor.changes("small.rscd", (0, 1, "")))
            editor.findings("small.rscd")
            gc.collect()
            return tracemalloc.get_traced_memory()[0]

        tracemalloc.start()
        try:
            before = kept_after(50)
            # Some 2.5 kB would be kept of each, if what was begun for it were.
            assert kept_after(200) - before < 100_000
        finally:
            tracemalloc.stop()
