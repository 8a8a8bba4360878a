"""Words with systemd: datagrams as sd_notify(3) has them, and none where they are not wanted."""

import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from robosc_bridge.daemon.service_manager import ServiceManager
from robosc_bridge.daemon.states import OperatorCommand
from robosc_bridge.daemon.threads.workers import DriveWorker
from robosc_bridge.devices.interface import STANDSTILL
from support.driven import driven


class Manager:
    """Socket of systemd.

    Args:
        address: Name of its socket.
    """

    def __init__(self, address: str) -> None:
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(address)
        self.socket.setblocking(False)

    def heard(self) -> list[str]:
        """Return the texts that have come since the last look."""
        found = []
        while True:
            try:
                found.append(self.socket.recv(4096).decode())
            except BlockingIOError:
                return found


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[Manager]:
    found = Manager(str(tmp_path / "notify"))
    yield found
    found.socket.close()


def environment(manager: Manager, **more: str) -> dict[str, str]:
    return {"NOTIFY_SOCKET": manager.socket.getsockname(), "WATCHDOG_USEC": "9000000", "WATCHDOG_PID": "7", **more}


def test_it_receives_the_states_of_a_life(manager: Manager) -> None:
    service = ServiceManager(lambda now_s: True, environment(manager), 7)
    service.beat(100.0, "starting")
    assert manager.heard() == ["STATUS=starting", "WATCHDOG=1"]
    service.ready()
    service.beat(102.9, "starting")
    assert manager.heard() == ["READY=1"]
    service.beat(103.0, "running")
    service.stopping()
    service.close()
    service.beat(200.0, "over")
    assert manager.heard() == ["STATUS=running", "WATCHDOG=1", "STOPPING=1"]


def test_no_sign_of_life_is_sent_of_a_bridge_whose_wheels_have_none(
    manager: Manager, caplog: pytest.LogCaptureFixture
) -> None:
    is_working = False
    service = ServiceManager(lambda now_s: is_working, environment(manager), 7)
    for now_s in range(20):
        service.beat(float(now_s), "running")
    assert manager.heard() == ["STATUS=running"]
    assert len(caplog.messages) == 1
    is_working = True
    service.beat(20.0, "running")
    assert manager.heard() == ["WATCHDOG=1"]
    service.close()


@pytest.mark.parametrize("more", [{"WATCHDOG_PID": "8"}, {"WATCHDOG_USEC": "0"}, {"WATCHDOG_USEC": "-1"}])
def test_a_watchdog_of_another_process_or_none_is_not_fed(more: dict[str, str], manager: Manager) -> None:
    service = ServiceManager(lambda now_s: True, environment(manager, **more), 7)
    service.beat(100.0, "running")
    service.ready()
    assert manager.heard() == ["STATUS=running", "READY=1"]
    service.close()


def test_a_name_may_be_abstract() -> None:
    name = f"robosc-test-{id(object())}"
    manager = Manager("\0" + name)
    service = ServiceManager(lambda now_s: True, {"NOTIFY_SOCKET": "@" + name}, 7)
    service.ready()
    assert manager.heard() == ["READY=1"]
    service.close()
    manager.socket.close()


def test_nobody_listens_and_nothing_happens(tmp_path: Path) -> None:
    for service in (
        ServiceManager(lambda now_s: True, {}, 7),
        ServiceManager(lambda now_s: True, {"NOTIFY_SOCKET": str(tmp_path / "gone"), "WATCHDOG_USEC": "1"}, 7),
    ):
        service.ready()
        service.beat(1.0, "running")
        service.stopping()
        service.close()
        service.close()


def test_a_bridge_notifies_it_while_it_drives_and_when_it_ends(
    manager: Manager, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NOTIFY_SOCKET", manager.socket.getsockname())
    monkeypatch.setenv("WATCHDOG_USEC", "600000")
    monkeypatch.delenv("WATCHDOG_PID", raising=False)
    with driven("opencr") as bridge:
        bridge.steady()
        manager.heard()
        began_s = bridge.host.monotonic()
        bridge.until(lambda: bridge.host.monotonic() > began_s + 2.0, "two seconds")
        # Three in 0.6 s, at the first cycle after each is due.
        heard = manager.heard()
        assert set(heard) == {"WATCHDOG=1"}
        assert 9 <= len(heard) <= 10
        bridge.machine.daemon.post(OperatorCommand.QUIT)
        bridge.ended()
    assert manager.heard()[-1] in ("STOPPING=1", "STATUS=over")


class Hanging:
    """A drive base that hangs in its exchanges when it is set to: its clock goes on."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self.worker: DriveWorker | None = None
        self.seen: list[bool] = []

    def look(self, *waits_s: float) -> None:
        for wait_s in waits_s:
            self.now_s += wait_s
            assert self.worker is not None
            self.seen.append(self.worker.is_cycling(self.now_s))

    def open(self) -> None:
        self.look(25.0, 10.0)

    def exchange(self, velocity: object) -> None:
        self.look(1.9, 0.2)

    def close(self) -> None:
        pass


def test_a_step_that_takes_too_long_is_a_thread_that_hangs() -> None:
    base = Hanging()

    class Gate:
        velocity, is_torque_wanted, reasons, warnings = STANDSTILL, False, (), ()

        def output(self, now_s: float) -> "Gate":
            return self

        def drive_failed(self) -> None:
            pass

    drive_base: Any = base
    gate: Any = Gate()
    base.worker = worker = DriveWorker(drive_base, gate, lambda report: None, 0.02, lambda: base.now_s)
    worker.step(base.now_s)
    assert base.seen == [True, False]
    assert worker.is_cycling(base.now_s)
    # The worker brings nothing: the driver fails.
    worker.step(base.now_s)
    assert base.seen[2:] == [True, False]
    assert worker.is_cycling(base.now_s + 29.0)
    assert not worker.is_cycling(base.now_s + 31.0)
