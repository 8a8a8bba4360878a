"""Units of systemd and rules of udev."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from support.containers import TOP

UNITS = sorted((TOP / "deploy" / "systemd").glob("*.service"))

needs_systemd = pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="there is no systemd-analyze")


def _verified(file: Path, folder: Path) -> str:
    """Return the findings of systemd about a unit whose program is there; an instance stands for a template."""
    program = folder / "program"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    name = file.name.replace("@.", "@burger.")
    text = re.sub(r"/opt/robosc/bin/\S+", str(program), file.read_text())
    (folder / name).write_text(text)
    done = subprocess.run(
        ["systemd-analyze", "verify", "--recursive-errors=no", str(folder / name)], capture_output=True, text=True
    )
    return done.stdout + done.stderr + ("" if done.returncode == 0 else f"status {done.returncode}\n")


@needs_systemd
@pytest.mark.parametrize("file", UNITS, ids=lambda file: file.stem)
def test_systemd_finds_nothing(file: Path, tmp_path: Path) -> None:
    assert _verified(file, tmp_path) == ""


@needs_systemd
def test_systemd_would_find_something(tmp_path: Path) -> None:
    file = tmp_path / "wrong.service"
    file.write_text(UNITS[-1].read_text().replace("ProtectHome", "ProtectHouse"))
    folder = tmp_path / "folder"
    folder.mkdir()
    assert re.search("Unknown key.* 'ProtectHouse'", _verified(file, folder))


@needs_systemd
@pytest.mark.parametrize(("name", "exposure"), [("robosc-server.service", 15), ("robosc-bridge@.service", 20)])
def test_a_service_is_exposed_to_little(name: str, exposure: int) -> None:
    """Check the exposure, out of 100, as `systemd-analyze security` counts: 20 is still its best word, OK."""
    file = TOP / "deploy" / "systemd" / name
    command = ["systemd-analyze", "security", "--offline=true", f"--threshold={exposure}", "--no-pager", str(file)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout.splitlines()[-1]
