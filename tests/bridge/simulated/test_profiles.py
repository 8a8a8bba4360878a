"""Profiles of the simulated robot: what differs from ideal, by the seed of the run."""

import itertools
import math
import statistics
from collections import Counter

import numpy as np
import pytest

from robosc.execution.runtime.clock import ManualClock
from robosc_bridge.devices.interface import Velocity
from robosc_bridge.devices.lidar import make_lds01
from robosc_simulated import (
    BAD_DAY,
    BODIES,
    IDEAL,
    LIDARS,
    PROFILES,
    TYPICAL,
    Battery,
    Faults,
    Look,
    Noise,
    Scene,
    SimulatedTurtleBot3,
    Timebase,
    VirtualHost,
    Walls,
    World,
    maze_scene,
)
from robosc_simulated.battery import CAPACITY_WH, voltage_at
from robosc_simulated.line import Sending, SimulatedLine
from robosc_simulated.profile import Profile, find_profile
from robosc_simulated.scene import parse_scene
from support.drive import Rig, rig
from support.scenario_runs import maze_run

OPEN_SPACE = Walls(())


class Talker:
    """A device that sends what it is given, and keeps what it hears.

    Args:
        baud: Its speed; None: any.
    """

    def __init__(self, baud: int | None = None) -> None:
        self.baud = baud
        self.heard: list[bytes] = []
        self.waiting: list[bytes] = []
        self.answers = True

    def receive(self, data: bytes, baud: int) -> list[Sending]:
        self.heard.append(data)
        return [Sending(data)] if self.answers else []

    def update(self) -> list[Sending]:
        found, self.waiting = [Sending(data) for data in self.waiting], []
        return found

    def due_s(self) -> float:
        return -math.inf if self.waiting else math.inf

    def plug_in(self) -> None: ...


def talk(count: int, faults: dict[str, float], seed: int = 0) -> tuple[Talker, list[bytes]]:
    """Write packets of ten bytes one by one; what the device has heard, and what came back for each."""
    with VirtualHost() as host:
        device = Talker()
        with SimulatedLine(device, Timebase(host), seed=seed) as line:
            vars(line.faults).update(faults)
            port = host.open_port(line.path, 1_000_000)
            host.sleep(0.001)
            back = []
            for number in range(count):
                port.write(number.to_bytes(10, "little"))
                host.sleep(0.1)
                back.append(port.read(0.0))
            return device, back


def shares(packets: list[bytes]) -> Counter[str]:
    """Number of packets that came in each way."""
    found: Counter[str] = Counter()
    for number, data in enumerate(packets):
        sent = number.to_bytes(10, "little")
        wrong = sum((one ^ other).bit_count() for one, other in zip(data, sent, strict=False))
        match len(data):
            case 0:
                found["lost"] += 1
            case 10:
                found["whole" if data == sent else "flipped"] += 1
                assert wrong <= 1
            case 20:
                assert data == sent * 2
                found["twice"] += 1
            case _:
                assert sent.startswith(data)
                found["cut"] += 1
    return found


@pytest.mark.parametrize(
    ("fault", "kind"), [("duplicate_share", "twice"), ("cut_share", "cut"), ("flip_share", "flipped")]
)
def test_packets_to_the_host_are_damaged(fault: str, kind: str) -> None:
    device, back = talk(400, {fault: 0.25})
    found = shares(back)
    assert set(found) <= {"whole", kind, "lost"}
    assert 60 < found[kind] < 140
    # A cut at the very beginning.
    assert found["lost"] < 25
    assert shares(device.heard) == {"whole": 400}
    assert talk(400, {fault: 0.25})[1] == back
    assert talk(400, {fault: 0.25}, seed=1)[1] != back


@pytest.mark.parametrize(
    ("fault", "least", "most"),
    [("device_drop_share", 260, 340), ("device_cut_share", 380, 400), ("device_flip_share", 400, 400),
     ("device_duplicate_share", 460, 540)],
)  # fmt: skip
def test_packets_to_the_device_are_damaged(fault: str, least: int, most: int) -> None:
    device, _ = talk(400, {fault: 0.25})
    assert least <= len(device.heard) <= most
    whole = sum(data == number.to_bytes(10, "little") for number, data in enumerate(device.heard))
    assert whole < 340 or fault == "device_duplicate_share"


