"""`robosc explain` as a user runs it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from robosc.cli.main import main
from robosc.diagnostics import codes, document, page


def printed(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(["explain", *arguments]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    return captured.out


@pytest.mark.parametrize("asked", ["unknown-name", "[unknown-name]", "Unknown-Name"])
def test_a_code_is_explained_as_it_is_printed_or_typed(capsys: pytest.CaptureFixture[str], asked: str) -> None:
    assert printed(capsys, asked) == page("unknown-name").markdown


def test_the_list_has_a_line_for_each_code(capsys: pytest.CaptureFixture[str]) -> None:
    lines = printed(capsys, "--list").splitlines()
    assert [line.split()[0] for line in lines] == list(codes())
    for line in lines:
        found = page(line.split()[0])
        assert line.split()[1] == found.severity
        assert line.endswith(found.summary)


def test_all_is_the_document(capsys: pytest.CaptureFixture[str]) -> None:
    assert printed(capsys, "--all") == document()


def test_json(capsys: pytest.CaptureFixture[str]) -> None:
    one = json.loads(printed(capsys, "import-cycle", "--json"))
    assert list(one) == ["code", "severity", "stage", "summary", "markdown", "example", "fixed", "see_also"]
    assert (one["code"], one["severity"], one["stage"]) == ("import-cycle", "error", "model")
    assert [block["library"] for block in one["example"]] == [None, "Platforms", "Wheels"]
    assert [block["lines"] for block in one["example"]] == [[], [2], []]
    listed = json.loads(printed(capsys, "--list", "--json"))["codes"]
    assert [item["code"] for item in listed] == list(codes())
    assert set(listed[0]) == {"code", "severity", "stage", "summary"}
    everything = json.loads(printed(capsys, "--all", "--json"))["codes"]
    assert next(item for item in everything if item["code"] == "import-cycle") == one


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("unknown-nam", "there is no diagnostic code 'unknown-nam'; did you mean 'unknown-name'?"),
        ("duplicated-state", "did you mean 'duplicate-state'?"),
        ("zzz", "'robosc explain --list' lists them"),
        ("", "there is no diagnostic code ''"),
        ("../pages/unknown-name", "there is no diagnostic code"),
    ],
)
def test_an_unknown_code_is_one_line_and_status_2(capsys: pytest.CaptureFixture[str], code: str, words: str) -> None:
    assert main(["explain", code]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    (line,) = captured.err.splitlines()
    assert line.startswith("robosc: ")
    assert words in line


@pytest.mark.parametrize("arguments", [[], ["--list", "--all"], ["unknown-name", "--all"], ["a", "b"]])
def test_just_one_thing_is_asked_for(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as raised:
        main(["explain", *arguments])
    assert raised.value.code == 2
    assert "usage: robosc" in capsys.readouterr().err


def test_an_explanation_loads_no_more_than_it_needs() -> None:
    code = (
        "import sys; from robosc.cli.main import main; main(['explain', 'unknown-name']);"
        "print([m for m in ('dd', 'jinja2', 'robosc.synthesis', 'robosc.execution') if m in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert result.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize("is_terminal", [False, True])
def test_on_a_terminal_check_says_where_to_read_more(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, is_terminal: bool
) -> None:
    path = tmp_path / "empty.rscd"
    path.write_text("", encoding="utf-8")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: is_terminal)
    assert main(["check", str(path)]) == 1
    closing = "1 error (more about a code: robosc explain CODE)" if is_terminal else "1 error"
    assert capsys.readouterr().err.splitlines()[-1] == closing
