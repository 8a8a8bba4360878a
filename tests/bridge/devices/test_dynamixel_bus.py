"""Requests and answers in virtual time, and every way in which an answer can be wrong."""

import itertools
import math
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from robosc_bridge.devices.dynamixel_bus import DynamixelBus, RefusedError
from robosc_bridge.errors import DeviceSilentError, LineLostError
from robosc_bridge.host import Port
from support.peer import Answers, VirtualPeer, asked, packet, status

LIMIT_S = 0.1


@contextmanager
def _bus(peer: VirtualPeer, limit_s: float = LIMIT_S) -> Iterator[DynamixelBus]:
    line = peer.time.open_port(peer.path, 1_000_000)
    bus = DynamixelBus(line, lambda device: f"device {device}", limit_s, peer.time)
    bus.begin(10.0)
    yield bus


def _memory(request: bytes) -> bytes:
    """An answer that shows what was asked for: as many bytes as wanted, each its own address."""
    device, instruction, address, length = asked(request)
    match instruction:
        case 1:
            return status(device, b"\x24\x04\x2d")
        case 2:
            return status(device, bytes((address + index) % 256 for index in range(length)))
        case _:
            return status(device)


class _Scripted:
    """Answers as `_memory`, but as it is set for the next requests."""

    def __init__(self, *script: Answers) -> None:
        self._script = list(script)

    def __call__(self, request: bytes) -> Answers:
        return self._script.pop(0) if self._script else [_memory(request)]


def test_ping_read_write_and_reboot_are_as_worked() -> None:
    with VirtualPeer(lambda request: [_memory(request)]) as peer, _bus(peer) as bus:
        assert bus.ping(1) == (1060, 45)
        assert bus.read(1, 132, 4).data == bytes((132, 133, 134, 135))
        bus.write(1, 64, b"\1")
        bus.reboot(1)
        bus.sync_write(104, {1: (76).to_bytes(4, "little"), 2: (177).to_bytes(4, "little")})
        bus.sync_write(98, {1: b"\x19", 2: b"\x19"})
        bus.read(1, 70, 1)
    assert [request.hex(" ") for request in peer.requests] == [
        "ff ff fd 00 01 03 00 01 19 4e",
        "ff ff fd 00 01 07 00 02 84 00 04 00 1d 15",
        "ff ff fd 00 01 06 00 03 40 00 01 db 66",
        "ff ff fd 00 01 03 00 08 2f 4e",
        "ff ff fd 00 fe 11 00 83 68 00 04 00 01 4c 00 00 00 02 b1 00 00 00 54 b6",
        "ff ff fd 00 fe 0b 00 83 62 00 01 00 01 19 02 19 b4 c5",
        "ff ff fd 00 01 07 00 02 46 00 01 00 3c a3",
    ]


def test_a_synchronised_read_keeps_what_each_device_reported() -> None:
    def both(request: bytes) -> Answers:
        return [status(1, b"a" * 21), status(2, b"b" * 21, 0x80)]

    with VirtualPeer(both) as peer, _bus(peer) as bus:
        found = bus.sync_read(126, 21, (1, 2))
    assert peer.requests[0].hex(" ") == "ff ff fd 00 fe 09 00 82 7e 00 15 00 01 02 3e 1e"
    assert (found[1].data, found[1].is_alert) == (b"a" * 21, False)
    assert (found[2].data, found[2].is_alert) == (b"b" * 21, True)


def test_a_missing_device_does_not_hide_what_comes_behind_it() -> None:
    def second(request: bytes) -> Answers:
        return [status(2, b"b", 0x80)] if request[7] == 0x82 else [_memory(request)]

    with VirtualPeer(second) as peer, _bus(peer) as bus:
        found = bus.sync_read(64, 1, (1, 2))
        assert set(found) == {2}
        assert found[2].is_alert
        assert bus.counters.repeated == 1


