"""Explanations on models made for them, and on random models against enumerated states."""

import re
from collections import Counter, deque
from typing import Any

import msgspec
import pytest

from robosc.automata import Semantics, System, to_automata
from robosc.automata.compile import NO_DATA, State, compile_expression
from robosc.automata.state import Subject, subjects
from robosc.errors import UnsupportedModelError
from robosc.explanation import Explanation, ModelWords, RequestError, explain_synthesis, explanation_text
from robosc.explanation.constraints import ConstraintKind, relaxable_constraints, without_ranges
from robosc.explanation.explanations import document
from robosc.explanation.parts import EventReport
from robosc.model.places import Places
from robosc.model.structure import Deployment, Model, is_tau
from robosc.source import Location
from robosc.synthesis import runs, ways
from robosc.verification import ExplicitSupervisor, synthesize_explicit
from support.effort import seeds
from support.engines import needs_cudd
from support.models import DOOR, checked, marked_place
from support.random_supervisors import random_supervisor

LIMIT = 2_000
EXAMPLES = 40

LIFT = """component Lift {
    outgoing message up with type: none
    incoming message arm with type: none
    incoming message bottom with type: none
    behaviour {
        variable n: integer(0..2)
        initial marked state off { on request to arm goto armed }
        marked state armed { on response from up do n := n + 1 goto off }
    }
}
requirement bottom needs Lift.n = 0"""
"""Armed, it may count beyond its range; nothing sets it back."""

pytestmark = needs_cudd


def robot(*parts: str) -> str:
    return "\n".join(["robot R {", "interface i use S from p", *parts, "}"])


def explained(text: str, **asked: Any) -> Explanation:
    """Return the explanation of a model, the same by both engines."""
    found = checked(text)
    assert found.model is not None, [str(item) for item in found.diagnostics]
    assert found.places is not None
    system = to_automata(found.model, Deployment.CONTROLLER)
    results = [
        explain_synthesis(ModelWords(found.model, found.places, system, Deployment.CONTROLLER), engine=engine, **asked)
        for engine in ("cudd", "oxidd", "autoref")
    ]
    assert results == results[:1] * len(results)
    assert explanation_text(results[0])
    return results[0]


def event(text: str, name: str) -> EventReport:
    (report,) = explained(text, event=name).events
    return report


def place(location: Location | None) -> tuple[int, int]:
    assert location is not None
    return location.line, location.column


# No supervisor


def test_trouble_and_blame_agree() -> None:
    """Two things are broken, each of them enough; the one that is not blamed would be broken sooner."""
    text = """component C { outgoing message slip with type: none
        behaviour { initial marked state a { on response from slip goto b }
        marked state b { on response from slip goto c } marked state c { } } }"""
    rules = ("requirement never C.c", "requirement never C.b")
    blamed = set()
    for first, second in (rules, rules[::-1]):
        explanation = explained(robot(text, first, second)).empty
        assert explanation is not None
        (part,) = (item.part for item in explanation.blamed)
        assert list(explanation.trouble.way.events) == ["slip.response"] * (2 if part.text == rules[0] else 1)
        assert [item.text for item in explanation.trouble.parts] == [part.text]
        blamed.add(part.text)
    assert rules[0] in blamed


def test_requirements_that_are_to_blame_together() -> None:
    """Each by itself could be kept; a third one has nothing to do with it."""
    door = DOOR.replace("initial marked", "initial")
    lamp = DOOR.replace("Door", "Lamp").replace("open", "light").replace("shut", "douse")
    needed = ["requirement open needs Lamp.lighted", "requirement light needs Door.opened"]
    other = "requirement douse needs Door.closed"
    lamp = lamp.replace("lighted", "lit").replace("lightned", "lit")
    needed = [text.replace("lighted", "lit") for text in needed]
    explanation = explained(robot(door, lamp, other, *needed)).empty
    assert explanation is not None
    marking = "that Door gets to a marked state (opened)"
    assert [item.part.text for item in explanation.blamed] == [*needed, marking]
    assert [item.suffices for item in explanation.blamed] == [True, True, True]
    assert explanation.is_minimal
    assert [item.text for item in explanation.removal] == needed[:1]
    assert (explanation.trouble.kind, explanation.trouble.way.events) == ("blocking", ())
    for kept in needed:
        assert explained(robot(door, lamp, other, kept)).empty is None


