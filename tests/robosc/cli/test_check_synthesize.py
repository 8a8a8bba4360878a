"""`robosc check --synthesize`, and the warnings that only synthesis can give as the commands print them."""

from pathlib import Path
from typing import Any

import pytest

from robosc.cli.main import main
from support.commands import run_json
from support.models import EMPTY, EXAMPLES, UNSUPPORTED

LINE_FOLLOWER = str(EXAMPLES / "line_follower" / "line_follower.rscd")

LIGHTS = """robot R {
    component Lights {
        incoming message red with identifier: "/light", type: none
        incoming message green with identifier: "/light", type: none
        outgoing message button with type: none
        behaviour {
            initial marked state dark { on response from button goto lit }
            marked state lit { }
        }
    }
    requirement green needs Lights.lit
    requirement red needs Lights.dark or Lights.lit
}"""

COMPETING = "'green' and 'red' can both be requested on '/light' after button.response"


@pytest.fixture
def write(tmp_path: Path) -> Any:
    def written(text: str) -> str:
        path = tmp_path / "robot.rscd"
        path.write_text(text, encoding="utf-8")
        return str(path)

    return written


def test_only_with_the_option_check_synthesizes(capsys: pytest.CaptureFixture[str], write: Any) -> None:
    model = write(LIGHTS)
    assert main(["check", "--strict", model]) == 0
    assert capsys.readouterr().out.endswith("no findings\n")
    assert main(["check", "--synthesize", model]) == 0
    captured = capsys.readouterr()
    lines = captured.err.splitlines()
    assert captured.out == ""
    assert lines[0] == f"robot.rscd:4:26: warning: {COMPETING} [competing-requests]"
    assert "robot.rscd:3:26: note: the other one is here" in lines
    assert "robot.rscd:12:5: warning: this requirement never restricts 'red' [unused-requirement]" in lines
    assert lines[-1] == "2 warnings"
    assert main(["check", "--synthesize", "--strict", model]) == 1


def test_json_has_the_findings_and_what_became_of_the_synthesis(capsys: pytest.CaptureFixture[str], write: Any) -> None:
    model = write(LIGHTS)
    status, document = run_json(capsys, "check", "--synthesize", model)
    assert (status, document["status"], document["reason"], document["warnings"]) == (0, "supervisor", "", 2)
    first = document["diagnostics"][0]
    assert (first["code"], first["message"], first["line"]) == ("competing-requests", COMPETING, 4)
    assert [place["line"] for place in first["related"]] == [3]
    status, synthesized = run_json(capsys, "synth", model)
    assert (status, synthesized["diagnostics"]) == (0, document["diagnostics"])
    assert "status" not in run_json(capsys, "check", model)[1]


def test_synth_prints_the_warnings_and_the_exit_status_stays(capsys: pytest.CaptureFixture[str], write: Any) -> None:
    assert main(["synth", write(LIGHTS)]) == 0
    captured = capsys.readouterr()
    assert COMPETING in captured.err
    assert "maximally permissive" in captured.out


@pytest.mark.parametrize("engine", ["cudd", "oxidd", "autoref"])
def test_deployment_and_engine_are_those_of_the_synthesis(
    capsys: pytest.CaptureFixture[str], write: Any, engine: str
) -> None:
    # A layer needs to tell the two messages apart.
    recognized_by_data = LIGHTS.replace('"/light", type: none', '"/light", type: boolean')
    recognized_by_data = recognized_by_data.replace("type: boolean", "type: boolean, when: value", 1)
    model = write(recognized_by_data)
    for deployment, codes in (
        ("controller", ["competing-requests", "unused-requirement"]),
        ("layer", ["unused-requirement"]),
    ):
        options = ["--synthesize", "--engine", engine, "--deployment", deployment]
        _, document = run_json(capsys, "check", *options, model)
        assert [item["code"] for item in document["diagnostics"]] == codes


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (["--engine", "cudd"], "they need --synthesize"),
        (["--deployment", "controller"], "they need --synthesize"),
        (["--synthesize", "--engine", "magic"], "unknown engine 'magic'"),
    ],
)
def test_wrong_use_of_options_of_the_synthesis(
    capsys: pytest.CaptureFixture[str], options: list[str], problem: str
) -> None:
    assert main(["check", LINE_FOLLOWER, *options]) == 2
    assert problem in capsys.readouterr().err


def test_a_robot_without_a_supervisor_fails(capsys: pytest.CaptureFixture[str], write: Any) -> None:
    model = write(EMPTY)
    assert main(["check", model]) == 0
    capsys.readouterr()
    assert main(["check", "--synthesize", model]) == 1
    assert "robot.rscd: no supervisor exists: " in capsys.readouterr().err
    status, document = run_json(capsys, "check", "--synthesize", model)
    assert (status, document["status"]) == (1, "empty")
    assert document["reason"].startswith("no supervisor exists: ")


def test_a_model_beyond_synthesis_fails_and_keeps_its_findings(capsys: pytest.CaptureFixture[str], write: Any) -> None:
    model = write(UNSUPPORTED.replace("on response from", "on response to"))
    status, document = run_json(capsys, "check", "--synthesize", model)
    assert (status, document["status"]) == (1, "unsupported model")
    assert document["reason"]
    assert [item["code"] for item in document["diagnostics"]] == ["wrong-preposition"]
    assert main(["check", "--synthesize", model]) == 1
    assert document["reason"] in capsys.readouterr().err


def test_a_model_with_errors_is_not_synthesized(capsys: pytest.CaptureFixture[str], write: Any) -> None:
    model = write("robot R { requirement go needs Nobody.here }")
    status, document = run_json(capsys, "check", "--synthesize", model)
    assert (status, document["status"], document["errors"]) == (1, "model errors", 2)


def test_a_library_has_nothing_to_synthesize_and_nothing_wrong(capsys: pytest.CaptureFixture[str], write: Any) -> None:
    model = write("library L { component C { incoming message m with type: none } }")
    assert main(["check", "--synthesize", model]) == 0
    assert "a library has no robot" in capsys.readouterr().err


def test_a_file_that_is_no_text_is_an_error_like_any_other(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "robot.rscd"
    path.write_bytes(b"robot \xff")
    plain = run_json(capsys, "check", str(path))
    assert plain[0] == 1
    assert run_json(capsys, "check", "--synthesize", str(path)) == plain
