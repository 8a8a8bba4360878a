"""Driving by keys through a supervision layer."""

import os
import select
import sys
import termios
import threading
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager

from robosc_bridge.terminal.client import BridgeClient, RefusedError, UnreachableError, Wish
from robosc_bridge.terminal.shown import printable

PERIOD_S = 0.1
"""Time between requests while the robot is to move."""

KEEP_ALIVE_S = 0.5
"""Time between signs of life while it is not."""

LINEAR_M_S, ANGULAR_RAD_S = 0.22, 2.0
"""Fastest wish; what the robot may do is for the bridge's own limits."""

STEP_M_S, STEP_RAD_S = 0.02, 0.2

HELP = "w/s or up/down: faster, slower   a/d or left/right: turn   x: halt   space: STOP   r: resume   q: end"

_ARROWS = {"\x1b[A": "w", "\x1b[B": "s", "\x1b[C": "d", "\x1b[D": "a"}
_ZEROS = 3
_BLOCKED_S = 1.0


class Wished:
    """The velocity that the keys ask for.

    Attributes:
        linear_m_s: Forward.
        angular_rad_s: Counter-clockwise.
    """

    def __init__(self) -> None:
        self.linear_m_s = 0.0
        self.angular_rad_s = 0.0

    @property
    def is_motion(self) -> bool:
        """Whether the robot is to move."""
        return bool(self.linear_m_s or self.angular_rad_s)

    def press(self, key: str) -> None:
        """Heed a key; any but those of the help changes nothing."""
        match key:
            case "w" | "s":
                step = STEP_M_S if key == "w" else -STEP_M_S
                self.linear_m_s = _stepped(self.linear_m_s, step, LINEAR_M_S)
            case "a" | "d":
                turn = STEP_RAD_S if key == "a" else -STEP_RAD_S
                self.angular_rad_s = _stepped(self.angular_rad_s, turn, ANGULAR_RAD_S)
            case "x" | " ":
                self.linear_m_s = self.angular_rad_s = 0.0


def _stepped(value: float, step: float, most: float) -> float:
    # Rounded: steps there and back end at exactly zero.
    return round(min(max(value + step, -most), most), 6)


def keys_of(text: str) -> list[str]:
    """The keys in what a terminal sent; arrows as the letters that mean the same."""
    found = []
    while text:
        arrow = next((code for code in _ARROWS if text.startswith(code)), None)
        found.append(_ARROWS[arrow] if arrow else text[0])
        text = text[len(arrow or " ") :]
    return found


def teleop(client: BridgeClient) -> int:
    """Drive until `q` or the end of the terminal's input; the exit status.

    Raises:
        RefusedError: The bridge does not let this caller drive.
        UnreachableError: There is no terminal; or the connection is lost, and the bridge stops the wheels by itself.
    """
    if not os.isatty(sys.stdin.fileno()):
        raise UnreachableError("keys are typed in a terminal, and there is none")
    topic = client.drive_topic()
    teller = _Teller()
    operator = client.operate(f"teleop of {os.environ.get('USER', 'somebody')}"[:100], teller.told)
    wished, zeros_left, next_s, is_on = Wished(), 0, time.monotonic(), True
    with _raw_keys() as number:
        sys.stdout.write(f"{HELP}\r\n")
        try:
            while is_on:
                for key in _read(number, max(next_s - time.monotonic(), 0.0)):
                    is_on = is_on and key not in ("q", "\x03", "\x04")
                    wished.press(key)
                    # What is wished goes out with the key, not with the next period.
                    next_s, zeros_left = time.monotonic(), _ZEROS
                    _obey(client, key, teller)
                if not is_on:
                    break
                if time.monotonic() >= next_s:
                    if wished.is_motion or zeros_left:
                        zeros_left = _ZEROS if wished.is_motion else zeros_left - 1
                        operator.drive(topic, wished.linear_m_s, wished.angular_rad_s)
                        next_s = time.monotonic() + PERIOD_S
                    else:
                        operator.keep_alive()
                        next_s = time.monotonic() + KEEP_ALIVE_S
                    teller.show(wished)
            operator.drive(topic, 0.0, 0.0)
        finally:
            operator.close()
            sys.stdout.write("\r\n")
    return 0


def _obey(client: BridgeClient, key: str, teller: "_Teller") -> None:
    """Keys that are for the bridge itself."""
    try:
        if key == " ":
            client.stop()
            teller.note = "stopped: r lets it go on"
        elif key == "r":
            client.want(Wish.RESUME)
            teller.note = ""
    except RefusedError as error:
        teller.note = str(error)


class _Teller:
    """The one line that tells how it goes.

    Attributes:
        note: What was said last.
    """

    def __init__(self) -> None:
        self.note = ""
        self._lock = threading.Lock()
        self._blocked = ("", 0.0)

    def told(self, what: str, text: str) -> None:
        """From the thread that listens: something was blocked or refused."""
        with self._lock:
            if what == "blocked":
                self._blocked = (text, time.monotonic())
            else:
                self.note = text

    def show(self, wished: Wished) -> None:
        """Write it again."""
        with self._lock:
            name, time_s = self._blocked
        blocked = f"   BLOCKED {name}" if name and time.monotonic() - time_s < _BLOCKED_S else ""
        text = f"{wished.linear_m_s:+.2f} m/s {wished.angular_rad_s:+.1f} rad/s{blocked}   {self.note}"
        sys.stdout.write(f"\r\x1b[K{printable(text)}")
        sys.stdout.flush()


@contextmanager
def _raw_keys() -> Iterator[int]:
    """The terminal's input, key by key, as long as it lasts; the number of its file."""
    number = sys.stdin.fileno()
    before = termios.tcgetattr(number)
    tty.setraw(number)
    try:
        yield number
    finally:
        termios.tcsetattr(number, termios.TCSADRAIN, before)


def _read(number: int, limit_s: float) -> list[str]:
    """Keys that come within a time; the end of the input is a `q`."""
    ready, _, _ = select.select([number], [], [], limit_s)
    if not ready:
        return []
    try:
        data = os.read(number, 256)
    except OSError:
        data = b""
    return keys_of(data.decode("utf-8", "replace")) if data else ["q"]


__all__ = ["HELP", "RefusedError", "UnreachableError", "Wished", "keys_of", "teleop"]
