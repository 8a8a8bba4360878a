"""Draws the way of a scan to a wheel through the bridge, docs/pictures/scan-to-wheel.svg.

    python deploy/draw_scan_to_wheel.py        # also part of make pictures

Every hop is a function by its name, and times are the constants of the code: tests look whether there are such
functions, whether a bridge calls them in this order and in these threads, and whether the picture is up to date.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

from robosc_bridge.assembly import EXCHANGE_S
from robosc_bridge.configuration.structure import Execution

PICTURE = Path(__file__).parents[1] / "docs" / "pictures" / "scan-to-wheel.svg"

SCANNER, LOOP, DRIVE = "scanner", "loop", "drive"
LANES = {
    SCANNER: "thread of the LiDAR",
    LOOP: "thread of the loop",
    DRIVE: "thread of the drive base",
}
"""Threads, with their titles."""


@dataclass(frozen=True)
class Hop:
    """A function on the way.

    Attributes:
        thread: Key of `LANES`.
        function: Name of the function, `module:name`.
        note: Effect on the scan or the command, in a few words.
        time: Time that is spent waiting, before or in it; empty: none.
    """

    thread: str
    function: str
    note: str
    time: str = ""

    @property
    def is_safety(self) -> bool:
        """True if it is one of the safety layer."""
        return self.function.startswith("robosc_bridge.safety.")


_PERIOD, _EXCHANGE = f"{Execution().period_s * 1000:g} ms", f"{EXCHANGE_S * 1000:g} ms"

HOPS = (
    Hop(SCANNER, "robosc_bridge.devices.lidar:Lidar.receive", "waits for bytes", "a revolution: 100 to 200 ms"),
    Hop(SCANNER, "robosc_bridge.transport.serial_line:SerialLine.read", "bytes of the last frame"),
    Hop(SCANNER, "robosc_bridge.protocol.framing:FrameDecoder.feed", "frames; damaged ones are dropped"),
    Hop(SCANNER, "robosc_bridge.protocol.revolutions:RevolutionBuilder.add", "points, up to a full revolution"),
    Hop(SCANNER, "robosc_bridge.protocol.revolutions:nearest_by_degree", "360 ranges, the nearest of each degree"),
    Hop(SCANNER, "robosc_bridge.safety.layer:SafetyLayer.on_scan", "there is a scan, and how much it sees"),
    Hop(SCANNER, "robosc_bridge.daemon.loop:Daemon.post", "into the inbox; never waits"),
    Hop(LOOP, "robosc_bridge.daemon.loop:Daemon.cycle", "woken by the inbox"),
    Hop(LOOP, "robosc_bridge.safety.layer:SafetyLayer.loop_cycled", "the loop is at work"),
    Hop(LOOP, "robosc_bridge.daemon.robot.adapter:RobotAdapter.on_scan", "for all that is mapped to scanner"),
    Hop(LOOP, "robosc_bridge.daemon.channel_data:scan_data", "as sensor_msgs/LaserScan"),
    Hop(LOOP, "robosc.execution.runtime.runner:Runner.receive", "an event of the model: its state is another"),
    Hop(
        LOOP,
        "robosc.execution.runtime.requests:PolicyDecisions.decide",
        f"chooses a request; by `every: period`, up to {_PERIOD} later",
    ),
    Hop(LOOP, "robosc_bridge.daemon.robot.adapter:RobotAdapter.publish", "a message for the drive"),
    Hop(LOOP, "robosc_bridge.daemon.robot.motion:MotionTarget.drive", "the wanted velocity"),
    Hop(LOOP, "robosc_bridge.safety.layer:SafetyLayer.command", "brought within the limits"),
    Hop(LOOP, "robosc_bridge.daemon.threads.device_thread:DeviceThread.hurry", "another velocity: at once"),
    Hop(LOOP, "robosc_bridge.daemon.threads.workers:DriveWorker.wake", "also into an exchange under way"),
    Hop(
        DRIVE,
        "robosc_bridge.daemon.threads.workers:DriveWorker.step",
        f"hurried, or each {_EXCHANGE}",
        "answers on a bus of servos: up to 3 ms",
    ),
    Hop(DRIVE, "robosc_bridge.safety.layer:SafetyLayer.output", "zero for any reason; else a ramp"),
    Hop(DRIVE, "robosc_bridge.devices.opencr:OpenCrBase.exchange", "or of another drive base"),
    Hop(DRIVE, "robosc_bridge.devices.kinematics:opencr_words", "in units of the board"),
    Hop(DRIVE, "robosc_bridge.devices.dynamixel_bus:DynamixelBus.write", "a packet; its answer is awaited later"),
    Hop(DRIVE, "robosc_bridge.transport.serial_line:SerialLine.write", "bytes on the way to the wheel"),
    Hop(DRIVE, "robosc_bridge.daemon.threads.workers:DriveWorker.written", "the time `scan_to_wheel` ends here"),
)
"""The way, in the order in which functions are entered."""

HANDOVERS = {LOOP: "inbox", DRIVE: "hurry"}
"""Names of what hands the way over to a thread."""

_LANE, _GAP, _BOX, _ROW, _TOP, _EDGE = 330, 24, 40, 50, 92, 16
_INK, _QUIET, _LINE, _SAFETY, _TIME = "#1b1f24", "#57606a", "#8c959f", "#b42318", "#0550ae"


def drawn() -> str:
    """Return the picture."""
    width = 2 * _EDGE + len(LANES) * _LANE + (len(LANES) - 1) * _GAP
    columns = {thread: _EDGE + number * (_LANE + _GAP) for number, thread in enumerate(LANES)}
    rows: dict[str, list[Hop]] = {thread: [hop for hop in HOPS if hop.thread == thread] for thread in LANES}
    height = _TOP + max(map(_height, rows.values())) + 56
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" '
        'font-family="Helvetica, Arial, sans-serif">',
        "<title>The way of a scan to a wheel: threads, functions, times, and the safety layer</title>",
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        f'<path d="M0 0 8 4 0 8z" fill="{_LINE}"/></marker></defs>',
    ]
    ends: dict[str, tuple[int, int]] = {}
    for thread, hops in rows.items():
        left, lane_height = columns[thread], _height(hops) + 22
        parts.append(
            f'<rect x="{left}" y="{_TOP - 76}" width="{_LANE}" height="{lane_height + 32}" rx="8" fill="#f6f8fa" '
            f'stroke="{_LINE}"/>'
        )
        parts.append(_text(left + 14, _TOP - 52, LANES[thread], 15, _INK, is_bold=True))
        y = previous = _TOP - 30
        for number, hop in enumerate(hops):
            if hop.time:
                parts.append(_text(left + 46, y + 14, hop.time, 12, _TIME, is_bold=True))
                y += 24
            parts += _box(left + 14, y, hop)
            if number == 0:
                ends[f"{thread} begins"] = left + 14, y + _BOX // 2
            else:
                parts.append(_arrow(f"M{left + 34} {previous} V{y}"))
            previous = y + _BOX
            y += _ROW
        ends[f"{thread} ends"] = left + _LANE - 14, previous - _BOX // 2
    for before, after in zip(LANES, list(LANES)[1:], strict=False):
        (from_x, from_y), (to_x, to_y) = ends[f"{before} ends"], ends[f"{after} begins"]
        middle = from_x + 14 + _GAP // 2
        parts.append(_arrow(f"M{from_x} {from_y} H{middle} V{to_y} H{to_x}"))
        label_y = (from_y + to_y) // 2
        parts.append(
            f'<text x="{middle - 5}" y="{label_y}" font-size="12" fill="{_INK}" text-anchor="middle" '
            f'transform="rotate(-90 {middle - 5} {label_y})">{HANDOVERS[after]}</text>'
        )
    y = height - 20
    parts.append(f'<rect x="{_EDGE}" y="{y - 12}" width="22" height="15" rx="3" fill="#fff1f0" stroke="{_SAFETY}"/>')
    legend = "the safety layer: one lock, held for some 40 µs; all that moves a wheel goes through its output"
    parts.append(_text(_EDGE + 30, y, legend, 12, _INK))
    parts.append(_text(_EDGE + 620, y, "blue: where it waits; all else is computing", 12, _TIME))
    return "\n".join([*parts, "</svg>", ""])


def _height(hops: list[Hop]) -> int:
    return len(hops) * _ROW + sum(24 for hop in hops if hop.time)


def _box(x: int, y: int, hop: Hop) -> list[str]:
    fill, stroke = ("#fff1f0", _SAFETY) if hop.is_safety else ("#ffffff", _LINE)
    module, _, name = hop.function.partition(":")
    return [
        f'<rect x="{x}" y="{y}" width="{_LANE - 28}" height="{_BOX}" rx="5" fill="{fill}" stroke="{stroke}">'
        f"<title>{escape(module)}</title></rect>",
        _text(x + 10, y + 17, name, 13, _SAFETY if hop.is_safety else _INK, is_bold=True),
        _text(x + 10, y + 33, hop.note, 12, _QUIET),
    ]


def _text(x: int, y: int, text: str, size: int, colour: str, *, is_bold: bool = False) -> str:
    weight = ' font-weight="bold"' if is_bold else ""
    return f'<text x="{x}" y="{y}" font-size="{size}" fill="{colour}"{weight}>{escape(text)}</text>'


def _arrow(path: str) -> str:
    return f'<path d="{path}" fill="none" stroke="{_LINE}" stroke-width="1.5" marker-end="url(#tip)"/>'


def main() -> int:
    """Draw it; returns the exit status."""
    PICTURE.write_text(drawn(), encoding="utf-8")
    sys.stdout.write(f"{PICTURE}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
