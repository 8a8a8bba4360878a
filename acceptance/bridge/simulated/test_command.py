"""The simulator as a program of its own, and its commands."""

import re
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from robosc_simulated import read_motion
from support.waiting import wait_until
from support.wire import Host


class Program:
    """A simulator process and its two ends."""

    def __init__(self, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "robosc_simulated", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.input, self.output = self.process.stdin, self.process.stdout

    def send(self, line: str) -> None:
        self.input.write(line + "\n")
        self.input.flush()

    def ask(self, line: str) -> str:
        self.send(line)
        return self.output.readline().strip()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_serves_until_it_is_interrupted(number: int, tmp_path: Path) -> None:
    links = tmp_path / "base", tmp_path / "scanner"
    program = Program(
        "--robot", "burger", "--base", "dynamixel", "--lidar", "lds02", "--maze", "4x3", "--speed", "2",
        "--base-link", str(links[0]), "--scanner-link", str(links[1]),
    )  # fmt: skip
    with program.process as process:
        assert program.output.readline() == f"base {links[0]}\n"
        assert program.output.readline() == f"scanner {links[1]}\n"
        with Host(str(links[0])) as host:
            assert host.ask("ff ff fd 00 01 03 00 01 19 4e") == "ff ff fd 00 01 07 00 55 00 24 04 2d f4 df"
        with Host(str(links[1]), 115_200) as host:
            assert b"\x54\x2c" in host.receive(200)
        assert program.ask("pose") == "pose 0.0000 0.0000 0.0000"
        assert program.ask("jump").startswith("error: unknown command 'jump'")
        program.send("base disconnect")
        wait_until(lambda: not links[0].is_symlink())
        process.send_signal(number)
        assert process.wait(10) == 0
        assert process.stderr is not None
        assert process.stderr.read() == ""
    assert list(tmp_path.iterdir()) == []


def test_with_a_line_it_serves_a_camera_as_well(tmp_path: Path) -> None:
    track = tmp_path / "track"
    track.write_text("0 0\n2 0\n")
    for arguments in (["--line", "oval"], ["--line", str(track), "--camera-link", str(tmp_path / "camera")]):
        program = Program(*arguments)
        with program.process as process:
            found = dict(program.output.readline().split() for _ in range(3))
            assert list(found) == ["base", "scanner", "camera"]
            with socket.socket(socket.AF_UNIX) as client:
                client.settimeout(10.0)
                client.connect(found["camera"])
                assert client.recv(15, socket.MSG_WAITALL) == b"P5 160 120 255\n"
            process.terminate()
            assert process.wait(10) == 0
    assert found["camera"] == str(tmp_path / "camera")
    assert list(tmp_path.iterdir()) == [track]


def test_a_scene_is_served_and_its_motion_recorded(tmp_path: Path) -> None:
    scene, motion = tmp_path / "yard.yaml", tmp_path / "motion.jsonl"
    scene.write_text("goal: {x_m: 1, y_m: 0, radius_m: 0.2}\nobstacles: {box: {x_m: 3, y_m: 0, radius_m: 0.1}}\n")
    program = Program("--scene", str(scene), "--motion", str(motion))
    with program.process as process:
        assert [program.output.readline().split()[0] for _ in range(2)] == ["base", "scanner"]
        assert program.ask("goal") == "not yet"
        program.send("obstacle box 2 1")
        program.send("pose 1 0 0")
        assert re.fullmatch(r"reached [0-9.]+", program.ask("goal"))
        process.terminate()
        assert process.wait(10) == 0
    found = read_motion(motion)
    assert [event.happening for event in found.happenings] == ["obstacle", "goal"]
    assert (found.samples[0].x_m, found.samples[-1].x_m) == (0.0, 1.0)


def test_a_maze_on_the_command_line_has_an_exit() -> None:
    program = Program("--maze", "3x2")
    with program.process as process:
        program.output.readline()
        program.output.readline()
        program.send("pose 2 2 0")
        assert program.ask("goal").startswith("reached")
        process.terminate()
        assert process.wait(10) == 0


def test_it_goes_on_when_its_input_ends() -> None:
    program = Program("--lidar", "lds01")
    with program.process as process:
        base = program.output.readline().split()[1]
        program.input.close()
        with Host(base) as host:
            assert host.ask("ff ff fd 00 c8 03 00 01 3b fa") == "ff ff fd 00 c8 07 00 55 00 00 50 05 4c b7"
        process.terminate()
        assert process.wait(10) == 0
