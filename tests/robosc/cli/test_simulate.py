"""`robosc simulate` as a user runs it: files of events, chance, commands, and a real terminal."""

import io
import json
import os
import pty
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from robosc.cli.main import main
from robosc.cli.simulation_shell import HELP, Shell
from robosc.pipeline.saved_runs import ModelOfTest
from robosc.pipeline.simulation import Run
from robosc.pipeline.synthesis import synthesize
from support.lift import LIFT

MODEL = """robot Gate {
    datatype enum Way from double to { value > 0.5 -> free  default -> blocked }
    datatype object Scan { front: Way  class: integer(0..3) }
    interface range use Range from sensor_msgs
    component Sensor {
        outgoing message scan with identifier: "/scan", type: Scan links range
        outgoing message level with identifier: "/level", type: boolean
        behaviour {
            variable front: Way = blocked
            variable number: integer(0..3)
            on response from scan do front := value.front, number := value.class
            initial marked state sensing { }
        }
    }
    component Base {
        incoming message move with identifier: "/move", type: integer
        incoming message halt with identifier: "/halt", type: none
        behaviour {
            initial marked state idle { on request to move goto moving }
            state moving { on request to halt goto idle }
        }
    }
    requirement move needs Sensor.front = free
    provide move with Sensor.number + 1
}
"""
EVENTS = """# A run.
scan front=0.7 class=1

move.request
scan.response {"front": "blocked", "class": 2}
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "gate.rscd").write_text(MODEL, encoding="utf-8")
    (tmp_path / "run.txt").write_text(EVENTS, encoding="utf-8")
    return tmp_path


def typed(text: str) -> io.TextIOWrapper:
    """Standard input that is no terminal, as text and as bytes."""
    return io.TextIOWrapper(io.BytesIO(text.encode()), encoding="utf-8")


def test_events_of_a_file(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "gate.rscd", "--events", "run.txt"]) == 0
    assert capsys.readouterr().out == (
        "   1  scan.response (value.front = free, value.class = 1): Sensor.front = free, Sensor.number = 1\n"
        "   2  move.request: Base = moving\n"
        "      sends 2\n"
        "   3  scan.response (value.front = blocked, value.class = 2): Sensor.front = blocked, Sensor.number = 2\n"
        "now       Sensor = sensing, Base = moving, Sensor.front = blocked, Sensor.number = 2\n"
        "allowed   halt.request\n"
        "can come  scan.response, level.response\n"
    )


def test_an_event_that_is_not_possible_says_where_and_why(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", typed(EVENTS + "move\nhalt\n"))
    assert main(["simulate", "gate.rscd", "--events", "-", "--save", "kept.jsonl"]) == 1
    found = capsys.readouterr()
    why = "standard input:6: 'move.request' is not allowed now: Base is in moving, not in idle; requirement move needs "
    assert found.err.startswith(f"robosc: {why}")
    assert found.out.splitlines()[-2] == "allowed   halt.request"
    # Up to there it has happened.
    assert len(Path("kept.jsonl").read_text().splitlines()) == 3


def test_for_machines(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "gate.rscd", "--events", "run.txt", "--json"]) == 0
    *steps, end = map(json.loads, capsys.readouterr().out.splitlines())
    assert [step["step"] for step in steps] == [1, 2, 3]
    assert steps[1] == {
        "step": 2,
        "event": "move.request",
        "controllable": True,
        "data": {},
        "provided": 2,
        "skipped": [],
        "unknown": [],
        "reached": [],
        "visits": [],
        "cancelling": [],
        "strategy": None,
        "state": {
            "components": {"Sensor": "sensing", "Base": "moving"},
            "variables": {"Sensor.front": "free", "Sensor.number": 1},
            "communications": {},
        },
    }
    assert steps[2]["data"] == {"value.front": "blocked", "value.class": 2}
    assert steps[2]["skipped"] == []
    assert (end["status"], end["steps"], end["marked"], end["enabled"]) == ("done", 3, False, ["halt.request"])
    (disabled,) = end["disabled"]
    assert disabled["event"] == "move.request"
    assert disabled["why"][0] == "Base is in moving, not in idle"
    (Path.cwd() / "wrong.txt").write_text("halt\n")
    assert main(["simulate", "gate.rscd", "--events", "wrong.txt", "--json"]) == 1
    (end,) = map(json.loads, capsys.readouterr().out.splitlines())
    assert (end["status"], end["steps"]) == ("not possible", 0)
    assert end["message"].startswith("wrong.txt:1: 'halt.request' is not allowed now: Base is in idle, not in moving")


def test_chance_is_the_same_again_and_a_finding_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    outputs = []
    for seed in ("4", "4", "5"):
        assert main(["simulate", "gate.rscd", "--random", "20", "--seed", seed]) == 0
        outputs.append(capsys.readouterr().out)
    assert outputs[0] == outputs[1] != outputs[2]
    assert len(re.findall(r"^ *\d+  ", outputs[0], re.MULTILINE)) == 20
    assert main(["simulate", "gate.rscd", "--until-finding", "500", "--json"]) == 1
    *_, end = map(json.loads, capsys.readouterr().out.splitlines())
    assert (end["status"], end["finding"]["kind"], end["finding"]["event"]) == ("finding", "blocked", "move.request")
    words = ["--until-finding", "200", "--finding", "deadlock", "--finding", "unknown"]
    assert main(["simulate", "gate.rscd", *words]) == 0


def test_a_saved_log_is_taken_as_events_and_checked(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["simulate", "gate.rscd", "--random", "30", "--save", "a.jsonl", "--save", "test_a.py"]) == 0
    assert main(["check-log", "a.jsonl", "--model", "gate.rscd"]) == 0
    assert main(["synth", "gate.rscd", "-o", "gate.rsup"]) == 0
    assert main(["simulate", "gate.rsup", "--events", "a.jsonl", "--save", "b.jsonl"]) == 0
    assert Path("a.jsonl").read_bytes() == Path("b.jsonl").read_bytes()
    assert "test_run" in Path("test_a.py").read_text()


@pytest.mark.parametrize(
    ("words", "status", "message"),
    [
        (["--events", "none.txt"], 2, "cannot read none.txt: No such file or directory"),
        (["--events", "gate.rscd"], 1, "gate.rscd:1: what follows robot is neither JSON nor name=value: Gate {"),
        (["--random", "0"], 2, "invalid number of events from 1 to 1000000 value: '0'"),
        (["--finding", "deadlock"], 2, "--finding says what --until-finding looks for: it needs that"),
        (["--json"], 2, "--json and --save need events: --events, --random or --until-finding"),
        (["--events", "run.txt", "--strategy"], 2, "--strategy says how the controller plays in --random"),
        (["--random", "3", "--strategy"], 1, "the supervisor of Gate has no strategy: there are no goals or missions"),
        (["--random", "3", "--save", "x.txt"], 2, "x.txt: the name of a saved run ends in .jsonl"),
        (["--random", "3", "--save", "none/x.py"], 2, "cannot write none/x.py: No such file or directory"),
    ],
)
def test_wrong_use(words: list[str], status: int, message: str, capsys: pytest.CaptureFixture[str]) -> None:
    try:
        found = main(["simulate", "gate.rscd", *words])
    except SystemExit as error:
        found = int(str(error.code))
    assert found == status
    assert message in capsys.readouterr().err


def test_a_supervisor_of_another_deployment_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    main(["synth", "gate.rscd", "-o", "gate.rsup"])
    assert main(["simulate", "gate.rsup", "--deployment", "layer", "--random", "1"]) == 2
    assert "gate.rsup was made for the deployment controller" in capsys.readouterr().err


def test_commands_from_a_file(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    commands = """
        # what there is
        enabled
        why halt
        scan front=free class=1
        move
        why halt
        undo 5
        redo
        state
        history
        random 2 7
        random 25 7
        until-finding 50 3
        save run.jsonl
        restart
        help
        quit
        never read
    """
    monkeypatch.setattr("sys.stdin", typed(commands))
    assert main(["simulate", "gate.rscd"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[:3] == [
        "can come  scan.response  (value.front: free | blocked, value.class: integer(0..3))",
        "can come  level.response",
        "Base is in idle, not in moving",
    ]
    for line in (
        "halt.request can happen",
        "taken back: move.request",
        "taken back: scan.response",
        "nothing is left to be taken back",
        "taken again: scan.response",
        "seed 7",
        "      5 events, which 'history' lists",
        "written to run.jsonl",
        *HELP.splitlines(),
    ):
        assert line in lines, line
    assert any(line.startswith("blocked at move.request after ") for line in lines)
    assert Path("run.jsonl").exists()


def test_a_controller_follows_its_strategy(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    Path("lift.rscd").write_text(LIFT, encoding="utf-8")
    monkeypatch.setattr("sys.stdin", typed("arrived\ncall\nundo\ncall\narrived\nstrategy 1\nredo\nundo\nquit\n"))
    assert main(["simulate", "lift.rscd"]) == 0
    lines = capsys.readouterr().out.splitlines()
    goals = [line.partition(" ")[2].strip() for line in lines if line.startswith(("goals ", "strategy "))]
    assert goals == [
        *("1 not yet", "call.request"),  # a message that means nothing
        *("1 not yet", "waits"),  # called
        *("1 not yet", "call.request"),  # taken back
        *("1 not yet", "waits"),
        *("1 not yet", "enter.request"),
        *("1 true", "waits"),
        *("1 true", "waits"),
        *("1 not yet", "enter.request"),
    ]
    assert main(["simulate", "lift.rscd", "--random", "8", "--strategy", "--seed", "1", "--json"]) == 0
    *steps, end = map(json.loads, capsys.readouterr().out.splitlines())
    own = [step["event"] for step in steps if step["controllable"]]
    assert own == ["call.request", "enter.request"]
    assert [step["reached"] for step in steps if step["event"] == "enter.request"] == [[1]]
    assert steps[-1]["strategy"] is None
    assert (end["goals"], end["strategy"], end["enabled"]) == ([True], None, ["leave.request"])
    assert main(["simulate", "lift.rscd", "--until-finding", "30", "--strategy", "--finding", "blocked"]) == 0
    assert main(["simulate", "lift.rscd", "--until-finding", "30", "--finding", "blocked"]) == 1


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("mvoe", "there is no event 'mvoe'; did you mean 'move'"),
        ("halt", "'halt.request' is not allowed now: Base is in idle, not in moving; nothing is allowed"),
        ("level 3", "value of 'level.response' is 3, and must be boolean"),
        ("level 3 4", "what follows level is neither JSON nor name=value: 3 4"),
        ("why", "why which event? why EVENT"),
        ("undo 0", "N is a number from 1 to 1000000: undo [N]"),
        ("random", "N is a number from 1 to 1000000: random N [SEED]"),
        ("strategy", "N is a number from 1 to 1000000: strategy N [SEED]"),
        ("strategy 3", "the supervisor of Gate has no strategy: there are no goals or missions"),
        ("random x", "'x' is not a whole number: random N [SEED]"),
        ("until-finding 1 2 3", "too many words: until-finding [N] [SEED]"),
        ("save", "save to which file?"),
        ("save x.doc", "x.doc: the name of a saved run ends in .jsonl (an event log) or .py (a test)"),
        ("state now", "state takes nothing more"),
    ],
)
def test_a_wrong_command_ends_a_file_with_its_line(
    command: str, message: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", typed(f"state\n{command}\nstate\n"))
    assert main(["simulate", "gate.rscd"]) == 1
    found = capsys.readouterr()
    assert f"robosc: standard input:2: {message}" in found.err
    assert found.out.count("now  ") == 1


def test_completion(folder: Path) -> None:
    made = synthesize(folder / "gate.rscd").supervisor
    assert made is not None
    shell = Shell(Run(made), ModelOfTest(folder / "gate.rscd"))
    first = shell.words_after("")
    assert {"scan.response ", "until-finding ", "quit "} <= set(first)
    assert "move.request " not in first
    assert shell.words_after("why ") == ["move.request", "halt.request"]
    assert shell.words_after("scan.response ") == ["front=", "class="]
    assert shell.words_after("scan.response class=1 front=") == ["free ", "blocked "]
    assert shell.words_after("scan.response class=1 ") == ["front="]
    assert shell.words_after("level.response ") == ["false", "true"]
    assert shell.words_after("save ") == []


def test_a_terminal_has_a_prompt_completion_and_goes_on_after_mistakes(folder: Path) -> None:
    host, terminal = pty.openpty()
    command = [sys.executable, "-m", "robosc.cli.main", "simulate", "gate.rscd"]
    environment = {**os.environ, "TERM": "dumb", "INPUTRC": os.devnull}
    with subprocess.Popen(command, stdin=terminal, stdout=terminal, stderr=terminal, env=environment) as process:
        os.close(terminal)
        said = b""

        def until(wanted: bytes) -> None:
            nonlocal said
            while wanted not in said:
                said += os.read(host, 4096)
            said = said.partition(wanted)[2]

        def type_(text: bytes, wanted: bytes) -> None:
            os.write(host, text)
            until(wanted)

        until(b"Gate: 'help' lists the commands")
        until(b"> ")
        type_(b"halt\n", b"'halt.request' is not allowed now")
        until(b"> ")
        # Tab completes the only event that begins so, and the value of the enum.
        type_(b"sc\tfront=fr\tclass=1\n", b"scan.response (value.front = free, value.class = 1)")
        until(b"> ")
        type_(b"quit\n", b"quit")
        assert process.wait() == 0
    os.close(host)


def test_help_lists_every_command_of_the_shell(folder: Path) -> None:
    made = synthesize(folder / "gate.rscd").supervisor
    assert made is not None
    shell: Any = Shell(Run(made), ModelOfTest(folder / "gate.rscd"))
    listed = {word for line in HELP.splitlines() for word in re.findall(r"[a-z-]+", line)}
    assert set(shell._commands) <= listed


DENIED = """robot Gate {
    component Door {
        incoming message open with type: none
        incoming message call with type: none
        outgoing message opened with type: none
        behaviour {
            initial marked state shut { on request to open goto opening }
            state opening { on response from opened goto ajar }
            marked state ajar { on request to call goto shut }
        }
    }
    goal always eventually Door.ajar
}
"""


@pytest.fixture
def denied(folder: Path) -> str:
    (folder / "denied.rscd").write_text(DENIED, encoding="utf-8")
    return "denied.rscd"


def test_the_surroundings_play_against_the_user(
    denied: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("help\nenabled\nopen\nwait 2\nwhy opened\nundo\n"))
    assert main(["simulate", denied, "--counter-strategy"]) == 0
    found = capsys.readouterr().out
    assert "wait [N]" in found and "strategy N" not in found
    assert "   1  you           open.request: Door = opening" in found
    assert "denied    goal 1, whatever you do" in found
    assert "the surroundings wait, too" in found and "the surroundings decide it" in found
    assert "can come" not in found
    assert "taken back: open.request" in found


def test_a_mission_that_cannot_be_made_is_played_against(
    denied: str, folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    mission = "mission rounds { visit Door.ajar then Door.shut }"
    (folder / denied).write_text(DENIED.replace("goal always eventually Door.ajar", mission), encoding="utf-8")
    monkeypatch.setattr("sys.stdin", io.StringIO("open\nwait 2\n"))
    assert main(["simulate", denied, "--counter-strategy"]) == 0
    found = capsys.readouterr().out.splitlines()
    assert found[-5:] == [
        "the surroundings wait, too",
        "now       Door = opening",
        "mission   rounds: at visit 1, Door.ajar",
        "denied    visit 1 of mission rounds, whatever you do",
        "allowed   nothing",
    ]
    # The first visit can be made, and the second one is denied then.
    mission = "mission rounds { visit Door.shut then Door.opening then Door.ajar }"
    (folder / denied).write_text(DENIED.replace("goal always eventually Door.ajar", mission), encoding="utf-8")
    monkeypatch.setattr("sys.stdin", io.StringIO("state\n"))
    assert main(["simulate", denied, "--counter-strategy"]) == 0
    assert "denied    visit 2 of mission rounds; if it comes true, visit 3 of mission rounds" in capsys.readouterr().out
    (folder / "moves.txt").write_text("open\n", encoding="utf-8")
    assert main(["simulate", denied, "--counter-strategy", "--json", "--events", "moves.txt"]) == 0
    end = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (end["denied"], end["denied_next"]) == ("visit 3 of mission rounds", [])


def test_scripts_against_the_surroundings_say_whose_each_event_is(
    denied: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "moves.txt").write_text("wait\nopen\nwait\n", encoding="utf-8")
    assert main(["simulate", denied, "--counter-strategy", "--json", "--events", "moves.txt"]) == 0
    *steps, end = map(json.loads, capsys.readouterr().out.splitlines())
    assert [(item["event"], item["by"]) for item in steps] == [("open.request", "you")]
    assert (end["denied"], end["assumptions"], end["goals"]) == ("goal 1", [], [False])
    (folder / "moves.txt").write_text("opened\n", encoding="utf-8")
    assert main(["simulate", denied, "--counter-strategy", "--events", "moves.txt"]) == 1
    assert "the surroundings decide it" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "status", "message"),
    [
        (["denied.rscd", "--counter-strategy", "--random", "3", "--strategy"], 2, "--strategy: there is none"),
        (["denied.rscd", "--counter-strategy", "--until-finding", "3"], 2, "--until-finding"),
        (["denied.rscd", "--counter-strategy", "--deployment", "layer"], 2, "for controllers"),
        (["gate.rsup", "--counter-strategy"], 2, "for the model of a robot"),
        (["gate.rscd", "--counter-strategy"], 1, "the model has no goals"),
        (["reached.rscd", "--counter-strategy"], 1, "the goals can be reached"),
        (["made.rscd", "--counter-strategy"], 1, "the missions can be reached"),
        (["broken.rscd", "--counter-strategy"], 1, "syntax-error"),
        (["broken.rscd", "--counter-strategy", "--json", "--random", "1"], 1, ""),
    ],
)
def test_no_counter_strategy(
    denied: str, folder: Path, capsys: pytest.CaptureFixture[str], words: list[str], status: int, message: str
) -> None:
    (folder / "reached.rscd").write_text(DENIED.replace("Door.ajar", "Door.shut or Door.opening"), encoding="utf-8")
    made = DENIED.replace("goal always eventually Door.ajar", "mission calls { visit Door.shut or Door.opening }")
    (folder / "made.rscd").write_text(made, encoding="utf-8")
    (folder / "broken.rscd").write_text("robot", encoding="utf-8")
    try:
        found = main(["simulate", *words])
    except SystemExit as error:
        found = int(str(error.code))
    assert found == status
    assert message in capsys.readouterr().err
