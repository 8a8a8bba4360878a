"""A demonstration as a process, run as a user runs it, and what it leaves behind."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Demonstration:
    """One that runs.

    Attributes:
        child: Its process.
        folder: The one that it may write its temporary files to.
        limit_s: It takes no longer, nor to its end, nor to any line.
    """

    child: "subprocess.Popen[str]"
    folder: Path
    limit_s: float

    def until(self, text: str) -> None:
        """Read its output to a line with a text."""
        assert self.child.stdout is not None
        end_s = time.monotonic() + self.limit_s
        for line in self.child.stdout:
            if text in line:
                return
            assert time.monotonic() < end_s, f"{text!r} was not printed in {self.limit_s:g} s"
        raise AssertionError(f"it ended without printing {text!r}")

    def passes(self) -> str:
        """Wait until it has passed and left nothing, and return its output."""
        output, errors = self.child.communicate(timeout=self.limit_s)
        assert self.child.returncode == 0, output + errors
        assert self.leftovers() == []
        return output

    def is_interrupted_by(self, *numbers: signal.Signals) -> None:
        """Send signals, one behind the other: it ends, and leaves nothing."""
        for number in numbers:
            self.child.send_signal(number)
        _, errors = self.child.communicate(timeout=self.limit_s)
        assert self.child.returncode == 130, errors
        assert errors == "interrupted; everything is stopped\n"
        assert self.leftovers() == []

    def leftovers(self) -> list[str]:
        """Files in its folder, and processes that mention it in their command line or environment."""
        found = [str(path) for path in self.folder.iterdir()]
        for process in Path("/proc").iterdir():
            if process.name.isdigit() and int(process.name) != os.getpid():
                try:
                    traces = (process / "cmdline").read_bytes() + (process / "environ").read_bytes()
                except OSError:
                    continue
                if str(self.folder).encode() in traces:
                    found.append(f"process {process.name}: {traces[:200]!r}")
        return found


@contextmanager
def demonstration(script: str, *words: str, folder: Path, limit_s: float) -> Iterator[Demonstration]:
    """Run a demonstration; it is killed at the end of the block.

    Args:
        script: Its file in `deploy/demo`.
        words: Arguments of the script.
        folder: Folder for its temporary files; is made.
        limit_s: See `Demonstration`.
    """
    folder.mkdir()
    child = subprocess.Popen(
        [sys.executable, str(Path(__file__).parents[2] / "deploy" / "demo" / script), *words],
        env={**os.environ, "TMPDIR": str(folder)},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        yield Demonstration(child, folder, limit_s)
    finally:
        child.kill()
        child.communicate()
