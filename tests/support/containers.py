"""Containers without an engine: a Dockerfile is built and its program run in namespaces of the kernel, by util-linux.

The base image is this machine's own /usr with its Python at /usr/local; all else is what the Dockerfile says: its RUN
instructions, its user, its paths. The root is read-only, the network is its own, no capability is left, and the
program is process 1, as in an engine. Packages come from a folder of wheels that `make images` has filled.
"""

import contextlib
import fcntl
import hashlib
import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

from support.dockerfiles import Ignored, Stage, context_files, parse_dockerfile

TOP = Path(__file__).parents[2]
IMAGES = TOP / "deploy" / "images"
CACHE = TOP / "out" / "images"
PATIENCE_S = 120.0

_BASE_PATH = "/usr/local/bin:/usr/local/sbin:/usr/sbin:/usr/bin:/sbin:/bin"
_TOOLS = ("unshare", "nsenter", "mount", "setpriv", "ip", "ldconfig")


def why_not(wheels: Path) -> str:
    """Return the reason why no container can be imitated here; empty: it can be."""
    missing = [name for name in _TOOLS if shutil.which(name, path=f"{os.environ['PATH']}:/usr/sbin:/sbin") is None]
    if sys.platform != "linux" or os.geteuid() != 0 or missing:
        return "namespaces need Linux, root and util-linux" + (f": no {', '.join(missing)}" if missing else "")
    if subprocess.run(["unshare", "--mount", "--net", "--pid", "--fork", "true"], capture_output=True).returncode:
        return "no namespaces can be made here"
    if sys.base_prefix == "/usr":
        return "the interpreter is the system's own; the base image is imitated with one beside it"
    return "" if wheels.is_dir() else "no wheels are there: make images"


@dataclass(frozen=True)
class Image:
    """Result of a Dockerfile.

    Attributes:
        root: Folder of its files, but for those of the base.
        stage: Its last stage.
    """

    root: Path
    stage: Stage

    @property
    def environment(self) -> dict[str, str]:
        """Environment that its programs are given."""
        return self.stage.environment({"PATH": _BASE_PATH})

    @property
    def user(self) -> tuple[int, int]:
        """Numbers of user and group."""
        instruction = self.stage.last("USER")
        assert instruction is not None
        user, group = map(int, instruction.text.split(":"))
        return user, group


def build(name: str, wheels: Path, folder: Path) -> Image:
    """Carry out a Dockerfile.

    The result of its first RUN, of nothing but locked requirements, is kept for the next time.

    Args:
        name: Name of the Dockerfile, such as `server`.
        wheels: Folder in which pip finds packages, and nowhere else.
        folder: New folder for the image.
    """
    stages = parse_dockerfile((IMAGES / f"{name}.Dockerfile").read_text())
    roots: dict[str, Path] = {}
    for number, stage in enumerate(stages):
        root = folder / (stage.name or "image")
        roots[stage.name] = root
        # The base comes anew with every build of tests: only what follows it is kept.
        _carry_out(stage, root, roots, wheels, is_kept=number == 0)
    return Image(root, stages[-1])


def _carry_out(stage: Stage, root: Path, roots: Mapping[str, Path], wheels: Path, *, is_kept: bool) -> None:
    _lay_base(root)
    ignored = Ignored((TOP / ".dockerignore").read_text())
    place = "/"
    digest = hashlib.sha256(sys.version.encode())
    environment: dict[str, str] = {"PATH": _BASE_PATH}
    for number, item in enumerate(stage.instructions):
        digest.update(repr(item).encode())
        environment = Stage("", "", stage.instructions[: number + 1]).environment({"PATH": _BASE_PATH})
        match item.name:
            case "WORKDIR":
                place = item.text
                _inside(root, place).mkdir(parents=True, exist_ok=True)
            case "COPY":
                *sources, target = shlex.split(item.text)
                goal = _inside(root, str(Path(place) / target))
                if "from" in item.flags:
                    (source,) = sources
                    shutil.copytree(
                        _inside(roots[item.flags["from"]], source), goal, symlinks=True, copy_function=_link
                    )
                    continue
                for source, file in context_files(TOP, sources, ignored):
                    relative = file.relative_to(TOP / source) if (TOP / source).is_dir() else file.name
                    (goal / relative).parent.mkdir(parents=True, exist_ok=True)
                    shutil.copyfile(file, goal / relative)
                    digest.update(file.read_bytes())
            case "RUN":
                words = ["/bin/sh", "-c", item.text]
                if is_kept:
                    is_kept = False
                    _run_kept(root, words, environment, place, wheels, digest.hexdigest()[:16])
                else:
                    _run_in(root, words, environment, place, wheels)
            case "ENV" | "LABEL" | "USER" | "VOLUME" | "EXPOSE" | "STOPSIGNAL" | "HEALTHCHECK" | "ENTRYPOINT" | "CMD":
                pass
            case other:
                raise AssertionError(f"what is {other}?")


