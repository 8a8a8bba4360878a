"""Automata of files in the Python API: they are loaded as models are, and the same functions take them."""

from pathlib import Path

import pytest

import robosc
from robosc.cli.main import main
from robosc.explanation import EmptyExplanation
from robosc.pipeline.loading import LoadedAutomata
from support.automata_models import BUFFER, DOOR, EMPTY, TANK, TWO_TANKS, WRONG


def automata(text: str, name: str = "tank.cif") -> LoadedAutomata:
    found = robosc.load(text=text, name=name)
    assert isinstance(found, robosc.LoadedAutomata)
    return found


def test_a_file_and_a_text_are_the_same(tmp_path: Path) -> None:
    (tmp_path / "tank.cif").write_text(TANK)
    for given in (tmp_path / "tank.cif", str(tmp_path / "tank.cif"), automata(TANK)):
        assert not robosc.check(given)
        found = robosc.synthesize(given)
        assert isinstance(found, robosc.SystemSynthesis)
        assert found.supervisor is not None
        assert (found.supervisor.system.name, found.supervisor.states) == ("tank", 2)
        assert robosc.explore(given).graph is not None
        assert robosc.verify(given).passed
        assert robosc.explain(given, event="tank.c_fill").status is robosc.SynthesisStatus.SUPERVISOR
        assert list(robosc.generate(given, "cif").files or ()) == ["supervisor.cif"]


@pytest.mark.parametrize(("text", "name"), [(BUFFER, "line.gen"), (DOOR, "door.wmod")])
def test_plain_automata(text: str, name: str) -> None:
    assert robosc.synthesize(automata(text, name)).supervisor is not None


def test_imports_are_found_from_the_folder_of_a_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "tank.cif").write_text(TANK)
    monkeypatch.chdir(tmp_path)
    model = automata('import "parts/tank.cif";', "main.cif")
    assert [file.name for file in model.files] == ["main.cif", "parts/tank.cif"]
    assert not robosc.check(model)


def test_findings_are_reported_with_their_lines() -> None:
    model = automata(WRONG)
    for found in (robosc.synthesize(model), robosc.explore(model), robosc.explain(model)):
        assert found.status is robosc.SynthesisStatus.MODEL_ERRORS
        assert [item.code for item in found.diagnostics] == ["cif-unknown-name"]
        assert "  |   disc int[0..3] level = n;" in str(found)
    assert robosc.check(model).has_errors
    verified = robosc.verify(model)
    assert (verified.status, verified.report["status"]) == (robosc.VerificationStatus.NO_SUPERVISOR, "model errors")


def test_what_is_to_blame_is_reported() -> None:
    model = automata(EMPTY)
    assert isinstance(robosc.synthesize(model).explanation, EmptyExplanation)
    assert isinstance(robosc.generate(model, "cif").explanation, EmptyExplanation)
    assert robosc.verify(model).report["explanation"]["blamed"]


def test_modules_and_beginnings() -> None:
    made = robosc.synthesize(automata(TWO_TANKS), is_modular=True).supervisor
    assert made is not None
    assert len(made.modules) == 2
    several = automata(TANK.replace("= 1;", "in any;"))
    assert robosc.generate(several, "python").status is robosc.SynthesisStatus.UNSUPPORTED_MODEL
    assert robosc.generate(several, "python", initial="tank.level = 1").files is not None
    with pytest.raises(robosc.RequestError, match="did you mean"):
        robosc.generate(several, "python", initial="tank.levl = 1")


def test_what_is_of_robots_is_refused(tmp_path: Path) -> None:
    model = automata(TANK)
    for options in (
        robosc.SynthesisOptions(deployment=robosc.Deployment.LAYER),
        robosc.SynthesisOptions(allow_livelock=True),
        robosc.SynthesisOptions(verified_states=3),
    ):
        with pytest.raises(ValueError, match=r"is for models of robots, and tank\.cif holds automata"):
            robosc.synthesize(model, options)
    with pytest.raises(TypeError, match="automata are verified by themselves"):
        robosc.verify(model, "invariant true")
    with pytest.raises(TypeError, match="library_paths, interface_paths and distribution are for"):
        robosc.load(text=TANK, name="tank.cif", library_paths=[tmp_path])
    robot = robosc.load(text="robot R { component C { incoming message m with type: none } }")
    with pytest.raises(TypeError, match="a robot begins in one state"):
        robosc.generate(robot, "python", initial="C = a")
    made = robosc.synthesize(model).supervisor
    assert made is not None
    with pytest.raises(TypeError, match="give the automata"):
        robosc.generate(made, "python", initial="tank.level = 1")


def test_a_notebook_shows_the_text() -> None:
    assert automata(TANK)._repr_markdown_() == f"```\n{TANK.rstrip()}\n```\n"


BLIND = """plant lane:
  controllable c_in, c_out; uncontrollable u_slip;
  location free: initial; marked; edge c_in goto full; edge c_out;
  location full: edge c_out goto free; edge u_slip goto lost;
  location lost: marked; edge c_out goto free;
end
requirement invariant not lane.lost;
"""


def test_what_the_supervisor_always_forbids_is_a_warning(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "lane.cif"
    path.write_text(BLIND)
    assert robosc.check(path) == ()
    (found,) = robosc.synthesize(path).diagnostics
    assert (found.code, found.location and (found.location.line, found.location.column)) == ("never-enabled", (2, 16))
    assert found.message.startswith("'lane.c_in' can never happen: the supervisor forbids it")
    # In modules, too; not where something keeps it possible, and not of what plants or requirements never allow.
    assert robosc.synthesize(path, is_modular=True).diagnostics == (found,)
    for change in (("edge u_slip goto lost;", "edge u_slip;"), ("not lane.lost", "not lane.full")):
        path.write_text(BLIND.replace(*change))
        assert [item.code for item in robosc.synthesize(path).diagnostics] == (
            ["never-enabled"] if "full" in change[1] else []
        )
    path.write_text(BLIND)
    assert main(["check", str(path), "--synthesize"]) == 0
    assert "[never-enabled]" in capsys.readouterr().err
    assert main(["check", str(path), "--synthesize", "--strict"]) == 1
