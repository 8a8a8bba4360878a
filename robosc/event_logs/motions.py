"""The record of motion that belongs to an event log: a simulator writes it while an executor writes the log."""

from pathlib import Path

from robosc.errors import RoboscError
from robosc.motion_record import Motion, MotionError, read_motion

BESIDE = "motion.jsonl"
"""Name of a record that is found beside a log."""


class MotionOfLogError(RoboscError):
    """A record of motion cannot be used with a log; one sentence with its place."""


def motion_of_log(log: str | Path, given: Path | None, begin_s: float, end_s: float) -> Motion | None:
    """Return the motion of the robot while a log was written.

    Args:
        log: The log; without `given`, a record `motion.jsonl` beside it is taken if it is of the same time.
        given: The record; None: whatever lies beside the log.
        begin_s: Earliest time of the log's entries, in seconds since 1970-01-01 UTC.
        end_s: Latest time of them.

    Raises:
        MotionOfLogError: The given record cannot be read, is none, or is of another time than the log.
    """
    path = Path(log).with_name(BESIDE) if given is None else given
    if given is None and not path.is_file():
        return None
    try:
        found = read_motion(path)
    except MotionError as error:
        if given is None:
            return None
        raise MotionOfLogError(str(error)) from error
    samples = found.samples
    if samples and samples[0].time <= end_s and begin_s <= max(sample.time for sample in samples):
        return found
    if given is None:
        return None
    what = f"begins {samples[0].time - begin_s:+.1f} s from the log's first entry" if samples else "has no sample"
    raise MotionOfLogError(f"{path}: is of another time than {log}: it {what}")