def test_a_range_that_is_to_blame() -> None:
    text = (
        LIFT.replace("n + 1 goto off", "n + 1")
        .replace("initial ", "")
        .replace("marked state armed", "initial state armed")
    )
    text = text.replace("do n := n + 1", "do n := n + 1 on request to arm goto off").replace(
        "variable n", "variable §n"
    )
    plain, line, column = marked_place(robot(text))
    explanation = explained(plain).empty
    assert explanation is not None
    kinds = {item.part.kind for item in explanation.blamed}
    assert "range" in kinds
    assert place(next(item.part.location for item in explanation.blamed if item.part.kind == "range")) == (line, column)
    assert explanation.trouble.way.events == ("up.response", "up.response")
    assert explanation.trouble.messages == ("up.response can take Lift.n, which is 2, out of its range",)
    assert explanation.trouble.way.state.variables == {"Lift.n": 2}


def test_a_state_that_blocks() -> None:
    text = robot(DOOR.replace("initial marked", "initial"), "§requirement open needs Door.opened")
    plain, line, column = marked_place(text)
    explanation = explained(plain).empty
    assert explanation is not None
    trouble = explanation.trouble
    assert (trouble.kind, trouble.way.events, trouble.stopped is not None) == ("blocking", (), True)
    assert trouble.stopped is not None
    assert (trouble.stopped.events, trouble.stopped.stopped_at) == (("open.request",), 0)
    (reason,) = trouble.stopped.reasons
    assert reason.kind == "requirement"
    assert reason.part is not None
    assert place(reason.part.location) == (line, column)
    assert [item.part.kind for item in explanation.blamed] == ["requirement", "marking"]
    assert [item.part.text for item in explanation.blamed] == [
        "requirement open needs Door.opened",
        "that Door gets to a marked state (opened)",
    ]


def test_a_way_that_the_environment_leads_into_trouble() -> None:
    """The only way to the marked state goes through one that must never be; but that alone is to blame."""
    text = """component C { outgoing message slip with type: none incoming message go with type: none
        behaviour { initial state a { on response from slip goto b } state b { on request to go goto c }
        marked state c { } } }"""
    explanation = explained(robot(text, "requirement never C.b")).empty
    assert explanation is not None
    trouble = explanation.trouble
    assert (trouble.kind, trouble.way.events, trouble.is_forced) == ("bad", ("slip.response",), True)
    assert ([item.text for item in trouble.parts], trouble.stopped) == (["requirement never C.b"], None)
    assert [item.part.text for item in explanation.blamed] == ["requirement never C.b"]


def test_a_condition_on_cancel_that_is_to_blame() -> None:
    motor = """component Motor {
        action drive with request: none, response: none, feedback: none links i
        behaviour {
            initial state still { on request to drive goto driving }
            state driving {
                on cancel to drive goto done
                on response from drive goto still
                on error from drive goto still
            }
            marked state done { }
        }
    }"""
    explanation = explained(robot(motor, "requirement drive needs !Motor.done")).empty
    assert explanation is not None
    assert "drive.cancel only where a requirement on drive does not hold" in [
        item.part.text for item in explanation.blamed
    ]


# Reasons why an event cannot happen


def test_free_and_restricted_by_a_requirement() -> None:
    text = robot(
        DOOR, "component Bell { incoming message ring with type: none }", "§requirement Door.opened disables ring"
    )
    plain, line, column = marked_place(text)
    events = {item.event: item for item in explained(plain).events}
    assert {name: item.status for name, item in events.items()} == {
        "open.request": "free",
        "shut.request": "free",
        "ring.request": "restricted",
    }
    (reason,) = events["ring.request"].reasons
    assert reason.part is not None
    assert reason.way is not None
    assert (reason.kind, place(reason.part.location), reason.way.events) == (
        "requirement",
        (line, column),
        ("open.request",),
    )
    assert reason.message == "'requirement Door.opened disables ring' forbids it: Door is opened"


