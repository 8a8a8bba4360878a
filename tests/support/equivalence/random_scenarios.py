"""Random runs: what is likely to bring a controller on, with data that is often at a border."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from random import Random
from typing import Any

from robosc.expressions import (
    ArrayType,
    BooleanType,
    DoubleType,
    EnumType,
    IntegerType,
    NoneType,
    ObjectType,
    StringType,
    Type,
)
from robosc.model.structure import CommunicationKind, Deployment, Model
from robosc.supervisor import Supervisor
from robosc.targets.cpp.recording import texts_of
from support.equivalence.observation import Issued, Observation
from support.equivalence.python_targets import PythonTarget, reference
from support.equivalence.scenario import Action, Scenario

# Numbers that a float of 32 bits holds, too, but for the hostile ones.
_DOUBLES = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 6.0, -0.25, -1.0, -2.0)
# Numbers that any integer field holds, but for the hostile ones.
_INTEGERS = (0, 1, 2, 3, 4, 5, 6, 7, 100)
_TEXTS = ("", "a", "it's", '"""\n\\', "é")
_NAN = math.nan
_ASKS = {CommunicationKind.SERVICE: "ask_call", CommunicationKind.ACTION: "ask_goal"}
_OUTCOMES = ("succeeded", "succeeded", "rejected", "aborted", "cancelled", "lost")
_ENDS_OF_CANCELLED = ("cancelled", "cancelled", "cancelled", "succeeded", "aborted", "rejected", "lost")


class Dice:
    """Random source of data and actions.

    Args:
        model: Model to draw for.
        dice: Source of chance.
        is_hostile: True if data may be missing, not a number, or too large.
    """

    def __init__(self, model: Model, dice: Random, *, is_hostile: bool) -> None:
        self._model = model
        self._dice = dice
        self._is_hostile = is_hostile
        self._topics: dict[str, list[Type]] = {}
        self._asked: dict[str, list[Type]] = {}
        self._texts = (*_TEXTS, *texts_of(model))
        for item in model.communications:
            if item.kind is CommunicationKind.OUTGOING_MESSAGE and item.response is not None:
                self._topics.setdefault(item.identifier, []).append(item.response)
            if item.kind is CommunicationKind.INCOMING_MESSAGE and item.request is not None:
                self._asked.setdefault(item.identifier, []).append(item.request)

    def message(self) -> Action | None:
        """A message on some topic: what all messages of the model read of it."""
        if not self._topics:
            return None
        topic = self._dice.choice(sorted(self._topics))
        return Action("message", topic, self.datum(*self._topics[topic]))

    def asked(self) -> Action | None:
        """Draw a request that an existing controller may send to a layer: a message, a call, a goal."""
        servers = [item for item in self._model.communications if item.kind in _ASKS]
        kinds = {identifier: ("ask", types) for identifier, types in self._asked.items()}
        kinds |= {item.name: (_ASKS[item.kind], [item.request or NoneType()]) for item in servers}
        if not kinds:
            return None
        subject = self._dice.choice(sorted(kinds))
        kind, types = kinds[subject]
        return Action(kind, subject, self.datum(*types, is_complete=True))

    def received(self, name: str, part: str) -> Any:
        """Data of a reply, feedback or result."""
        return self.datum(getattr(self._model.communication(name), part))

    def datum(self, *types: Type, is_complete: bool = False) -> Any:
        """Draw a value that may come as something of all these types.

        Args:
            types: The types.
            is_complete: True if nothing is missing that cannot be said in C, where no event would be refused for it.
        """
        dice = self._dice
        sources = [self._source(type_) for type_ in types]
        # A missing number is NaN in C.
        is_missing = self._is_hostile and not isinstance(sources[0], DoubleType) and dice.random() < 0.05
        if is_missing and (not is_complete or all(map(_may_be_unknown, sources))):
            return None
        match sources[0]:
            case BooleanType():
                return dice.choice((True, False))
            case IntegerType():
                return dice.choice((*_INTEGERS, -1, -2, 2**31, -(2**40)) if self._is_hostile else _INTEGERS)
            case DoubleType():
                return dice.choice((*_DOUBLES, math.nan, math.inf, 1e308) if self._is_hostile else _DOUBLES)
            case StringType():
                return dice.choice(self._texts)
            case ArrayType(element=element):
                if isinstance(self._source(element), DoubleType) and dice.random() < 0.6:
                    return self._scan(element)
                if self._is_hostile and isinstance(element, BooleanType):
                    return [dice.choice((True, False, None)) for _ in range(dice.randint(0, 4))]
                return [self.datum(element, is_complete=True) for _ in range(dice.randint(0, 4))]
            case ObjectType():
                found: dict[str, list[Type]] = {}
                for source in sources:
                    if isinstance(source, ObjectType):
                        for part in self._model.object(source.name).properties:
                            found.setdefault(part.name, []).append(part.type)
                return {name: self.datum(*parts, is_complete=is_complete) for name, parts in found.items()}
            case NoneType():
                return None
        raise AssertionError(types)

    def _scan(self, element: Type) -> list[Any]:
        """Much of the same, as a scan has it, and something in the way."""
        beams = [self.datum(element)] * 360
        for _ in range(self._dice.choice((0, 0, 1, 2))):
            begin = self._dice.choice((0, 15, 20, 225, 270, 330, 345))
            beams[begin : begin + 10] = [self.datum(element)] * len(beams[begin : begin + 10])
        return beams

    def _source(self, type_: Type) -> Type:
        return self._model.enum(type_.name).source if isinstance(type_, EnumType) else type_