def arrivals(device: Talker, packets: list[bytes], **faults: object) -> list[tuple[float, bytes]]:
    """Times after a whole second at which bytes of packets, which are sent then, come."""
    with VirtualHost(now_s=1000.0) as host, SimulatedLine(device, Timebase(host)) as line:
        vars(line.faults).update(faults)
        port = host.open_port(line.path, device.baud or 1_000_000)
        host.sleep(1.0)
        device.waiting = list(packets)
        line._end.wake()
        begin_s, found = host.monotonic(), []
        while data := port.read(0.1):
            found.append((host.monotonic() - begin_s, data))
        return found


def test_bytes_take_their_time_on_the_wire() -> None:
    found = arrivals(Talker(115_200), [b"a" * 48, b"b" * 24], has_wire_time=True)
    assert [len(data) for _, data in found] == [48, 24]
    assert [time_s for time_s, _ in found] == pytest.approx([480 / 115_200, 720 / 115_200], abs=1e-4)
    assert arrivals(Talker(115_200), [b"a" * 48])[0][0] == 0.0


def test_an_adapter_gathers_bytes_until_its_time_is_over() -> None:
    (time_s, data), = arrivals(Talker(), [b"a" * 20, b"b" * 20], batch_s=0.016)  # fmt: skip
    # The timer runs on whatever comes: 1001 s is in the middle of a period.
    assert data == b"a" * 20 + b"b" * 20
    assert time_s == pytest.approx(math.ceil(1001 / 0.016) * 0.016 - 1001, abs=1e-4)
    assert 0.001 < time_s <= 0.016


def test_an_adapter_passes_a_full_packet_on_at_once() -> None:
    first, second = arrivals(Talker(), [b"a" * 40, b"b" * 40], batch_s=0.016)
    assert first == (0.0, b"a" * 40 + b"b" * 22)
    assert second[1] == b"b" * 18
    assert 0.001 < second[0] <= 0.016


def world_of(profile: Profile, walls: Walls | Scene = OPEN_SPACE, seed: int = 0) -> World:
    return World(BODIES["burger"], walls, Timebase(ManualClock()), seed=seed, profile=profile)


def test_a_wheel_has_inertia_and_a_dead_band() -> None:
    world = world_of(BAD_DAY)
    wheel = world.left
    wheel.is_driven, wheel.goal_rad_s = True, 3.0
    world.time.advance(0.08)
    world.catch_up()
    assert wheel.speed_rad_s == pytest.approx(3.0 * (1 - math.exp(-1)), rel=0.01)
    world.time.advance(1.0)
    world.catch_up()
    assert wheel.speed_rad_s == 3.0
    wheel.goal_rad_s = 0.9 * BAD_DAY.dead_band_rad_s
    world.time.advance(1.0)
    world.catch_up()
    assert wheel.speed_rad_s == 0.0
    wheel.goal_rad_s = 1.1 * BAD_DAY.dead_band_rad_s
    world.time.advance(1.0)
    world.catch_up()
    assert wheel.speed_rad_s == wheel.goal_rad_s


def test_the_slowest_rotation_is_above_the_dead_band() -> None:
    """The rotation of the skills, at its slowest, moves a Burger's wheels on any day."""
    slowest_rad_s = 0.08 * 0.160 / 2 / 0.033
    assert max(profile.dead_band_rad_s for profile in PROFILES.values()) < slowest_rad_s


def test_a_battery_empties_and_sags_under_load() -> None:
    assert voltage_at(1.0) == 12.6
    assert voltage_at(0.5) == pytest.approx((11.5 + 11.75) / 2)
    assert voltage_at(-1.0) == voltage_at(0.0) == 9.9
    world = world_of(BAD_DAY)
    battery = Battery(world, 0.75, 0.15)
    still_v = battery.voltage_v()
    for wheel in (world.left, world.right):
        wheel.is_driven, wheel.goal_rad_s = True, wheel.fastest_rad_s
    world.time.advance(1.0)
    world.catch_up()
    assert 0.05 < still_v - battery.voltage_v() < 0.2
    world.time.advance(599.0)
    world.catch_up()
    # 5 W, and 3 W for each wheel, for ten minutes.
    battery.voltage_v()
    assert (0.75 - battery.charge) * CAPACITY_WH == pytest.approx(11 / 6, rel=0.01)