def test_restricted_by_the_supervisor_with_the_trouble_that_would_follow() -> None:
    report = event(robot(LIFT), "arm")
    assert report.status == "restricted"
    reason = next(item for item in report.reasons if item.kind == "supervisor")
    assert reason.way is not None
    assert reason.way.state.variables == {"Lift.n": 2}
    assert reason.way.events == ("arm.request", "up.response") * 2
    assert reason.trouble is not None
    assert (reason.trouble.way.events, reason.trouble.is_forced, reason.trouble.kind) == ((), True, "bad")
    assert reason.trouble.messages == ("up.response can take Lift.n, which is 2, out of its range",)


def test_restricted_by_a_range_and_by_its_behaviour() -> None:
    counter = """component C { service add with request: none, response: none links i
        incoming message rest with type: none
        behaviour { variable §n: integer(0..1) initial marked state on_ { on request to add do n := n + 1
        on request to rest goto off } marked state off { on request to rest goto on_ } } }
        requirement rest needs C.n = 0"""
    plain, line, column = marked_place(robot(counter))
    report = event(plain, "add.request")
    assert [item.kind for item in report.reasons] == ["behaviour", "behaviour", "range"]
    protocol, behaviour, limit = report.reasons
    assert protocol.message == "add is waiting, where it has no transition on add.request"
    assert behaviour.message == "C is off, where it has no transition on add.request"
    assert limit.part is not None
    assert place(limit.part.location) == (line, column)
    assert limit.message == "it would take C.n, which is 1, out of its range"
    assert limit.way is not None
    assert limit.way.events == ("add.request", "add.response", "add.reset")


def test_never_because_of_behaviours_requirements_or_the_supervisor() -> None:
    door = DOOR.replace("goto closed }", "goto closed }\n state ajar { on request to slam goto closed }")
    door = door.replace("behaviour", "incoming message slam with type: none\n behaviour")
    report = event(robot(door), "slam")
    assert (report.status, [item.kind for item in report.reasons]) == ("never", ["behaviour"])
    assert report.stopped is None
    # A way exists, but it is forbidden: that is reported.
    reachable = door.replace("to shut goto closed", "to shut goto ajar")
    report = event(robot(reachable, "requirement shut needs Door.closed"), "slam")
    assert report.status == "never"
    assert report.stopped is not None
    assert (report.stopped.events, report.stopped.stopped_at) == (("open.request", "shut.request"), 1)
    assert [item.kind for item in report.stopped.reasons] == ["requirement"]
    # Two of three requirements are enough.
    bell = "component Bell { incoming message ring with type: none }"
    needs = [f"requirement ring needs {item}" for item in ("Door.closed", "!Door.opened", "Door.opened")]
    report = event(robot(DOOR, bell, *needs), "ring")
    assert report.status == "never"
    assert [item.part.text for item in report.reasons if item.part] == [needs[0], needs[2]]
    report = event(robot(LIFT.replace("integer(0..2)", "integer(0..2) = 2")), "arm")
    assert (report.status, [item.kind for item in report.reasons]) == ("never", ["supervisor"])


