"""Tests of commands that a person types, against an endpoint on a real socket, or as programs."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from robosc_api.security import Scope, ServerSecurity, TokenFile, make_token
from robosc_api.v1 import bridge_pb2 as pb
from robosc_bridge.daemon.states import OperatorCommand, State
from robosc_bridge.main import main as robosc_bridge
from robosc_bridge.remote import RemoteSettings
from robosc_bridge.remote import endpoint as endpoint_module
from robosc_bridge.safety import Reason
from robosc_bridge.terminal import client
from robosc_bridge.terminal.commands import NAMES, main
from robosc_bridge.terminal.formatting import Lines, event_line, status_lines
from support.certificates import Authority
from support.interrupts import interrupt_without_its_lock
from support.remote import READING, FakeDaemon, connected, served
from support.waiting import PATIENCE_S, wait_until

NOWHERE = "127.0.0.1:1"


@pytest.fixture(autouse=True)
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """A busy machine may take longer for an answer than a bridge may."""
    for name in ("STOP_LIMIT_S", "STATUS_LIMIT_S", "COMMAND_LIMIT_S"):
        monkeypatch.setattr(client, name, PATIENCE_S)


@pytest.fixture
def daemon() -> Any:
    with FakeDaemon() as made:
        yield made


@pytest.fixture
def address(daemon: FakeDaemon) -> Any:
    with served(daemon) as endpoint:
        yield endpoint.address


def bridge(*arguments: str, **variables: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "robosc_bridge.command", *arguments]
    environment = {**os.environ, **variables}
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=PATIENCE_S, env=environment)


@contextmanager
def watching(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "robosc_bridge.command", "watch", *arguments]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


class TestWishes:
    @pytest.mark.parametrize("name", ["start", "standby", "resume", "reset", "stop"])
    def test_it_is_ordered(
        self, name: str, daemon: FakeDaemon, address: str, capsys: pytest.CaptureFixture[str]
    ) -> None:
        assert main([name, "--address", address]) == 0
        assert daemon.commands() == [OperatorCommand(name)]
        assert capsys.readouterr().out in (f"{name}: done\n", "stopped\n")

    def test_a_refusal_is_one_line_and_status_1(
        self, daemon: FakeDaemon, address: str, capsys: pytest.CaptureFixture[str]
    ) -> None:
        daemon.refusal = "reset it first\nor \x1b[31mnot"
        assert main(["start", "--address", address]) == 1
        assert capsys.readouterr().err == "robosc-bridge: reset it first or [31mnot\n"

    @pytest.mark.parametrize("name", [name for name in NAMES if name not in ("token", "tokens", "teleop")])
    def test_where_nobody_answers_it_is_status_2(self, name: str, capsys: pytest.CaptureFixture[str]) -> None:
        assert main([name, "--address", NOWHERE]) == 2
        errors = capsys.readouterr().err
        assert errors.startswith(f"robosc-bridge: no bridge answers at {NOWHERE}: ")
        assert errors.count("\n") == 1

    @pytest.mark.parametrize(
        ("name", "status", "errors"), [("status", 130, "robosc-bridge: interrupted\n"), ("watch", 0, "")]
    )
    def test_an_interrupt_that_comes_out_as_another_error(
        self, name: str, status: int, errors: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> None:
        def interrupted(*_: Any, **__: Any) -> Any:
            interrupt_without_its_lock()

        monkeypatch.setattr(client.BridgeClient, name, interrupted)
        assert main([name, "--address", NOWHERE]) == status
        assert capsys.readouterr().err == errors

    def test_the_whole_program_knows_them(self, daemon: FakeDaemon, address: str) -> None:
        assert robosc_bridge(["stop", "--address", address]) == 0
        assert daemon.commands() == [OperatorCommand.STOP]

    @pytest.mark.parametrize("wrong", ["50061", "robot:0", "robot:70000", ":1", "a b:1"])
    def test_wrong_addresses_are_wrong_use(self, wrong: str, capsys: pytest.CaptureFixture[str]) -> None:
        with pytest.raises(SystemExit) as caught:
            main(["stop", "--address", wrong])
        assert caught.value.code == 2
        assert "neither HOST nor HOST:PORT" in capsys.readouterr().err

    def test_as_a_program_with_the_address_in_the_environment(self, daemon: FakeDaemon, address: str) -> None:
        done = bridge("stop", ROBOSC_BRIDGE=address)
        assert (done.returncode, done.stdout, done.stderr) == (0, "stopped\n", "")
        assert daemon.commands() == [OperatorCommand.STOP]
        assert bridge("stop", ROBOSC_BRIDGE="nonsense").returncode == 2

    def test_a_stop_loads_nothing_that_runs_a_robot(self) -> None:
        text = (
            "import sys, robosc.cli.starting; start = set(sys.modules); "
            "from robosc_bridge.terminal import client, commands; loaded = set(sys.modules) - start; "
            "print([name for name in loaded if name.split('.')[0] in ('robosc', 'numpy', 'cv2', 'serial')])"
        )
        done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=True)
        assert done.stdout == "[]\n"


class TestSecurity:
    def test_over_tls_with_a_token(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        authority = Authority(tmp_path)
        certificate, key = authority.sign("bridge")
        assert main(["token", "screen", "--scope", "watch"]) == 0
        made = capsys.readouterr()
        token, tokens = tmp_path / "token", tmp_path / "tokens"
        token.write_text(made.out)
        tokens.write_text(made.err.splitlines()[-1])
        tokens.chmod(0o600)
        security = ServerSecurity(certificate=certificate, key=key, tokens=tokens)
        with FakeDaemon() as daemon, served(daemon, RemoteSettings("127.0.0.1:0", security)) as endpoint:
            given = ["--address", endpoint.address, "--ca", str(authority.file), "--token-file", str(token)]
            assert main(["status", *given]) == 0
            assert main(["stop", *given]) == 0
            capsys.readouterr()
            assert main(["start", *given]) == 1
            assert "scope does not include 'operate'" in capsys.readouterr().err
            assert main(["status", "--address", endpoint.address, "--ca", str(authority.file)]) == 1
            assert "a valid token is needed" in capsys.readouterr().err
            assert main(["status", "--address", endpoint.address]) == 2
            done = bridge(
                "stop", ROBOSC_BRIDGE=endpoint.address, ROBOSC_CA=str(authority.file), ROBOSC_TOKEN_FILE=str(token)
            )
            assert done.returncode == 0, done.stderr
            assert daemon.commands() == [OperatorCommand.STOP, OperatorCommand.STOP]

    def test_files_that_cannot_be_used_are_wrong_use(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        empty = tmp_path / "empty"
        empty.touch()
        assert main(["stop", "--address", NOWHERE, "--token-file", str(empty)]) == 2
        assert "exactly one token" in capsys.readouterr().err
        assert main(["stop", "--address", NOWHERE, "--ca", str(empty)]) == 2
        assert main(["stop", "--address", NOWHERE, "--certificate", str(empty)]) == 2

    def test_a_token_may_do_what_it_is_for_by_default(self, capsys: pytest.CaptureFixture[str]) -> None:
        assert main(["token", "me"]) == 0
        made = capsys.readouterr()
        assert made.err.splitlines()[-1].startswith("me watch,operate sha256:")
        assert made.out.strip() not in made.err
        assert main(["token", "not a name"]) == 2
        assert make_token("a", (Scope.WATCH,))[0] != made.out.strip()

    def test_a_token_file_is_kept_by_commands(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        file = tmp_path / "tokens"
        assert main(["tokens", "add", str(file), "me"]) == 0
        entry = TokenFile(file).find(capsys.readouterr().out.strip())
        assert entry is not None and entry.scopes == {Scope.WATCH, Scope.OPERATE}
        assert main(["tokens", "list", str(file)]) == 0
        assert f"me    {entry.id}  operate,watch  never    valid" in capsys.readouterr().out
        assert main(["tokens", "revoke", str(file), "you"]) == 2
        assert capsys.readouterr().err == f"robosc-bridge: {file}: no token with the name or id 'you'\n"


class TestStatus:
    def test_for_people(self, daemon: FakeDaemon, address: str, capsys: pytest.CaptureFixture[str]) -> None:
        daemon.show(reading=replace(READING, battery_share=0.5))
        assert main(["status", "--address", address]) == 0
        assert capsys.readouterr().out.splitlines() == [
            "running",
            "  nothing moves: The scanner has made no full revolution for too long.",
            "  nothing moves: An operator has stopped the robot. (until reset)",
            "  warning: The battery will soon be empty.",
            "  nothing is requested: '/order' is stale",
            "  drive: works",
            "  scanner: is not there",
            "  battery: 11.8 V, 50 %",
            "  motors: hold",
            "  motor fault: input voltage",
            "  at x 1.00 m, y 2.00 m, heading 29 degrees",
            "  moves at 0.10 m/s, -0.20 rad/s",
            "  decisions left out: 4",
            "  exchange: p50 2.0 ms, p99 10.0 ms, at most 10.0 ms",
            "  line of the drive: requests 70, unanswered 3",
            "  Desk  idle count=3",
            "  allowed now: drive",
        ]

    def test_for_programs(self, daemon: FakeDaemon, address: str, capsys: pytest.CaptureFixture[str]) -> None:
        daemon.show(reading=READING)
        assert main(["status", "--json", "--address", address]) == 0
        found = json.loads(capsys.readouterr().out)
        assert found["state"] == "BRIDGE_STATE_RUNNING"
        assert found["reasons"][1]["code"] == "OPERATOR_STOP"
        assert found["components"] == [{"name": "Desk", "state": "idle", "variables": {"count": 3.0}}]
        assert found["drive"]["battery_v"] == 11.8
        assert "battery_share" not in found["drive"]
        assert found["devices"][1] == {"name": "scanner", "works": False}

    @pytest.mark.parametrize(
        ("change", "words"),
        [
            ({"state": State.FAULT, "problem": "the drive base is lost"}, "fault: the drive base is lost"),
            ({"time_s": 0.0}, "old: the bridge's loop hangs"),
        ],
    )
    def test_what_is_not_well_is_status_1(
        self, change: Any, words: str, daemon: FakeDaemon, address: str, capsys: pytest.CaptureFixture[str]
    ) -> None:
        daemon.show(**change)
        assert main(["status", "--address", address]) == 1
        assert words in capsys.readouterr().out

    def test_a_loop_that_has_not_turned_yet(
        self, daemon: FakeDaemon, address: str, capsys: pytest.CaptureFixture[str]
    ) -> None:
        daemon.feed._snapshot = None
        assert main(["status", "--address", address]) == 1
        assert "has not run yet" in capsys.readouterr().err

    def test_a_terminal_obeys_nothing_of_what_is_shown(self) -> None:
        snapshot = pb.Snapshot(problem="\x1b]0;x\x07\n", stops=["a\nb"], enabled=["\x1b[2J"])
        assert all(line.isprintable() for line in status_lines(snapshot))


class TestWatch:
    def test_a_line_for_each_event_until_ctrl_c(self, daemon: FakeDaemon, address: str) -> None:
        with watching("--address", address, "--rate", "100") as process:
            assert process.stdout is not None
            assert process.stdout.readline().endswith(
                "= running: The scanner has made no full revolution for too long.; An operator has stopped the robot.\n"
            )
            daemon.feed.append({"time": 1.5, "kind": "blocked", "identifier": "/cmd_vel", "what": "not allowed"})
            line = process.stdout.readline()
            assert line.split(" ", 1)[1] == "! blocked    /cmd_vel not allowed\n"
            assert line.split(" ", 1)[0].endswith(":01.500")
            daemon.feed.append({"time": 2.0, "kind": "event", "event": "order.response", "data": {"value": 3}})
            assert process.stdout.readline().split(" ", 1)[1] == "  event      order.response data={'value': 3.0}\n"
            daemon.show(reasons=(Reason.STANDBY,), state=State.STANDBY)
            assert "= standby: The robot is in standby." in process.stdout.readline()
            process.send_signal(signal.SIGINT)
            _, errors = process.communicate(timeout=PATIENCE_S)
            assert (process.returncode, errors) == (0, "")

    def test_as_json_lines_with_scans(self, daemon: FakeDaemon, address: str) -> None:
        from support.remote import scan

        daemon.show(scan=scan(1.5))
        with watching("--json", "--scans", "--address", address) as process:
            assert process.stdout is not None
            found = json.loads(process.stdout.readline())
            assert found["snapshot"]["state"] == "BRIDGE_STATE_RUNNING"
            assert found["scan"]["ranges_m"][:2] == [1.5, "NaN"]
            assert found["lost_events"] == "0"

    def test_the_end_of_the_bridge_is_reported(self, daemon: FakeDaemon, monkeypatch: pytest.MonkeyPatch) -> None:
        # However long a busy machine takes for it.
        monkeypatch.setattr(endpoint_module, "_GRACE_S", PATIENCE_S)
        with served(daemon) as endpoint, watching("--address", endpoint.address) as process:
            assert process.stdout is not None
            process.stdout.readline()
            endpoint.stop()
            _, errors = process.communicate(timeout=PATIENCE_S)
            assert process.returncode == 2
            assert errors.endswith(": the bridge ends\n")

    def test_who_reads_no_more_ends_it_quietly(self, daemon: FakeDaemon, address: str) -> None:
        with watching("--json", "--address", address, "--rate", "100") as process:
            assert process.stdout is not None
            process.stdout.readline()
            process.stdout.close()
            end_s = time.monotonic() + PATIENCE_S
            while process.poll() is None:
                assert time.monotonic() < end_s
                daemon.show()
                time.sleep(0.01)
            assert process.stderr is not None
            assert (process.returncode, process.stderr.read()) == (0, "")

    def test_lost_events_and_a_loop_that_hangs_are_printed(self) -> None:
        lines = list(Lines().of(pb.WatchResponse(lost_events=7, snapshot=pb.Snapshot(state=3, age_s=5.0))))  # type: ignore[arg-type]
        assert lines[0].endswith("! 7 events were lost: they came too quickly")
        assert lines[1].endswith("= running")
        assert lines[2].endswith("! the bridge's loop hangs")

    def test_what_is_the_same_is_printed_once(self) -> None:
        lines = Lines()
        response = pb.WatchResponse(snapshot=pb.Snapshot(state=3))  # type: ignore[arg-type]
        assert len(list(lines.of(response))) == 1
        assert list(lines.of(response)) == []

    def test_an_entry_of_any_kind_is_a_line(self) -> None:
        assert "!" in event_line({"time": 1.0, "kind": "fault", "what": "x"})
        assert event_line({}).isprintable()
        assert event_line({"time": "never", "kind": "\n", "event": "\x1b", "data": math.nan}).isprintable()


def test_a_watcher_that_is_killed_leaves_nothing_behind(daemon: FakeDaemon, address: str) -> None:
    with watching("--address", address) as process:
        assert process.stdout is not None
        process.stdout.readline()
        assert daemon.feed.is_watched
    wait_until(lambda: not daemon.feed.is_watched)
    with connected(address) as stub:
        assert stub.GetStatus(pb.GetStatusRequest(), timeout=PATIENCE_S).HasField("snapshot")