@pytest.mark.parametrize(
    "noise",
    [
        bytes(range(256)),
        b"\xff\xff\xfd",
        b"\xff" * 40,
        packet(1, bytes((2, 132, 0, 4, 0))),
        status(7, b"1234"),
        status(1, b"12345"),
        status(1),
    ],
    ids=["garbage", "half a header", "0xff", "echo", "another device", "too long", "too short"],
)
def test_what_comes_before_the_answer_is_passed_over(noise: bytes) -> None:
    with VirtualPeer(_Scripted([noise, status(1, b"good")])) as peer, _bus(peer) as bus:
        assert bus.read(1, 132, 4).data == b"good"
        assert bus.counters.repeated == 0
    assert len(peer.requests) == 1


def test_an_answer_in_single_bytes_is_put_together() -> None:
    pieces: list[bytes | float] = []
    for byte in status(1, b"good"):
        pieces += [bytes((byte,)), 0.001]
    with VirtualPeer(_Scripted(pieces)) as peer, _bus(peer) as bus:
        assert bus.read(1, 132, 4).data == b"good"


@pytest.mark.parametrize(
    ("first", "is_damaged"),
    [
        ([], False),
        ([status(1, b"bad!")[:-1] + b"\0"], True),
        ([status(1, b"bad!")[:9]], True),
        ([status(7, b"bad!")], False),
        ([status(1, b"", 3)], False),
    ],
    ids=["silence", "wrong checksum", "half a packet", "another id", "request came damaged"],
)
def test_a_request_is_made_again_once(first: Answers, is_damaged: bool) -> None:
    with VirtualPeer(_Scripted(first)) as peer, _bus(peer) as bus:
        assert bus.read(1, 132, 4).data == bytes((132, 133, 134, 135))
        assert bus.counters.repeated == 1
        assert (bus.counters.damaged > 0) == is_damaged


def test_a_synchronised_read_that_came_damaged_is_made_again() -> None:
    reads = iter((status(1, b"", 3) + status(2, b"", 3), status(1, b"a") + status(2, b"b")))

    def answer(request: bytes) -> Answers:
        return [next(reads)] if request[7] == 0x82 else [_memory(request)]

    with VirtualPeer(answer) as peer, _bus(peer) as bus:
        found = bus.sync_read(64, 1, (1, 2))
        assert [found[device].data for device in (1, 2)] == [b"a", b"b"]
        assert bus.counters.repeated == 1


def test_silence_is_reported_in_time_and_names_who_answers_instead() -> None:
    with VirtualPeer(lambda request: [status(7, b"1234")]) as peer, _bus(peer) as bus:
        begin_s = peer.time.monotonic()
        with pytest.raises(DeviceSilentError, match="device 1 does not answer, but device 7 does"):
            bus.read(1, 132, 4)
        # It was made again once; the bytes of an answer take their time, too.
        assert peer.time.monotonic() - begin_s == pytest.approx(2 * LIMIT_S, abs=0.001)
        # The next device is not held up: the port is not busy, and nothing waits.
        begin_s = peer.time.monotonic()
        assert bus.read(7, 132, 4).data == b"1234"
        assert peer.time.monotonic() == begin_s


def test_all_requests_of_a_cycle_end_with_it() -> None:
    with VirtualPeer(lambda request: []) as peer, _bus(peer) as bus:
        begin_s = peer.time.monotonic()
        bus.begin(1.5 * LIMIT_S, repeats=5)
        with pytest.raises(DeviceSilentError):
            bus.read(1, 132, 4)
        with pytest.raises(DeviceSilentError, match="no time is left"):
            bus.write(1, 64, b"\1")
        assert peer.time.monotonic() - begin_s == pytest.approx(1.5 * LIMIT_S)


def test_a_clock_that_a_person_may_set_is_not_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    with VirtualPeer(lambda request: []) as peer, _bus(peer) as bus:
        monkeypatch.setattr(peer.time, "wall", lambda: pytest.fail("it was asked"))
        with pytest.raises(DeviceSilentError):
            bus.ping(1)


