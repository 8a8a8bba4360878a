"""Messages that keep acting after they were sent, and their release."""

from __future__ import annotations

from typing import Any, Dict, List, Optional, Sequence, Tuple

from robosc.execution.runtime.falling_conditions import have_fallen
from robosc.execution.runtime.limits import is_within
from robosc.execution.runtime.protocol import ControlledSystem


class _Acting:
    """
    The last message of an identifier, not the all-default one.

    :ivar request: Name of the communication whose request sent it.
    :ivar event: Event of that request.
    :ivar was_enabled: True if the request was enabled in the last stable state since.
    :ivar held: Values for the conjuncts of its requirements: True if one held in that state; then
        whether the message was within the limits that applied there.
    :ivar data: Its data, or the message itself, if there are limits; else None.
    :ivar is_due: True if the message is to be released, because a condition that held holds no
        longer. It stays due until something is sent there, so it is enough to remember the last
        stable state.
    """

    __slots__ = ('data', 'event', 'held', 'is_due', 'request', 'was_enabled')

    def __init__(self, request: str, was_enabled: bool, held: Tuple[bool, ...], data: Any) -> None:
        self.request = request
        self.event = request + '.request'
        self.was_enabled = was_enabled
        self.held = held
        self.data = data
        self.is_due = False


class Releases:
    """
    Tracker of the last message of each release identifier.

    :param system: System that shows what is enabled and what holds.
    :param identifiers: The release identifiers.
    :param requests: Communications of each of them, in source order.
    :param may_wait: True if a due release waits while another request there is enabled: only in a
        controller.
    """

    __slots__ = ('_acting', '_events', '_may_wait', '_system', 'identifiers', 'waiting')

    def __init__(
        self,
        system: ControlledSystem,
        identifiers: Sequence[str],
        requests: Dict[str, Tuple[str, ...]],
        may_wait: bool,
    ) -> None:
        self._system = system
        self._may_wait = may_wait
        self.identifiers = tuple(identifiers)
        self._events = {
            identifier: tuple((name, name + '.request') for name in requests[identifier])
            for identifier in identifiers
        }
        self._acting: Dict[str, _Acting] = {}
        self.waiting: Tuple[str, ...] = ()

    def due(self, issuing: Optional[str] = None) -> List[str]:
        """
        Return the identifiers to release now, in this stable state.

        The caller releases them and reports it to `released`.

        :param issuing: Communication whose request led to this state and whose message is about to
            go out: a condition that this request makes false does not release its own earlier
            message.
        """
        if not self._acting:
            return []
        now: List[str] = []
        waiting: List[str] = []
        for identifier, acting in self._acting.items():
            if acting.request == issuing:
                continue
            self._observe(acting)
            if acting.is_due:
                must_wait = self._may_wait and self._another_is_enabled(identifier, acting)
                (waiting if must_wait else now).append(identifier)
        self.waiting = tuple(waiting)
        return now

    def _observe(self, acting: _Acting) -> None:
        """Observe one message in a stable state."""
        is_enabled = self._system.enabled(acting.event)
        holds = self._holds(acting.request, acting.data)
        if (acting.was_enabled and not is_enabled) or have_fallen(acting.held, holds):
            acting.is_due = True
        acting.was_enabled = is_enabled
        acting.held = holds

    def _holds(self, request: str, data: Any) -> Tuple[bool, ...]:
        """Return what allows a message to go on acting, apart from its request."""
        holds = self._system.conjuncts(request)
        if data is None:
            return holds
        return (*holds, is_within(data, self._system.limits(request)))

    def _another_is_enabled(self, identifier: str, acting: _Acting) -> bool:
        enabled = self._system.enabled
        return any(
            name != acting.request and enabled(event) for name, event in self._events[identifier]
        )

    def alternatives(self, identifier: str) -> Tuple[str, ...]:
        """Communications of an identifier whose message would end a waiting release."""
        sender = self._acting[identifier].request
        return tuple(name for name, _ in self._events[identifier] if name != sender)

    def supersede(self, identifier: str) -> None:
        """Note that a request was decided whose message ends a release that waits here."""
        if identifier in self.waiting:
            self.released(identifier)

    def sent(self, request: str, identifier: str, is_default: bool, data: Any = None) -> None:
        """
        Note that a message went out on a release identifier.

        The system is in the stable state after its request.

        :param data: Its data, or the message itself, if there are limits of the request.
        """
        self.released(identifier)
        if not is_default:
            is_enabled = self._system.enabled(request + '.request')
            self._acting[identifier] = _Acting(
                request, is_enabled, self._holds(request, data), data
            )

    def sent_unchanged(
        self, request: str, identifier: str, is_default: bool, data: Any = None
    ) -> None:
        """
        Note a sent message whose request changed nothing.

        Everything that was enabled still is.
        """
        acting = self._acting.get(identifier)
        if is_default or acting is None or acting.request != request:
            self.sent(request, identifier, is_default, data)
        elif data is not acting.data:
            # In an earlier state other limits, or other conditions of its data, applied.
            acting.data = data
            acting.held = self._holds(request, data)

    def is_acting(self, identifier: str) -> bool:
        """Return True if the last message sent on a release identifier still acts."""
        return identifier in self._acting

    def acting(self) -> Tuple[str, ...]:
        """Return the release identifiers whose last message still acts."""
        return tuple(self._acting)

    def released(self, identifier: str) -> None:
        """Note that the default message went out on an identifier, or another one will."""
        self._acting.pop(identifier, None)
        if identifier in self.waiting:
            self.waiting = tuple(item for item in self.waiting if item != identifier)

    def clear(self) -> None:
        """Note that the default message went out everywhere."""
        self._acting.clear()
        self.waiting = ()