def _may_be_unknown(type_: Type) -> bool:
    """Return True if a value of a type may be unknown wherever it stands."""
    return isinstance(type_, StringType | ArrayType) or (isinstance(type_, IntegerType) and not type_.is_bounded)


def random_settings(supervisor: Supervisor, dice: Random) -> dict[str, Any]:
    """Settings under which targets must agree: all but the policy `random`, which C draws from another generator."""
    model = supervisor.model
    requests = [item.name for item in model.communications if item.kind is not CommunicationKind.OUTGOING_MESSAGE]
    # Source order: C takes no order of them.
    sent = [item for item in model.communications if item.kind is CommunicationKind.INCOMING_MESSAGE]
    topics = list(dict.fromkeys(item.identifier for item in sent))
    policy = dice.choice(("fair", "fair", "priority"))
    if supervisor.strategy is not None:
        policy = "strategy"
    decisions: dict[str, Any] = {
        "policy": policy,
        "priority": tuple(dice.sample(requests, dice.randint(0, len(requests)))) if policy == "priority" else (),
        "every": dice.choice(("period", "event")),
    }
    if supervisor.deployment is Deployment.LAYER:
        decisions = {"command_timeout_s": dice.choice((0.0, 0.5, 2.0))}
    if supervisor.strategy is not None:
        decisions["assumption_timeout_s"] = dice.choice((0.0, 0.25, 1.0))
    return {
        **decisions,
        "on_unknown": dice.choice(("default", "default", "keep", "fault")),
        "release_identifiers": tuple(topic for topic in topics if dice.random() < 0.7),
        "service_timeout_s": dice.choice((0.25, 1.5, 10.0)),
        "action_timeout_s": dice.choice((None, None, 0.5, 2.0)),
        "cancel_timeout_s": dice.choice((0.0, 0.25, 1.0)),
    }


def random_scenario(supervisor: Supervisor, seed: int, length: int, *, is_hostile: bool = True) -> Scenario:
    """A run that follows what the reference asks for: replies come to calls that were made."""
    dice = Random(seed)
    scenario = Scenario((), random_settings(supervisor, dice))
    target = reference(supervisor)
    target.start(scenario)
    drawn = Dice(supervisor.model, dice, is_hostile=is_hostile)
    actions: list[Action] = []
    following = _next_of_layer if supervisor.deployment is Deployment.LAYER else _next
    for _ in range(length):
        action = following(supervisor.model, target, dice, drawn)
        actions.append(action)
        target.do(action)
    return Scenario(tuple(actions), scenario.settings)


def _next(model: Model, target: PythonTarget, dice: Random, drawn: Dice) -> Action:
    chance = dice.random()
    if chance < 0.02:
        return Action("wait", seconds=dice.choice((0.25, 1.0, 2.5, 12.0)))
    if chance < 0.03:
        return Action("restart") if dice.random() < 0.7 else Action("stop")
    if chance < 0.4:
        return Action("tick")
    if chance < 0.65 and (replies := _replies(model, target, dice, drawn, _OUTCOMES)):
        return dice.choice(replies)
    return drawn.message() or Action("tick")


def _next_of_layer(model: Model, target: PythonTarget, dice: Random, drawn: Dice) -> Action:
    if target.is_faulty and dice.random() < 0.4:
        return Action("restart")
    if dice.random() < 0.55:
        return _next(model, target, dice, drawn)
    if dice.random() < 0.15 and (cancels := cancels_of(model, target)):
        return dice.choice(cancels)
    return drawn.asked() or Action("tick")


def cancels_of(model: Model, target: PythonTarget) -> list[Action]:
    """The cancels of goals that an existing controller has sent."""
    actions = [item.name for item in model.communications if item.kind is CommunicationKind.ACTION]
    return [Action("ask_cancel", name) for name in actions if target.callers.count(name)]


