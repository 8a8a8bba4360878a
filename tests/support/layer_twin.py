"""The obvious twin of the supervision layer: it remembers everything and looks it all up anew.

Of the product it uses the interpreted supervisor and the value of expressions, nothing of the executors.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from robosc.execution.interpreter import InterpretedSystem
from robosc.expressions import Expression
from robosc.expressions.evaluate import evaluate
from robosc.model.structure import Bound, CommunicationKind
from robosc.supervisor import Supervisor

MessageReceived = tuple[Any, ...]
Holds = tuple[bool, ...]


class Fault(Exception):
    """A fault that stops the robot until a restart."""


class Endless(Fault):
    """Silent steps that do not end: the state at which that is noticed does not matter."""


@dataclass
class TwinGoal:
    """A goal that its server has not ended."""

    number: int
    action: str
    caller: Any
    until: float
    history: list[Holds] = field(default_factory=list)
    runs_in_model: bool = True
    is_accepted: bool = False
    asked: float | None = None
    is_cancel_sent: bool = False
    is_old: bool = False
    is_late: bool = False
    turned_first: bool = False
    was_cancelled_by_caller: bool = False
    has_ended_for_caller: bool = False


@dataclass
class TwinCall:
    """A call that was not answered."""

    number: int
    service: str
    caller: Any
    until: float
    is_old: bool = False


@dataclass
class Acting:
    """The last message on a release identifier, not the default one, with all that held in each stable state since."""

    name: str
    message: Any
    history: list[Holds] = field(default_factory=list)


_NONE = object()


def turned(history: list[Holds]) -> bool:
    """Return True if something held in an earlier state and does not in the last."""
    *earlier, last = history
    return any(state[place] and not now for state in earlier for place, now in enumerate(last))


def has_bad_number(message: Any) -> bool:
    """Return True if a message of mappings has a NaN or an infinity."""
    if isinstance(message, dict):
        return any(map(has_bad_number, message.values()))
    return isinstance(message, float) and not math.isfinite(message)


def is_zero(message: Any) -> bool:
    """Return True if a message is the all-default message."""
    return message is None or all(value == 0 for value in message.values())


def _nothing(*names: str) -> str:
    raise KeyError(names)


def is_true(condition: Expression | None, message: Any) -> bool:
    """Return True if a condition over a message is true."""
    if condition is None:
        return True
    return evaluate(condition, _nothing, _nothing, lambda path: (message or {}).get(path[0])) is True


class LayerTwin:
    """Expected behaviour of a layer.

    Attributes:
        reported: All that was reported to either side, in order; the caller's ends of one step come last, sorted.
        events: Every event that happened.
        late: The action of each goal that did not end in time after its cancel, in the order of these reports.
        unexpected: Number of replies that the model did not wait for, and of cancels of what has ended for the
            caller.
    """

    def __init__(self, supervisor: Supervisor, settings: dict[str, Any]) -> None:
        self.model = supervisor.model
        self.system = InterpretedSystem(supervisor)
        self.settings = settings
        self.now = 0.0
        self.reported: list[MessageReceived] = []
        self.events: list[str] = []
        self.unexpected = 0
        self.late: list[str] = []
        self.calls: list[TwinCall] = []
        self.goals: list[TwinGoal] = []
        self.last_call = self.last_goal = 0
        self.acting: dict[str, Acting] = {}
        self.arrived: dict[str, float] = {}
        self.reasons: set[str] = set()
        self.is_endless = False
        self.actions = [item.name for item in self.model.communications if item.kind is CommunicationKind.ACTION]
        self.sensors = {
            item.name: settings["max_age_s"][item.identifier]
            for item in self.model.communications
            if item.kind is CommunicationKind.OUTGOING_MESSAGE and item.identifier in settings["max_age_s"]
        }
        self.seen: dict[str, float] = {}
        self.started = 0.0
        with self.guard():
            self.settle()

    # Behaviour of both deployments.

    @contextmanager
    def guard(self) -> Iterator[None]:
        try:
            yield
        except Fault as fault:
            self.is_endless = self.is_endless or isinstance(fault, Endless)
            self.reasons.add("fault")
            self.rest()

    def take(self, event: str) -> bool:
        if self.system.step(event) is None:
            return False
        self.events.append(event)
        return True

    def settle(self, issuing: str | None = None) -> None:
        states = {self.system.signature()}
        while (event := self.silent()) is not None:
            assert self.take(event)
            if self.system.signature() in states:
                raise Endless
            states.add(self.system.signature())
        for goal in self.goals:
            goal.history.append(self.system.requirements(goal.action))
        for identifier, acting in list(self.acting.items()):
            if acting.name != issuing:
                acting.history.append(self.holds(acting.name, acting.message))
                if turned(acting.history):
                    self.zero(identifier)

    def silent(self) -> str | None:
        for goal in self.sorted_goals():
            if goal.runs_in_model and turned([*goal.history, self.system.requirements(goal.action)]):
                goal.turned_first = goal.turned_first or goal.asked is None
                self.cancel(goal)
        description = self.system.description
        return next((event for event in (*description.resets, *description.taus) if self.system.enabled(event)), None)

    def holds(self, name: str, message: Any) -> Holds:
        is_within = self.limited(name, message) == message
        return (self.system.enabled(f"{name}.request"), *self.system.conjuncts(name), is_within)

    def zero(self, identifier: str) -> None:
        self.acting.pop(identifier, None)
        self.reported.append(("default", identifier))

    def sorted_goals(self) -> list[TwinGoal]:
        return sorted(self.goals, key=lambda item: self.actions.index(item.action))

    def cancelling(self) -> tuple[str, ...]:
        """Return the actions whose goal is being cancelled."""
        return tuple(goal.action for goal in self.sorted_goals() if goal.asked is not None)

    def cancel(self, goal: TwinGoal) -> None:
        goal.asked = self.now if goal.asked is None else goal.asked
        if goal.is_accepted and not goal.is_cancel_sent:
            goal.is_cancel_sent = True
            self.reported.append(("cancel", goal.action, goal.number))

    def rest(self) -> None:
        for identifier in self.settings["release_identifiers"]:
            self.zero(identifier)
        for goal in self.sorted_goals():
            self.cancel(goal)

    @property
    def may_request(self) -> bool:
        are_all_new = not any(call.is_old for call in self.calls) and not any(goal.is_old for goal in self.goals)
        return not self.reasons and self.seen.keys() >= self.sensors.keys() and are_all_new

    # Data from the caller.

    def request(self, identifier: str, message: Any) -> None:
        self.arrived[identifier] = self.now
        for item in self.model.communications:
            is_it = is_zero(message) if item.is_when_default else is_true(item.when, message)
            if item.identifier == identifier and is_it:
                break
        else:
            item = None
        blocked = ("blocked", identifier)
        if item is None or not self.allows(item.name, message):
            self.reported.append(blocked)
            return
        found = self.limited(item.name, message)
        if found is _NONE:
            self.reported.append(blocked)
            return
        is_moved, message = found != message, found
        with self.guard():
            self.take(f"{item.name}.request")
            self.settle(item.name)
            if identifier in self.settings["release_identifiers"]:
                self.acting.pop(identifier, None)
                if is_moved or not is_zero(message):
                    self.acting[identifier] = Acting(item.name, message, [self.holds(item.name, message)])
            self.reported.append(("publish", item.name, message))

    def limited(self, name: str, message: Any) -> Any:
        """The message, each number the nearest that all limits allow; `_NONE` if they allow none."""
        state = self.system.state()
        bounds: dict[str, list[Bound]] = {}
        for limit in self.model.limits_for(name):
            applies = limit.condition is None or evaluate(
                limit.condition, lambda c, v: state[c]["variables"][v], lambda c: str(state[c]["state"])
            )
            for bound in limit.bounds if applies is not False else ():
                bounds.setdefault(bound.path[0], []).append(bound)
        for part, found in bounds.items():
            value = (message or {}).get(part) or 0
            places = [value, *(end for bound in found for end in (bound.low, bound.high))]
            allowed = [place for place in places if all(bound.low <= place <= bound.high for bound in found)]
            if not allowed:
                return _NONE
            nearest = min((abs(place - value), place) for place in allowed)[1]
            if nearest != value:
                message = {**(message or {}), part: nearest}
        return message

    def allows(self, name: str, message: Any) -> bool:
        is_open = any(goal.action == name for goal in self.goals)
        enabled = self.system.enabled(f"{name}.request")
        return self.may_request and not has_bad_number(message) and not is_open and enabled

    def call(self, service: str, caller: Any, message: Any) -> None:
        if not self.allows(service, message):
            self.reported += [("no answer", service, caller), ("blocked", f"/{service}")]
            return
        with self.guard():
            self.take(f"{service}.request")
            self.settle(service)
            self.last_call += 1
            self.calls.append(TwinCall(self.last_call, service, caller, self.now + self.settings["service_timeout_s"]))
            self.reported.append(("call", service, self.last_call, message))

    def goal(self, action: str, caller: Any, message: Any) -> None:
        if not self.allows(action, message):
            self.reported += [("reject", action, caller), ("blocked", f"/{action}")]
            return
        with self.guard():
            self.take(f"{action}.request")
            self.settle(action)
            self.last_goal += 1
            goal = TwinGoal(self.last_goal, action, caller, self.now + self.settings["action_timeout_s"])
            goal.history.append(self.system.requirements(action))
            self.goals.append(goal)
            self.reported += [("goal", action, goal.number, message), ("accept", action, caller)]

    def cancelled_by_caller(self, goal: TwinGoal) -> None:
        if goal.has_ended_for_caller:
            self.unexpected += 1
            return
        if goal.was_cancelled_by_caller:
            return
        goal.was_cancelled_by_caller = True
        self.cancel(goal)
        self.finish()

    # Data from the robot.

    def receive(self, identifier: str, data: Any) -> None:
        is_fault = False
        with self.guard():
            for item in self.model.communications:
                if item.identifier != identifier:
                    continue
                reading = self.system.read(f"{item.name}.response", data)
                if reading.enum_unknown and self.settings["on_unknown"] == "keep":
                    continue
                is_fault = is_fault or (reading.enum_unknown and self.settings["on_unknown"] == "fault")
                assert self.system.step(f"{item.name}.response", reading) is not None
                self.events.append(f"{item.name}.response")
                if item.name in self.sensors:
                    self.seen[item.name] = self.now
                    self.reasons.discard(item.name)
            self.settle()
            if is_fault:
                raise Fault
        self.finish()
        self.reported.append(("pass", identifier, data))

    def reply(self, call: TwinCall, data: Any) -> None:
        self.calls.remove(call)
        if call.is_old:
            self.unexpected += data is not None
            return
        with self.guard():
            assert self.take(f"{call.service}.{'error' if data is None else 'response'}")
            self.settle()
        kind = ("no answer", call.service, call.caller) if data is None else ("answer", call.service, call.caller, data)
        self.reported.append(kind)
        self.finish()

    def accept(self, goal: TwinGoal) -> None:
        goal.is_accepted = True
        if goal.asked is not None:
            self.cancel(goal)

    def feedback(self, goal: TwinGoal, data: Any) -> None:
        if goal.runs_in_model:
            with self.guard():
                assert self.take(f"{goal.action}.feedback")
                self.settle()
        else:
            self.unexpected += 1
        # Also if this very feedback turns the goal against its requirements.
        if not goal.has_ended_for_caller:
            self.reported.append(("feedback", goal.action, goal.caller, data))
        self.finish()

    def end(self, goal: TwinGoal, outcome: str, data: Any) -> None:
        self.goals.remove(goal)
        if goal.runs_in_model:
            is_ours = goal.turned_first or goal.was_cancelled_by_caller
            kind = "cancel" if outcome == "cancelled" and is_ours else "error"
            with self.guard():
                assert self.take(f"{goal.action}.{'response' if outcome == 'succeeded' else kind}")
                self.settle()
        elif outcome == "succeeded":
            self.unexpected += 1
        if not goal.has_ended_for_caller:
            as_it_is = outcome in ("succeeded", "cancelled") if goal.was_cancelled_by_caller else outcome == "succeeded"
            reported = outcome if as_it_is else "aborted"
            self.reported.append(("end", goal.action, goal.caller, reported, data))
        self.finish()

    # Time and rest.

    def wait(self, seconds: float) -> None:
        self.now += seconds
        with self.guard():
            self.over()
        self.finish()

    def over(self) -> None:
        timeout = self.settings["command_timeout_s"]
        for identifier in list(self.acting):
            if timeout and self.now - self.arrived[identifier] >= timeout:
                self.zero(identifier)
        for call in [item for item in self.calls if self.now >= item.until]:
            self.calls.remove(call)
            if call.is_old:
                continue
            assert self.take(f"{call.service}.error")
            self.reported.append(("no answer", call.service, call.caller))
            self.settle()
        for goal in self.sorted_goals():
            # The one that cancels a goal waits for its end.
            if goal.runs_in_model and goal.asked is None and self.now >= goal.until:
                goal.runs_in_model = False
                assert self.take(f"{goal.action}.error")
                self.settle()
                self.cancel(goal)
        for goal in self.sorted_goals():
            if (
                goal.asked is not None
                and not goal.is_late
                and self.now >= goal.asked + self.settings["cancel_timeout_s"]
            ):
                goal.is_late = True
                self.late.append(goal.action)
        for name, age in self.sensors.items():
            if self.now - self.seen.get(name, self.started) >= age and name not in self.reasons:
                self.reasons.add(name)
                self.rest()

    def stop(self, is_fault: bool) -> None:
        self.reasons.add("fault" if is_fault else "stop")
        self.rest()

    def restart(self) -> None:
        if not self.reasons:
            self.rest()
        self.reasons.clear()
        self.seen.clear()
        self.started = self.now
        self.reported += [("no answer", call.service, call.caller) for call in self.calls if not call.is_old]
        for call in self.calls:
            call.is_old = True
        for goal in self.goals:
            goal.runs_in_model = False
            goal.is_old = True
        self.system.restart()
        with self.guard():
            self.settle()
        self.finish()

    def finish(self) -> None:
        """Goals that only the supervisor, time or a restart ended are aborted for their callers."""
        for goal in self.goals:
            if not (goal.runs_in_model or goal.was_cancelled_by_caller or goal.has_ended_for_caller):
                goal.has_ended_for_caller = True
                self.reported.append(("end", goal.action, goal.caller, "aborted", None))
