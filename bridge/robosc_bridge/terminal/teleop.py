"""Driving by keys through a supervision layer.

Without keys there is no motion: a requested velocity expires soon after the last key, and the terminal repeats a held
key. Signs of life are sent while keys come or the terminal answers (ECMA-48, 8.3.35: DSR 5 is answered by CSI 0 n), so
that a program whose terminal was cut off does not count as an operator.
"""

import os
import select
import signal
import sys
import termios
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, Protocol

from robosc_bridge.terminal.client import (
    BridgeClient,
    DriveTopic,
    Operator,
    RefusedError,
    RequestedCommand,
    UnreachableError,
)
from robosc_bridge.terminal.formatting import printable

PERIOD_S = 0.1
"""Time between requests while the robot is to move."""

KEEP_ALIVE_S = 0.5
"""Time between signs of life while it is not."""

EXPIRY_S = 0.6
"""A request holds for so long after a key: longer than terminals wait before they repeat a held key, commonly 0.5 s."""

PRESENT_S = 1.5
"""The operator counts as gone after so long without a byte of the terminal."""

LINEAR_M_S, ANGULAR_RAD_S = 0.22, 2.0
"""Fastest request; what the robot may do is for the bridge's own limits."""

STEP_M_S, STEP_RAD_S = 0.02, 0.2

HELP = (
    "w/s or up/down: faster, slower   a/d or left/right: rotate   hold k: go on like this   x: halt   space: STOP   "
    "r: resume   q: end"
)

_ARROWS = {"\x1b[A": "w", "\x1b[B": "s", "\x1b[C": "d", "\x1b[D": "a"}
PRESENT = "present"
"""Answer of the terminal, in place of a key."""

_ASK = "\x1b[5n"
_CODES = {**_ARROWS, "\x1b[0n": PRESENT}
_DRIVING = frozenset("wasdk")
_ZEROS = 3
_BLOCKED_S = 1.0
_ANSWER_S = 0.1
_SIGNALS = (signal.SIGTERM, signal.SIGHUP)


class Running(Protocol):
    """Task that runs beside the keys."""

    def is_alive(self) -> bool:
        """Return True if the task has not ended."""


class Terminal(Protocol):
    """Terminal that keys come from, with its clock."""

    def monotonic(self) -> float:
        """Return the time in seconds."""

    def read(self, limit_s: float) -> list[str]:
        """Return keys that come within a time; the end of the input is a `q`."""

    def write(self, text: str) -> None:
        """Show something."""

    def start(self, run: Callable[[], None]) -> Running:
        """Let something go on beside the keys."""


class RequestedVelocity:
    """Velocity that the keys request.

    Attributes:
        linear_m_s: Forward.
        angular_rad_s: Counter-clockwise.
    """

    def __init__(self) -> None:
        self.linear_m_s = 0.0
        self.angular_rad_s = 0.0
        self._expiry_s = 0.0

    @property
    def is_motion(self) -> bool:
        """True if motion is requested."""
        return bool(self.linear_m_s or self.angular_rad_s)

    def expire(self, now_s: float) -> None:
        """Request a standstill, if no key came for too long."""
        if now_s >= self._expiry_s:
            self.linear_m_s = self.angular_rad_s = 0.0

    def press(self, key: str, now_s: float) -> None:
        """Handle a key; keys that the help does not list have no effect."""
        self.expire(now_s)
        if key in _DRIVING:
            self._expiry_s = now_s + EXPIRY_S
        match key:
            case "w" | "s":
                step = STEP_M_S if key == "w" else -STEP_M_S
                self.linear_m_s = _stepped(self.linear_m_s, step, LINEAR_M_S)
            case "a" | "d":
                angular_rad_s = STEP_RAD_S if key == "a" else -STEP_RAD_S
                self.angular_rad_s = _stepped(self.angular_rad_s, angular_rad_s, ANGULAR_RAD_S)
            case "x" | " ":
                self.linear_m_s = self.angular_rad_s = 0.0


