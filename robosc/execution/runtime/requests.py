"""Decisions: which request is issued, and how."""

from __future__ import annotations

from typing import Collection, Dict, NamedTuple, Optional, Sequence, Set, Tuple

from robosc.execution.runtime.calls import Calls, Goals
from robosc.execution.runtime.decision import Policy
from robosc.execution.runtime.limits import limited
from robosc.execution.runtime.progress import ProgressAccount
from robosc.execution.runtime.protocol import (
    CommunicationInfo,
    ControlledSystem,
    DataDoesNotFit,
    Middleware,
    requesting,
)
from robosc.execution.runtime.recorder import Recorder
from robosc.execution.runtime.release import Releases
from robosc.execution.runtime.steps import Steps

_MESSAGE = 'incoming message'
_ACTION = 'action'


class Request(NamedTuple):
    """
    A request.

    :ivar name: Its communication.
    :ivar event: Its event.
    :ivar identifier: Identifier that its message goes to.
    :ivar kind: `incoming message`, `service` or `action`.
    :ivar keeps_acting: True if that is a release identifier.
    :ivar has_limits: True if there are limits of it.
    """

    name: str
    event: str
    identifier: str
    kind: str
    keeps_acting: bool
    has_limits: bool = False


def requests_of(
    infos: Sequence[CommunicationInfo], released: Sequence[str]
) -> Tuple[Request, ...]:
    """
    Return the requests of a model, in source order.

    :param infos: Its communications.
    :param released: The release identifiers.
    """
    return tuple(
        Request(
            name=info.name,
            event=info.name + '.request',
            identifier=info.identifier,
            kind=info.kind,
            keeps_acting=info.kind == _MESSAGE and info.identifier in released,
            has_limits=info.has_limits,
        )
        for info in requesting(infos)
    )


def by_identifier(requests: Sequence[Request]) -> Dict[str, Tuple[str, ...]]:
    """Return the communications of each release identifier."""
    found: Dict[str, Tuple[str, ...]] = {}
    for request in requests:
        if request.keeps_acting:
            found[request.identifier] = (*found.get(request.identifier, ()), request.name)
    return found


class Decisions:
    """
    Part of an executor that issues requests, at most one in each decision.

    :param system: The controlled system.
    :param middleware: Middleware that requests go to.
    :param requests: All of them, in source order.
    :param steps: Steps that take their events.
    :param recorder: Recorder of requests that cannot be issued.
    :param releases: Messages that keep acting.
    :param calls: Service calls under way.
    :param goals: Goals under way.
    """

    __slots__ = (
        '_calls',
        '_goals',
        '_middleware',
        '_recorder',
        '_releases',
        '_requests',
        '_steps',
        '_system',
    )

    def __init__(
        self,
        system: ControlledSystem,
        middleware: Middleware,
        requests: Tuple[Request, ...],
        steps: Steps,
        recorder: Recorder,
        releases: Releases,
        calls: Calls,
        goals: Goals,
    ) -> None:
        self._system = system
        self._middleware = middleware
        self._requests = requests
        self._steps = steps
        self._recorder = recorder
        self._releases = releases
        self._calls = calls
        self._goals = goals

    def _issue(self, request: Request, now_s: float) -> bool:
        """Issue a request; return False if its data is unknown or does not fit."""
        name, event, identifier, kind, keeps_acting, has_limits = request
        moved: Tuple[str, ...] = ()
        unchanging = self._steps.unchanging
        known = unchanging.get(name)
        if known is None:
            is_known, data = self._system.provide(name)
            if not is_known:
                return self._withhold(request, 'its data')
            if has_limits:
                found = limited(data, self._system.limits(name))
                if found is None:
                    return self._withhold(request, 'no number is within all limits')
                data, moved = found
        else:
            data, is_default, moved = known
        middleware = self._middleware
        try:
            message = middleware.prepare(name, data)
        except DataDoesNotFit as error:
            return self._withhold(request, 'its data does not fit: {}'.format(error))
        releases = self._releases
        if moved:
            self._recorder.limited(event, moved)
        if known is None:
            is_default = keeps_acting and middleware.is_default(name, message)
            if keeps_acting and releases.waiting:
                releases.supersede(identifier)
        self._steps.take(event, data)
        # A step that changed nothing in this state changes nothing the next time.
        has_changed = known is None and self._steps.settle(name)
        if kind == _MESSAGE:
            if has_changed:
                if keeps_acting:
                    releases.sent(name, identifier, is_default, data if has_limits else None)
            else:
                unchanging[name] = (data, is_default, moved)
                if keeps_acting:
                    releases.sent_unchanged(
                        name, identifier, is_default, data if has_limits else None
                    )
            middleware.publish(name, message)
        elif kind == 'service':
            self._calls.call(middleware, name, message, now_s)
        else:
            self._goals.send(middleware, name, message, now_s)
        return True

    def _withhold(self, request: Request, reason: str) -> bool:
        """Release the message that acts on the identifier of a request that cannot be issued."""
        self._recorder.unknown(request.event, (reason,))
        if request.keeps_acting and self._releases.is_acting(request.identifier):
            self._steps.release(request.identifier)
        return False