def _replies(model: Model, target: PythonTarget, dice: Random, drawn: Dice, outcomes: Sequence[str]) -> list[Action]:
    """Return the actions that servers may take now."""
    found = []
    for item in model.communications:
        if not target.ids.count(item.name):
            continue
        if item.kind is CommunicationKind.SERVICE:
            found.append(Action("reply", item.name, drawn.received(item.name, "response")))
            found.append(Action("fail", item.name))
        else:
            is_cancelling = item.name in target.executor.cancelling
            if is_cancelling and outcomes is _OUTCOMES:
                found.append(Action("refuse", item.name, how=dice.choice(("ended", "ended", "running"))))
            possible = _ENDS_OF_CANCELLED if outcomes is _OUTCOMES else (*outcomes, "cancelled", "cancelled")
            how = dice.choice(possible if is_cancelling else outcomes)
            result = drawn.received(item.name, "response") if how == "succeeded" else None
            found.append(Action("end", item.name, result, how=how))
            found.append(Action("feedback", item.name, drawn.received(item.name, "feedback")))
            found.append(Action("accept", item.name))
    return found


def node_settings(model: Model, policy: str | None = "fair") -> dict[str, Any]:
    """Settings under which a node decides whenever something comes, and never else; None: under its own policy."""
    settings = {"every": "event", "policy": policy, **_timeless(model)}
    return {**settings, "assumption_timeout_s": 0.0} if model.assumptions else settings


def _timeless(model: Model) -> dict[str, Any]:
    """Settings under which a node does nothing because time passes: none passes for the reference."""
    sensors = {item.identifier for item in model.communications if item.max_age is not None}
    return {
        "period_s": 3600.0,
        "service_timeout_s": 3600.0,
        "cancel_timeout_s": 0.0,
        # They must have been seen, but the test may take its time.
        "max_age_s": dict.fromkeys(sorted(sensors), 3600.0),
    }


def node_scenario(supervisor: Supervisor, seed: int, length: int, *, ends_on_cancel: bool = True) -> Scenario:
    """A run for a node with real servers: each decision comes with something that comes.

    The period is as long as can be, so that no timer decides at its own will; servers accept every goal, and a goal
    that the controller cancels ends: at once, or else later and in any way.
    """
    dice = Random(seed)
    settings = node_settings(supervisor.model, dice.choice(("fair", "priority")))
    scenario = Scenario((), settings)
    target = reference(supervisor)
    target.start(scenario)
    drawn = Dice(supervisor.model, dice, is_hostile=False)
    actions: list[Action] = []
    while len(actions) < length:
        chance = dice.random()
        replies = _replies(supervisor.model, target, dice, drawn, ("succeeded", "aborted"))
        replies = [item for item in replies if item.do not in ("accept", "fail")]
        action = dice.choice(replies) if replies and chance < 0.4 else drawn.message()
        if action is None:
            break
        actions.append(action)
        seen = target.do(action)
        actions += follow(seen, target, ends_on_cancel=ends_on_cancel)
    return Scenario(tuple(actions), settings)


def ticking_scenario(supervisor: Supervisor, seed: int, length: int) -> Scenario:
    """A run for a node on simulated time: it begins with a period, and sensors may become stale."""
    dice = Random(seed)
    sensors = {i.identifier for i in supervisor.model.communications if i.kind is CommunicationKind.OUTGOING_MESSAGE}
    settings = {
        "every": dice.choice(("event", "period")),
        "max_age_s": dict.fromkeys(sorted(sensors), 0.75),
        "service_timeout_s": 3600.0,
    }
    scenario = Scenario((), settings)
    target = reference(supervisor)
    target.start(scenario)
    drawn = Dice(supervisor.model, dice, is_hostile=False)
    actions = [Action("tick")]
    actions += follow(target.do(actions[0]), target)
    while len(actions) < length:
        replies = _replies(supervisor.model, target, dice, drawn, ("succeeded", "aborted"))
        replies = [item for item in replies if item.do not in ("accept", "fail")]
        chance = dice.random()
        action = dice.choice(replies) if replies and chance < 0.25 else None
        if action is None and chance < 0.6:
            action = drawn.message()
        actions.append(action or Action("tick"))
        actions += follow(target.do(actions[-1]), target)
    return Scenario(tuple(actions), settings)


LAYER_KINDS = frozenset(
    {
        "publish",
        "call",
        "goal",
        "cancel",
        "pass",
        "blocked",
        "answer",
        "no answer",
        "accept",
        "reject",
        "feedback",
        "ended",
    }
)
"""Kinds of requests and reports of a layer, all of which a random run should show."""


