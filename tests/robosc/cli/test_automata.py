"""CIF models on the command line."""

import io
import json
from pathlib import Path

import pytest

from robosc import exploration
from robosc.cli.main import main

TANK = """plant tank:
  controllable c_fill; uncontrollable u_drain;
  disc int[0..3] level in any;
  location:
    initial; marked;
    edge c_fill do level := level + 1;
    edge u_drain when level > 1 do level := level - 1;
end
requirement tank.u_drain needs tank.level != 3;
"""


@pytest.fixture
def model(tmp_path: Path) -> str:
    path = tmp_path / "tank.cif"
    path.write_text(TANK)
    return str(path)


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    status = main(list(arguments))
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def test_check(model: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(capsys, "check", model) == (0, f"{model}: no findings\n", "")
    assert run(capsys, "check", model, "--synthesize")[0] == 0
    Path(model).write_text(f"{TANK}requirement x needs y;\nmarked false;\n")
    status, out, err = run(capsys, "check", model, "--json")
    assert (status, err) == (1, "")
    assert [item["code"] for item in json.loads(out)["diagnostics"]] == ["cif-unknown-name", "cif-unknown-name"]
    assert "  | requirement x needs y;\n  |             ^" in run(capsys, "check", model)[2]


def test_a_model_without_a_supervisor(model: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path(model).write_text(f"{TANK}marked false;\n")
    assert run(capsys, "check", model)[0] == 0
    for command in (["check", "--synthesize"], ["synth"], ["explore"], ["verify"]):
        status, out, err = run(capsys, *command, model)
        assert status == 1
        assert "no supervisor exists" in err
        status, out, _ = run(capsys, *command, model, "--json")
        assert (status, json.loads(out)["status"]) == (1, "empty")


def test_what_is_to_blame_is_reported(model: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path(model).write_text(TANK.replace("when level > 1", "").replace("level in any", "level = 1"))
    sentences = [
        "trouble:",
        "  from an initial state tank.u_drain, tank.u_drain can follow, and nothing can prevent it",
    ]
    for command in ("synth", "explain-synthesis"):
        status, out, err = run(capsys, command, model)
        assert (status, "no supervisor exists" in out + err) == (1, True)
        lines = (out + err).splitlines()
        assert lines[-4:] == [
            "    tank.u_drain can take tank.level, which is 0, out of its range",
            "to blame: this alone leaves no supervisor",
            "  tank.cif:1:7: the range of tank.level: int[0..3]",
            "there is a supervisor without it",
        ]
    assert sentences[0] in lines
    document = json.loads(run(capsys, "synth", model, "--json")[1])
    assert document["explanation"]["blamed"][0]["part"]["location"]["line"] == 1
    document = json.loads(run(capsys, "explain-synthesis", model, "--json")[1])
    assert (document["status"], document["explanation"]["empty"]["is_minimal"]) == ("empty", True)


def test_what_restricts_events_is_explained(model: str, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = run(capsys, "explain-synthesis", model, "--event", "tank.c_fill")
    assert (status, err) == (0, "")
    assert out.splitlines() == [
        "tank.c_fill: restricted",
        "  synthesis forbids it, because of what can follow; for instance in an initial state",
        "    it leads into trouble at once:",
        "      there: tank.level = 3",
        "      tank.u_drain cannot be prevented, against 'requirement tank.u_drain needs tank.level != 3'",
    ]
    status, out, _ = run(capsys, "explain-synthesis", model, "--state", "tank.level = 0")
    assert out.splitlines()[-2:] == [
        "tank.u_drain (uncontrollable): cannot happen",
        "  in tank tank.level > 1 is not true (tank.cif:1:7)",
    ]
    document = json.loads(run(capsys, "explain-synthesis", model, "--json")[1])
    assert (document["status"], document["explanation"]["is_of_automata"]) == ("supervisor", True)
    assert run(capsys, "explain-synthesis", model, "--event", "x")[0] == 2
    Path(model).write_text(f"{TANK}marked x;\n")
    assert json.loads(run(capsys, "explain-synthesis", model, "--json")[1])["status"] == "model errors"


def test_synth(model: str, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = run(capsys, "synth", model)
    assert (status, err) == (0, "")
    assert out.splitlines()[0] == "tank: a supervisor exists (3 states)"
    assert "c_fill needs" in out
    assert "begins only where" in out
    document = json.loads(run(capsys, "synth", model, "--json")[1])
    assert (document["states"], list(document["conditions"])) == (3, ["tank.c_fill"])


def test_figures_of_the_synthesis(model: str, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = run(capsys, "synth", model, "--statistics")
    assert status == 0
    lines = [line.split(maxsplit=1) for line in out.splitlines()[-11:]]
    assert ["search", "backwards"] in lines
    assert any(line[0] == "race" and line[1].startswith("backwards, ") and line[1].endswith(" won") for line in lines)
    assert ["rounds", "1"] in lines
    status, out, _ = run(capsys, "synth", model, "--json", "--statistics")
    found = json.loads(out)["statistics"]
    assert (found["search"], found["state_bits"], found["iterations"]) == ("backwards", 2, 1)
    (strategy,) = found["race"]
    assert (strategy["order"], strategy["search"], strategy["won"]) == (found["order"], "backwards", 1)
    assert found["seconds"] >= 0
    assert found["kernel"].startswith(("used", "not used"))
    Path(model).write_text(f"{TANK}marked false;\n")
    status, out, _ = run(capsys, "synth", model, "--statistics")
    assert status == 1
    assert "search" in out
    Path(model).write_text(f"{TANK}marked nothing;\n")
    assert json.loads(run(capsys, "synth", model, "--json", "--statistics")[1])["statistics"] is None


def test_synth_in_modules(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "two.cif"
    model.write_text(TANK.replace("level in any", "level = 1") + TANK.replace("tank", "tub").replace(" in any", " = 1"))
    controlled = str(tmp_path / "controlled.cif")
    status, out, err = run(capsys, "synth", str(model), "--modular", "-o", controlled)
    assert (status, err) == (0, "")
    assert out.splitlines()[0] == "two: a supervisor exists (4 states, 2 modules)"
    assert "module 2, 2 states: tub" in out.splitlines()
    assert "supervisor automaton sup:" in Path(controlled).read_text()
    document = json.loads(run(capsys, "synth", str(model), "--modular", "--json")[1])
    assert [item["automata"] for item in document["modules"]] == [["tank"], ["tub"]]


def test_the_controlled_system_is_written(model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "controlled.cif"
    assert run(capsys, "synth", model, "-o", str(output))[1].splitlines()[-1] == f"written to {output}"
    text = output.read_text()
    assert "supervisor tank.u_drain needs tank.level != 3;" in text.splitlines()
    assert json.loads(run(capsys, "synth", model, "-o", str(output), "--json")[1])["file"] == str(output)
    folder = tmp_path / "out"
    assert run(capsys, "generate", model, "--target", "cif", "-o", str(folder))[:2] == (0, f"{folder}/supervisor.cif\n")
    assert (folder / "supervisor.cif").read_text() == text


def test_plain_automata_of_other_tools(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A controlled system that is written for libFAUDES or Supremica is read again, and needs no more supervising."""
    model = tmp_path / "tank.cif"
    model.write_text(TANK.replace("level in any", "level = 1"))
    for ending in (".gen", ".wmod"):
        controlled = tmp_path / f"controlled{ending}"
        assert run(capsys, "synth", str(model), "-o", str(controlled))[0] == 0
        assert run(capsys, "check", str(controlled))[:2] == (0, f"{controlled}: no findings\n")
        document = json.loads(run(capsys, "synth", str(controlled), "--json")[1])
        assert (document["states"], document["conditions"]) == (2, {"tank.c_fill": "true"})
        assert run(capsys, "verify", str(controlled))[0] == 0
        assert run(capsys, "generate", str(controlled), "--target", "c99", "-o", str(tmp_path / ending))[0] == 0
        assert run(capsys, "format" if ending == ".gen" else "doc", str(controlled))[0] == 2
        controlled.write_text("x")
        status, out, err = run(capsys, "check", str(controlled))
        assert (status, "[automata-syntax]" in out + err) == (1, True)


def test_names_do_not_move_the_cursor(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "odd.gen"
    model.write_text(
        '<Generator name="a\x1b[2Jb" ftype="System"><Alphabet>go +C+</Alphabet><States>x</States>'
        "<TransRel>x go x</TransRel><InitStates>x</InitStates><MarkedStates>x</MarkedStates></Generator>"
    )
    for arguments in (["synth"], ["synth", "--modular"], ["explain-synthesis"]):
        status, out, err = run(capsys, *arguments, str(model))
        assert (status, "\x1b" in out + err) == (0, False), out + err


def test_too_many_states_for_one_automaton(
    model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(exploration, "DEFAULT_LIMIT", 2)
    status, _, err = run(capsys, "synth", model, "-o", str(tmp_path / "controlled.gen"))
    assert (status, "has more than 2 states" in err, "ends in .cif" in err) == (1, True, True)
    assert not (tmp_path / "controlled.gen").exists()


def test_no_file_of_the_model_is_written_over(model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "other.cif").write_text(TANK)
    Path(model).write_text('import "other.cif";\n')
    for name in ("tank.cif", "other.cif"):
        status, _, err = run(capsys, "synth", model, "-o", str(tmp_path / name))
        assert (status, "is the model itself" in err) == (2, True)
    assert (tmp_path / "other.cif").read_text() == TANK


def test_code_is_generated(model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "out"
    status, _, err = run(capsys, "generate", model, "--target", "c99", "-o", str(folder))
    assert (status, "tank may begin in 3 states, and code begins in one" in err) == (1, True)
    arguments = ["generate", model, "--target", "python", "-o", str(tmp_path / "begun"), "--initial"]
    assert run(capsys, *arguments, "tank.level = 1")[0] == 0
    assert run(capsys, *arguments, "tank = *, tank.level = 2")[0] == 0
    status, _, err = run(capsys, *arguments, "tank.level = 3")
    assert (status, "no supervisor exists" in err) == (1, True)
    for text, message in (
        ("tank.levl = 1", "unknown location or variable 'tank.levl'; did you mean 'tank.level'?"),
        ("tank = open", "unknown location of tank 'open'; there is *"),
    ):
        assert run(capsys, *arguments, text) == (2, "", f"robosc: --initial: {message}\n")
    # The model's own initial predicate stays.
    Path(model).write_text(f"{TANK}initial tank.level != 1;\n")
    assert run(capsys, *arguments, "tank.level = 1")[0] == 1
    assert run(capsys, *arguments, "tank.level = 2")[0] == 0
    status, _, err = run(capsys, "generate", model, "--target", "ros2", "-o", str(folder))
    assert (status, "the target ros2 needs a model of a robot" in err) == (1, True)
    Path(model).write_text(TANK.replace("level in any", "level = 1"))
    assert run(capsys, "generate", model, "--target", "c99", "-o", str(folder))[0] == 0
    assert {path.name for path in folder.iterdir()} >= {"tank_supervisor.c", "tank_supervisor.h", "main.c", "README.md"}
    arguments = ["generate", model, "--target", "python", "--package", "basin", "-o", str(folder)]
    assert run(capsys, *arguments)[:2] == (0, f"{folder}/basin.py\n")


def test_generate_without_a_supervisor(model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for addition, status in (("marked false;", "empty"), ("marked x;", "model errors")):
        Path(model).write_text(f"{TANK}{addition}\n")
        code, out, _ = run(capsys, "generate", model, "--target", "cif", "-o", str(tmp_path / "out"), "--json")
        document = json.loads(out)
        assert (code, document["status"], document["files"]) == (1, status, [])
    assert not (tmp_path / "out").exists()


def test_explore(model: str, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = run(capsys, "explore", model)
    assert (status, out.splitlines()[0]) == (0, "tank: 3 states, 3 transitions; it starts in state 0 or 1 or 2")
    document = json.loads(run(capsys, "explore", model, "--json")[1])
    assert (document["initial"], document["initial_states"], len(document["states"])) == (0, [0, 1, 2], 3)
    assert document["states"][0]["variables"] == {"tank.level": 0}
    assert run(capsys, "explore", model, "--dot")[1].count("start ->") == 3
    status, _, err = run(capsys, "explore", model, "--limit", "1")
    assert (status, "raise the limit" in err) == (1, True)


def test_verify(model: str, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = run(capsys, "verify", model, "--strict")
    assert (status, out.splitlines()[0]) == (0, "tank: passed")
    assert json.loads(run(capsys, "verify", model, "--json")[1])["status"] == "passed"
    assert run(capsys, "verify", model, "--quiet") == (0, "", "")


def test_a_supervisor_file(model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "tank.rsup"
    assert run(capsys, "synth", model, "-o", str(file))[1].splitlines()[-1] == f"written to {file}"
    assert run(capsys, "verify", str(file), model)[1].splitlines()[0] == "tank: passed"
    changed = file.read_bytes().replace(b'"states":3', b'"states":2')
    assert changed != file.read_bytes()
    file.write_bytes(changed)
    status, out, _ = run(capsys, "verify", str(file), model)
    assert (status, out.splitlines()[0]) == (1, "tank: failed")
    assert out.splitlines()[-1] == "wrong states: it states 2, and there are 3"
    fault = json.loads(run(capsys, "verify", str(file), model, "--json")[1])["faults"][0]
    assert (fault["check"], fault["message"]) == ("states", "it states 2, and there are 3")
    Path(model).write_text(TANK.replace("level > 1", "level > 2"))
    status, _, err = run(capsys, "verify", str(file), model)
    assert (status, "one of other automata" in err) == (1, True)
    Path(model).write_text(f"{TANK}marked x;")
    assert json.loads(run(capsys, "verify", str(file), model, "--json")[1])["status"] == "model errors"
    file.write_text("{}")
    assert json.loads(run(capsys, "verify", str(file), model, "--json")[1])["status"] == "failed"


def test_a_signed_supervisor_file(model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, key, other = tmp_path / "tank.rsup", tmp_path / "lab", tmp_path / "other"
    run(capsys, "synth", model, "-o", str(file))
    for name in (key, other):
        assert run(capsys, "key", str(name))[0] == 0
    status, out, _ = run(capsys, "sign", str(file), "--key", f"{key}.key", "--json")
    assert (status, json.loads(out)["model"], json.loads(out)["deployment"]) == (0, "tank", None)
    assert run(capsys, "verify", str(file), "--signed-by", f"{key}.pub")[0] == 0
    assert run(capsys, "verify", str(file), model, "--signed-by", f"{key}.pub")[0] == 0
    assert run(capsys, "verify", str(file), model, "--signed-by", f"{other}.pub")[0] == 1
    assert run(capsys, "verify", model, "--signed-by", f"{key}.pub")[0] == 2


CHOICE = """input bool sensor;
plant p:
  uncontrollable u;
  location a: initial; marked; edge u when sensor goto b; edge u when sensor goto c;
  location b: marked;
  location c: marked;
end
"""


def test_simulate(model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, _, err = run(capsys, "simulate", model, "--random", "3")
    assert (status, "--initial 'tank.level = 0'" in err) == (1, True)
    begin = ["simulate", model, "--initial", "tank.level = 1"]
    script = tmp_path / "events.txt"
    script.write_text("tank.c_fill\ntank.u_drain\n")
    status, out, err = run(capsys, *begin, "--events", str(script))
    assert (status, err) == (0, "")
    assert out.splitlines() == [
        "   1  tank.c_fill: tank.level = 2",
        "   2  tank.u_drain: tank.level = 1",
        "now       tank = *, tank.level = 1 (marked)",
        "allowed   tank.c_fill",
        "can come  nothing",
    ]
    script.write_text("tank.c_fill\ntank.c_fill\n")
    status, out, err = run(capsys, *begin, "--events", str(script))
    assert status == 1
    assert f"{script}:2: 'tank.c_fill' is not allowed now: the supervisor forbids it" in err
    status, out, _ = run(capsys, *begin, "--random", "4", "--json")
    assert (status, len(out.splitlines()), json.loads(out.splitlines()[-1])["status"]) == (0, 5, "done")


def test_simulate_says_which_of_several_states(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "choice.cif"
    path.write_text(CHOICE)
    begin = ["simulate", str(path), "--initial", "sensor = false"]

    def typed(text: str) -> tuple[int, str, str]:
        monkeypatch.setattr("sys.stdin", io.StringIO(text))
        return run(capsys, *begin)

    status, out, err = typed("sensor true\np.u -> p = c\nundo\np.u -> p = b\n")
    assert (status, err) == (0, "")
    assert [line for line in out.splitlines() if "p.u" in line and "come" not in line] == [
        "   2  p.u: p = c", "taken back: p.u", "   2  p.u: p = b",
    ]  # fmt: skip
    status, _, err = typed("sensor true\np.u\n")
    assert (status, "choose one: p.u -> p = b" in err) == (1, True)
    for text, message in (
        ("p.u -> p = d", "p is never 'd': it is one of a, b, c"),
        ("p.u -> q = a", "there is no part of the state 'q'"),
        ("p.u", "p: sensor does not hold"),
        ("save run.jsonl", "a run of automata is not saved"),
    ):
        status, _, err = typed(f"{text}\n")
        assert (status, message in err) == (1, True), err
    assert "-> STATE" in typed("help\n")[1]


def test_simulate_begins_in_the_given_state(model: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for text, status, message in (
        ("tank.level = 3", 1, "tank cannot begin in a state with tank.level = 3"),
        ("tank.level = 9", 1, "tank.level is never '9': it is one of 0, 1, 2, 3"),
        ("tank.levl = 1", 2, "--initial: there is no part of the state 'tank.levl'; did you mean 'tank.level'?"),
    ):
        assert run(capsys, "simulate", model, "--random", "1", "--initial", text)[0] == status
        assert message in run(capsys, "simulate", model, "--random", "1", "--initial", text)[2]
    log = tmp_path / "run.jsonl"
    log.write_text('{"event": "tank.c_fill"}\n')
    begin = ["simulate", model, "--initial", "tank.level = 1"]
    status, _, err = run(capsys, *begin, "--events", str(log))
    assert (status, "an event log is of a robot's model" in err) == (1, True)
    Path(model).write_text(f"{TANK}marked false;\n")
    assert run(capsys, "simulate", model, "--random", "1")[0] == 1


@pytest.mark.parametrize(
    "arguments",
    [
        ["synth", "-o", "x.txt"],
        ["synth", "--allow-livelock"],
        ["synth", "--verify-limit", "7"],
        ["synth", "--deployment", "layer"],
        ["check", "-L", "."],
        ["check", "-I", "."],
        ["verify", "--property", "never deadlock"],
        ["generate", "--target", "all", "-o", "out"],
        ["generate", "--target", "cif", "--package", "tank", "-o", "out"],
        ["generate", "--target", "cif", "--allow-livelock", "-o", "out"],
        ["simulate", "--random", "3", "--save", "run.jsonl"],
        ["simulate", "--deployment", "layer"],
        ["doc"],
        ["explain-synthesis", "--deployment", "layer"],
        ["format"],
        ["view", "--scene", "room"],
    ],
)
def test_what_means_nothing_for_automata_is_refused(
    arguments: list[str], model: str, capsys: pytest.CaptureFixture[str]
) -> None:
    status, out, err = run(capsys, *arguments, model)
    assert (status, out) == (2, "")
    assert "automata" in err
    assert err.count("\n") == 1


def test_a_file_that_is_not_there(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(capsys, "check", "none.cif") == (2, "", "robosc: there is no file none.cif\n")