def _stepped(value: float, step: float, most: float) -> float:
    # Rounded: steps there and back end at exactly zero.
    return round(min(max(value + step, -most), most), 6)


def keys_of(text: str) -> list[str]:
    """Return the keys in the input of a terminal: arrows as the equivalent letters, its own answer as `PRESENT`."""
    found = []
    while text:
        code = next((code for code in _CODES if text.startswith(code)), None)
        found.append(_CODES[code] if code else text[0])
        text = text[len(code or " ") :]
    return found


def teleop(client: BridgeClient) -> int:
    """Drive until `q` or the end of the terminal's input; returns the exit status.

    Raises:
        RefusedError: The bridge does not let this caller drive.
        UnreachableError: There is no terminal; or the connection is lost, and the bridge stops the wheels by itself.
    """
    if not os.isatty(sys.stdin.fileno()):
        raise UnreachableError("keys need a terminal, and there is none")
    topic = client.drive_topic()
    with _raw_keys() as number:
        drive(_ThisTerminal(number), client, topic)
    return 0


def drive(terminal: Terminal, client: BridgeClient, topic: DriveTopic) -> None:
    """Drive from a terminal until `q`; raises as `teleop`."""
    status_line = _StatusLine(terminal)
    operator = client.operate(f"teleop of {os.environ.get('USER', 'somebody')}"[:100], status_line.on_refusal)
    try:
        terminal.write(f"{HELP}\r\n")
        _drive(terminal, client, operator, topic, status_line)
    finally:
        # However it ends, also by a signal: no velocity is requested any more.
        with suppress(RefusedError, UnreachableError):
            operator.drive(topic, 0.0, 0.0)
        operator.close()
        # Answers that the terminal still owes are not for the shell.
        terminal.read(_ANSWER_S)
        with suppress(OSError):
            terminal.write("\r\n")


def _drive(
    terminal: Terminal, client: BridgeClient, operator: Operator, topic: DriveTopic, status_line: "_StatusLine"
) -> None:
    """Until a key or the end of the input ends it; raises as `teleop`."""
    requested, zeros_left, next_s, ask_s = RequestedVelocity(), 0, terminal.monotonic(), 0.0
    heard_s, resuming = next_s, _Resuming(terminal, client, status_line)
    while True:
        keys = terminal.read(max(next_s - terminal.monotonic(), 0.0))
        now_s = terminal.monotonic()
        if keys:
            heard_s = now_s
        for key in keys:
            if key in ("q", "\x03", "\x04"):
                return
            if key == PRESENT:
                continue
            requested.press(key, now_s)
            # A request goes out with the key, not with the next period.
            next_s, zeros_left = now_s, _ZEROS
            _obey(client, key, status_line, resuming)
        resuming.poll()
        now_s = terminal.monotonic()
        if now_s < next_s:
            continue
        requested.expire(now_s)
        if requested.is_motion or zeros_left:
            zeros_left = _ZEROS if requested.is_motion else zeros_left - 1
            operator.drive(topic, requested.linear_m_s, requested.angular_rad_s)
            next_s = now_s + PERIOD_S
        else:
            if now_s - heard_s < PRESENT_S:
                operator.keep_alive()
            next_s = now_s + KEEP_ALIVE_S
        status_line.show(requested, asks=now_s >= ask_s)
        if now_s >= ask_s:
            ask_s = now_s + KEEP_ALIVE_S


def _obey(client: BridgeClient, key: str, status_line: "_StatusLine", resuming: "_Resuming") -> None:
    """Keys that are for the bridge itself."""
    if key == " ":
        try:
            client.stop()
            status_line.note = "stopped: r lets it go on"
        except RefusedError as error:
            status_line.note = str(error)
    elif key == "r":
        resuming.begin()


