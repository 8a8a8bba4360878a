"""Rotations by an angle on request of the model, one at a time, and the report of their end.

The end of a call or goal is reported when the wheels stand: to command a standstill does not end the motion.
"""

import logging
import math
from collections.abc import Callable
from typing import Any

from robosc.model.structure import Communication, CommunicationKind
from robosc_bridge.configuration.channels import RotateChannel, RotatedChannel
from robosc_bridge.daemon.channel_data import angle_of
from robosc_bridge.daemon.executor_inputs import Listeners, Supervised
from robosc_bridge.daemon.robot.motion import MotionTarget

_log = logging.getLogger(__name__)

_SERVICE_SHARE = 0.9
"""Share of a call's time that a rotation may take."""


class _Rotation:
    """A rotation under way."""

    def __init__(self, asked: Communication, channel: RotateChannel, number: int | None, end_s: float) -> None:
        self.asked = asked
        self.channel = channel
        self.number = number
        self.end_s = end_s
        self.is_cancelled = False


class Rotations:
    """The rotation under way.

    Args:
        motion: Motion of the wheels.
        listeners: Identifiers that receive the end of a rotation that a message asked for.
        owe: Function that takes a report, which reaches the executor when it is not at work.
        on_failed: Function that is called with the reason of a failed rotation, if the model gets no message of it.
        service_timeout_s: Time after which a call fails for the executor, in seconds; None: never.
        clock: Clock that returns the time, in seconds.
    """

    def __init__(
        self,
        motion: MotionTarget,
        listeners: Listeners,
        owe: Callable[[Callable[[Supervised], None]], None],
        on_failed: Callable[[str], None],
        service_timeout_s: float | None,
        clock: Callable[[], float],
    ) -> None:
        self._motion = motion
        self._listeners = listeners
        self._owe = owe
        self._on_failed = on_failed
        self._service_timeout_s = math.inf if service_timeout_s is None else service_timeout_s
        self._clock = clock
        self._rotation: _Rotation | None = None

    @property
    def is_under_way(self) -> bool:
        """True if a rotation is under way whose end must be reported."""
        return self._rotation is not None

    @property
    def asked_by(self) -> str | None:
        """Name of the communication that requested the rotation under way; None: there is none."""
        return None if self._rotation is None else self._rotation.asked.name

    def forget(self) -> None:
        """Forget the rotation under way, for a new run: its end is not reported to the run that requested it."""
        self._rotation = None

    def begin(self, asked: Communication, channel: RotateChannel, number: int | None, message: Any) -> None:
        """Begin a rotation; none is under way.

        Args:
            asked: Communication that asked for it.
            channel: Channel that the communication is mapped to.
            number: Number of the call or goal; None: a message asked for it.
            message: Message with the angle.
        """
        # Before the executor believes that a call failed, it must have.
        is_call = asked.kind is CommunicationKind.SERVICE
        end_s = self._clock() + self._service_timeout_s * _SERVICE_SHARE if is_call else math.inf
        angle = angle_of(message) * (1.0 if channel.direction == "left" else -1.0)
        self._rotation = _Rotation(asked, channel, number, end_s)
        self._motion.rotate(math.radians(angle) if channel.unit == "degrees" else angle, self._clock())

    def end(self, reason: str, *, is_own: bool = False, at_once: bool = False) -> None:
        """End the rotation under way as failed.

        Args:
            reason: Reason.
            is_own: True if the model requested another motion.
            at_once: True if no standstill is awaited: another motion follows, or nobody measures it.
        """
        if self._rotation is not None:
            self._motion.stop(self._clock(), reason)
            self.poll(is_own=is_own, at_once=at_once)

    def cancel(self, communication: str, number: int) -> None:
        """End a rotation that an action requested; that it was cancelled is reported when the wheels stand."""
        rotation = self._rotation
        if rotation is not None and rotation.number == number and rotation.asked.name == communication:
            rotation.is_cancelled = self._motion.is_rotating
            self._motion.stop(self._clock(), "it was cancelled")

    def poll(self, *, is_own: bool = False, at_once: bool = False) -> None:
        """Check whether a rotation has ended; if so, its end is reported later to its requester."""
        rotation = self._rotation
        if rotation is not None and self._motion.is_rotating and self._clock() >= rotation.end_s:
            self._motion.stop(self._clock(), "the rotation takes longer than a call may")
        if rotation is None or self._motion.is_rotating:
            return
        if rotation.number is not None and self._motion.is_braking and not at_once:
            return
        self._rotation = None
        has_arrived, reason, number = self._motion.has_arrived, self._motion.reason, rotation.number
        if not has_arrived and not rotation.is_cancelled:
            _log.warning("the rotation asked for by %s has failed: %s", rotation.asked.identifier, reason)
        if number is None:
            self._report_end(reason, has_arrived=has_arrived, is_own=is_own)
        elif rotation.asked.kind is CommunicationKind.ACTION:
            outcome = "succeeded" if has_arrived else "cancelled" if rotation.is_cancelled else "aborted"
            result = None if outcome == "cancelled" else service_response(reason)
            self._owe(lambda executor: executor.on_goal_ended(number, outcome, result))
        elif has_arrived:
            self._owe(lambda executor: executor.on_reply(number, service_response("")))
        else:
            self._owe(lambda executor: executor.on_call_failed(number, reason))

    def _report_end(self, reason: str, *, has_arrived: bool, is_own: bool) -> None:
        """A rotation that a message requested has ended."""
        outcomes = ("done", "any") if has_arrived else ("failed", "any")
        listening = [name for name, channel in self._listeners.of(RotatedChannel) if channel.outcome in outcomes]
        for identifier in listening:
            self._owe(lambda executor, name=identifier: executor.receive(name, None))  # type: ignore[misc]
        if not has_arrived and not is_own and not listening:
            self._on_failed(reason)

    def report(self, executor: Supervised) -> None:
        """Send the feedback of the rotation under way, if an action requested it."""
        rotation = self._rotation
        if rotation is not None and rotation.number is not None and rotation.asked.kind is CommunicationKind.ACTION:
            left = self._motion.remaining_rad * (1.0 if rotation.channel.direction == "left" else -1.0)
            left = math.degrees(left) if rotation.channel.unit == "degrees" else left
            feedback = rotation.asked.feedback
            executor.on_feedback(rotation.number, {"remaining": left} if hasattr(feedback, "name") else left)


def service_response(reason: str) -> dict[str, Any]:
    """Return the answer of the bridge's own services and actions: done, or the reason why not."""
    return {"success": not reason, "message": reason}
