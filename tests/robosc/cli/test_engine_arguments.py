"""`--engine`, `--reorder`, `--max-nodes` and `--condition-seconds` of the commands that synthesize."""

import json
from pathlib import Path
from typing import Any

import pytest

from robosc.cli.main import main
from support.models import EXAMPLES

NAVIGATION = str(EXAMPLES / "navigation" / "navigation.rscd")


def outcome(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    assert main(["synth", NAVIGATION, "--json", *arguments]) == 0
    return json.loads(capsys.readouterr().out)["summary"]


def test_reordering_and_enough_nodes_change_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    plain = outcome(capsys)
    assert outcome(capsys, "--reorder") == plain
    assert outcome(capsys, "--max-nodes", "100000") == plain


def test_the_time_of_conditions_is_limited(capsys: pytest.CaptureFixture[str]) -> None:
    plain, hasty = outcome(capsys), outcome(capsys, "--condition-seconds", "0")
    assert outcome(capsys, "--condition-seconds", "1e9") == plain
    assert hasty["added"].keys() == plain["added"].keys()
    assert len(str(hasty["added"])) > len(str(plain["added"]))
    assert hasty["certificate"]["maximally_permissive"] == plain["certificate"]["maximally_permissive"] == "passed"


@pytest.mark.parametrize(
    ("option", "words", "problem"),
    [
        ("--condition-seconds", ("-1", "nan", "soon"), "invalid time value: '{word}'"),
        ("--max-nodes", ("0", "-1", "many"), "is not a number from 1 on"),
    ],
)
def test_a_limit_that_is_no_such_number_is_wrong_use(
    capsys: pytest.CaptureFixture[str], option: str, words: tuple[str, ...], problem: str
) -> None:
    for word in words:
        with pytest.raises(SystemExit) as caught:
            main(["synth", NAVIGATION, f"{option}={word}"])
        assert caught.value.code == 2
        assert problem.format(word=word) in capsys.readouterr().err


@pytest.mark.parametrize("command", [["synth"], ["explore"], ["check", "--synthesize"]])
@pytest.mark.parametrize("engine", ["auto", "oxidd", "autoref"])
def test_too_few_nodes_end_it(capsys: pytest.CaptureFixture[str], command: list[str], engine: str) -> None:
    assert main([*command, NAVIGATION, "--max-nodes", "50", "--engine", engine]) == 1
    captured = capsys.readouterr()
    assert captured.err == "robosc: BDD node limit 50 exceeded; raise it with --max-nodes\n"


@pytest.mark.parametrize("reason", ["the decision diagrams were refused memory", ""])
def test_memory_that_is_refused_ends_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, reason: str
) -> None:
    def refused(name: str) -> None:
        raise MemoryError(reason)

    monkeypatch.setattr("robosc.synthesis.workspace.make_manager", refused)
    assert main(["synth", NAVIGATION]) == 1
    assert capsys.readouterr().err == f"robosc: {reason or 'there is not enough memory'}\n"


@pytest.mark.parametrize("option", [["--reorder"], ["--max-nodes", "5"]])
def test_without_synthesis_there_is_nothing_to_limit(capsys: pytest.CaptureFixture[str], option: list[str]) -> None:
    assert main(["check", NAVIGATION, *option]) == 2
    assert "they need --synthesize" in capsys.readouterr().err


def test_the_model_itself_is_not_written_to(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "robot.rscd"
    text = Path(NAVIGATION).read_bytes()
    model.write_bytes(text)
    assert main(["synth", str(model), "-o", str(tmp_path / "." / "robot.rscd")]) == 2
    assert "is the model itself" in capsys.readouterr().err
    assert model.read_bytes() == text
