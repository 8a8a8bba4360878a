"""Cameras as streams: of a simulator's socket, and of a process that reads a film or a device that hangs."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from robosc_bridge.devices.camera import SIMULATED, Camera, GreyRows, ProcessCamera, make_camera
from robosc_bridge.errors import BridgeError, LineDeniedError, LineError, LineLostError, LineMissingError
from robosc_bridge.protocol.netpbm import GreyPicture, encoded
from support.waiting import wait_until

LIMIT_S = 20.0


def picture(shade: int, width: int = 8, height: int = 6) -> bytes:
    return encoded(GreyPicture(width, height, bytes([shade]) * (width * height)))


class Served:
    """A socket that a test writes pictures into."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(str(path))
        self._listener.listen(1)
        self.camera = make_camera(SIMULATED + str(path))
        self.camera.open()
        self.end, _ = self._listener.accept()

    def close(self) -> None:
        self.camera.close()
        self.end.close()
        self._listener.close()


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    found = Served(tmp_path / "socket")
    yield found
    found.close()


def shade(found: GreyRows | None) -> int | None:
    return None if found is None else int(found[0, 0])


def test_a_picture_comes_as_it_was_sent(served: Served) -> None:
    pixels = np.arange(48, dtype=np.uint8).reshape(6, 8)
    served.end.sendall(encoded(GreyPicture(8, 6, pixels.tobytes())))
    found = served.camera.receive(LIMIT_S)
    assert found is not None
    assert found.tolist() == pixels.tolist()


@pytest.mark.parametrize("chunk", [100_000, 64])
def test_the_newest_of_those_that_wait_counts(chunk: int, served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("robosc_bridge.devices.camera._CHUNK", chunk)
    for number in range(100):
        served.end.sendall(picture(number))
    assert shade(served.camera.receive(LIMIT_S)) == 99
    served.end.sendall(picture(100) + picture(101)[:20])
    assert shade(served.camera.receive(LIMIT_S)) == 100
    served.end.sendall(picture(101)[20:])
    assert shade(served.camera.receive(LIMIT_S)) == 101


def test_without_a_picture_it_waits_no_longer_than_it_may(served: Served) -> None:
    begin_s = time.monotonic()
    assert served.camera.receive(0.05) is None
    assert 0.05 <= time.monotonic() - begin_s < LIMIT_S


def test_one_who_sends_without_end_does_not_hold_it_up(served: Served, monkeypatch: pytest.MonkeyPatch) -> None:
    # So slow a reader is never done.
    monkeypatch.setattr("robosc_bridge.devices.camera._CHUNK", 64)
    for number in range(100):
        served.end.sendall(picture(number, 20, 20))
    assert shade(served.camera.receive(0.0)) != 99
    end_s = time.monotonic() + LIMIT_S
    while shade(served.camera.receive(0.0)) != 99:
        assert time.monotonic() < end_s


def test_what_are_no_pictures_is_reported(served: Served) -> None:
    served.end.sendall(b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\n\r\n")
    with pytest.raises(BridgeError, match=f"{served.path}: the stream does not hold grey pictures"):
        served.camera.receive(LIMIT_S)


def test_whoever_ends_is_gone_and_can_come_again(served: Served) -> None:
    served.end.sendall(picture(1)[:20])
    served.end.close()
    with pytest.raises(LineLostError, match="whoever served its pictures has ended"):
        while served.camera.receive(LIMIT_S) is None:
            pass
    served.camera.close()
    with pytest.raises(LineLostError, match="not open"):
        served.camera.receive(0.0)
    served.camera.open()
    again, _ = served._listener.accept()
    # The half picture is gone.
    again.sendall(picture(7))
    assert shade(served.camera.receive(LIMIT_S)) == 7
    again.close()


def test_a_socket_that_is_missing_or_nobody_serves_is_reported(tmp_path: Path) -> None:
    for path in (tmp_path / "none", tmp_path / "dead"):
        if path.name == "dead":
            with socket.socket(socket.AF_UNIX) as listener:
                listener.bind(str(path))
        with pytest.raises(LineMissingError, match=f"{path}: no program serves pictures there"):
            make_camera(f"{SIMULATED}{path}").open()
    with pytest.raises(LineError, match="cannot be opened"):
        make_camera(SIMULATED + "x" * 200).open()


def film(path: Path, pictures: int, rate_hz: float) -> Path:
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), rate_hz, (64, 48))
    for number in range(pictures):
        writer.write(np.full((48, 64, 3), 100 + number % 100, np.uint8))
    writer.release()
    return path


def until(camera: Camera, condition: Callable[[GreyRows | None], bool]) -> None:
    end_s = time.monotonic() + LIMIT_S
    while not condition(camera.receive(0.05)):
        assert time.monotonic() < end_s


def process_of(camera: Camera) -> subprocess.Popen[bytes]:
    assert isinstance(camera, ProcessCamera)
    assert camera._process is not None
    return camera._process


def test_a_film_is_shown_at_its_speed_and_ends(tmp_path: Path) -> None:
    camera = make_camera(str(film(tmp_path / "film.avi", 10, 20.0)))
    camera.open()
    until(camera, lambda found: found is not None and found.shape == (48, 64))
    begin_s = time.monotonic()
    with pytest.raises(LineLostError, match=r"film.avi: no more pictures come"):
        until(camera, lambda found: False)
    assert time.monotonic() - begin_s > 0.3
    process = process_of(camera)
    camera.close()
    camera.close()
    assert process.returncode is not None


def test_its_process_ends_with_the_bridge_even_while_it_hangs(tmp_path: Path) -> None:
    path = tmp_path / "hangs"
    os.mkfifo(path)
    camera = make_camera(str(path))
    camera.open()
    process = process_of(camera)
    assert process.stdin is not None
    process.stdin.close()
    process.wait(LIMIT_S)
    camera.close()


def test_a_process_that_is_killed_is_reported(tmp_path: Path) -> None:
    camera = make_camera(str(film(tmp_path / "film.avi", 300, 20.0)))
    camera.open()
    process_of(camera).kill()
    with pytest.raises(LineLostError, match="has ended with status -9"):
        until(camera, lambda found: False)
    camera.close()


def test_what_is_wrong_with_a_camera_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(LineMissingError, match="video7: there is no such camera"):
        make_camera(str(tmp_path / "video7")).open()
    text = tmp_path / "text"
    text.write_text("no film")
    camera = make_camera(str(text))
    camera.open()
    with pytest.raises(
        LineError, match="text: no pictures can be read: another program uses it, or it is not a camera"
    ):
        until(camera, lambda found: False)
    camera.close()
    monkeypatch.setattr("robosc_bridge.devices.camera.os.access", lambda *_: False)
    with pytest.raises(LineDeniedError, match="in the group video"):
        make_camera(str(text)).open()


def test_a_process_that_cannot_be_started_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "executable", str(tmp_path / "none"))
    with pytest.raises(LineError, match="no process for the camera could be started"):
        make_camera("/dev/null").open()


def test_a_camera_process_whose_host_hears_no_more_ends(tmp_path: Path) -> None:
    """A camera process ends that writes into a pipe without a reader."""
    path = film(tmp_path / "film.avi", 300, 20.0)
    command = [sys.executable, "-m", "robosc_bridge.devices.camera_process", str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None and process.stderr is not None
        process.stdout.close()
        wait_until(lambda: process.poll() is not None)
        assert process.stderr.read() == b""
