"""Reasons why the robot may not move, and cautions for a person while it may."""

from enum import StrEnum


class Reason(StrEnum):
    """Reason why the wheels are commanded to stand still, as a sentence for a person.

    Most reasons end together with their cause; those in `LATCHING` hold until an operator resets them.
    """

    STANDBY = "The robot is in standby."
    CLOCK = "The clock went backwards."
    OPERATOR_STOP = "An operator has stopped the robot."
    SUPERVISOR_FAULT = "The supervisor has failed."
    PAUSED = "The bridge's computer stood still for too long."
    MOTOR_FAULT = "A motor reports a fault."
    TORQUE_LOST = "A motor does not hold, or has let go on its own."
    WHEEL_ASTRAY = "A wheel does not rotate as commanded: it is blocked, or does not stop."
    UNBIDDEN_MOTION = "The wheels rotate without a command, perhaps by a button of the board or its remote control."
    BATTERY_LOW = "The battery is empty."
    TORQUE_AWAITED = "The motors do not hold yet."
    COMMAND_SILENT = "No command has come for too long."
    SCAN_STALE = "The scanner has made no full revolution for too long."
    SCAN_BLIND = "The scanner measures nothing in the direction of motion."
    SCAN_TOUCHING = "Something in the direction of motion is nearer than the scanner can measure."
    MOTOR_SILENT = "The motors have not answered for too long."
    LOOP_OVERRUN = "The supervisor's loop has not run for too long."
    OPERATOR_LOST = "The link to the operator is lost."


LATCHING = (
    Reason.OPERATOR_STOP,
    Reason.SUPERVISOR_FAULT,
    Reason.PAUSED,
    Reason.MOTOR_FAULT,
    Reason.TORQUE_LOST,
    Reason.WHEEL_ASTRAY,
    Reason.UNBIDDEN_MOTION,
    Reason.BATTERY_LOW,
)
"""They hold until `SafetyLayer.reset`."""

TORQUE_OFF = (Reason.MOTOR_FAULT, Reason.TORQUE_LOST, Reason.WHEEL_ASTRAY, Reason.UNBIDDEN_MOTION)
"""They want torque off, too, once the wheels stand still or the time for that is over; so does standby.
With `Reason.UNBIDDEN_MOTION` it goes at once: such wheels do not come to rest otherwise.

`Reason.OPERATOR_STOP` joins them if `SafetyLimits.is_torque_off_on_operator_stop`.
"""


class Caution(StrEnum):
    """Caution that does not stop the robot, as a sentence for a person."""

    BATTERY = "The battery will soon be empty."
    MOTOR_VOLTAGE = "A motor reports that its supply is out of range."
    COMMAND_REFUSED = "A command was not a number and counts as a stop."
    SCAN_BLIND = "The scanner measures nothing in the direction of motion: it is covered, or nothing is in range."
    READING_REFUSED = "A reading of the drive base was refused: no body moves like that."
    SCAN_NOISY = "Many frames of the scanner are damaged."
    TORQUE_HELD = "The motors hold after the stop: buttons and remote control of the board can still move them."
