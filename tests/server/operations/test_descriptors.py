"""Tests of the descriptors that connections may take, and of the watch over connections in a running server."""

import resource
import threading
from pathlib import Path

import pytest

from robosc_server.operations.descriptors import highest_descriptor_limit, raise_descriptor_limit, usable_connections
from support.job_workers import StartedWorkers
from support.service import served


@pytest.mark.parametrize(
    ("wanted", "workers", "limit", "expected"),
    [
        (4096, 2, 65_536, 4096),
        (4096, 2, 1024, 752),
        (100, 2, 1024, 100),
        (4096, 2, 64, 16),
        (4096, 2, resource.RLIM_INFINITY, 4096),
    ],
)
def test_connections_leave_descriptors_for_everything_else(
    wanted: int, workers: int, limit: int, expected: int
) -> None:
    assert usable_connections(wanted, workers, limit) == expected


@pytest.mark.parametrize(
    ("soft", "hard", "expected"),
    [
        (1024, 20_000, 20_000),
        (1024, 524_288, 65_536),
        (100_000, 524_288, 100_000),
        (1024, resource.RLIM_INFINITY, 65_536),
    ],
)
def test_the_soft_limit_is_raised_and_never_lowered(
    soft: int, hard: int, expected: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    limits = [(soft, hard)]
    monkeypatch.setattr(resource, "getrlimit", lambda kind: limits[-1])
    monkeypatch.setattr(resource, "setrlimit", lambda kind, new: limits.append(new))
    assert highest_descriptor_limit() == expected
    raise_descriptor_limit()
    assert limits[-1] == (expected, hard)
    assert len(limits) == 1 + (expected != soft)


def test_a_server_watches_its_connections_as_long_as_it_runs(tmp_path: Path) -> None:
    def watches() -> int:
        return sum(thread.name == "connection watch" for thread in threading.enumerate())

    with served(given_workers=StartedWorkers()):
        assert watches() == 1
    assert watches() == 0
    # Over a Unix socket there are no strangers, and the kernel counts no bytes.
    with served(given_workers=StartedWorkers(), socket=tmp_path / "s"):
        assert watches() == 0
