"""Puts together what a container sees, and becomes its program: run by `support.containers` in new namespaces, as root.

Its argument is a JSON document: see `_Plan` there.
"""

import ctypes
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

_DEVICES = ("null", "zero", "full", "random", "urandom", "tty")

# prctl(2)
_SET_MDWE, _REFUSE_EXEC_GAIN = 65, 1


def main(plan: dict[str, Any]) -> None:
    """Never returns."""
    root = Path(plan["root"])
    _mount("--bind", root, root)
    # Folders of the base image.
    _mount("--rbind", "/usr", root / "usr")
    _mount("--bind", plan["python"], root / "usr/local")
    for source, target in plan["binds"]:
        place = root / target.lstrip("/")
        if Path(source).is_dir():
            place.mkdir(parents=True, exist_ok=True)
        else:
            place.parent.mkdir(parents=True, exist_ok=True)
            place.touch()
        _mount("--bind", source, place)
        if not plan["is_writable"]:
            _mount("-o", "remount,bind,ro", place)
    for source, target in plan["volumes"]:
        _mount("--bind", source, root / target.lstrip("/"))
    _mount("-t", "proc", "proc", root / "proc")
    _mount("-t", "tmpfs", "-o", "mode=755", "tmpfs", root / "dev")
    for name in _DEVICES:
        (root / "dev" / name).touch()
        _mount("--bind", f"/dev/{name}", root / "dev" / name)
    (root / "dev/fd").symlink_to("/proc/self/fd")
    (root / "dev/shm").mkdir()
    _mount("-t", "tmpfs", "-o", "mode=1777", "tmpfs", root / "dev/shm")
    if not plan["is_writable"]:
        _mount("-o", "remount,bind,ro", root)
        _mount("-o", "remount,bind,ro", root / "usr")
        _mount("-o", "remount,bind,ro", root / "usr/local")
    for target in plan["temporary"]:
        _mount("-t", "tmpfs", "-o", "mode=1777", "tmpfs", root / target.lstrip("/"))
    os.chroot(root)
    os.chdir(plan["folder"])
    if plan["is_memory_sealed"]:
        # Kernels before 6.3 know no such thing, and go on without it.
        ctypes.CDLL(None).prctl(_SET_MDWE, _REFUSE_EXEC_GAIN, 0, 0, 0)
    os.execve(plan["command"][0], plan["command"], plan["environment"])


def _mount(*words: object) -> None:
    subprocess.run(["mount", *map(str, words)], check=True)


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
