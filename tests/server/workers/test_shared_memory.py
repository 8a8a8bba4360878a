"""Memory that a fork server shares with its forks: what they do not write, they need not copy."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc.kernel import kernel_module
from robosc_server.workers.shared_memory import HUGE_PAGE_BYTES, _huge_pages_of

COUNTED = """
import gc, json, os, resource, sys, types
from robosc_server.workers import shared_memory

class Thing:
    def __init__(self, number):
        self.name = f"thing {number}"
        self.parts = (number + 1000.5, [number], {f"key {number}": f"value {number}"})

def read(things):
    found = [(thing, thing.name, *thing.parts, *thing.parts[2].items()) for thing in things]
    return len(found)

def faults_of_a_fork():
    pid = os.fork()
    if pid == 0:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
        for begin in range(0, len(things), 100):
            read(things[begin:begin + 100])
        count = resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
        os.write(write_end, f"{count:10}".encode())
        os._exit(0)
    os.waitpid(pid, 0)
    return int(os.read(read_end, 10))

read_end, write_end = os.pipe()
things = [Thing(number) for number in range(20_000)]
gc.disable()
faults_of_a_fork()
before = faults_of_a_fork()
kept = shared_memory.keep_objects()
after = faults_of_a_fork()
print(json.dumps({"before": before, "after": after, "kept": kept}))
"""

CHANGED = """
import gc
from robosc_server.workers import shared_memory

class Ending:
    def __del__(self):
        ended.append(True)

ended = []
texts, places, named = ["a"], {"b": 1}, {"c"}
def code(value, *, by=(7000, ("inner", 8000.5))):
    return [value, by, "constant", 123456789]
known = code(1)
shared_memory.keep_objects()
gc.freeze()
for number in range(1000):
    texts.append(f"text {number}"); places[f"place {number}"] = Ending(); named.add(number * 1000)
    assert code(1) == known
del texts[1:]
places.clear(); named.clear()
gc.collect()
assert texts == ["a"] and not places and not named and len(ended) == 1000, len(ended)
text = known[2]
text += "s"
assert text == "constants" and known[2] == "constant"
print("as before")
"""

JOINED = """
import mmap, re
from pathlib import Path
from robosc_server.workers import shared_memory

def huge_bytes():
    found = re.findall(r"AnonHugePages: +(\\d+) kB", Path("/proc/self/smaps").read_text())
    return sum(int(size) for size in found) * 1024

memory = mmap.mmap(-1, 8 * 2**20, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
memory.write(bytes(range(256)) * 2**15)
before = huge_bytes()
joined = shared_memory.join_pages()
print(before, huge_bytes(), joined, memory[:] == bytes(range(256)) * 2**15)
"""

needs_kernel = pytest.mark.skipif(kernel_module() is None, reason="there is no compiled kernel")


def output_of(program: str) -> str:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    return subprocess.run(
        [sys.executable, "-c", program], env=environment, check=True, capture_output=True, text=True
    ).stdout


@needs_kernel
def test_a_fork_that_reads_objects_copies_few_pages() -> None:
    found = json.loads(output_of(COUNTED))
    assert found["kept"] > 20_000 * 7
    assert found["after"] * 4 < found["before"], found


@needs_kernel
def test_kept_objects_change_as_before() -> None:
    assert output_of(CHANGED) == "as before\n"


def test_without_the_kernel_nothing_is_kept() -> None:
    program = (
        "import os; os.environ['ROBOSC_KERNEL'] = '0'\n"
        "from robosc_server.workers import shared_memory\n"
        "print(shared_memory.keep_objects())"
    )
    assert output_of(program) == "0\n"


def test_private_memory_is_of_huge_pages() -> None:
    choices = Path("/sys/kernel/mm/transparent_hugepage/enabled")
    if tuple(map(int, os.uname().release.split(".")[:2])) < (6, 1) or not choices.exists():
        pytest.skip("this kernel makes no huge pages when asked to")
    before, after, joined, *is_same = output_of(JOINED).split()
    if "[never]" in choices.read_text() and joined == "0":
        pytest.skip("this machine makes no huge pages")
    assert int(joined) >= 3 * HUGE_PAGE_BYTES
    assert int(after) - int(before) >= 3 * HUGE_PAGE_BYTES
    assert is_same == ["True"]


@given(
    begin=st.integers(0, 2**34).map(lambda page: page * 4096),
    pages=st.integers(1, 5000),
    name=st.sampled_from(["", "[heap]"]),
)
def test_huge_pages_lie_within_their_mapping(begin: int, pages: int, name: str) -> None:
    end = begin + pages * 4096
    first, behind = _huge_pages_of(f"{begin:x}-{end:x} rw-p 00000000 00:00 0          {name}".rstrip())
    assert first % HUGE_PAGE_BYTES == behind % HUGE_PAGE_BYTES == 0
    fitting = [
        address
        for address in range(begin // HUGE_PAGE_BYTES * HUGE_PAGE_BYTES, end, HUGE_PAGE_BYTES)
        if begin <= address and address + HUGE_PAGE_BYTES <= end
    ]
    assert list(range(first, behind, HUGE_PAGE_BYTES)) == fitting


@pytest.mark.parametrize(
    "rest",
    [
        "r--p 00000000 00:00 0",
        "rw-s 00000000 00:00 0",
        "rw-p 00001000 fe:00 4711  /usr/lib/libc.so.6",
        "rw-p 00000000 00:00 0     [stack]",
    ],
)
def test_other_memory_stays_as_it_is(rest: str) -> None:
    first, behind = _huge_pages_of(f"7f0000000000-7f0001000000 {rest}")
    assert first == behind
