"""Cameras as streams: of a simulator's socket, and of a process that reads a film or a device that hangs."""

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

from robosc_bridge.devices.camera import Camera, ProcessCamera, make_camera


def process_of(camera: Camera) -> subprocess.Popen[bytes]:
    assert isinstance(camera, ProcessCamera)
    assert camera._process is not None
    return camera._process


@pytest.mark.real_time
def test_a_camera_that_hangs_while_it_is_opened_is_left(tmp_path: Path) -> None:
    """Use a pipe without a writer: opening it waits for ever."""
    path = tmp_path / "hangs"
    os.mkfifo(path)
    camera = make_camera(str(path))
    camera.open()
    process = process_of(camera)
    assert camera.receive(0.1) is None
    begin_s = time.monotonic()
    camera.close()
    assert time.monotonic() - begin_s < 2.0
    assert process.returncode == -signal.SIGKILL