def test_an_endless_stream_of_foreign_bytes_ends_the_wait_all_the_same() -> None:
    def babble(request: bytes) -> Answers:
        while True:
            yield status(7, b"1234")
            yield b"\xff\xff\xfd\x00" * 50
            yield 0.001

    with VirtualPeer(babble) as peer, _bus(peer) as bus:
        bus.begin(1.0, repeats=0)
        begin_s = peer.time.monotonic()
        with pytest.raises(DeviceSilentError):
            bus.ping(1)
        assert peer.time.monotonic() - begin_s == pytest.approx(LIMIT_S, abs=0.002)


@pytest.mark.parametrize("answer", [status(1, b"late"), status(1, b"", 7)], ids=["data", "refusal"])
def test_a_late_answer_is_not_taken_for_that_to_the_next_request(answer: bytes) -> None:
    # So late that the next request is out already.
    late: Answers = [1.5 * LIMIT_S, answer]
    with VirtualPeer(_Scripted(late)) as peer, _bus(peer) as bus:
        bus.begin(10.0, repeats=0)
        with pytest.raises(DeviceSilentError):
            bus.read(1, 132, 4)
        assert bus.read(1, 132, 4).data == bytes((132, 133, 134, 135))
        assert bus.counters.foreign == 1


class _Interrupter:
    """Interruption that writes as soon as there is an answer to wait for; the wait is woken for it at once.

    Args:
        bus: Bus of the device.
        line: Its line.
        data: Data to interject, one after the other.
    """

    def __init__(self, bus: DynamixelBus, line: Port, *data: bytes) -> None:
        self._bus = bus
        self._line = line
        self.left = list(data)
        bus.interruption = self._interrupt
        line.wake()

    def _interrupt(self) -> None:
        if self.left:
            self._bus.interject(1, 150, self.left.pop(0))
            self._line.wake()


def _line_of(bus: DynamixelBus) -> Port:
    return bus._port.line


def _slow(request: bytes) -> Answers:
    """One that works off its requests one after the other, each in 10 ms."""
    return [0.01, _memory(request) if request[7] == 0x02 else status(1)]


def test_what_is_interjected_goes_out_while_an_answer_is_awaited_and_is_heard_after_it() -> None:
    with VirtualPeer(_slow) as peer, _bus(peer) as bus:
        interrupter = _Interrupter(bus, _line_of(bus), b"new", b"newer")
        begin_s = peer.time.monotonic()
        assert bus.read(1, 132, 4).data == bytes((132, 133, 134, 135))
        assert peer.time.monotonic() - begin_s == pytest.approx(0.02)
        assert [request[7] for request in peer.requests] == [0x02, 0x03]
        assert peer.requests[1][8:-2] == b"\x96\0new"
        # The next one waits for the next answer that is awaited.
        assert interrupter.left == [b"newer"]
        assert bus.read(1, 4, 1).data == b"\4"
        assert peer.requests[3][8:-2] == b"\x96\0newer"
        assert (bus.counters.unanswered, bus.counters.foreign, bus.counters.requests) == (0, 0, 4)


def test_an_answer_of_which_a_part_has_come_is_kept() -> None:
    whole = status(1, b"good")
    with VirtualPeer(_Scripted([whole[:8], 0.01, whole[8:]])) as peer, _bus(peer) as bus:
        _Interrupter(bus, _line_of(bus), b"new")
        # Not woken: the first look is the one that finds a part.
        _line_of(bus).read(0.0)
        assert bus.read(1, 132, 4).data == b"good"
        assert [request[7] for request in peer.requests] == [0x02, 0x03]
        assert bus.counters.repeated == 0


def test_an_interjection_discards_nothing_that_has_come() -> None:
    whole = status(1, b"good")
    # Both parts are there, one of them unread, when it is sent.
    with VirtualPeer(_Scripted([whole[:8]])) as peer, _bus(peer) as bus:
        line = _line_of(bus)

        def interrupt() -> None:
            if not interrupted:
                interrupted.append(True)
                peer.send(whole[8:])
                bus.interject(1, 150, b"new")

        interrupted: list[bool] = []
        bus.interruption = interrupt
        assert bus.read(1, 132, 4).data == b"good"
        assert line.read(0.0) == b""
        assert bus.counters.repeated == 0


