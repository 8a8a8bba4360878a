"""
A supervision layer and the controller behind it as child processes.

Each ends when the other or their parent ends.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import ctypes
import signal
import subprocess
import sys
import time
from typing import Any

# The robot is brought to rest in less than this.
LAYER_END_S = 5.0
CONTROLLER_END_S = 2.0
POLL_S = 0.05
EXIT_CONTROLLER = 1
EXIT_USAGE = 2

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)

# prctl(2): the signal that a process gets when its parent dies.
_SET_PARENT_DEATH_SIGNAL = 1


def run_both(
    name: str,
    layer_command: Sequence[str],
    controller_command: Sequence[str],
    environment: Mapping[str, str],
) -> int:
    """
    Run both until one of them ends or a signal comes.

    1 if the controller failed, else the layer's status.

    :param name: Name that stands before what goes wrong, on standard error.
    :param layer_command: Command that starts the layer.
    :param controller_command: Command that starts the controller.
    :param environment: Environment of the layer; the controller gets this process's.
    """
    received: list[int] = []
    for number in _SIGNALS:
        signal.signal(number, lambda given, frame: received.append(given))
    end_with_parent = _end_with_parent()
    layer = controller = None
    status = 0
    try:
        # The user wrote this command.
        layer = subprocess.Popen(  # noqa: S603
            layer_command, env=environment, preexec_fn=end_with_parent
        )
        controller = subprocess.Popen(controller_command, preexec_fn=end_with_parent)  # noqa: S603
        while not received and layer.poll() is None and controller.poll() is None:
            time.sleep(POLL_S)
        status = 0 if received else _failure_of(name, controller)
    except OSError as error:
        sys.stderr.write(f'{name}: cannot start the controller: {error}\n')
        status = EXIT_USAGE
    # The layer first: what the controller still sends goes nowhere, and the robot is at rest.
    layer_status = _stopped(layer, LAYER_END_S)
    _stopped(controller, CONTROLLER_END_S)
    return status or layer_status


def _end_with_parent() -> Callable[[], Any] | None:
    """
    Return the function that a child runs first, to be ended even where its parent is killed.

    None where that cannot be had.
    """
    try:
        prctl = ctypes.CDLL(None).prctl
    except (AttributeError, OSError):
        return None
    return lambda: prctl(_SET_PARENT_DEATH_SIGNAL, int(signal.SIGTERM), 0, 0, 0)


def _failure_of(name: str, controller: subprocess.Popen[bytes]) -> int:
    """1, with a line that says so, if the controller ended in failure, else 0."""
    status = controller.poll()
    if not status:
        return 0
    sys.stderr.write(f'{name}: the controller ended with status {status}\n')
    return EXIT_CONTROLLER


def _stopped(process: subprocess.Popen[bytes] | None, limit_s: float) -> int:
    """End a process, with force if need be: its exit status, 1 if a signal ended it."""
    if process is None:
        return 0
    if process.poll() is None:
        process.terminate()
    try:
        status = process.wait(limit_s)
    except subprocess.TimeoutExpired:
        process.kill()
        status = process.wait()
    return 1 if status < 0 else status
