"""A worker in the hands of a hostile program: what it tries is refused by the kernel, and does no harm."""

import json
import os
import re
import struct
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import grpc
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc.targets import available_targets
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_api.v1 import synthesis_pb2_grpc
from robosc_server import main as program
from robosc_server.tasks.requests import RequestLimits, accept_request
from robosc_server.tasks.run import run_task
from robosc_server.tasks.task import Report, Result, TaskKind, TaskLimits
from robosc_server.workers import frames
from robosc_server.workers.frames import AnswerReader, FrameError, Tag
from robosc_server.workers.local import LocalWorkers
from robosc_server.workers.system_calls import ALLOW, ARCHITECTURES, KILL, REFUSE, UNKNOWN, filter_program
from support.background import BackgroundLoop, is_running, parent_of
from support.fake_tasks import TASK_FUNCTION as FAKE
from support.requests import MESSAGES, bundle_at
from support.service import served
from support.waiting import PATIENCE_S

ROOT = Path(__file__).parents[3]
STUB: Any = synthesis_pb2_grpc.SynthesisServiceStub
HEADERS = {
    "x86_64": (Path("/usr/include/x86_64-linux-gnu/asm/unistd_64.h"), r"#define __NR_(\w+) (\d+)"),
    "aarch64": (Path("/usr/include/asm-generic/unistd.h"), r"#define __NR(?:3264)?_(\w+) (\d+)"),
}
OWN_PID = 4711


def bundle(text: str) -> pb.Bundle:
    return pb.Bundle(main=pb.SourceFile(name="robot.rscd", text=text))