class PolicyDecisions(Decisions):
    """Decisions by a policy that chooses among the enabled requests."""

    __slots__ = ('_allowed', '_numbers', '_open', 'policy')

    policy: Policy

    def begin(self, policy: Policy) -> None:
        """Begin with a policy that has no past, before the first decision in the initial state."""
        self.policy = policy
        self._allowed: Set[int] = set()
        self._open: Set[int] = set()
        self._numbers = {request.name: number for number, request in enumerate(self._requests)}

    def decide(self, now_s: float) -> bool:
        """
        Issue one of the enabled requests of this stable state, if there is any.

        :returns: True if a service was called or a goal was sent, so that something new waits for
            time to pass.
        """
        if not self._steps.is_decided:
            self._take_changes()
            self._steps.is_decided = True
        issued = None
        if self._releases.waiting:
            issued = self._issue_one_of(self._ending(), now_s)
        if issued is None:
            issued = self._issue_one_of(None, now_s)
        self.policy.close()
        return issued is not None and issued.kind != _MESSAGE

    def _take_changes(self) -> None:
        """
        Tell the policy which requests have become enabled or disabled.

        An action whose old goal may still be under way is left out.
        """
        allowed, policy = self._allowed, self.policy
        changed: Collection[int] = self._system.changed_requests()
        allowed.symmetric_difference_update(changed)
        if self._goals or self._open:
            are_open = {self._numbers[goal.action] for goal in self._goals.open_goals()}
            changed = {*changed, *(are_open ^ self._open)}
            self._open = are_open
        for number in changed:
            if number in allowed and number not in self._open:
                policy.enable(number)
            else:
                policy.disable(number)

    def _ending(self) -> Tuple[int, ...]:
        """Return the enabled requests whose message would end a release that waits."""
        return tuple(
            sorted(
                self._numbers[name]
                for identifier in self._releases.waiting
                for name in self._releases.alternatives(identifier)
                if self._numbers[name] in self.policy.enabled
            )
        )

    def _issue_one_of(self, among: Optional[Tuple[int, ...]], now_s: float) -> Optional[Request]:
        """Issue and return the policy's choice, or the next if its data is not known or unfit."""
        policy = self.policy
        while True:
            chosen = policy.choose(among)
            if chosen is None:
                return None
            request = self._requests[chosen]
            if self._issue(request, now_s):
                policy.issued(chosen)
                return request
            policy.withhold(chosen)
            if among is not None:
                among = tuple([number for number in among if number != chosen])


class StrategyDecisions(Decisions):
    """
    Decisions by the strategy of the supervisor: the request that it chooses, or none.

    :ivar progress: Account of the strategy's progress, which asks the strategy.
    """

    __slots__ = ('_chosen', 'progress')

    progress: ProgressAccount
    _chosen: Optional[int]

    def decide(self, now_s: float) -> bool:
        """
        Issue the chosen request of this stable state, if it is enabled.

        :returns: True if a service was called or a goal was sent, so that something new waits for
            time to pass.
        """
        if not self._steps.is_decided:
            self._chosen = self._find_chosen()
            self._steps.is_decided = True
        chosen = self._chosen
        if self._releases.waiting:
            if chosen is not None and self._ends_release(chosen):
                if self._issue(self._requests[chosen], now_s):
                    return False
                chosen = None
            # The strategy chooses something else, or nothing: then no message comes that the
            # releases wait for.
            self._release_waiting()
        if chosen is None:
            return False
        request = self._requests[chosen]
        return self._issue(request, now_s) and request.kind != _MESSAGE

    def _find_chosen(self) -> Optional[int]:
        """
        Return the number of the chosen request, if it may be issued.

        An action whose cancelled goal is not known to have ended is waited for. A strategy is
        asked also where it has nothing to choose: it notes the goals that are true.
        """
        chosen = self.progress.decide()
        if chosen is None:
            return None
        request = self._requests[chosen]
        if not self._system.enabled(request.event):
            return None
        if request.kind == _ACTION and self._goals.is_open(request.name):
            return None
        return chosen

    def _ends_release(self, chosen: int) -> bool:
        """Return True if the message of a request would end a release that waits."""
        name = self._requests[chosen].name
        return any(
            name in self._releases.alternatives(identifier)
            for identifier in self._releases.waiting
        )

    def _release_waiting(self) -> None:
        """Release what waits for a message that does not come."""
        for identifier in self._releases.waiting:
            self._steps.release(identifier)
