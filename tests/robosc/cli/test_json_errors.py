"""With `--json`, wrong use and failures are one JSON document, too; messages and exit statuses are as without it."""

import argparse
import json
from pathlib import Path
from typing import Any

import pytest

from robosc.cli.arguments import Parser
from robosc.cli.main import guarded, main, make_parser
from robosc.cli.output import ExitCode
from robosc_client.main import main as client_main
from robosc_client.main import make_parser as make_client_parser
from support.interrupts import interrupt_without_its_lock
from support.models import EXAMPLES

LINE_FOLLOWER = str(EXAMPLES / "line_follower" / "line_follower.rscd")
WRONG_USE: dict[str, list[str]] = {
    "new": ["1nvalid"],
    "check": ["none.rscd"],
    "format": ["none.rscd"],
    "synth": ["none.rscd"],
    "simulate": [LINE_FOLLOWER, "--events", "none.txt"],
    "verify": [LINE_FOLLOWER],
    "explore": ["none.rscd"],
    "generate": [LINE_FOLLOWER, "--target", "pascal", "-o", "out"],
    "explain-synthesis": ["none.rscd"],
    "explain": ["nothing-like-it"],
    "doc": ["none.rscd"],
    "key": ["no/such/folder/lab"],
    "sign": ["none.rsup", "--key", "none.key"],
    "plot": ["none.jsonl"],
    "check-log": ["none.jsonl", "--model", LINE_FOLLOWER],
    "convert-log": ["none.jsonl"],
    "doctor": ["--server", "no host"],
}
"""For each command arguments that its parser takes, but that are wrong."""

CLIENT = [
    "bench", "cancel", "check", "explain-synthesis", "explore", "format", "generate", "get", "health", "list", "synth",
    "targets", "top", "verify", "version", "watch",
]  # fmt: skip
"""The commands of `robosc-client` with `--json`; `submit` and `profile` have commands of their own."""


def commands(parser: Parser) -> dict[str, argparse.ArgumentParser]:
    """The commands that have `--json`."""
    (found,) = (item for item in parser._actions if isinstance(item, argparse._SubParsersAction))
    return {name: item for name, item in found.choices.items() if "--json" in item._option_string_actions}


def error_of(text: str) -> dict[str, Any]:
    document = json.loads(text)
    assert list(document) == ["error"]
    assert isinstance(document["error"], dict)
    return document["error"]


def test_every_command_with_json_is_tested() -> None:
    assert sorted(WRONG_USE) == sorted(commands(make_parser()))
    assert sorted(commands(make_client_parser())) == CLIENT


@pytest.mark.parametrize("command", WRONG_USE)
def test_wrong_use(
    command: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    status = main([command, *WRONG_USE[command]])
    plain = capsys.readouterr()
    assert (status != 0, plain.out) == (True, "")
    assert main([command, *WRONG_USE[command], "--json"]) == status
    found = capsys.readouterr()
    assert found.err == plain.err
    error = error_of(found.out)
    assert error["status"] == status
    assert found.err.splitlines()[0] == f"robosc: {error['message']}"


@pytest.mark.parametrize("command", [*WRONG_USE, *(f"client {name}" for name in CLIENT)])
def test_arguments_that_the_parser_refuses(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    *client, name = command.split()
    run = client_main if client else main

    def refused(*more: str) -> Any:
        with pytest.raises(SystemExit) as caught:
            run([name, "--nonsense", *more])
        assert caught.value.code == 2
        return capsys.readouterr()

    plain, found = refused(), refused("--json")
    assert plain.out == ""
    assert found.err == plain.err
    error = error_of(found.out)
    assert error["status"] == 2
    assert found.err.rstrip().endswith(f"error: {error['message']}")
    # After `--` it is no option.
    assert refused("--", "--json").out == ""


def test_help_is_no_error(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["check", "--json", "--help"])
    assert caught.value.code == 0
    assert capsys.readouterr().out.startswith("usage: robosc check")


@pytest.mark.parametrize("command", ["synth", "doc", "explore", "explain-synthesis", "generate"])
def test_a_model_with_errors(command: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Check that a command, whatever it makes of the model, prints one document, with the findings."""
    path = tmp_path / "broken.rscd"
    path.write_text("robot R {\n  requirement go needs Nobody.here\n}\n", encoding="utf-8")
    more = ["-o", str(tmp_path / "out"), "--target", "python"] if command == "generate" else []
    assert main([command, str(path), "--json", *more]) == 1
    document = json.loads(capsys.readouterr().out)
    document = document.get("error", document)
    assert [item["code"] for item in document["diagnostics"]] == ["unknown-name"] * document["errors"]


def test_a_text_that_cannot_be_a_model(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "binary.rscd"
    path.write_bytes(b"\xff\xfe\x00")
    assert main(["explore", str(path)]) == 1
    plain = capsys.readouterr()
    assert main(["explore", str(path), "--json"]) == 1
    found = capsys.readouterr()
    assert json.loads(found.out)
    assert plain.out == ""


def test_an_interrupt_that_comes_out_as_another_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert guarded("robosc", interrupt_without_its_lock, as_json=True) == ExitCode.INTERRUPTED
    assert error_of(capsys.readouterr().out)["message"] == "interrupted"


def test_a_server_that_is_not_there(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["check", LINE_FOLLOWER, "--server", "127.0.0.1:1", "--deadline", "5"]
    assert client_main(arguments) == 3
    plain = capsys.readouterr()
    assert client_main([*arguments, "--json"]) == 3
    found = capsys.readouterr()
    assert (plain.out, found.err) == ("", plain.err)
    assert error_of(found.out)["status"] == 3


@pytest.mark.parametrize(
    ("fault", "status", "message"),
    [
        (KeyboardInterrupt(), ExitCode.INTERRUPTED, "interrupted"),
        (
            OSError(28, "No space left on device", "out/x"),
            ExitCode.USAGE,
            "cannot write out/x: No space left on device",
        ),
    ],
)
def test_what_ends_a_command_from_outside(
    fault: BaseException, status: ExitCode, message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    def run() -> int:
        raise fault

    assert guarded("robosc", run, as_json=True) == status
    found = capsys.readouterr()
    assert (found.err, error_of(found.out)) == (f"robosc: {message}\n", {"status": int(status), "message": message})