@pytest.fixture(scope="module")
def state(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("state")


@pytest.fixture(scope="module")
def fake(state: Path) -> Iterator[Any]:
    with served(FAKE, worker_processes=2, state_dir=state) as address, grpc.insecure_channel(address) as channel:
        yield channel


@pytest.fixture
def sibling(fake: Any) -> Iterator[int]:
    """The process of another caller's task."""
    call = STUB(fake).Synthesize(pb.SynthesizeRequest(bundle=bundle("pid\nsleep 600")))
    yield int(next(call).progress.message)
    call.cancel()


def tried(channel: Any, what: str) -> str:
    """Return the result of a task that tried something."""
    response = STUB(channel).Check(pb.CheckRequest(bundle=bundle(f"try {what}")), timeout=PATIENCE_S)
    return str(response.diagnostics[0].message)


class TestHostileCode:
    @pytest.mark.parametrize(
        ("what", "expected"),
        [
            ("environment", "EACCES"),
            ("read /etc/hostname", "EACCES"),
            ("read /proc/self/environ", "EACCES"),
            ("list /", "EACCES"),
            ("signal everybody", "EPERM"),
            ("fork", "EPERM"),
            ("thread", "EPERM"),
            ("program", "EPERM"),
            ("stay", "EPERM"),
            ("session", "EPERM"),
            ("socket inet", "EPERM"),
            ("socket inet6", "EPERM"),
            ("socket unix", "EPERM"),
            ("socket netlink", "EPERM"),
            ("send", "EPERM"),
            ("code", "EPERM"),
            ("rights", "EPERM"),
            ("descriptors", "socket pipe"),
            ("dumpable", "[0]"),
        ],
    )
    def test_it_reaches_nothing(self, fake: Any, what: str, expected: str) -> None:
        assert tried(fake, what) == expected

    def test_it_reads_nothing_that_is_kept(self, fake: Any, state: Path) -> None:
        files = [path for path in state.rglob("*") if path.is_file()]
        assert files
        for path in files:
            assert tried(fake, f"read {path}") == "EACCES"
            assert tried(fake, f"write {path}") == "EPERM"
            assert tried(fake, f"remove {path}") == "EPERM"
            assert path.exists()
        assert tried(fake, f"write {state / 'new'}") == "EPERM"
        assert not (state / "new").exists()

    def test_it_reads_the_programs_that_it_consists_of(self, fake: Any) -> None:
        assert tried(fake, f"read {os.__file__}") == "done"
        assert tried(fake, f"read {grpc.__file__}") == "done"
        assert tried(fake, f"read {ROOT / 'robosc' / '__init__.py'}") == "done"
        assert tried(fake, f"read {ROOT / 'pyproject.toml'}") == "EACCES"

    @pytest.mark.parametrize("what", ["signal", "trace", "memory", "limit", "interrupt"])
    def test_it_does_nothing_to_others(self, fake: Any, sibling: int, what: str) -> None:
        fork_server = parent_of(sibling)
        # The server is this process: it must not be an answer of the kernel's by chance that it lives on.
        for pid in (sibling, fork_server, parent_of(fork_server)):
            assert tried(fake, f"{what} {pid}") == "EPERM"
            assert is_running(pid)

    def test_it_is_ended_when_it_floods_the_server_with_reports(self, fake: Any) -> None:
        call = STUB(fake).Synthesize(pb.SynthesizeRequest(bundle=bundle("flood")), timeout=PATIENCE_S)
        with pytest.raises(grpc.RpcError) as caught:
            for _ in call:
                pass
        error: Any = caught.value
        assert error.code() is grpc.StatusCode.INTERNAL
        assert "sent an invalid answer" in error.details()
        assert tried(fake, "list /") == "EACCES"


class TestReportsAreBounded:
    def test_by_their_number_in_time(self) -> None:
        now_s = 100.0
        reader = AnswerReader(TaskLimits(), lambda: now_s)
        header = frames.HEADER.pack(Tag.REPORT.value, 2)
        for _ in range(frames.REPORTS_BURST):
            reader.read_header(header)
        with pytest.raises(FrameError, match="1001 reports"):
            reader.read_header(header)
        now_s += 2.0
        for _ in range(2 * frames.REPORTS_PER_SECOND - 1):
            reader.read_header(header)
        with pytest.raises(FrameError, match="1101 reports"):
            reader.read_header(header)

    def test_by_their_size(self) -> None:
        longest = frames.report_frame(Report("\U0001f916" * 5000, "\U0001f916" * 5000))
        AnswerReader(TaskLimits()).read_header(longest[: frames.HEADER.size])
        with pytest.raises(FrameError, match="a report of 131073 bytes"):
            AnswerReader(TaskLimits()).read_header(frames.HEADER.pack(Tag.REPORT.value, 2**17 + 1))


def requests() -> list[tuple[TaskKind, Any]]:
    """Each kind, synthesis by each engine, and generation of everything."""
    model = bundle_at(ROOT / "examples" / "line_follower" / "line_follower.rscd")
    found: list[tuple[TaskKind, Any]] = [
        (kind, MESSAGES[kind](bundle=model)) for kind in (TaskKind.CHECK, TaskKind.SYNTHESIZE, TaskKind.EXPLORE)
    ]
    for engine in ("oxidd", "autoref"):
        options = pb.SynthesisOptions(engine=engine)
        found.append((TaskKind.SYNTHESIZE, pb.SynthesizeRequest(bundle=model, options=options)))
    found.append((TaskKind.VERIFY, pb.VerifyRequest(bundle=model, properties=["invariant true"])))
    found.append((TaskKind.FORMAT, pb.FormatRequest(file=model.main)))
    targets = [info.name for info in available_targets()]
    return found + [(TaskKind.GENERATE, pb.GenerateRequest(bundle=model, target=name)) for name in targets]


def test_every_task_is_done_as_without_confinement() -> None:
    async def note(report: object) -> None:
        """Drop a report."""

    with BackgroundLoop() as loop:
        workers = LocalWorkers(2, must_be_confined=True)
        loop.run(workers.__aenter__())
        assert workers.missing == ()
        for kind, request in requests():
            task = accept_request(kind, request.SerializeToString(), RequestLimits())
            outcome = loop.run(workers.run(task, TaskLimits(), note))
            assert isinstance(outcome, Result), (kind, outcome)
            assert outcome == run_task(kind, task.request, TaskLimits(), lambda report: None)
        loop.run(workers.__aexit__())


def without(number: int, *command: str, instead: int = 0x50026) -> list[str]:
    """A command on a kernel that does not have a call, or does something else `instead`."""
    # Load the number; where it is this one: no such call; else go on.
    rules = struct.pack("=" + "HBBI" * 4, 0x20, 0, 0, 0, 0x15, 0, 1, number, 0x06, 0, 0, instead, 0x06, 0, 0, ALLOW)
    text = (
        "import ctypes, os, sys\n"
        "from robosc_server.workers import kernel\n"
        "class Program(ctypes.Structure):\n"
        "    _fields_ = (('length', ctypes.c_ushort), ('instructions', ctypes.c_char_p))\n"
        f"program = Program(4, bytes.fromhex('{rules.hex()}'))\n"
        "kernel.prctl(kernel.SET_NO_NEW_PRIVILEGES, 1)\n"
        "kernel.prctl(kernel.SET_SECCOMP, 2, ctypes.addressof(program))\n"
        "os.execv(sys.executable, [sys.executable, *sys.argv[1:]])\n"
    )
    return [sys.executable, "-c", text, *command]


LANDLOCK = 444
NO_LANDLOCK = "file access is not restricted (no Landlock): Function not implemented"


class TestAKernelWithoutAPart:
    def test_a_server_that_needs_it_does_not_start(self, tmp_path: Path) -> None:
        command = without(LANDLOCK, "-m", "robosc_server.main", "--port", "0", "--state-dir", str(tmp_path / "state"))
        done = subprocess.run([*command, "--confinement", "required"], capture_output=True, text=True, timeout=100)
        assert done.returncode == 1
        assert (
            f"robosc-server: confinement is required, but this machine cannot confine workers: {NO_LANDLOCK}"
            in done.stderr
        )

    def test_a_server_that_does_not_need_it_warns_and_keeps_the_rest(self, tmp_path: Path) -> None:
        program = (
            "import asyncio, logging\n"
            "from robosc_server.tasks.task import TaskLimits\n"
            "from robosc_server.workers.local import LocalWorkers\n"
            "from support.fake_tasks import TASK_FUNCTION, fake_task, said\n"
            "async def note(report): pass\n"
            "async def main():\n"
            "    async with LocalWorkers(1, TASK_FUNCTION) as workers:\n"
            "        print(workers.missing)\n"
            "        for what in ('read /etc/hostname', 'write FILE', 'socket inet'):\n"
            "            print(said(await workers.run(fake_task('try ' + what), TaskLimits(), note)))\n"
            "logging.basicConfig(format='%(message)s')\n"
            "asyncio.run(main())\n"
        )
        program = program.replace("FILE", str(tmp_path / "file"))
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
        command = without(LANDLOCK, "-c", program)
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=100)
        assert done.stdout.splitlines() == [str((NO_LANDLOCK,)), "done", "EPERM", "EPERM"]
        assert done.stderr.splitlines() == [f"workers are not fully confined: {NO_LANDLOCK}"]

    @pytest.mark.parametrize(
        ("is_there", "setting", "grade", "message", "status"),
        [
            (False, "required", "error", NO_LANDLOCK, 1),
            (False, "best-effort", "warning", NO_LANDLOCK, 0),
            (True, "required", "ok", "workers can access only program files, no network and no other process", 0),
        ],
    )
    def test_is_reported_before_a_server_is_started(
        self, tmp_path: Path, is_there: bool, setting: str, grade: str, message: str, status: int
    ) -> None:
        settings = ("--port", "0", "--state-dir", str(tmp_path), "--confinement", setting)
        words = ("-m", "robosc_server.main", "check-config", "--json", *settings)
        command = [sys.executable, *words] if is_there else without(LANDLOCK, *words)
        done = subprocess.run(command, capture_output=True, text=True, timeout=100)
        assert {"part": "confinement", "grade": grade, "message": message} in json.loads(done.stdout)["findings"]
        assert done.returncode == status

    def test_also_where_who_tries_it_is_ended(self) -> None:
        command = without(LANDLOCK + 2, "-m", "robosc_server.workers.sandbox", instead=KILL)
        done = subprocess.run(command, capture_output=True, text=True, timeout=100)
        assert json.loads(done.stdout) == ["file access is not restricted (no Landlock): the attempt was killed"]