def layer_node_scenario(supervisor: Supervisor, seed: int, length: int) -> Scenario:
    """A run for a layer with real servers: they accept every goal, and end one that is cancelled as cancelled."""
    dice = Random(seed)
    model = supervisor.model
    settings = layer_node_settings(model)
    target = reference(supervisor)
    target.start(Scenario((), settings))
    drawn = Dice(model, dice, is_hostile=False)
    actions: list[Action] = []
    running: set[int] = set()
    while len(actions) < length:
        chance = dice.random()
        replies = _replies(model, target, dice, drawn, ("succeeded", "aborted"))
        replies = [item for item in replies if item.do not in ("accept", "fail")]
        # A caller's cancel of a goal that was rejected or has ended does not reach the layer.
        cancels = [item for item in cancels_of(model, target) if target.callers.last(item.subject) in running]
        if replies and chance < 0.25:
            action: Action | None = dice.choice(replies)
        elif cancels and chance < 0.35:
            action = dice.choice(cancels)
        else:
            action = drawn.message() if chance < 0.6 else drawn.asked()
            if action is not None and action.do == "ask":
                kind = dice.random()
                if kind < 0.2:
                    action = replace(action, data=_with_numbers(action.data, _NAN if kind < 0.1 else 0.0))
        if action is None:
            break
        actions.append(action)
        seen = target.do(action)
        issued = list(seen.issued)
        actions += follow(seen, target, issued)
        running |= {data["caller"] for kind, _, data in issued if kind == "accept"}
        running -= {data["caller"] for kind, _, data in issued if kind == "ended"}
    return Scenario(tuple(actions), settings)


def layer_node_settings(model: Model) -> dict[str, Any]:
    """Settings under which a layer does nothing because time passes."""
    return {"command_timeout_s": 0.0, **_timeless(model)}


def _with_numbers(data: Any, number: float) -> Any:
    """The same with another number in the place of each that is no integer."""
    if isinstance(data, dict):
        return {name: _with_numbers(part, number) for name, part in data.items()}
    return number if isinstance(data, float) else data


def for_layer_node(supervisor: Supervisor, scenario: Scenario) -> Scenario:
    """Return both sides' messages of a recorded run, for a layer that does nothing merely because time passes."""
    actions = tuple(action for action in scenario.actions if action.do in ("message", "ask"))
    return Scenario(actions, layer_node_settings(supervisor.model))


def for_node(supervisor: Supervisor, scenario: Scenario) -> Scenario:
    """A recorded run for a node that decides whenever something comes.

    Services answer at once as they did last; goals are accepted at once, and cancelled ones end at once; feedback and
    other ends come when they came, if there is a goal then.
    """
    settings = node_settings(supervisor.model)
    answers = {action.subject: action.data for action in scenario.actions if action.do == "reply"}
    target = reference(supervisor)
    target.start(Scenario((), settings))
    actions: list[Action] = []
    for action in scenario.actions:
        if action.do == "end" and action.how == "rejected":
            action = replace(action, how="aborted")
        is_of_goal = action.do == "feedback" or (action.do == "end" and action.how != "cancelled")
        if action.do == "message" or (is_of_goal and target.ids.count(action.subject)):
            actions.append(action)
            actions += follow(target.do(action), target, answers=answers)
    return Scenario(tuple(actions), settings)


ODD_MESSAGES = tuple(
    Action("message", topic, data)
    for topic, data in (
        ("/scan", {"ranges": [2.0] * 360}),
        ("/line/correction", _NAN),
        ("/line/correction", 0.5),
        ("/scan", {"ranges": [_NAN] * 360}),
        ("/line/correction", math.inf),
        ("/emergency_stop/stop", None),
        ("/emergency_stop/stop", None),
        ("/line/correction", _NAN),
        ("/emergency_stop/resume", None),
        ("/scan", {"ranges": []}),
        ("/line/lost", None),
        ("/scan", {"ranges": [-1.0] * 20}),
        ("/scan", {"ranges": [2.0] * 360}),
        ("/line/correction", 0.125),
    )
)
"""Messages that may come to the line follower, too: with numbers that are NaN, and with too few numbers."""


def follow(
    seen: Observation,
    target: PythonTarget,
    issued: list[Issued] | None = None,
    answers: Mapping[str, Any] | None = None,
    *,
    ends_on_cancel: bool = True,
) -> list[Action]:
    """Let servers act at once: accept goals, end cancelled ones, and answer calls of services that have an answer.

    `issued` gets what is issued meanwhile.
    """
    found = []
    waiting = list(seen.issued)
    while waiting:
        kind, name, _ = waiting.pop(0)
        action = {
            "goal": Action("accept", name),
            "cancel": Action("end", name, how="cancelled") if ends_on_cancel else None,
            "call": Action("reply", name, answers[name]) if answers and name in answers else None,
        }.get(kind)
        if action is not None:
            found.append(action)
            then = target.do(action).issued
            waiting += then
            if issued is not None:
                issued += then
    return found