def test_where_the_answer_is_lost_behind_which_something_was_interjected_the_request_is_made_again() -> None:
    reads = itertools.count()

    def lossy(request: bytes) -> Answers:
        return [0.01] if request[7] == 0x02 and next(reads) == 0 else _slow(request)

    with VirtualPeer(lossy) as peer, _bus(peer) as bus:
        _Interrupter(bus, _line_of(bus), b"new")
        begin_s = peer.time.monotonic()
        assert bus.read(1, 132, 4).data == bytes((132, 133, 134, 135))
        # Answers keep their order: none is awaited once the next one is there.
        assert peer.time.monotonic() - begin_s == pytest.approx(0.04)
        assert (bus.counters.unanswered, bus.counters.repeated) == (1, 1)


def test_a_device_that_is_silent_is_not_asked_again_behind_what_was_interjected() -> None:
    with VirtualPeer(_Scripted([], [])) as peer, _bus(peer) as bus:
        _Interrupter(bus, _line_of(bus), b"new")
        with pytest.raises(DeviceSilentError):
            bus.read(1, 132, 4)
        assert [request[7] for request in peer.requests] == [0x02, 0x03]
        assert bus.counters.repeated == 0
        # The rest is as after any silence.
        bus.interruption = None
        bus.begin(10.0)
        assert bus.read(1, 132, 4).data == bytes((132, 133, 134, 135))


def test_what_was_interjected_and_is_not_answered_spoils_no_later_answer() -> None:
    late: Answers = [1.5 * LIMIT_S, status(1)]
    with VirtualPeer(_Scripted([0.01, status(1, b"good")], late)) as peer, _bus(peer) as bus:
        bus.begin(10.0)
        _Interrupter(bus, _line_of(bus), b"new")
        assert bus.read(1, 132, 4).data == b"good"
        assert (bus.counters.unanswered, bus.unheard) == (1, 1)
        bus.interruption = None
        # Its late answer would confirm this one.
        bus.write(1, 64, b"\1")
        assert bus.counters.foreign == 1


def test_an_older_write_does_not_follow_one_that_was_interjected() -> None:
    with VirtualPeer(_Scripted([], [])) as peer, _bus(peer) as bus:
        _Interrupter(bus, _line_of(bus), b"new")
        with pytest.raises(DeviceSilentError):
            bus.write(1, 150, b"old")
        assert [request[10:-2] for request in peer.requests] == [b"old", b"new"]
    # One answer of two is that to the newer one: each comes as the other one.
    with VirtualPeer(_Scripted([], [0.01, status(1)])) as peer, _bus(peer) as bus:
        _Interrupter(bus, _line_of(bus), b"new")
        bus.write(1, 150, b"old")
        assert [request[10:-2] for request in peer.requests] == [b"old", b"new"]
        assert bus.unheard == 0


def test_a_write_is_reported_when_the_line_has_it() -> None:
    sent: list[int] = []
    with VirtualPeer(_Scripted([])) as peer, _bus(peer) as bus:
        bus.write(1, 64, b"\1", sent=lambda: sent.append(len(peer.requests)))
        # Before the device has heard it, and again with the one that is made again, behind the one that settles.
        assert sent == [0, 2]


def test_an_answer_that_comes_twice_is_not_taken_for_that_to_the_next_request() -> None:
    with VirtualPeer(_Scripted([status(1, b"good"), 0.01, status(1, b"good")])) as peer, _bus(peer) as bus:
        assert bus.read(1, 132, 4).data == b"good"
        peer.time.sleep(0.02)
        assert bus.read(1, 132, 4).data == bytes((132, 133, 134, 135))


def test_a_late_answer_to_a_write_confirms_no_other_write() -> None:
    late: Answers = [1.5 * LIMIT_S, status(1)]
    with VirtualPeer(_Scripted(late, [])) as peer, _bus(peer) as bus:
        bus.begin(10.0, repeats=0)
        with pytest.raises(DeviceSilentError):
            bus.write(1, 64, b"\1")
        # The peer drops what follows: the late answer is all there is.
        with pytest.raises(DeviceSilentError):
            bus.write(1, 64, b"\0")