class TestTheServerItself:
    def test_lets_nobody_of_the_same_user_look_into_it(self) -> None:
        script = (
            "import ctypes, os, sys\n"
            "from robosc_server.workers.kernel import SET_DUMPABLE, keep_memory_private, prctl\n"
            "os.getuid() or os.setuid(65534)\n"
            "prctl(SET_DUMPABLE, 1)\n"  # A program of this user can be dumped.
            "def looked(pid):\n"
            "    answers, answering = os.pipe()\n"
            "    if os.fork() == 0:\n"
            "        try:\n"
            "            open(f'/proc/{pid}/environ').read(); answer = b'read'\n"
            "        except PermissionError:\n"
            "            answer = b'refused'\n"
            "        os.write(answering, answer); os._exit(0)\n"
            "    os.wait()\n"
            "    return os.read(answers, 100).decode()\n"
            "print(looked(os.getpid()))\n"
            "keep_memory_private()\n"
            "print(looked(os.getpid()))\n"
        )
        done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60)
        assert done.stdout.split() == ["read", "refused"]

    def test_does_so_from_its_start(self, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
        done: list[str] = []
        monkeypatch.setattr(program, "keep_memory_private", lambda: done.append("private"))

        def serve(settings: object) -> int:
            done.append("served")
            return 0

        monkeypatch.setattr(program, "_serve", serve)
        assert program.main(["--state-dir", str(tmp_path)]) == 0
        assert done == ["private", "served"]


def decided(instructions: bytes, machine: int, number: int, arguments: list[int]) -> int:
    """Return a filter's decision on a call: instruction by instruction, as the kernel's manual has them."""
    data = struct.pack("=IIQ6Q", number, machine, 0, *arguments)
    word, place = 0, 0
    while True:
        code, if_true, if_false, value = struct.unpack_from("=HBBI", instructions, 8 * place)
        place += 1
        if code == 0x20:
            (word,) = struct.unpack_from("=I", data, value)
        elif code == 0x06:
            return int(value)
        else:
            holds = word == value if code == 0x15 else bool(word & value)
            place += if_true if holds else if_false


def expected(name: str, arguments: list[int]) -> bool:
    """Return True if a call may be made, in plain words."""
    low = [argument & 0xFFFFFFFF for argument in arguments]
    match name:
        case "kill" | "tgkill" | "tkill":
            return low[0] == OWN_PID
        case "prlimit64":
            return low[0] == 0
        case "openat":
            flags = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_PATH
            return low[2] & flags == 0
        case "fcntl":
            return low[1] in (0, 1, 2, 3, 1030)
        case "mmap":
            return not low[2] & 4 or (not low[2] & 2 and not low[3] & 0x20)
        case "mprotect":
            return not low[2] & 4
        case "sendto":
            return arguments[4] == 0
        case "clone":
            return low[0] == 0x3D0F00
    return True


ARGUMENT = st.one_of(
    st.sampled_from(
        [0x3D0F00, 0, 1, 2, 3, 4, 5, 7, 8, 9, 0x20, 0x22, 0o100, 0o1000, 0o10000000, 1030, OWN_PID, -1, 1 << 32]
    ),
    st.integers(-(2**63), 2**63 - 1),
)


class TestFilter:
    @pytest.mark.parametrize("machine", ARCHITECTURES)
    @given(st.data())
    def test_says_what_is_meant(self, machine: str, data: st.DataObject) -> None:
        architecture = ARCHITECTURES[machine]
        instructions = filter_program(architecture, OWN_PID)
        names = {number: name for name, number in architecture.numbers.items()}
        arguments = [value & (2**64 - 1) for value in data.draw(st.lists(ARGUMENT, min_size=6, max_size=6))]
        for number in range(470):
            wanted = ALLOW if number in names and expected(names[number], arguments) else REFUSE
            wanted = UNKNOWN if names.get(number) == "clone3" else wanted
            assert decided(instructions, architecture.mark, number, arguments) == wanted

    def test_ends_who_calls_as_another_kind_of_machine(self) -> None:
        for architecture in ARCHITECTURES.values():
            instructions = filter_program(architecture, OWN_PID)
            # The 32-bit calls of a PC, and the 64-bit ones of either.
            for mark in {0x40000003, *(other.mark for other in ARCHITECTURES.values())} - {architecture.mark}:
                assert decided(instructions, mark, architecture.numbers["read"], [0] * 6) == KILL
        # Calls of 64-bit machines with 32-bit pointers have numbers of their own.
        own = ARCHITECTURES["x86_64"]
        assert decided(filter_program(own, OWN_PID), own.mark, 0x40000000, [0] * 6) == REFUSE

    @pytest.mark.parametrize("machine", ARCHITECTURES)
    def test_has_the_numbers_of_the_kernels_headers(self, machine: str) -> None:
        header, pattern = HEADERS[machine]
        if not header.exists():
            pytest.skip("no headers of Linux here")
        numbers = {name: int(number) for name, number in re.findall(pattern, header.read_text())}
        numbers.setdefault("newfstatat", numbers.get("fstatat", -1))
        for name, number in ARCHITECTURES[machine].numbers.items():
            assert numbers[name] == number, name