def test_ways_that_take_too_long_to_find(monkeypatch: pytest.MonkeyPatch) -> None:
    """Check that each place that would show a way of the behaviours says that it shows none."""
    unfound = "no way of the behaviours is shown: finding one takes too long"
    once = """component Once { incoming message go with type: none
        behaviour { initial marked state before { on request to go goto after } state after { }
        state never { on request to go goto before } } }"""
    back = once.replace("state after { }", "state after { on request to go goto never }")
    text = robot(back, "requirement go needs !Once.after")
    for limits in ((runs.MAXIMUM_EFFORT, ways.MAXIMUM_NODES), (0, 0)):
        monkeypatch.setattr(runs, "MAXIMUM_EFFORT", limits[0])
        monkeypatch.setattr(ways, "MAXIMUM_NODES", limits[1])
        is_given_up = limits[0] == 0
        (reason,) = event(text, "go").reasons
        assert reason.trouble is not None
        assert (unfound in reason.trouble.messages) == is_given_up
        assert (reason.trouble.stopped is None) == is_given_up
        (remark, *_) = (item for item in explained(text).remarks if item.kind == "unreachable-state")
        assert remark.message == "Once never gets to 'after'" + (f": {unfound}" if is_given_up else "")
        assert (remark.stopped is None) == is_given_up
        with pytest.raises(RequestError, match=f"; {unfound}" if is_given_up else "would have the way"):
            explained(text, state="Once.never")
    door = DOOR.replace("goto closed }", "goto closed }\n state ajar { on request to slam goto closed }")
    door = door.replace("behaviour", "incoming message slam with type: none\n behaviour")
    reachable = robot(door.replace("to shut goto closed", "to shut goto ajar"), "requirement shut needs Door.closed")
    report = event(reachable, "slam")
    assert (report.status, report.stopped, report.unfound) == ("never", None, unfound)
    assert f"slam.request: can never happen\n  {report.reasons[0].message}" in str(explained(reachable, event="slam"))
    assert f"\n  {unfound}" in str(explained(reachable, event="slam"))
    # The absence of a way is reported where it is known.
    (ajar, *_) = explained(
        robot(DOOR.replace("marked state opened", "marked state ajar { }\n marked state opened"))
    ).remarks
    assert ajar.message == "Door never gets to 'ajar': its behaviour has no way there"


def test_a_guard_that_is_not_true() -> None:
    text = """component C { outgoing message go with type: none
        behaviour { variable b: boolean initial marked state here { transition if b goto there
        on response from go do b := true } marked state there { } } }"""
    report = explained(robot(text), state="!C.b", event="C.tau_1").state
    assert report is not None
    (item,) = report.events
    assert not item.can_happen
    assert [reason.message for reason in item.reasons] == ["C is here, where C.b is not true"]


# Explanations of a state


def test_in_a_state_and_after_a_run() -> None:
    text = robot(
        DOOR, "component Bell { incoming message ring with type: none }", "requirement Door.opened disables ring"
    )
    for asked in (
        {"state": "Door.opened"},
        {"after": "open"},
        {"after": "open.request, shut, open", "state": "Door.opened"},
    ):
        report = explained(text, **asked).state
        assert report is not None
        assert {item.event: item.can_happen for item in report.events} == {
            "open.request": False,
            "shut.request": True,
            "ring.request": False,
        }
        long = ("open.request", "shut.request", "open.request")
        assert report.way.events == (long if len(asked) == 2 else ("open.request",))
        assert report.way.is_shortest == (len(asked) == 1)
        assert report.fitting == "1"
    report = explained(text, event="ring", after="open, shut").state
    assert report is not None
    assert [(item.event, item.can_happen, item.reasons) for item in report.events] == [("ring.request", True, ())]
    # All events where nothing is asked for.


def test_of_the_states_that_fit_one_is_shown_in_which_the_event_cannot_happen() -> None:
    report = explained(robot(LIFT), event="bottom", state="Lift.off").state
    assert report is not None
    assert (report.way.events, report.fitting) == (("arm.request", "up.response"), "3")
    assert [item.can_happen for item in report.events] == [False]
    report = explained(robot(LIFT), event="bottom", state="Lift.off, Lift.n = 0").state
    assert report is not None
    assert (report.way.events, report.events[0].can_happen) == ((), True)


