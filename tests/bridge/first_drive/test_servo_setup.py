"""Set-up of servos: torque off first, only what differs, everything read back, nothing without a yes."""

from argparse import Namespace
from collections.abc import Iterator
from typing import Any

import pytest

from robosc_bridge.devices.robots import ROBOTS
from robosc_bridge.driver_registry import make_drive_base
from robosc_bridge.first_drive import commands
from robosc_bridge.main import main
from robosc_simulated import SimulatedLine, Timebase, World, room
from robosc_simulated.robots import BODIES
from robosc_simulated.servo import Servo
from robosc_simulated.servo_bus import ServoBus
from robosc_simulated.virtual_host import VirtualHost


@pytest.fixture
def host() -> Iterator[VirtualHost]:
    with VirtualHost() as found:
        yield found


class Bench:
    """Servos on an adapter, as they left the factory unless said else.

    Args:
        host: Host whose port it is.
        ids: Ids of the servos.
        settings: Their settings.
    """

    def __init__(self, host: VirtualHost, *ids: int, **settings: int) -> None:
        self.host = host
        time = Timebase(host)
        self.world = World(BODIES["burger"], room(4.0, 3.0), time)
        named = {name.replace("_", " "): value for name, value in settings.items()}
        wheels = (self.world.left, self.world.right)
        model = BODIES["burger"].servo_model
        self.servos = [
            Servo(model, self.world, wheel, number, settings=named) for wheel, number in zip(wheels, ids, strict=False)
        ]
        self.line = SimulatedLine(ServoBus(tuple(self.servos)), time)

    def run(self, *answers: str, **arguments: Any) -> int:
        """Return the exit status of the command."""
        given = {
            "port": self.line.path, "id": None, "baud": None, "wheel": None, "new_id": None, "new_baud": None,
            "direction": None, "yes": False,
        }  # fmt: skip
        left = list(answers)
        status = commands._setup(Namespace(**given | arguments), self.host, lambda question: left.pop(0))
        assert left == []
        return status

    def close(self) -> None:
        self.line.close()


def test_two_servos_from_the_factory_become_wheels_that_drive(
    host: VirtualHost, capsys: pytest.CaptureFixture[str]
) -> None:
    bench = Bench(host, 1)
    assert bench.run("y", wheel="right") == 0
    (servo,) = bench.servos
    table = servo.table
    assert (table["id"], table["baud rate"], table["drive mode"], table["operating mode"]) == (2, 3, 1, 1)
    out = capsys.readouterr().out
    assert "servo 1 at 57600 baud" in out
    assert "baud rate (address 8): 57600 -> 1000000" in out
    assert "written: servo 2 at 1000000 baud" in out
    # Once more: nothing differs, and no question is asked.
    assert bench.run(wheel="right") == 0
    assert "nothing is to be written" in capsys.readouterr().out
    bench.close()


def test_what_it_sets_up_is_what_the_driver_takes(host: VirtualHost) -> None:
    bench = Bench(host, 1, 2, baud_rate=3, drive_mode=0)
    with pytest.raises(SystemExit):
        main(["setup-servo", "--port", "/dev/none", "--wheel", "middle"])
    assert bench.run("y", id=2, wheel="right") == 0
    assert bench.run("yes", id=1, wheel="left") == 0
    base = make_drive_base("dynamixel", path=bench.line.path, robot=ROBOTS["burger"], host=host)
    base.open()
    base.set_torque(True)
    base.close()
    bench.close()


def test_torque_goes_off_first_and_stays_off(host: VirtualHost) -> None:
    bench = Bench(host, 1, baud_rate=3, operating_mode=1)
    (servo,) = bench.servos
    servo.table["torque enable"] = 1
    assert bench.run(new_id=7, yes=True) == 0
    assert (servo.table["torque enable"], servo.table["id"]) == (0, 7)
    bench.close()


@pytest.mark.parametrize("answer", ["", "n", "no", "Y!", "yess"])
def test_nothing_is_written_without_a_yes(answer: str, host: VirtualHost, capsys: pytest.CaptureFixture[str]) -> None:
    bench = Bench(host, 1)
    (servo,) = bench.servos
    servo.table["torque enable"] = 1
    assert bench.run(answer, wheel="right") == 1
    assert "nothing was written" in capsys.readouterr().out
    assert (servo.table["id"], servo.table["baud rate"], servo.table["torque enable"]) == (1, 1, 1)
    bench.close()


def test_two_servos_of_which_none_is_named_are_refused_and_so_is_an_id_that_is_taken(
    host: VirtualHost, capsys: pytest.CaptureFixture[str]
) -> None:
    bench = Bench(host, 1, 2)
    assert bench.run(wheel="left") == 1
    assert "servos 1, 2 answer; name one with --id" in capsys.readouterr().err
    assert bench.run(id=1, new_id=2) == 1
    assert "another servo on this line has the id 2 already" in capsys.readouterr().err
    assert bench.run(id=9) == 1
    assert "no servo 9 answers at 1000000, 57600" in capsys.readouterr().err
    bench.close()


def test_a_servo_that_still_rotates_is_not_written_to(host: VirtualHost, capsys: pytest.CaptureFixture[str]) -> None:
    bench = Bench(host, 1, baud_rate=3, operating_mode=1)
    bench.world.left.speed_rad_s = 50.0
    assert bench.run(new_id=7, yes=True) == 1
    assert "servo 1 still rotates; nothing was written" in capsys.readouterr().err
    assert bench.servos[0].table["id"] == 1
    host.sleep(20.0)
    assert bench.run(new_id=7, yes=True) == 0
    bench.close()


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (["--new-id", "253"], "an id is a whole number from 0 to 252"),
        (["--new-baud", "1000"], "a servo has 9600, 57600"),
        (["--id", "-1"], "-1: an id is a whole number from 0 to 252"),
    ],
)
def test_what_a_servo_cannot_have_is_wrong_use(
    arguments: list[str], problem: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as raised:
        main(["setup-servo", "--port", "/dev/none", *arguments])
    assert raised.value.code == 2
    assert problem in capsys.readouterr().err


def test_a_port_that_is_not_there_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["setup-servo", "--port", "/dev/none", "--wheel", "left"]) == 2
    assert capsys.readouterr().err == "robosc-bridge: /dev/none: there is no such port; is the device plugged in?\n"


def test_no_servo_is_taken_for_a_wheel_that_is_none(host: VirtualHost, capsys: pytest.CaptureFixture[str]) -> None:
    bench = Bench(host, 1)
    bench.servos[0].table["model number"] = 350
    assert bench.run(wheel="left") == 1
    assert "is of model 350, no wheel" in capsys.readouterr().err
    bench.close()