def test_a_line_that_is_always_late_never_seems_to_answer() -> None:
    # It answers everything, in order, half a second late.
    delayed: list[tuple[float, bytes]] = []

    def send() -> None:
        while True:
            peer.time.wait(lambda: bool(delayed), math.inf)
            due_s, answer = delayed.pop(0)
            peer.time.sleep(due_s - peer.time.monotonic())
            peer.send(answer)

    def keep(request: bytes) -> Answers:
        delayed.append((peer.time.monotonic() + 0.5, _memory(request)))
        return []

    with VirtualPeer(keep) as peer, _bus(peer, 0.03) as bus:
        peer.time.thread(send, "line").start()
        end_s = peer.time.monotonic() + 60.0
        while peer.time.monotonic() < end_s:
            bus.begin(0.1)
            with pytest.raises(DeviceSilentError):
                bus.read(1, 132, 4)
        assert bus.counters.foreign > 500


def test_late_answers_of_a_synchronised_read_are_not_taken_for_the_next() -> None:
    def both(data: bytes) -> bytes:
        return status(1, data) + status(2, data)

    class Late:
        count = 0

        def __call__(self, request: bytes) -> Answers:
            if request[7] != 0x82:
                return [_memory(request)]
            self.count += 1
            return [1.5 * LIMIT_S, both(b"late")] if self.count == 1 else [both(b"good")]

    with VirtualPeer(Late()) as peer, _bus(peer) as bus:
        bus.begin(10.0, repeats=0)
        assert bus.sync_read(132, 4, (1, 2)) == {}
        found = bus.sync_read(132, 4, (1, 2))
    assert {found[1].data, found[2].data} == {b"good"}


@pytest.mark.parametrize("length", [1, 2, 4])
def test_a_refused_read_is_an_error_and_no_value(length: int) -> None:
    with VirtualPeer(lambda request: [status(1, b"", 0x87)]) as peer, _bus(peer) as bus:
        with pytest.raises(RefusedError, match=r"device 1 does not let \d bytes at 200 be read: no access") as caught:
            bus.read(1, 200, length)
        assert caught.value.number == 7
    assert len(peer.requests) == 1


def test_a_refused_write_is_an_error() -> None:
    with (
        VirtualPeer(lambda request: [status(1, b"", 6)]) as peer,
        _bus(peer) as bus,
        pytest.raises(RefusedError, match="value beyond a limit"),
    ):
        bus.write(1, 104, (400).to_bytes(4, "little"))


def test_a_write_may_have_a_limit_of_its_own() -> None:
    with VirtualPeer(_Scripted([2.5 * LIMIT_S, status(200)])) as peer, _bus(peer) as bus:
        bus.write(200, 59, b"\1", 5.0)
        assert bus.counters.repeated == 0


def test_a_line_that_is_gone_is_reported_as_such_and_leaves_nothing_busy() -> None:
    with VirtualPeer(lambda request: [_memory(request)]) as peer, _bus(peer) as bus:
        bus.ping(1)
        peer.unplug()
        for _ in range(2):
            with pytest.raises(LineLostError, match=peer.path):
                bus.ping(1)


def test_a_line_that_is_lost_while_waiting_is_reported_as_such() -> None:
    def hang_up(request: bytes) -> Answers:
        yield 0.05
        peer.unplug()

    with VirtualPeer(hang_up) as peer, _bus(peer, 5.0) as bus:
        begin_s = peer.time.monotonic()
        with pytest.raises(LineLostError):
            bus.ping(1)
        assert peer.time.monotonic() - begin_s == pytest.approx(0.05)


def test_a_packet_that_the_sdk_does_not_take_is_our_mistake() -> None:
    with VirtualPeer(lambda request: []) as peer, _bus(peer) as bus, pytest.raises(ValueError, match="does not send"):
        bus.write(1, 0, bytes(1100))