@pytest.mark.parametrize(
    ("asked", "problem"),
    [
        ({"event": "opne"}, "unknown event 'opne'; did you mean 'open'?"),
        ({"event": "x\x1b[2J"}, r"unknown event 'x\x1b[2J'; there is open, shut, up, arm, bottom, open.request, "),
        ({"after": "open, open"}, "'open.request' cannot happen after open.request: Door is opened, where it has no "),
        ({"after": "shut"}, "'shut.request' cannot happen in the initial state: Door is closed"),
        ({"state": "Dor.opened"}, "unknown component or communication 'Dor'; did you mean 'Door'?"),
        ({"state": "Door.opend"}, "unknown state or synthesis variable of Door 'opend'; did you mean 'opened'?"),
        ({"state": "Door.opened = 3"}, "Door.opened is a state: it has no value to compare"),
        ({"state": "Lift.n"}, "Lift.n needs a value: Lift.n = 0"),
        ({"state": "Lift.n = high"}, "'high' is not a value of Lift.n; there is a whole number"),
        ({"state": "Lift.n > 7"}, "the controlled system is never in a state that fits 'Lift.n > 7'"),
        ({"state": "Door"}, "'Door' is not a condition such as Door.closed"),
        ({"state": " , "}, "no state is asked for"),
        (
            {"state": "Lift.armed and Lift.n = 2"},
            "the behaviours would have the way arm.request, up.response, arm.request, up.response, "
            "arm.request, but arm.request must not happen: synthesis forbids it",
        ),
    ],
)
def test_what_is_not_there(asked: dict[str, str], problem: str) -> None:
    with pytest.raises(RequestError, match=re.escape(problem)):
        explained(robot(DOOR, LIFT), **asked)


# Warnings


def test_a_silent_step_that_changes_nothing_is_no_way_on() -> None:
    text = robot(
        """component N { outgoing message o with type: none incoming message m with type: none
           behaviour { initial marked state a { transition on response from o goto b }
                       marked state b { on request to m goto a } } }"""
    )
    assert [item.kind for item in explained(text).remarks] == ["only-uncontrollable"]


def test_an_unknown_requirement_is_reported_as_unknown() -> None:
    text = robot(
        """component N { outgoing message p with type: integer(0..60) incoming message go with type: none
           behaviour { variable n: integer(0..60) on response from p do n := value
                       initial marked state idle { on request to go goto idle } } }""",
        "requirement go needs N.n * 100000000 > 0",
    )
    for state, why in (
        ("N.n = 30", "forbids it, for its value is unknown: N.n is 30"),
        ("N.n = 0", "forbids it: N.n is 0"),
    ):
        report = explained(text, event="go", state=state).state
        assert report is not None
        (reason,) = report.events[0].reasons
        assert reason.message.endswith(why)


def test_a_reported_condition_holds_in_every_way() -> None:
    """The first event of the shortest way is possible later; what stops every way is the last."""
    text = robot(
        """component S { outgoing message o with type: none
           behaviour { initial marked state off { on response from o goto on1 } marked state on1 { } } }""",
        """component M { incoming message go with type: none incoming message on2 with type: none
           behaviour { initial marked state idle { on request to go goto mid }
                       marked state mid { on request to on2 goto far } marked state far { } } }""",
        "requirement go needs S.on1",
        "requirement never M.far",
    )
    (remark,) = (item for item in explained(text).remarks if item.kind == "unreachable-state")
    assert remark.stopped is not None
    assert (remark.stopped.events, remark.stopped.stopped_at) == (("o.response", "go.request", "on2.request"), 2)