@pytest.mark.parametrize("base", ["opencr", "dynamixel"])
def test_servos_and_board_live_from_the_battery_until_a_person_says_otherwise(base: str) -> None:
    with SimulatedTurtleBot3(base=base, clock=ManualClock(), profile="bad-day") as robot:
        robot.advance(0.1)
        assert robot.battery is not None
        volts = robot.battery.voltage_v()
        assert robot.left.voltage_v == pytest.approx(volts, abs=0.03)
        robot.left.brown_out(8.0)
        if robot.opencr is not None:
            assert robot.opencr.panel.battery_v == pytest.approx(volts, abs=0.03)
            robot.opencr.set_battery(11.2)
        robot.advance(0.1)
        assert robot.left.voltage_v == (8.0 if base == "dynamixel" else 11.2)
        if robot.opencr is not None:
            assert robot.opencr.panel.battery_v == 11.2


def test_a_motor_warms_up_and_cools_down() -> None:
    with SimulatedTurtleBot3(base="dynamixel", walls=OPEN_SPACE, clock=ManualClock(), profile="bad-day") as robot:
        servo = robot.left
        servo.write(64, b"\1")
        servo.write(104, (250).to_bytes(4, "little"))
        robot.advance(120.0)
        servo.catch_up()
        warm_c = servo.temperature_c
        assert 36.0 < warm_c < 33.0 + BAD_DAY.warming_c
        servo.write(104, bytes(4))
        robot.advance(60.0)
        servo.catch_up()
        assert 33.0 < servo.temperature_c < warm_c - 0.5


def ranges(profile: Profile, scene: Scene, revolutions: int = 20, lidar: str = "lds01") -> list[float]:
    """Distances straight ahead, in metres; 0: nothing."""
    world = World(BODIES["burger"], scene, Timebase(ManualClock()), profile=profile)
    scanner = LIDARS[lidar](world, noise_m=world.scene.noise.lidar_m)
    found = []
    for _ in range(revolutions):
        found += scanner._distances_mm([degree / 10 for degree in range(-20, 21)])
    return [value / 1000 for value in found]


def test_a_lidar_has_noise_that_grows_with_the_distance() -> None:
    near, far = (Scene("walls", Walls([(x_m, -9.0, x_m, 9.0)])) for x_m in (0.468, 2.468))
    spreads = [statistics.pstdev(value for value in ranges(TYPICAL, scene) if value) for scene in (near, far)]
    assert 0.003 < spreads[0] < 0.007
    assert 0.01 < spreads[1] < 0.02
    assert statistics.pstdev(ranges(IDEAL, near)) < 0.001


def test_a_lidar_sees_dark_things_from_near_and_little_of_glass() -> None:
    def seen_share(walls: str, profile: Profile, x_m: float) -> float:
        scene = parse_scene(f"walls: {{{walls}: [[{x_m}, -9, {x_m}, 9]]}}".encode(), "scene", "scene.yaml")
        found = ranges(profile, scene)
        return sum(value > 0 for value in found) / len(found)

    assert seen_share("dark", TYPICAL, 1.0) > 0.98
    assert seen_share("dark", TYPICAL, 3.0) == 0.0
    assert seen_share("segments", TYPICAL, 3.0) > 0.98
    assert seen_share("glass", TYPICAL, 1.0) == pytest.approx(0.25, abs=0.05)
    assert seen_share("glass", BAD_DAY, 1.0) == pytest.approx(0.1, abs=0.05)
    assert seen_share("glass", IDEAL, 1.0) == seen_share("dark", IDEAL, 3.0) == 1.0