def _run_kept(
    root: Path, words: Sequence[str], environment: Mapping[str, str], place: str, wheels: Path, key: str
) -> None:
    """Run it, or take what it made the last time from the cache."""
    CACHE.mkdir(parents=True, exist_ok=True)
    kept = CACHE / key
    with (CACHE / f"{key}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not kept.is_dir():
            _run_in(root, words, environment, place, wheels)
            part = CACHE / f"{key}.part"
            shutil.rmtree(part, ignore_errors=True)
            for name in ("build", "opt"):
                shutil.copytree(root / name, part / name, symlinks=True)
            part.rename(kept)
            return
        for name in ("build", "opt"):
            shutil.copytree(kept / name, root / name, symlinks=True, copy_function=_link, dirs_exist_ok=True)


def _run_in(root: Path, words: Sequence[str], environment: Mapping[str, str], place: str, wheels: Path) -> None:
    variables = {**environment, "PIP_NO_INDEX": "1", "PIP_FIND_LINKS": "/wheels", "HOME": "/root"}
    plan = _plan(root, words, variables, place)
    plan["is_writable"] = True
    plan["binds"] = [(str(wheels), "/wheels")]
    done = subprocess.run(
        ["unshare", "--mount", "--propagation", "private", "--net", *_starter(plan)], capture_output=True, text=True
    )
    assert done.returncode == 0, f"{words[-1]}\n{done.stdout}\n{done.stderr}"


def _lay_base(root: Path) -> None:
    for name in ("usr", "proc", "sys", "dev", "etc", "opt", "tmp", "run", "root", "var/lib", "wheels"):
        (root / name).mkdir(parents=True)
    (root / "tmp").chmod(0o1777)
    for name in ("bin", "sbin", "lib", "lib64"):
        if Path("/", name).is_symlink():
            (root / name).symlink_to(f"usr/{name}")
    (root / "etc/passwd").write_text("root:x:0:0:root:/root:/bin/sh\nnobody:x:65534:65534:nobody:/:/bin/false\n")
    (root / "etc/group").write_text("root:x:0:\nnogroup:x:65534:\n")
    (root / "etc/nsswitch.conf").write_text("hosts: files\n")
    (root / "etc/hosts").write_text("127.0.0.1 localhost\n")
    (root / "etc/ld.so.conf").write_text("/usr/local/lib\n/usr/lib/x86_64-linux-gnu\n/usr/lib/aarch64-linux-gnu\n")
    _run_in(root, ["/sbin/ldconfig"], {"PATH": _BASE_PATH}, "/", root / "wheels")


def _inside(root: Path, place: str) -> Path:
    return root / os.path.normpath(place).lstrip("/")


def _link(source: str, target: str) -> None:
    """Link a file: existing files are not written, so that they need not be copied."""
    with contextlib.suppress(FileExistsError):
        os.link(source, target, follow_symlinks=False)


def _plan(root: Path, command: Sequence[str], environment: Mapping[str, str], folder: str) -> dict[str, object]:
    return {
        "root": str(root),
        "python": sys.base_prefix,
        "binds": [],
        "volumes": [],
        "temporary": [],
        "is_writable": False,
        "is_memory_sealed": False,
        "folder": folder,
        "command": list(command),
        "environment": dict(environment),
    }


def _starter(plan: Mapping[str, object]) -> list[str]:
    return [sys.executable, "-I", str(Path(__file__).with_name("container_start.py")), json.dumps(plan)]


class Network:
    """A network of its own, with a loopback device and nothing else, for containers and their callers."""

    def __init__(self) -> None:
        self._holder = subprocess.Popen(
            ["unshare", "--net", "sh", "-c", "ip link set lo up && echo up && exec sleep infinity"],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._holder.stdout is not None and self._holder.stdout.readline() == "up\n"

    @property
    def entry(self) -> list[str]:
        """Words that are put before a command that is to run within."""
        return ["nsenter", f"--net=/proc/{self._holder.pid}/ns/net"]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._holder.kill()
        self._holder.communicate()


@dataclass(frozen=True)
class Start:
    """Start of a container: settings that an engine gets beside the image.

    Attributes:
        command: Entry point and words.
        environment: Variables beside those of the image.
        user: Numbers of user and group.
        files: Files and folders by their place within, read-only.
        volumes: Folders by their place within, for the user to write.
        temporary: Places within for files that are forgotten.
        folder: Folder in which it starts.
        hosts: Names of the machine itself.
        is_memory_sealed: True if no memory may be written and executed (MemoryDenyWriteExecute of systemd).
    """

    command: Sequence[str]
    environment: Mapping[str, str] = field(default_factory=dict)
    user: tuple[int, int] = (10001, 10001)
    files: Mapping[str, Path] = field(default_factory=dict)
    volumes: Mapping[str, Path] = field(default_factory=dict)
    temporary: Sequence[str] = ("/tmp",)
    folder: str = "/"
    hosts: Sequence[str] = ()
    is_memory_sealed: bool = False


class Container:
    """A container that runs inside the `with` block."""

    def __init__(self, image: Image, start: Start, network: Network, output: Path) -> None:
        self._environment = {**image.environment, **start.environment}
        user, group = start.user
        self._rights = [
            *("/usr/bin/setpriv", f"--reuid={user}", f"--regid={group}", "--clear-groups", "--no-new-privs"),
            *("--bounding-set=-all", "--inh-caps=-all", "--"),
        ]
        for place, folder in start.volumes.items():
            folder.mkdir(parents=True, exist_ok=True)
            os.chown(folder, user, group)
            _inside(image.root, place).mkdir(parents=True, exist_ok=True)
        (image.root / "etc/hosts").write_text(" ".join(["127.0.0.1", "localhost", *start.hosts]) + "\n")
        places = [""] if start.command[0].startswith("/") else self._environment["PATH"].split(":")
        programs = [_inside(image.root, str(Path(place, start.command[0]))) for place in places]
        assert any(program.exists() for program in programs), f"there is no {start.command[0]} in the image"
        plan = _plan(image.root, [*self._rights, *start.command], self._environment, start.folder)
        plan["binds"] = [(str(file), place) for place, file in start.files.items()]
        plan["volumes"] = [(str(folder), place) for place, folder in start.volumes.items()]
        plan["temporary"] = list(start.temporary)
        plan["is_memory_sealed"] = start.is_memory_sealed
        command = ["unshare", "--mount", "--propagation", "private", "--pid", "--fork", "--kill-child", *_starter(plan)]
        self._output = output
        with output.open("wb") as stream:
            self._outer = subprocess.Popen([*network.entry, *command], stdout=stream, stderr=stream)

    @property
    def output(self) -> str:
        """Output that it has written so far."""
        return self._output.read_text(errors="replace")

    @property
    def pid(self) -> int:
        """Its process 1, as the machine counts."""
        return int(Path(f"/proc/{self._outer.pid}/task/{self._outer.pid}/children").read_text().split()[0])

    def run(self, command: Sequence[str], limit_s: float = PATIENCE_S) -> subprocess.CompletedProcess[str]:
        """Run a command within, as a health check is."""
        inside = ["nsenter", f"--target={self.pid}", "--mount", "--net", "--pid", "--root", *self._rights, *command]
        return subprocess.run(inside, capture_output=True, text=True, timeout=limit_s, env=self._environment)

    def wait_for(self, command: Sequence[str], limit_s: float = PATIENCE_S) -> None:
        """Run a command within again and again until it succeeds, as an engine does at the start."""
        end = time.monotonic() + limit_s
        while True:
            with contextlib.suppress(IndexError, FileNotFoundError):
                done = self.run(command)
                if done.returncode == 0:
                    return
                assert time.monotonic() < end, f"{done.stdout}{done.stderr}\n{self.output}"
            assert self._outer.poll() is None, self.output
            time.sleep(0.05)

    def wait(self, limit_s: float) -> int:
        """Its exit status, waiting for its end."""
        return self._outer.wait(limit_s)

    def stop(self, limit_s: float) -> int:
        """Ask it to end, and wait; returns its exit status."""
        first = self.pid
        os.kill(first, signal.SIGTERM)
        try:
            return self._outer.wait(limit_s)
        except subprocess.TimeoutExpired:
            threads = sorted(Path(f"/proc/{first}/task").glob("*/wchan"))
            waiting = {file.parent.name: file.read_text() for file in threads}
            raise AssertionError(f"it goes on after {limit_s} s, waiting in {waiting}:\n{self.output}") from None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._outer.kill()
        self._outer.wait()


def wheels_of(name: str) -> Path:
    """Return the folder of an image's packages, once `make images` has fetched them."""
    return TOP / "out" / "wheels" / name


def main() -> int:
    """Build every image once, so that the next time is a matter of seconds; returns the exit status."""
    for name in ("server", "bridge"):
        reason = why_not(wheels_of(name))
        if reason:
            sys.stderr.write(f"{name}: {reason}\n")
            return 0
        with tempfile.TemporaryDirectory() as folder:
            build(name, wheels_of(name), Path(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
