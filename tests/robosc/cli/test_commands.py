"""The commands as a user runs them: what is printed, where, and with which exit status."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from robosc.cli.main import main
from robosc.supervisor import decode
from support.commands import run_json
from support.models import EXAMPLES, STOPPING

LINE_FOLLOWER = str(EXAMPLES / "line_follower" / "line_follower.rscd")
NAVIGATION = str(EXAMPLES / "navigation" / "navigation.rscd")


@pytest.fixture
def broken(tmp_path: Path) -> str:
    path = tmp_path / "broken.rscd"
    path.write_text("robot R {\n  requirement go needs\n    Nobody.here\n}\n", encoding="utf-8")
    return str(path)


def test_check_of_a_sound_model(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", LINE_FOLLOWER]) == 0
    assert capsys.readouterr().out == f"{LINE_FOLLOWER}: no findings\n"


def test_check_prints_every_finding_with_its_place(capsys: pytest.CaptureFixture[str], broken: str) -> None:
    assert main(["check", broken]) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    lines = captured.err.splitlines()
    assert lines[0] == "broken.rscd:2:15: error: unknown communication 'go' [unknown-name]"
    assert lines[1:3] == ["  |   requirement go needs", "  |               ^^"]
    assert lines[3].startswith("  = fix: ")
    assert lines[-1] == "2 errors"


def test_check_json(capsys: pytest.CaptureFixture[str], broken: str) -> None:
    status, document = run_json(capsys, "check", broken)
    assert status == 1
    assert (document["errors"], document["warnings"], document["notes"]) == (2, 0, 0)
    first = document["diagnostics"][0]
    assert (first["code"], first["file"], first["line"], first["column"], first["length"]) == (
        "unknown-name", "broken.rscd", 2, 15, 2,
    )  # fmt: skip


def test_strict_makes_warnings_count(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", NAVIGATION]) == 0
    assert main(["check", "--strict", NAVIGATION]) == 1
    assert "may-leave-range" in capsys.readouterr().err


def test_synth_prints_a_summary_and_writes_the_supervisor(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    target = tmp_path / "nav.rsup"
    assert main(["synth", NAVIGATION, "-o", str(target)]) == 0
    output = capsys.readouterr().out
    assert "16: 9 controllable, 7 not" in output
    assert "1044 states, 6504 transitions" in output
    assert "navigate.request    Navigator.failures <= 2" in output
    assert "maximally permissive  passed" in output
    supervisor = decode(target.read_bytes())
    assert supervisor.model.name == "Navigation"
    assert [path.name for path in tmp_path.iterdir()] == ["nav.rsup"]


def test_synth_json_and_both_engines_write_the_same_bytes(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    contents = []
    for engine in ("cudd", "oxidd", "autoref"):
        target = tmp_path / f"{engine}.rsup"
        status, document = run_json(capsys, "synth", LINE_FOLLOWER, "-o", str(target), "--engine", engine)
        assert (status, document["status"], document["summary"]["states"]) == (0, "supervisor", 16)
        contents.append(target.read_bytes())
    assert contents == contents[:1] * len(contents)


def test_the_layer_is_another_supervisor(capsys: pytest.CaptureFixture[str]) -> None:
    status, document = run_json(capsys, "synth", NAVIGATION, "--deployment", "layer")
    assert status == 0
    assert document["summary"]["deployment"] == "layer"
    assert document["summary"]["events"] == {"controllable": 8, "uncontrollable": 8}


@pytest.mark.parametrize("command", [["synth"], ["explore"], ["generate", "--target", "python", "-o", "{folder}"]])
def test_an_empty_supervisor_is_a_result_with_a_reason(
    capsys: pytest.CaptureFixture[str], empty: str, tmp_path: Path, command: list[str]
) -> None:
    folder = tmp_path / "out"
    arguments = [part.format(folder=folder) for part in command]
    assert main([*arguments, empty]) == 1
    assert "no supervisor exists: " in capsys.readouterr().err
    status, document = run_json(capsys, *arguments, empty)
    assert (status, document["status"]) == (1, "empty")
    assert document["reason"]
    assert not folder.exists()


@pytest.mark.parametrize("command", [["synth"], ["explore"], ["generate", "--target", "ros2", "-o", "{folder}"]])
def test_errors_of_the_model_stop_every_command(
    capsys: pytest.CaptureFixture[str], broken: str, tmp_path: Path, command: list[str]
) -> None:
    arguments = [part.format(folder=tmp_path / "out") for part in command]
    assert main([*arguments, broken]) == 1
    assert "2 errors" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_library_has_no_supervisor(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "lib.rscd"
    path.write_text("library L { component C { incoming message m with type: none } }", encoding="utf-8")
    assert main(["check", str(path)]) == 0
    assert main(["synth", str(path)]) == 1
    assert "a library has no robot" in capsys.readouterr().err


def test_an_output_that_is_no_plain_file_stays_what_it_is(tmp_path: Path) -> None:
    pipe, link, target = tmp_path / "pipe", tmp_path / "link.rsup", tmp_path / "target.rsup"
    os.mkfifo(pipe)
    reader = subprocess.Popen(["cat", str(pipe)], stdout=subprocess.PIPE)
    assert main(["synth", LINE_FOLLOWER, "-o", str(pipe)]) == 0
    content, _ = reader.communicate(timeout=30)
    assert pipe.is_fifo()
    target.write_bytes(b"old")
    target.chmod(0o640)
    link.symlink_to(target.name)
    (tmp_path / "link.rsup.part").write_bytes(b"somebody's")
    assert main(["synth", LINE_FOLLOWER, "-o", str(link)]) == 0
    assert link.is_symlink()
    assert target.read_bytes() == content
    assert target.stat().st_mode & 0o777 == 0o640
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link.rsup", "link.rsup.part", "pipe", "target.rsup"]


def test_explore_prints_the_graph(capsys: pytest.CaptureFixture[str]) -> None:
    status, document = run_json(capsys, "explore", LINE_FOLLOWER)
    assert status == 0
    assert sorted(document) == ["initial", "states", "transitions"]
    initial = document["states"][document["initial"]]
    assert initial["components"]["LineDetector"] == "no_line"
    assert initial["variables"] == {"LidarSensor.ahead": "obstructed"}
    assert "halt.request" in initial["enabled"]
    assert "move.request" not in initial["enabled"]
    assert main(["explore", LINE_FOLLOWER, "--dot"]) == 0
    assert capsys.readouterr().out.startswith("digraph")
    assert main(["explore", LINE_FOLLOWER, "--limit", "3"]) == 1
    assert "more than 3" in capsys.readouterr().err


def test_generate_writes_a_package_and_keeps_what_a_user_changed(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    folder = tmp_path / "out"
    arguments = ["generate", LINE_FOLLOWER, "--target", "ros2", "-o", str(folder)]
    status, document = run_json(capsys, *arguments)
    assert status == 0
    assert str(folder / "line_follower_controller" / "node.py") in document["files"]
    assert main(arguments) == 0
    parameters = folder / "config" / "parameters.yaml"
    parameters.write_text("changed: true\n", encoding="utf-8")
    capsys.readouterr()
    assert main(arguments) == 1
    assert "parameters.yaml" in capsys.readouterr().err
    assert parameters.read_text(encoding="utf-8") == "changed: true\n"
    assert main([*arguments, "--force"]) == 0
    assert parameters.read_text(encoding="utf-8") != "changed: true\n"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["check", "{folder}/nothing.rscd"], "there is no file"),
        (["check", "{folder}"], "is a folder"),
        (["check", LINE_FOLLOWER, "-L", "{folder}/nowhere"], "there is no library folder"),
        (["synth", LINE_FOLLOWER, "-o", "{folder}/no/such/place.rsup"], "cannot write"),
        (["synth", LINE_FOLLOWER, "-o", "{folder}"], "cannot write"),
        (["check", "{folder}/" + "a" * 300], "cannot read"),
        (["check", LINE_FOLLOWER, "-L", "{folder}/" + "a" * 300], "cannot read"),
        (["check", LINE_FOLLOWER, "-I", "{folder}/" + "a" * 300], "cannot read"),
        (["synth", LINE_FOLLOWER, "-o", "{folder}/loop"], "Too many levels of symbolic links"),
        (["format", ""], "the name of a file is empty"),
        (["generate", LINE_FOLLOWER, "--target", "python", "-o", LINE_FOLLOWER], "cannot write"),
    ],
)
def test_wrong_use_is_one_line_and_status_2(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, arguments: list[str], words: str
) -> None:
    (tmp_path / "loop").symlink_to("loop")
    assert main([part.format(folder=tmp_path) for part in arguments]) == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert error.startswith("robosc: ")
    assert words in error


@pytest.mark.parametrize("arguments", [["chek"], ["explore", LINE_FOLLOWER, "--limit", "0"], ["check"]])
def test_the_parser_refuses_with_status_2(capsys: pytest.CaptureFixture[str], arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as raised:
        main(arguments)
    assert raised.value.code == 2
    assert "usage: robosc" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("target", "messages", "code"),
    [
        ("python", 'incoming message a with identifier: "/x", type: double', "conflicting-topic"),
        ("ros2", 'incoming message a with identifier: "/x", type: double', "conflicting-topic"),
        ("python", 'outgoing message a with identifier: "/x", type: boolean, depth: 3', "conflicting-topic"),
        ("ros2", 'incoming message a with identifier: "/1x", type: double', "invalid-identifier"),
        ("ros2", 'incoming message a with identifier: "", type: double', "invalid-identifier"),
        ("ros2", "} interface i use BateryState from sensor_msgs component D {", "unknown-ros-type"),
        ("ros1-cpp", "} interface i use BateryState from sensor_msgs component D {", "unknown-ros-type"),
        ("ros2", "outgoing message a with type: O links i behaviour { variable v: double"
         " on response from a do v := value.percentag initial marked state s { } } }"
         " datatype object O { percentag: double }"
         " interface i use BatteryState from sensor_msgs component D {", "unknown-field"),
        ("ros2", "outgoing message a with type: O links i } datatype object O { K: array(double) }"
         " interface i use CameraInfo from sensor_msgs component D {", "ros1-only"),
        ("ros1", "outgoing message a with type: O links i } datatype object O { k: array(double) }"
         " interface i use CameraInfo from sensor_msgs component D {", "ros2-only"),
        ("ros1", "outgoing message a with type: O links i } datatype object O { present: boolean percentage: integer }"
         " interface i use BatteryState from sensor_msgs component D {", "field-type-mismatch"),
        ("ros2", 'incoming message a with type: none, stamped: "x" links i }'
         " interface i use Twist from geometry_msgs component D {", "no-header"),
    ],
)  # fmt: skip
def test_what_is_only_a_warning_of_the_check_stops_a_target_at_its_place(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, target: str, messages: str, code: str
) -> None:
    path = tmp_path / "model.rscd"
    path.write_text(
        f'robot R {{ component C {{ outgoing message m with identifier: "/x", type: boolean\n{messages} }} }}'
    )
    assert main(["check", str(path)]) == 0
    assert "model.rscd:2:" in capsys.readouterr().err
    assert main(["generate", str(path), "--target", target, "-o", str(tmp_path / "out")]) == 1
    error = capsys.readouterr().err
    assert "model.rscd:2:" in error
    assert "error: " in error
    assert f"[{code}]" in error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("interface", "code"), [("Cell from power_msgs", "unknown-ros-type"), ("Battery from power_msgs", "unknown-field")]
)
def test_definitions_of_one_s_own_refuse_packages_and_no_model(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, interface: str, code: str
) -> None:
    messages = tmp_path / "power_msgs" / "msg"
    messages.mkdir(parents=True)
    (tmp_path / "power_msgs/package.xml").write_text("<package format='3'><name>power_msgs</name></package>")
    (messages / "Battery.msg").write_text("float32 charge\n")
    path = tmp_path / "model" / "robot.rscd"
    path.parent.mkdir()
    path.write_text(
        f"robot R {{ interface i use {interface} datatype object O {{ level: double }}\n"
        "component C { outgoing message m with type: O links i behaviour { variable v: double "
        "on response from m do v := value.level initial marked state s { } } } }"
    )
    given = [str(path), "-I", str(tmp_path / "power_msgs")]
    assert main(["check", *given]) == 0
    assert "warning: power_msgs" in (printed := capsys.readouterr().err)
    assert f"[{code}]" in printed
    assert main(["synth", *given, "-o", str(tmp_path / "robot.rsup")]) == 0
    assert main(["check", "--strict", *given]) == 1
    assert main(["generate", *given, "--target", "ros2", "-o", str(tmp_path / "out")]) == 1


@pytest.mark.parametrize(
    ("body", "target"),
    [
        ('component C { incoming message a with identifier: "", type: double }', "python"),
        ("interface i use BateryState from sensor_msgs component C { }", "python"),
        ("interface i use Header from std_msgs datatype object H { seq: integer } "
         "component C { outgoing message m with type: H links i }", "ros1"),
        ("interface i use BatteryState from sensor_msgs datatype object H { power_supply_status: boolean } "
         "component C { outgoing message m with type: H links i }", "ros2-cpp"),
    ],
)  # fmt: skip
def test_what_ros_cannot_do_others_can(tmp_path: Path, body: str, target: str) -> None:
    path = tmp_path / "model.rscd"
    path.write_text(f"robot R {{ {body} }}")
    assert main(["generate", str(path), "--target", target, "-o", str(tmp_path / "out")]) == 0


@pytest.mark.parametrize(
    ("status", "arguments", "words"),
    [
        (2, ["synth", LINE_FOLLOWER, "--engine", "magic"], "unknown engine 'magic'"),
        (2, ["generate", LINE_FOLLOWER, "--target", "ros", "-o", "x"], "unknown target 'ros'"),
    ],
)
def test_what_is_not_to_be_had_is_said(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    status: int,
    arguments: list[str],
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == status
    assert words in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_the_installed_command_and_a_closed_pipe(tmp_path: Path) -> None:
    robosc = Path(sys.executable).with_name("robosc")
    result = subprocess.run(
        [str(robosc), "check", LINE_FOLLOWER], capture_output=True, text=True, timeout=60, check=False
    )
    assert (result.returncode, result.stderr) == (0, "")
    read, write = os.pipe()
    os.close(read)
    try:
        result = subprocess.run(
            [str(robosc), "explore", NAVIGATION],
            stdout=write,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
            check=False,
        )
    finally:
        os.close(write)
    assert "Traceback" not in result.stderr
    assert "BrokenPipe" not in result.stderr


@pytest.mark.parametrize(
    "arguments",
    [["check", LINE_FOLLOWER], ["check", "--json", LINE_FOLLOWER], ["doc", LINE_FOLLOWER], ["explain", "--all"]],
)
def test_results_that_cannot_be_written_are_an_error(arguments: list[str]) -> None:
    robosc = Path(sys.executable).with_name("robosc")
    with Path("/dev/full").open("w") as full:
        result = subprocess.run(
            [str(robosc), *arguments], stdout=full, stderr=subprocess.PIPE, text=True, timeout=60, check=False
        )
    assert result.returncode == 2
    assert result.stderr == "robosc: cannot write the results: No space left on device\n"


def test_a_closed_standard_output_is_nobodys_error() -> None:
    robosc = Path(sys.executable).with_name("robosc")
    result = subprocess.run(
        ["sh", "-c", '"$0" check "$1" >&-', str(robosc), LINE_FOLLOWER], capture_output=True, timeout=60, check=False
    )
    assert (result.returncode, result.stderr) == (0, b"")


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8:strict"])
def test_any_text_can_be_printed_in_any_encoding(encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "nam\udcffe.rscd"
    path.write_text(
        "robot R { component C { incoming message m with identifier: '/\u00e9\u6f22\U0001f916', type: x } }", "utf-8"
    )
    robosc = Path(sys.executable).with_name("robosc")

    def output(*arguments: str) -> bytes:
        result = subprocess.run(
            [str(robosc), *arguments, str(path)],
            capture_output=True,
            env=os.environ | {"PYTHONIOENCODING": encoding},
            timeout=60,
            check=False,
        )
        assert b"Traceback" not in result.stderr
        assert result.returncode == 1
        return result.stdout

    output("check")
    found = json.loads(output("check", "--json").decode(encoding.partition(":")[0]))
    assert {item["code"] for item in found["diagnostics"]} >= {"unknown-name"}


def test_nothing_forges_a_line_or_moves_the_cursor(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "model.rscd"
    path.write_text(
        'robot R { component C { incoming message m with identifier: "a\nerror: fake\x1b[2J", type: none } }'
    )
    assert main(["check", str(path)]) == 1
    assert main(["explain", "\x1b[2J\nfake"]) == 2
    assert main(["check", "\x1b[2J\nfake"]) == 2
    error = capsys.readouterr().err
    assert "\x1b" not in error
    assert not [line for line in error.splitlines() if line.startswith(("error: fake", "fake"))]


SLOW = ("dataclasses", "importlib.resources", "inspect", "jinja2", "robosc.execution", "robosc.strategies.synthesize")


@pytest.mark.parametrize(
    ("command", "needless"),
    [("check", (*SLOW, "dd", "robosc.synthesis", "typing_extensions")), ("synth", ("jinja2", *SLOW[-2:]))],
)
def test_what_a_command_does_not_need_is_not_imported(command: str, needless: tuple[str, ...]) -> None:
    """A cold start pays only for what a command uses."""
    code = (
        "import atexit, sys; before = set(sys.modules); names = sys.argv.pop().split();"
        "from robosc.cli.command import entry;"
        "atexit.register(lambda: print([name for name in names if name in set(sys.modules) - before]));"
        "entry()"
    )
    result = subprocess.run(
        [sys.executable, "-c", code, command, LINE_FOLLOWER, " ".join(needless)],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert result.stdout.splitlines()[-1] == "[]"


LIVELOCK = """robot R {
    component B {
        behaviour {
            initial marked state a { transition goto b }
            state b { transition goto a }
        }
    }
}"""


def test_silent_steps_that_never_end_are_an_error_unless_allowed(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    model = tmp_path / "model.rscd"
    model.write_text(LIVELOCK, encoding="utf-8")
    target, folder = tmp_path / "out.rsup", tmp_path / "out"
    assert main(["synth", str(model), "-o", str(target)]) == 1
    assert main(["generate", str(model), "--target", "python", "-o", str(folder)]) == 1
    printed = capsys.readouterr().err
    assert (
        printed.count("error: silent steps never end: from the initial state, B.tau_1, B.tau_2 repeat themselves") == 2
    )
    assert printed.count("--allow-livelock overrides this") == 2
    assert not target.exists() and not folder.exists()
    status, document = run_json(capsys, "synth", str(model))
    assert (status, document["status"], document["summary"]) == (1, "model errors", None)
    assert main(["synth", str(model), "-o", str(target), "--allow-livelock"]) == 0
    captured = capsys.readouterr()
    assert "warning: silent steps never end" in captured.err
    assert "finite response       failed" in captured.out
    controller = decode(target.read_bytes()).certificate.controller
    assert controller is not None and controller.finite_response == "failed"
    assert main(["generate", str(model), "--target", "python", "-o", str(folder), "--allow-livelock"]) == 0
    assert folder.exists()
    # The graph is of everything allowed, whatever an executor does.
    assert main(["explore", str(model)]) == 0
    assert main(["check", str(model), "--synthesize"]) == 1


@pytest.mark.parametrize("words", [["--strict", "check", "x.rscd"], ["--library-path=x", "check"], ["--json"]])
def test_options_before_a_command_are_refused_with_their_place(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        main(words)
    assert left.value.code == 2
    option = words[0].partition("=")[0]
    assert f"put the options of a command after it: robosc COMMAND {option} ..." in capsys.readouterr().err


def test_options_of_the_program_itself_may_be_shortened(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(["--vers"])
    assert left.value.code == 0
    assert capsys.readouterr().out.startswith("robosc ")


def test_a_cancel_that_must_be_possible_is_an_error_and_nothing_overrides_it(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    model, target, folder = tmp_path / "model.rscd", tmp_path / "out.rsup", tmp_path / "out"
    model.write_text(STOPPING, encoding="utf-8")
    said = "error: 'travel' cannot be cancelled after travel.request, stop.response"
    for command in (
        ["synth", "--allow-livelock", "-o", str(target)],
        ["generate", "--target", "python", "--allow-livelock", "-o", str(folder)],
        ["check", "--synthesize"],
    ):
        assert main([command[0], str(model), *command[1:]]) == 1
        printed = capsys.readouterr().err
        assert said in printed and "because it would have to forbid a cancel that must be possible" in printed
    assert not target.exists() and not folder.exists()
    # The graph is only looked at.
    assert main(["explore", str(model)]) == 0
    assert main(["explain-synthesis", str(model)]) == 0
    capsys.readouterr()
    model.write_text(STOPPING.replace("cancel to travel goto braking", "cancel to travel goto idle"), encoding="utf-8")
    assert main(["synth", str(model), "-o", str(target)]) == 0
    assert "cancels possible      passed" in capsys.readouterr().out
    controller = decode(target.read_bytes()).certificate.controller
    assert controller is not None and controller.cancels == "passed"