def test_a_glass_obstacle_in_front_of_a_wall_hides_it() -> None:
    text = "walls: {segments: [[2, -9, 2, 9]]}\nobstacles: {vase: {x_m: 1, y_m: 0, radius_m: 0.4, look: glass}}"
    scene = parse_scene(text.encode(), "scene", "scene.yaml")
    assert scene.obstacles[0].look is Look.GLASS
    found = ranges(TYPICAL, scene)
    assert {round(value, 1) for value in found} <= {0.0, 0.6, 0.7}
    assert Counter(bool(value) for value in found)[False] > 0.6 * len(found)
    world = world_of(TYPICAL, scene)
    world.put_obstacle("vase", False)
    assert world.seen(None, np.array([[1.0, 0.0]]))[1] is None


def revolutions_s(profile: Profile, seconds: float) -> list[float]:
    """Times at which a driver has full revolutions, from its start."""
    with VirtualHost() as host, SimulatedTurtleBot3(lidar="lds01", clock=host, profile=profile.name) as robot:
        scanner = make_lds01(robot.scanner_path, host=host)
        begin_s = host.monotonic()
        scanner.open()
        found = []
        while host.monotonic() - begin_s < seconds:
            if (scan := scanner.receive(1.0)) is not None:
                found.append(scan.time_s - begin_s)
        scanner.close()
        return found


def test_a_lidar_comes_to_its_speed() -> None:
    found = revolutions_s(TYPICAL, 4.0)
    gaps = [after - before for before, after in itertools.pairwise(found)]
    assert gaps[0] > 0.25
    assert gaps[-1] == pytest.approx(0.2, abs=0.01)


def test_a_lidar_stalls_and_goes_on() -> None:
    found = revolutions_s(BAD_DAY, 180.0)
    gaps = [after - before for before, after in itertools.pairwise(found) if before > 3.0]
    assert 1 <= sum(gap > BAD_DAY.stall_s for gap in gaps) <= 8
    assert max(gaps) < 3.0


def driven(bench: Rig, velocity: Velocity) -> tuple[float, ...]:
    bench.start()
    reading = bench.drive(velocity, 2.0)
    return (*reading.wheels_m_s, *bench.robot.world.pose, reading.battery_v or 0.0)


@pytest.mark.parametrize("kind", ["opencr", "dynamixel"])
@pytest.mark.parametrize("profile", list(PROFILES))
def test_drivers_drive_on_any_day_and_the_same_each_time(kind: str, profile: str) -> None:
    def once(seed: int) -> tuple[float, ...]:
        with rig(kind, profile=profile, answer_limit_s=0.034, seed=seed, walls=OPEN_SPACE) as bench:
            return driven(bench, Velocity(0.1, 0.4))

    found = once(1)
    assert found == once(1)
    assert (found == once(2)) is (profile == "ideal")
    assert found[0] == pytest.approx(0.068, abs=0.006)
    assert found[4] == pytest.approx(0.8, abs=0.08)


def test_a_scene_can_say_its_profile() -> None:
    scene = parse_scene(b"profile: bad-day\nnoise: {slip_share: 0.3}", "scene", "scene.yaml")
    with SimulatedTurtleBot3(scene=scene, clock=ManualClock()) as robot:
        assert robot.profile is BAD_DAY
        assert robot.world.scene.noise == Noise(0.3, 0.02, 0.003, 0.008, 5.0)
        assert robot.base_faults.flip_share == BAD_DAY.to_host.flip
        assert robot.base_faults.device_flip_share == BAD_DAY.to_device.flip
    with SimulatedTurtleBot3(scene=scene, clock=ManualClock(), profile="ideal") as robot:
        assert robot.profile is IDEAL
        assert robot.base_faults == robot.scanner_faults == Faults()
    with pytest.raises(ValueError, match="there is no profile 'worst'; there are ideal, typical, bad-day"):
        find_profile("worst")


# The others, and the mazes of the package, are in acceptance/.
@pytest.mark.parametrize("base", ["opencr", "dynamixel"])
def test_a_small_maze_is_solved_on_a_bad_day(base: str) -> None:
    with maze_run(maze_scene(2, 1), profile="bad-day", base=base, seed=1) as run:
        run.until_reached(100.0)