class _Resuming:
    """Lets the robot go on, in a thread: until the bridge has answered, a stop must be typed as ever."""

    def __init__(self, terminal: Terminal, client: BridgeClient, status_line: "_StatusLine") -> None:
        self._terminal = terminal
        self._client = client
        self._status_line = status_line
        self._running: Running | None = None
        self._failure: UnreachableError | None = None

    def begin(self) -> None:
        """Request it; a second request before the first one is served changes nothing."""
        if self._running is None or not self._running.is_alive():
            self._running = self._terminal.start(self._ask)

    def poll(self) -> None:
        """Check that the bridge could be asked.

        Raises:
            UnreachableError: It could not.
        """
        if self._failure is not None:
            raise self._failure

    def _ask(self) -> None:
        try:
            self._client.request(RequestedCommand.RESUME)
            self._status_line.note = ""
        except RefusedError as error:
            self._status_line.note = str(error)
        except UnreachableError as error:
            self._failure = error


class _StatusLine:
    """The one line that reports the progress.

    Attributes:
        note: Last thing that was said.
    """

    def __init__(self, terminal: Terminal) -> None:
        self.note = ""
        self._terminal = terminal
        self._lock = threading.Lock()
        self._blocked = ("", 0.0)

    def on_refusal(self, what: str, text: str) -> None:
        """From the thread that listens: something was blocked or refused."""
        with self._lock:
            if what == "blocked":
                self._blocked = (text, self._terminal.monotonic())
            else:
                self.note = text

    def show(self, requested: RequestedVelocity, *, asks: bool) -> None:
        """Write it again, and ask the terminal whether it is there."""
        with self._lock:
            name, time_s = self._blocked
        blocked = f"   BLOCKED {name}" if name and self._terminal.monotonic() - time_s < _BLOCKED_S else ""
        text = f"{requested.linear_m_s:+.2f} m/s {requested.angular_rad_s:+.1f} rad/s{blocked}   {self.note}"
        self._terminal.write(f"\r\x1b[K{printable(text)}{_ASK if asks else ''}")


@contextmanager
def _raw_keys() -> Iterator[int]:
    """The terminal's input, key by key, as long as it lasts; the number of its file. Signals end it in order."""
    number = sys.stdin.fileno()
    before = termios.tcgetattr(number)
    handlers = {which: signal.signal(which, _leave) for which in _SIGNALS}
    try:
        tty.setraw(number)
        yield number
    finally:
        # Not drained first: a terminal that was cut off takes no more.
        with suppress(termios.error):
            termios.tcsetattr(number, termios.TCSANOW, before)
        for which, handler in handlers.items():
            signal.signal(which, handler)


def _leave(number: int, frame: Any) -> None:
    for which in _SIGNALS:
        signal.signal(which, signal.SIG_IGN)
    sys.exit(128 + number)


class _ThisTerminal:
    """The terminal of this process, key by key.

    Args:
        number: Of its file.
    """

    monotonic = staticmethod(time.monotonic)

    def __init__(self, number: int) -> None:
        self._number = number

    def read(self, limit_s: float) -> list[str]:
        """Return keys that come within a time; the end of the input is a `q`."""
        ready, _, _ = select.select([self._number], [], [], limit_s)
        if not ready:
            return []
        try:
            data = os.read(self._number, 256)
        except OSError:
            data = b""
        return keys_of(data.decode("utf-8", "replace")) if data else ["q"]

    def write(self, text: str) -> None:
        """Show something."""
        sys.stdout.write(text)
        sys.stdout.flush()

    def start(self, run: Callable[[], None]) -> threading.Thread:
        """Let something go on beside the keys."""
        thread = threading.Thread(target=run, name="resume", daemon=True)
        thread.start()
        return thread


__all__ = ["HELP", "RefusedError", "RequestedVelocity", "Terminal", "UnreachableError", "drive", "keys_of", "teleop"]
