"""The simulated camera's socket: what goes over it, read here with nothing of the drivers."""

import contextlib
import re
import socket
import stat
from pathlib import Path

import numpy as np
import pytest

from robosc.execution.runtime.clock import ManualClock
from robosc_simulated import BODIES, Scene, SimulatedCamera, SimulatedTurtleBot3, Timebase, Track, Walls, World, oval
from robosc_simulated.commands import UnknownCommandError, execute
from robosc_simulated.floor import SHADE as LINE
from support.descriptors import open_descriptors

HEAD = b"P5 160 120 255\n"
SIZE = len(HEAD) + 160 * 120


class Stage:
    """A camera over a line, and time in the hands of a test."""

    def __init__(self, path: Path | None = None) -> None:
        self.time = Timebase(ManualClock())
        scene = Scene("line", Walls(()), line=Track([(-1.0, 0.0), (2.0, 0.0)]))
        self.world = World(BODIES["burger"], scene, self.time)
        self.camera = SimulatedCamera(self.world, path)

    def connected(self) -> socket.socket:
        found = socket.socket(socket.AF_UNIX)
        found.settimeout(5.0)
        found.connect(self.camera.path)
        return found


def received(client: socket.socket, count: int) -> bytes:
    data = b""
    while len(data) < count:
        more = client.recv(count - len(data))
        assert more, f"only {len(data)} bytes"
        data += more
    return data


def is_silent(client: socket.socket) -> bool:
    client.setblocking(False)
    try:
        return not client.recv(1)
    except BlockingIOError:
        return True
    finally:
        client.settimeout(5.0)


def test_pictures_come_at_their_rate_and_show_the_line() -> None:
    scene = Stage()
    with scene.connected() as client:
        scene.time.advance(0.01)
        received(client, SIZE)
        scene.time.advance(0.03)
        assert is_silent(client)
        data = b""
        for _ in range(20):
            scene.time.advance(0.05)
            data += received(client, SIZE)
            assert is_silent(client)
        assert re.findall(rb"P5 \d+ \d+ 255\n", data) == [HEAD] * 20
        picture = np.frombuffer(data[len(HEAD) : SIZE], np.uint8).reshape(120, 160)
        assert np.flatnonzero(picture[100] == LINE).mean() == pytest.approx(79.5)
    scene.camera.close()
    scene.camera.close()


def test_it_sees_from_where_the_robot_is_now() -> None:
    scene = Stage()
    scene.world.place(0.0, 0.03, 0.0)
    with scene.connected() as client:
        scene.time.advance(0.01)
        picture = np.frombuffer(received(client, SIZE)[len(HEAD) :], np.uint8).reshape(120, 160)
        assert np.flatnonzero(picture[100] == LINE).mean() > 90
        scene.camera.is_covered = True
        scene.time.advance(0.05)
        assert set(received(client, SIZE)[len(HEAD) :]) == {0}
        scene.camera.is_frozen = True
        scene.time.advance(1.0)
        assert is_silent(client)
    scene.camera.close()


def test_one_who_does_not_read_misses_whole_pictures() -> None:
    scene = Stage()
    with scene.connected() as client:
        scene.time.advance(30.0)
        data = b""
        client.setblocking(False)
        for _ in range(200):
            scene.time.advance(0.05)
            with contextlib.suppress(BlockingIOError):
                data += client.recv(SIZE // 3)
        assert len(data) > 20 * SIZE
        for begin in range(0, len(data) - SIZE, SIZE):
            assert data[begin : begin + len(HEAD)] == HEAD
        # Most of 800 were never sent.
        assert scene.camera.sent < 100
    scene.camera.close()


def test_a_plug_that_is_pulled_ends_all_connections(tmp_path: Path) -> None:
    path = tmp_path / "camera"
    scene = Stage(path)
    with scene.connected() as client:
        scene.time.advance(0.01)
        received(client, SIZE)
        scene.camera.disconnect()
        scene.camera.disconnect()
        assert client.recv(1) == b""
    assert not path.exists()
    assert not scene.camera.is_connected
    scene.time.advance(1.0)
    scene.camera.reconnect()
    scene.camera.reconnect()
    assert stat.S_ISSOCK(path.stat().st_mode)
    with scene.connected() as client:
        scene.time.advance(0.1)
        received(client, SIZE)
    scene.camera.close()
    scene.camera.reconnect()
    assert list(tmp_path.iterdir()) == []


def test_only_a_few_are_served() -> None:
    scene = Stage()
    clients = []
    for _ in range(6):
        clients.append(scene.connected())
        scene.time.advance(0.01)
    scene.time.advance(0.05)
    for number, client in enumerate(clients):
        assert (client.recv(1) == b"") is (number >= 4)
        client.close()
    scene.time.advance(0.1)
    with scene.connected() as client:
        scene.time.advance(0.1)
        received(client, SIZE)
    scene.camera.close()


def test_what_is_there_already_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "camera"
    path.write_text("mine")
    before = open_descriptors()
    with pytest.raises(FileExistsError, match="something at"):
        SimulatedTurtleBot3(camera_link=path, clock=ManualClock())
    with pytest.raises(OSError, match="too long"):
        SimulatedTurtleBot3(camera_link=tmp_path / ("x" * 120), clock=ManualClock())
    assert path.read_text() == "mine"
    assert open_descriptors() <= before


def test_it_obeys_commands() -> None:
    with SimulatedTurtleBot3(line=oval(), clock=ManualClock()) as robot:
        camera = robot.camera
        assert camera is not None
        execute(robot, "camera cover")
        execute(robot, "camera freeze")
        assert (camera.is_covered, camera.is_frozen) == (True, True)
        execute(robot, "camera uncover")
        execute(robot, "camera go")
        assert (camera.is_covered, camera.is_frozen) == (False, False)
        execute(robot, "camera disconnect")
        assert not camera.is_connected
        execute(robot, "camera reconnect")
        assert camera.is_connected
        with pytest.raises(UnknownCommandError, match="a camera does not know 'jump'"):
            execute(robot, "camera jump")
    with SimulatedTurtleBot3(clock=ManualClock()) as robot, pytest.raises(UnknownCommandError):
        execute(robot, "camera cover")
