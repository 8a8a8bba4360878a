"""`robosc key`, `robosc sign` and `robosc verify --signed-by` as a user runs them."""

import json
from pathlib import Path

import pytest

from robosc.cli.main import main
from support.models import EXAMPLES

MODEL = str(EXAMPLES / "maze_solver" / "maze_solver.rscd")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a supervisor and a key pair, to work in."""
    monkeypatch.chdir(tmp_path)
    assert main(["synth", MODEL, "-o", "maze.rsup"]) == 0
    assert main(["key", "ours", "--comment", "the lab"]) == 0
    return tmp_path


def test_a_supervisor_is_signed_and_the_signature_found_right(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sign", "maze.rsup", "--key", "ours.key"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "maze.rsup.sig: signature of a controller for MazeSolver"
    assert main(["verify", "maze.rsup", "--signed-by", "ours.pub"]) == 0
    assert capsys.readouterr().out.startswith("maze.rsup: signed by the lab (SHA256:")
    assert main(["verify", "maze.rsup", MODEL, "--signed-by", "ours.pub"]) == 0
    signed, passed, *_ = capsys.readouterr().out.splitlines()
    assert signed.startswith("maze.rsup: signed by the lab")
    assert passed == f"maze.rsup: passed: a right supervisor of {MODEL}"


def test_for_machines(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    assert main(["key", "more", "--json"]) == 0
    made = json.loads(capsys.readouterr().out)
    assert (made["private"], made["public"]) == ("more.key", "more.pub")
    assert main(["sign", "maze.rsup", "--key", "more.key", "--json"]) == 0
    output = json.loads(capsys.readouterr().out)
    assert output == {"file": "maze.rsup.sig", "model": "MazeSolver", "deployment": "controller"}
    assert main(["verify", "maze.rsup", "--signed-by", "ours.pub", "--signed-by", "more.pub", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found == {
        "status": "signed", "model": "MazeSolver", "deployment": "controller", "signed_by": made["fingerprint"],
    }  # fmt: skip
    assert main(["verify", "maze.rsup", MODEL, "--signed-by", "ours.pub", "--json"]) == 1
    assert "is not a trusted key" in json.loads(capsys.readouterr().out)["reason"]


def test_a_changed_file_fails_with_and_without_its_model(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sign", "maze.rsup", "--key", "ours.key"]) == 0
    with (folder / "maze.rsup").open("ab") as file:
        file.write(b" ")
    for model in ([], [MODEL]):
        capsys.readouterr()
        assert main(["verify", "maze.rsup", *model, "--signed-by", "ours.pub"]) == 1
        output = capsys.readouterr()
        assert (output.out, output.err.count("\n")) == ("", 1)
        assert "the signature of the lab (SHA256:" in output.err
        assert "has been changed" in output.err
    assert main(["verify", "maze.rsup", MODEL]) == 0


@pytest.mark.parametrize(
    ("arguments", "status", "problem"),
    [
        (["key", "ours"], 2, "cannot write ours.key: File exists"),
        (["key", "none/ours"], 2, "cannot write none/ours.key: No such file or directory"),
        (["key", "new", "--comment", "a\nb"], 2, "the comment of a key must be one printable line"),
        (["sign", "maze.rsup", "--key", "none.key"], 2, "cannot read none.key: No such file or directory"),
        (["sign", "none.rsup", "--key", "ours.key"], 2, "cannot read none.rsup: No such file or directory"),
        (["sign", "ours.pub", "--key", "ours.key"], 1, "the supervisor file is not UTF-8 JSON"),
        (["sign", "maze.rsup", "--key", "ours.pub"], 1, "ours.pub: others may read this private key"),
        (["verify", "maze.rsup", "--signed-by", "none.pub"], 2, "cannot read none.pub"),
        (["verify", "maze.rsup", "--signed-by", "ours.pub"], 2, "cannot read maze.rsup.sig"),
        (["verify", "maze.rsup", "--signed-by", "maze.rsup"], 1, "maze.rsup: no public key"),
        (["verify", MODEL, "--signed-by", "ours.pub", "--property", "reachable true"], 2, "--signed-by"),
        (["verify", "maze.rsup", "--signed-by", "ours.pub", "--property", "reachable true"], 2, "needs its model"),
    ],
)
def test_what_cannot_be_is_one_clear_message(
    folder: Path, arguments: list[str], status: int, problem: str, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert main(arguments) == status
    output = capsys.readouterr().err
    assert problem in output
    assert output.count("\n") == 1
    assert not (folder / "new.key").exists()


def test_a_signature_does_not_make_up_for_another_deployment(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sign", "maze.rsup", "--key", "ours.key"]) == 0
    assert main(["verify", "maze.rsup", "--signed-by", "ours.pub", "--deployment", "layer"]) == 1
    assert "made for the deployment controller, not layer" in capsys.readouterr().err
