"""A whole bridge that is told to end while its motors go on: nothing more begins, and nothing stays begun."""

from collections.abc import Callable

import pytest

from robosc_bridge.daemon.states import OperatorCommand, State
from robosc_bridge.devices.interface import UNDO_LIMIT_S
from robosc_simulated import Rover, SimulatedTurtleBot3
from robosc_simulated.rover import GUIDED
from support.driven import Driven, driven

ARM, FORCE = 400, 21196.0
REACHABLE = "{grpc_address: '127.0.0.1:1'}"


def _rover(robot: SimulatedTurtleBot3) -> Rover:
    assert robot.rover is not None
    return robot.rover


def _orders(bridge: Driven) -> list[float]:
    """Return the orders to arm (1) and to disarm (0), as the rover has heard them."""
    return [parameters[0] for number, parameters in _rover(bridge.robot).commands if number == ARM]


def _until_arming(bridge: Driven) -> None:
    bridge.until(lambda: 1.0 in _orders(bridge), "an order to arm", 60.0)


@pytest.mark.parametrize("order", [OperatorCommand.QUIT, OperatorCommand.STOP, OperatorCommand.STANDBY])
def test_after_a_stop_no_further_order_to_arm_goes_out_and_what_has_begun_is_undone(order: OperatorCommand) -> None:
    def mute(robot: SimulatedTurtleBot3) -> None:
        _rover(robot).answers_commands = False
        # It is in that mode already: the order to enter it would not be answered either.
        _rover(robot).mode = GUIDED

    with driven("mavlink-rover", before=mute, remote=REACHABLE) as bridge:
        _until_arming(bridge)
        bridge.machine.daemon.post(order)
        bridge.until(lambda: not _rover(bridge.robot).is_armed and 0.0 in _orders(bridge), "it to be disarmed", 10.0)
        before = _orders(bridge).count(1.0)
        bridge.host.sleep(2 * UNDO_LIMIT_S)
        assert before == 1
        assert _orders(bridge).count(1.0) == 1
        assert not _rover(bridge.robot).is_armed
        if order is OperatorCommand.QUIT:
            assert bridge.ended() == ""
            # Its heartbeats have shown it.
            assert bridge.has_ended_well
        else:
            assert bridge.state is not State.OVER


def test_an_order_to_arm_that_takes_effect_late_is_undone() -> None:
    def late(robot: SimulatedTurtleBot3) -> None:
        _rover(robot).arms_after_s = 1.2

    with driven("mavlink-rover", before=late) as bridge:
        _until_arming(bridge)
        bridge.machine.quit()
        assert bridge.ended() == ""
        assert bridge.has_ended_well
        bridge.host.sleep(5.0)
        assert not _rover(bridge.robot).is_armed


def _hears_nothing_more(robot: SimulatedTurtleBot3) -> None:
    robot.base_faults.drop_share = 1.0


def _is_cut_off(robot: SimulatedTurtleBot3) -> None:
    robot.base_line.disconnect()


@pytest.mark.parametrize("cause", [_hears_nothing_more, _is_cut_off])
def test_what_cannot_be_undone_is_named_and_the_end_is_not_a_good_one(
    cause: Callable[[SimulatedTurtleBot3], None],
) -> None:
    def mute(robot: SimulatedTurtleBot3) -> None:
        _rover(robot).answers_commands = False
        _rover(robot).mode = GUIDED

    with driven("mavlink-rover", before=mute) as bridge:
        _until_arming(bridge)
        cause(bridge.robot)
        bridge.machine.quit()
        bridge.ended()
        assert not bridge.has_ended_well
        assert any("the rover may be armed" in message for message in bridge.messages)


@pytest.mark.parametrize("base", ["opencr", "dynamixel", "mavlink-rover"])
def test_a_bridge_that_has_driven_ends_well(base: str) -> None:
    with driven(base) as bridge:
        bridge.steady()
        bridge.machine.quit()
        assert bridge.ended() == ""
        assert bridge.has_ended_well
        assert not bridge.robot.world.left.is_driven


@pytest.mark.parametrize("base", ["opencr", "dynamixel", "mavlink-rover"])
def test_a_driving_base_that_is_cut_off_at_the_end_is_named(base: str) -> None:
    with driven(base) as bridge:
        bridge.steady()
        bridge.robot.base_line.disconnect()
        bridge.machine.quit()
        bridge.ended()
        assert not bridge.has_ended_well
        assert any("may hold" in message or "may be armed" in message for message in bridge.messages)


@pytest.mark.parametrize("base", ["opencr", "dynamixel"])
def test_answers_that_are_lost_while_torque_goes_on_do_not_leave_it_on(base: str) -> None:
    """Its answers come again 2 s later, within the time for which it is tried."""
    with driven(base, remote=REACHABLE) as bridge:
        bridge.steady()
        assert _answered(bridge, OperatorCommand.STANDBY)
        bridge.until(lambda: not bridge.robot.world.left.is_driven, "the motors to let go")
        bridge.machine.daemon.post(OperatorCommand.START)
        bridge.until(lambda: bridge.robot.world.left.is_driven, "torque")
        bridge.robot.base_faults.drop_share = 1.0
        bridge.machine.quit()
        bridge.host.sleep(2.0)
        bridge.robot.base_faults.drop_share = 0.0
        bridge.ended()
        assert not bridge.robot.world.left.is_driven
        assert bridge.has_ended_well


def _answered(bridge: Driven, command: OperatorCommand) -> bool:
    bridge.machine.daemon.post(command)
    bridge.until(lambda: bridge.state is State.STANDBY, "standby")
    return True
