"""Installations from `make dist` on a machine without network, and the programs as a user starts them there."""

import hashlib
import json
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

TOP = Path(__file__).parents[2]
DIST = TOP / "out" / "dist"
MODEL = TOP / "examples" / "line_follower" / "line_follower.rscd"

pytestmark = pytest.mark.skipif(not (DIST / "SHA256SUMS").is_file(), reason="there is no out/dist: make dist")


def offline() -> list[str]:
    """The words before a command that take its network away; none where the kernel does not allow that."""
    words = ["unshare", "--map-root-user", "--net"]
    is_there = shutil.which("unshare") is not None
    return (
        words if is_there and subprocess.run([*words, "true"], capture_output=True, check=False).returncode == 0 else []
    )


OFFLINE = offline()


class Installation:
    """An environment with RoboSC and some of its extras.

    Args:
        folder: Its folder.
        extras: The extras.
    """

    def __init__(self, folder: Path, extras: str) -> None:
        self._bin = folder / "bin"
        self._folder = folder
        self.run(sys.executable, "-m", "venv", str(folder))
        asked = f"robosc[{extras}]" if extras else "robosc"
        self.run(str(self._bin / "pip"), "install", "--no-index", "--find-links", str(DIST / "wheels"), asked)

    def run(self, *command: str, status: int = 0) -> str:
        """Return what a command prints, which ends with a status; a program's name alone is of the environment."""
        words: Sequence[str] = [*OFFLINE, *command]
        if "/" not in command[0]:
            words = [*OFFLINE, str(self._bin / command[0]), *command[1:]]
        # No variable of the tester's leads to packages elsewhere.
        environment = {"PATH": "/usr/bin:/bin", "HOME": str(self._folder), "LANG": "C.UTF-8"}
        done = subprocess.run(
            words, cwd=self._folder.parent, env=environment, capture_output=True, text=True, check=False, timeout=600
        )
        assert done.returncode == status, done.stdout + done.stderr
        return done.stdout

    def findings(self, *words: str, status: int = 0) -> dict[str, str]:
        """Return the grade of each part that `robosc doctor` examines."""
        document = json.loads(self.run("robosc", "doctor", "--json", *words, status=status))
        return {item["part"]: item["grade"] for item in document["findings"]}


def test_the_checksums_are_those_of_the_files() -> None:
    lines = (DIST / "SHA256SUMS").read_text(encoding="utf-8").splitlines()
    sums = {name: digest for digest, name in (line.split("  ") for line in lines)}
    files = [path for path in DIST.rglob("*") if path.is_file() and path.name != "SHA256SUMS"]
    assert {str(path.relative_to(DIST)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files} == sums
    assert {"udev/60-robosc.rules", "systemd/robosc-server.service", "constraints.txt"} <= sums.keys()
    wheels = sorted(path.name for path in DIST.glob("robosc-*.whl"))
    # One wheel has the kernel, the other is for every system.
    assert [name.split("-", 2)[2].split("_")[0] for name in wheels] == ["cp312-abi3-linux", "py3-none-any.whl"]
    assert [sums[name] for name in wheels] == [sums[f"wheels/{name}"] for name in wheels]


@pytest.mark.parametrize("extras", ["", "client", "server", "bridge", "view", "lsp"])
def test_it_is_installed_without_network(extras: str, tmp_path: Path) -> None:
    made = Installation(tmp_path / "environment", extras)
    assert {"robosc": "ok", "kernel": "ok"}.items() <= made.findings("--for", "synth").items()
    assert "supervisor" in made.run("robosc", "synth", str(MODEL), "-o", str(tmp_path / "line.rsup"))
    made.run("robosc", "verify", str(tmp_path / "line.rsup"), str(MODEL))
    purpose = {"server": "server", "view": "view"}.get(extras, "synth")
    found = made.findings("--for", purpose)
    if purpose in ("server", "view"):
        assert found[f"extra {purpose}"] == "ok"
    # Programs whose packages are there start; that of an extra that is not says what it needs.
    match extras:
        case "client":
            assert "bench" in made.run("robosc-client", "--help")
        case "server":
            made.run("robosc-server", "check-config", "--port", "0", "--state-dir", str(tmp_path))
        case "bridge":
            assert "opencr" in made.run("robosc-bridge", "drivers")
            assert made.findings()["extra bridge"] == "ok"
        case "lsp":
            assert "can be started" in made.run("robosc-lsp", "--check")
        case "":
            assert made.findings("--for", "server", status=1)["extra server"] == "missing"
            made.run("robosc", "completion", "bash", "--install")
            for program in ("robosc-client", "robosc-server", "robosc-bridge"):
                made.run(program, status=2)
