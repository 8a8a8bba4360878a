"""Benchmark of the time until the bridge stops a robot that sees an obstacle, from the wire to the wire.

`robosc-bridge run` drives a simulated robot that is put before a wall and back again; all data at the devices' ends
of both lines is recorded with its times. *Reaction*: from the last byte of the frame that ends the first turn of the
LiDAR with the obstacle in it, to the first byte of the command of zero; the bridge decides at each event, and nothing
is wrong with the lines. The bridge and the simulator have priority over other programs where that is permitted.

A virtual machine does not always run: *undisturbed* are the trials during which no processor was taken away for more
than a millisecond, from the last exchange before the obstacle was shown to the command; the remaining time is that of
the bridge and the simulator.

Usage: reaction.py [--trials N] [--lidar NAME]
"""

import argparse
import math
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[3]
sys.path[:0] = [
    str(Path(__file__).parent), str(ROOT), str(ROOT / "bridge"), str(ROOT / "tests" / "benchmarks")
]  # fmt: skip

from rig import (  # noqa: E402
    LIMIT_S,
    STOP_AT_OBSTACLE,
    STOP_CHANNELS,
    Machine,
    Simulator,
    configuration,
    environment,
    in_ms,
    percentile,
    simulated,
    spread,
)

from figures import text_table  # noqa: E402  # found through the path above
from robosc_bridge.devices.lidar import LDS01, LDS02, LDS03, Model  # noqa: E402
from robosc_bridge.protocol.revolutions import RevolutionBuilder, nearest_by_degree  # noqa: E402
from robosc_simulated.recorder import Record, read_records  # noqa: E402
from support.real_time import preferred  # noqa: E402  # rig adds its folder to the path

TRIALS = 200
LIDAR = "lds03"
MODELS: dict[str, Model[Any]] = {model.name: model for model in (LDS01, LDS02, LDS03)}
CASES = (("dynamixel", 0.010, 0.015), ("opencr", 0.020, 0.025))
"""Base, period, and what the 99th percentile should stay below."""

TURN_S = {"lds01": 0.2, "lds02": 0.17, "lds03": 0.1}
FAR, NEAR = "pose 0 0 0", "pose 1.7 0 0"
NEAREST_M = 0.5
AHEAD = (0, 20, 340)

HEADER = [
    "base, period", "trials", "p50, ms", "p99, ms", "max, ms", "undisturbed", "p50, ms", "p99, ms", "max, ms",
    "aim (p99), ms", "all", "undisturbed",
]  # fmt: skip


@dataclass(frozen=True)
class Trial:
    """One stop of the robot.

    Attributes:
        shown_s: Time at which the last byte of the turn that shows the obstacle was sent, in seconds.
        stopped_s: Time at which the first byte of the command of zero had come, in seconds; infinity: not while the
            obstacle was there.
    """

    shown_s: float
    stopped_s: float

    @property
    def reaction_s(self) -> float:
        """From the one to the other."""
        return self.stopped_s - self.shown_s


def turns(records: Sequence[Record], lidar: str) -> Iterator[tuple[float, bool]]:
    """Yield the time at which each revolution of the LiDAR was sent to its end, and True if it shows an obstacle."""
    model = MODELS[lidar]
    decoder, builder = model.make_decoder(), RevolutionBuilder()
    for record in records:
        if record.line != "scanner" or record.is_from_host:
            continue
        for frame in decoder.feed(record.data):
            revolution = builder.add(model.points(frame))
            if revolution:
                ranges = nearest_by_degree(revolution.angles_deg, revolution.ranges_m)
                # The model's rule: a beam without a measurement is an obstacle.
                yield record.time_s, not all(ranges[degree] > NEAREST_M for degree in AHEAD)


def commands(records: Sequence[Record]) -> Iterator[tuple[float, bool]]:
    """Yield the time at which the first byte of each command to the wheels had come, and True if it is zero.

    Dynamixel protocol 2.0 by hand: the header, the device, the length, the instruction, its parameters.
    """
    header = b"\xff\xff\xfd\x00"
    data, starts = b"", []
    for record in records:
        if record.line == "base" and record.is_from_host:
            starts.append((len(data), record.time_s))
            data += record.data
    at, chunk = data.find(header), 0
    while at >= 0 and at + 7 <= len(data):
        while chunk + 1 < len(starts) and starts[chunk + 1][0] <= at:
            chunk += 1
        length = int.from_bytes(data[at + 5 : at + 7], "little")
        packet = data[at + 4 : at + 7 + length - 2]
        device, instruction, parameters = packet[0], packet[3], packet[4:]
        if (device, instruction, parameters[:4]) == (0xFE, 0x83, b"\x68\x00\x04\x00"):  # SYNC WRITE, goal velocity
            yield starts[chunk][1], not any(parameters[5:9]) and not any(parameters[10:14])
        elif (device, instruction, parameters[:2]) == (200, 0x03, b"\x96\x00"):  # OpenCR: WRITE, velocities
            yield starts[chunk][1], not any(parameters[2:])
        at = data.find(header, at + 7 + length)