def test_warnings() -> None:
    text = robot(
        DOOR.replace("marked state opened", "marked state ajar { }\n marked state opened"),
        LIFT,
        "requirement shut needs Door.opened",
        "requirement open needs Lift.off and Lift.armed",
    )
    remarks = explained(text).remarks
    assert Counter(item.kind for item in remarks) == {
        "never-enabled": 2,
        "unused-requirement": 1,
        "unreachable-state": 2,
        "only-uncontrollable": 2,
    }
    ajar, opened = (item for item in remarks if item.kind == "unreachable-state")
    assert (ajar.message, ajar.stopped) == ("Door never gets to 'ajar': its behaviour has no way there", None)
    assert opened.message == "Door never gets to 'opened'"
    assert opened.stopped is not None
    assert (opened.stopped.events, opened.stopped.stopped_at) == (("open.request",), 0)
    armed, full = (item for item in remarks if item.kind == "only-uncontrollable")
    assert armed.way is not None
    assert armed.message == (
        "after arm.request, up.response, arm.request only the environment can move on (one of 2 such states)"
    )
    assert armed.way.state.components == {"Door": "closed", "Lift": "armed"}
    assert full.way is not None
    assert full.way.state.components == {"Door": "closed", "Lift": "off"}
    assert explained(robot(DOOR)).remarks == ()


def test_a_state_in_which_nothing_can_happen() -> None:
    once = """component Once { incoming message go with type: none
        behaviour { initial marked state before { on request to go goto after } marked state after { } } }"""
    (remark,) = explained(robot(once)).remarks
    assert (remark.kind, remark.message) == ("deadlock", "after go.request nothing at all can happen")
    assert remark.way is not None
    assert remark.way.state.components == {"Once": "after"}


def test_texts_are_on_one_line_and_the_document_has_every_attribute() -> None:
    explanation = explained(robot(DOOR, LIFT))
    assert list(document(explanation)) == ["empty", "events", "state", "remarks", "is_of_automata"]
    assert msgspec.convert(document(explanation), Explanation) == explanation


# Random models against enumerated states


def places_of(model: Model) -> Places:
    """A place of its own for every part of a model; lines say which part."""
    places = Places(Location("m", 1, 1))
    places.communications.update({item.name: Location("c", n + 1, 1) for n, item in enumerate(model.communications)})
    places.requirements.extend(Location("r", n + 1, 1) for n in range(len(model.requirements)))
    for number, item in enumerate(model.components):
        places.components[item.name] = Location("k", number + 1, 1)
        if item.behaviour:
            rows = range(len(item.behaviour.transitions))
            places.transitions[item.name] = tuple(Location(f"t{number}", row + 1, 1) for row in rows)
            places.states.update(
                {
                    (item.name, state.name): Location(f"s{number}", n + 1, 1)
                    for n, state in enumerate(item.behaviour.states)
                }
            )
            places.variables.update(
                {
                    (item.name, each.name): Location(f"v{number}", n + 1, 1)
                    for n, each in enumerate(item.behaviour.variables)
                }
            )
    return places


class Enumerated:
    """The controlled system, state by state."""

    def __init__(self, system: System, supervisor: ExplicitSupervisor) -> None:
        self.system = system
        self.semantics = Semantics(system)
        ranges = [item for item in relaxable_constraints(system) if item.kind is ConstraintKind.RANGE]
        self.unbounded = Semantics(without_ranges(system, ranges))
        self.supervisor = supervisor
        self.places = {subject: place for place, subject in enumerate(subjects(system))}
        self.distances = {self.semantics.initial: 0}
        queue = deque(self.distances)
        while queue:
            state = queue.popleft()
            for item in system.events:
                if self.allows(state, item.name):
                    for target in self.semantics.targets(state, item.name):
                        if target not in self.distances:
                            self.distances[target] = self.distances[state] + 1
                            queue.append(target)

    def allows(self, state: State, name: str) -> bool:
        if self.system.event(name).is_controllable:
            return self.supervisor.allows(state, name)
        return self.semantics.enabled(state, name)

    def moves_on(self, state: State, name: str) -> bool:
        """Return True if an event can happen and is no silent step back into the same state."""
        return self.allows(state, name) and (not is_tau(name) or self.semantics.targets(state, name) != {state})

    def nearest(self, states: list[State]) -> int:
        return min(self.distances[state] for state in states)

    def check(self, report: EventReport, met: Counter[str]) -> None:
        name = report.event
        wanted = [state for state in self.distances if self.unbounded.enabled(state, name)]
        possible = [state for state in self.distances if self.allows(state, name)]
        assert report.status == ("never" if not possible else "free" if len(possible) == len(wanted) else "restricted")
        met[report.status] += 1
        expected: dict[tuple[str, int], list[State]] = {}
        for number, condition in enumerate(self.system.conditions):
            if condition.event == name:
                holds = compile_expression(condition.condition, self.places)
                expected[f"condition {number}", number] = [s for s in wanted if holds(s, NO_DATA) is not True]
        distances = {self.nearest(states) for states in expected.values() if states}
        kinds = Counter(item.kind for item in report.reasons)
        if report.status == "restricted":
            assert kinds["requirement"] == sum(bool(states) for states in expected.values())
            assert (kinds["range"] > 0) == any(not self.semantics.enabled(state, name) for state in wanted)
            lost = [s for s in wanted if self.semantics.enabled(s, name) and self.semantics.condition(s, name)]
            lost = [s for s in lost if not self.allows(s, name)]
            assert (kinds["supervisor"] > 0) == bool(lost)
            if lost:
                distances.add(self.nearest(lost))
        for reason in report.reasons:
            met[f"{report.status} {reason.kind}"] += 1
            assert reason.way is not None
            if reason.kind in ("requirement", "supervisor") and report.status == "restricted":
                assert len(reason.way.events) in distances
            met["long"] += len(reason.way.events) > 2
            assert (reason.trouble is not None) == (reason.kind == "supervisor")
        met["stopped"] += report.stopped is not None
        assert report.stopped is None or not wanted


