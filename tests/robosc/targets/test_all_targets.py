"""All targets at once: what each gives alone, in folders, and what refuses is reported."""

import json
import re
from itertools import pairwise
from pathlib import Path

import pytest

from robosc.certification import SynthesisOutcome, make_supervisor
from robosc.cli.main import main
from robosc.errors import Severity, UnsupportedModelError
from robosc.model.structure import Deployment
from robosc.targets import (
    ALL,
    GeneratedFiles,
    GenerateOptions,
    TargetInfo,
    TargetRefusal,
    UnknownTargetError,
    available_targets,
    generate,
    generate_or_refuse,
    register,
    registry,
    require_generatable,
    targets_left_out,
)
from robosc.targets.all_targets import _cell
from robosc.targets.registry import Target
from support.generated import example_supervisor
from support.models import bundle_of

EXAMPLES = Path(__file__).parents[3] / "examples"
LINE_FOLLOWER = EXAMPLES / "line_follower" / "line_follower_layer.rscd"
MAZE = EXAMPLES / "maze_solver" / "maze_solver.rscd"

SPACES = """robot Spaces {
    component Arm {
        incoming message lift with identifier: "with spaces", type: none
        behaviour { initial marked state there { on request to lift } }
    }
}"""


pytestmark = pytest.mark.usefixtures("own_registry")


def outcome_of(text: str) -> SynthesisOutcome:
    return make_supervisor(bundle_of(text), deployment=Deployment.CONTROLLER)


def files_of(outcome: SynthesisOutcome, target: str) -> GeneratedFiles:
    found = generate_or_refuse(outcome.supervisor, outcome.diagnostics, target)
    assert isinstance(found, GeneratedFiles)
    return found


def refusing(name: str) -> None:
    """A target that refuses every model."""

    def refuse(supervisor: object, options: GenerateOptions) -> GeneratedFiles:
        raise UnsupportedModelError("no | model\nwill do")

    register(Target(TargetInfo(name, "picky"), refuse))


@pytest.mark.parametrize("deployment", Deployment)
@pytest.mark.parametrize("name", [info.name for info in available_targets()])
def test_a_blank_line_parts_each_heading_of_a_page_from_what_is_before(name: str, deployment: Deployment) -> None:
    made = make_supervisor(bundle_of(LINE_FOLLOWER.read_text(encoding="utf-8")), deployment=deployment)
    assert made.supervisor is not None
    for path, text in generate(made.supervisor, name).items():
        if path.endswith(".md"):
            lines = text.splitlines()
            crowded = [line for before, line in pairwise(lines) if before and re.match("#+ [A-Z]", line)]
            assert not crowded, f"{path}: {crowded}"


def test_each_target_gives_what_it_gives_alone() -> None:
    outcome = outcome_of(MAZE.read_text(encoding="utf-8"))
    files = files_of(outcome, ALL)
    assert outcome.supervisor is not None
    expected = {"README.md"}
    for info in available_targets():
        alone = generate(outcome.supervisor, info.name)
        expected |= {f"{info.name}/{path}" for path in alone}
        assert {path: files[f"{info.name}/{path}"] for path in alone} == dict(alone)
        assert {f"{info.name}/{path}" for path in alone.executables} <= files.executables
    assert set(files) == expected
    assert targets_left_out(files, ALL) == ()
    assert files_of(outcome, ALL) == files


STRICT = """robot Strict {
    component Arm {
        incoming message lift with type: none
        outgoing message lowered with type: none
        behaviour {
            variable lifts: integer(0..9)
            initial marked state down { on request to lift goto up }
            state up { on response from lowered do lifts := lifts + 1 goto down }
        }
    }
    component Lid {
        incoming message open with type: none
        outgoing message shut with type: none
        behaviour {
            initial marked state closed { on request to open goto opened }
            state opened { on response from shut goto closed }
        }
    }
    requirement {lift, open} needs Arm.lifts < 9
    requirement Arm.up or Arm.lifts = 7 disables open
    requirement never Arm.up and Lid.opened
    requirement always Arm.lifts <= 8
}"""


@pytest.mark.parametrize("name", [info.name for info in available_targets() if info.name not in ("cif", "ros2-msgs")])
def test_every_target_writes_every_requirement(name: str) -> None:
    """Only in CIF they are no words but statements of the model itself, and messages are of no model."""
    files = files_of(outcome_of(STRICT), name)
    requirements = [line.strip() for line in STRICT.splitlines() if line.strip().startswith("requirement ")]
    pages = [text for path, text in files.items() if path.endswith("README.md")] or ["\n".join(files.values())]
    for page in pages:
        shown = {line.strip(" /*#") for line in page.splitlines()}
        assert [text for text in requirements if text not in shown] == []


