"""The machine as the examination sees it; tests put another in its place."""

import contextlib
import getpass
import grp
import os
import shutil
import signal
import stat
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Output:
    """Output of a program that has ended by itself.

    Attributes:
        status: Its exit status.
        text: Its standard output and standard error.
    """

    status: int
    text: str


class Machine:
    """This machine.

    Attributes:
        python: Path of the running interpreter.
        python_version: Its version, as in `sys.version_info`.
        environment: Variables of the environment.
    """

    def __init__(self) -> None:
        self.python: str = sys.executable
        self.python_version: tuple[int, ...] = tuple(sys.version_info[:3])
        self.environment: Mapping[str, str] = os.environ

    def requirements(self) -> tuple[str, ...] | None:
        """Return the requirements of the installed RoboSC, as in its metadata; None: it is not installed."""
        try:
            return tuple(metadata.requires("robosc") or ())
        except metadata.PackageNotFoundError:
            return None

    def version(self, package: str) -> str | None:
        """Return the version of an installed package; None: it is not installed."""
        try:
            return metadata.version(package)
        except metadata.PackageNotFoundError:
            return None

    def find_program(self, name: str) -> str | None:
        """Return the path of a program; None: there is none of that name."""
        return shutil.which(name, path=self.environment.get("PATH"))

    def run(self, command: Sequence[str], limit_s: float) -> Output | None:
        """Run a program without input, and end it when the time is over.

        Args:
            command: The program and its arguments.
            limit_s: Longest time, in seconds.

        Returns:
            Its output; None: it cannot be started, or did not end in time.
        """
        try:
            process = subprocess.Popen(  # noqa: S603  # programs that the checks name
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                env=dict(self.environment),
                start_new_session=True,
            )
        except OSError:
            return None
        try:
            text, _ = process.communicate(timeout=limit_s)
        except subprocess.TimeoutExpired:
            return None
        finally:
            # Processes that it has started hold its output open.
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
            if process.stdout is not None:
                process.stdout.close()
        return Output(process.returncode, text.decode("utf-8", "replace"))

    def matching(self, folder: str, pattern: str) -> tuple[str, ...]:
        """Return the paths in a folder that match a pattern, sorted; a folder that is not there has none."""
        return tuple(sorted(map(str, Path(folder).expanduser().glob(pattern))))

    def is_usable(self, device: str) -> bool:
        """Return True if the user may read and write a device."""
        return os.access(device, os.R_OK | os.W_OK)

    def is_device(self, path: str) -> bool:
        """Return True if a path leads to a character device."""
        try:
            return stat.S_ISCHR(Path(path).stat().st_mode)
        except OSError:
            return False

    def users_of(self, device: str) -> tuple[str, ...]:
        """Return the programs that have a device open, as `NAME (NUMBER)`: those that this user may look at."""
        place, found = Path(device).resolve(), []
        for process in sorted(Path("/proc").glob("[0-9]*")):
            # Processes end meanwhile, and those of others are hidden.
            with contextlib.suppress(OSError):
                if any(link.readlink() == place for link in (process / "fd").iterdir()):
                    name = (process / "comm").read_text("utf-8", "replace").strip()
                    found.append(f"{name} ({process.name})")
        return tuple(found)

    def group_of(self, device: str) -> str:
        """Return the group that a device belongs to."""
        try:
            return Path(device).group()
        except (KeyError, OSError):
            return "dialout"

    def groups(self) -> frozenset[str]:
        """Return the names of the groups that this process belongs to."""
        return frozenset(item.gr_name for item in grp.getgrall() if item.gr_gid in {os.getegid(), *os.getgroups()})

    def is_member(self, group: str) -> bool:
        """Return True if the user belongs to a group from the next login on."""
        try:
            return getpass.getuser() in grp.getgrnam(group).gr_mem
        except (KeyError, OSError):
            return False