@pytest.mark.random
def test_random_models() -> None:
    met: Counter[str] = Counter()
    for seed in seeds(EXAMPLES):
        model = random_supervisor(seed).model
        components = [
            msgspec.structs.replace(
                item,
                behaviour=item.behaviour
                and msgspec.structs.replace(
                    item.behaviour,
                    states=tuple(msgspec.structs.replace(state, is_marked=True) for state in item.behaviour.states),
                ),
            )
            for item in model.components
        ]
        model = msgspec.structs.replace(model, components=tuple(components))
        try:
            system = to_automata(model, Deployment.CONTROLLER)
            supervisor = synthesize_explicit(system, limit=LIMIT)
        except UnsupportedModelError:
            continue
        if supervisor is None:
            continue
        places = places_of(model)
        found = [
            explain_synthesis(ModelWords(model, places, system, Deployment.CONTROLLER), engine=engine)
            for engine in (("cudd", "oxidd", "autoref") if seed % 8 == 0 else ("cudd",))
        ]
        assert found[-1] == found[0]
        assert (found[0].empty is not None) == supervisor.is_empty
        assert explanation_text(found[0])
        met["empty"] += supervisor.is_empty
        if supervisor.is_empty:
            continue
        twin = Enumerated(system, supervisor)
        assert set(twin.distances) == supervisor.reachable
        for report in found[0].events:
            twin.check(report, met)
        remarks = [item for item in found[0].remarks if item.kind == "unreachable-state"]
        seen = {(str(s), state[place]) for state in twin.distances for s, place in twin.places.items()}
        locations = places.states
        assert {item.location for item in remarks} == {
            location for (name, each), location in locations.items() if (str(Subject(name)), each) not in seen
        }
        met["unreachable"] += len(remarks)
        waiting = [
            state
            for state in twin.distances
            if not any(twin.moves_on(state, item.name) for item in system.events if item.is_controllable)
        ]
        kinds = {item.kind for item in found[0].remarks}
        stuck = [state for state in waiting if not any(twin.moves_on(state, item.name) for item in system.events)]
        assert ("deadlock" in kinds) == bool(stuck)
        assert ("only-uncontrollable" in kinds) == (len(stuck) < len(waiting))
        met["waiting"] += len(waiting) > len(stuck)
    assert all(
        met[name]
        for name in ("free", "restricted", "never", "restricted requirement", "never requirement", "stopped", "long")
    ), met
    assert met["waiting"], met
    assert met["unreachable"], met