@pytest.mark.parametrize("name", [info.name for info in available_targets()])
@pytest.mark.parametrize("robot", ["maze_solver/maze_solver", "line_follower/line_follower"])
def test_the_same_supervisor_gives_the_same_bytes(name: str, robot: str) -> None:
    again = example_supervisor.__wrapped__(robot, Deployment.CONTROLLER)
    assert generate(example_supervisor(robot), name) == generate(again, name)


def test_a_target_that_refuses_is_left_out_and_reported() -> None:
    refusing("cobol")
    files = files_of(outcome_of(MAZE.read_text(encoding="utf-8")), ALL)
    assert targets_left_out(files, ALL) == ("cobol",)
    assert "| cobol | picky | not generated: no \\| model will do |" in files["README.md"].splitlines()
    assert targets_left_out(files, "cif") == ()


def test_what_a_terminal_would_obey_is_escaped_in_the_page() -> None:
    shown = _cell("no \x1b]0;mine\x07 and \u202ebackwards |")
    assert shown == "no \\x1b]0;mine\\x07 and \\u202ebackwards \\|"
    assert shown.isprintable()


def test_an_error_of_one_target_leaves_out_that_one() -> None:
    outcome = outcome_of(SPACES)
    refusal = generate_or_refuse(outcome.supervisor, outcome.diagnostics, "ros2")
    assert isinstance(refusal, TargetRefusal)
    assert refusal.target == "ros2"
    assert [item.code for item in refusal.diagnostics if item.severity is Severity.ERROR] == ["invalid-identifier"]
    assert all(item.severity is not Severity.ERROR for item in outcome.diagnostics)
    files = files_of(outcome, ALL)
    assert "ros2" in targets_left_out(files, ALL)
    assert "python" not in targets_left_out(files, ALL)
    assert "[invalid-identifier]" in files["README.md"]


def test_where_every_target_refuses_there_is_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "_BUILT_IN", {})
    refusing("cobol")
    with pytest.raises(UnsupportedModelError, match="no target can do this model"):
        files_of(outcome_of(MAZE.read_text(encoding="utf-8")), ALL)


def test_names() -> None:
    require_generatable(ALL)
    with pytest.raises(UnknownTargetError):
        require_generatable("every")


def test_without_a_supervisor_there_are_no_files() -> None:
    outcome = outcome_of("robot R { nonsense }")
    assert outcome.supervisor is None
    assert generate_or_refuse(outcome.supervisor, outcome.diagnostics, ALL) is None


def test_the_command_reports_what_is_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    refusing("cobol")
    assert main(["generate", str(MAZE), "--target", "all", "-o", str(tmp_path)]) == 0
    out, err = capsys.readouterr()
    assert f"{tmp_path / 'README.md'}\n" in out
    assert "not generated: cobol; README.md says why\n" in err
    assert main(["generate", str(MAZE), "--target", "all", "-o", str(tmp_path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["left_out"] == ["cobol"]


def test_a_target_that_refuses_now_leaves_nothing_of_an_earlier_model(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    spaces = tmp_path / "spaces.rscd"
    spaces.write_text(SPACES, encoding="utf-8")
    assert main(["generate", str(MAZE), "--target", "all", "-o", str(out)]) == 0
    assert "is removed" not in (out / "README.md").read_text(encoding="utf-8")
    (out / "ros2" / "README.md").write_text("mine", encoding="utf-8")
    capsys.readouterr()
    assert main(["generate", str(spaces), "--target", "all", "-o", str(out)]) == 0
    err = capsys.readouterr().err
    assert [path for path in (out / "ros2").rglob("*") if path.is_file()] == [out / "ros2" / "README.md"]
    assert f"removed, because it was of an earlier model: {out / 'ros2' / 'package.xml'}\n" in err
    assert (
        f"not removed, because changed since generated; it is of an earlier model: {out / 'ros2' / 'README.md'}" in err
    )
    assert "now is removed" in (out / "README.md").read_text(encoding="utf-8")
    assert (out / "python").is_dir()
    assert main(["generate", str(spaces), "--target", "all", "-o", str(out), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["removed"], document["kept"]) == ([], [str(out / "ros2" / "README.md")])