def trials(records: Sequence[Record], lidar: str) -> list[Trial]:
    """Return the outcome of each obstacle that was shown while the robot was driving."""
    seen, sent = list(turns(records, lidar)), list(commands(records))
    found = []
    before = True
    for index, (shown_s, is_obstructed) in enumerate(seen):
        if is_obstructed and not before:
            last_zero = [is_zero for time_s, is_zero in sent if time_s < shown_s][-1:]
            clear_again_s = next((time_s for time_s, is_one in seen[index:] if not is_one), math.inf)
            stopped_s = next((time_s for time_s, is_zero in sent if time_s >= shown_s and is_zero), None)
            if last_zero == [False]:
                is_missed = stopped_s is None or stopped_s > clear_again_s
                found.append(Trial(shown_s, math.inf if stopped_s is None or is_missed else stopped_s))
        before = is_obstructed
    return found


def _drive(robot: Simulator, process: "subprocess.Popen[str]", lidar: str, count: int) -> None:
    """Put the robot before the wall and back, so often."""
    chance = random.Random(1)
    end_s = time.monotonic() + LIMIT_S
    start = robot.ask("pose")
    while robot.ask("pose") == start:
        if process.poll() is not None or time.monotonic() > end_s:
            raise RuntimeError("the bridge does not drive")
        time.sleep(0.05)
    for _ in range(count):
        # Two turns and more: the first one is of both places. Never at the same phase of turns, decisions, exchanges.
        robot.send(FAR)
        time.sleep((2.3 + chance.random()) * TURN_S[lidar] + 0.1)
        robot.send(NEAR)
        time.sleep((2.3 + chance.random()) * TURN_S[lidar] + 0.3)
    robot.send(FAR)
    time.sleep(3 * TURN_S[lidar])


def measured(base: str, period_s: float, count: int = TRIALS, lidar: str = LIDAR) -> list[Trial]:
    """Measure one base."""
    with preferred(), tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        record = folder / "record"
        with simulated("--base", base, "--lidar", lidar, "--record", str(record)) as robot:
            file = folder / "bridge.yaml"
            file.write_text(configuration(robot, base, lidar, period_s, STOP_CHANNELS))
            command = [
                sys.executable, "-m", "robosc_bridge.main", "run", "--model", str(STOP_AT_OBSTACLE),
                "--config", str(file),
            ]  # fmt: skip
            with (folder / "log").open("w+") as log:
                process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stderr=log, text=True, env=environment())
                try:
                    _drive(robot, process, lidar, count)
                except RuntimeError as error:
                    log.seek(0)
                    raise RuntimeError(f"{error}: {log.read()}") from error
                finally:
                    process.terminate()
                    process.wait()
                if process.returncode:
                    log.seek(0)
                    raise RuntimeError(log.read())
        with record.open(encoding="ascii") as lines:
            return trials(list(read_records(lines)), lidar)


def _row(machine: Machine, case: tuple[str, float, float], found: Sequence[Trial]) -> list[str]:
    base, period_s, aim_s = case
    everywhere = [trial.reaction_s for trial in found]
    calm = [trial.reaction_s for trial in found if not machine.was_away(trial.shown_s - period_s, trial.stopped_s)]
    verdicts = ["met" if samples and percentile(samples, 99) < aim_s else "missed" for samples in (everywhere, calm)]
    return [
        f"{base}, {period_s * 1e3:.0f} ms", str(len(found)), *spread(everywhere), str(len(calm)),
        *(spread(calm) if calm else ["-"] * 3), in_ms(aim_s), *verdicts,
    ]  # fmt: skip


def table(count: int = TRIALS, lidar: str = LIDAR) -> str:
    """One row for each base."""
    machine = Machine()
    with machine.watched():
        found = [(case, measured(case[0], case[1], count, lidar)) for case in CASES]
    rows = [_row(machine, *one) for one in found]
    return text_table(f"Reaction to an obstacle, {lidar} ({machine})", HEADER, rows)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="How soon the bridge stops a robot that sees an obstacle.")
    parser.add_argument("--trials", type=int, default=TRIALS)
    parser.add_argument("--lidar", choices=sorted(MODELS), default=LIDAR)
    options = parser.parse_args()
    sys.stdout.write(table(options.trials, options.lidar) + "\n")
