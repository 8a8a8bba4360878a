"""Exploration and simulation of automata: against a product that is built by hand, state by state."""

import json
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import pytest
from hypothesis import given, settings

import robosc
from robosc.automata import DiscreteVariable, EventCondition, InputVariable, Role, System, disables
from robosc.automata.compile import State
from robosc.expressions import ITSELF, Binary, Constant, EnumType, IntegerType, StateTest, Unary
from robosc.pipeline.system_runs import initial_states_in_words
from robosc.pipeline.walking import WalkFindingKind
from support.effort import examples
from support.naive_system import NaiveSystem
from support.random_systems import system_seeds, wide_system
from support.supervised_systems import supervised
from support.systems import automaton, edge, operation, read, received, system

MAXIMUM_STATES = 40
STEPS = 12

LINE = system(
    automaton("Machine", ["idle -start-> busy", "busy -u_done-> idle"], marked=["idle"]),
    automaton("Buffer", ["empty -u_done-> full", "full -u_done-> lost", "full -take-> empty"], marked=["empty"]),
)
COLOUR = EnumType("Colour", ("red", "green"))
CAMERA = system(
    automaton(
        "Camera",
        [
            edge("on -u_seen-> on", colour=received("colour"), count=received("ranges", 1)),
            edge("on -u_seen-> off", operation(read("Camera.count"), "=", 2)),
            "off -go-> on",
        ],
        variables=[DiscreteVariable("colour", COLOUR, ("red",)), DiscreteVariable("count", IntegerType(0, 2), (0,))],
    ),
    inputs=[
        InputVariable("u_seen", ("colour",), COLOUR),
        InputVariable("u_seen", ("ranges", 1), IntegerType(0, 2), may_be_unknown=True),
    ],
)


def parts(automata: System, state: State) -> dict[str, Any]:
    """A state as a run shows it: locations, then variables."""
    given = {str(subject): value for subject, value in zip(NaiveSystem(automata).subjects, state, strict=True)}
    held = {item.name for item in automata.automata if all(part.name != ITSELF for part in item.variables)}
    return dict(sorted(given.items(), key=lambda item: item[0] not in held))


def by_name(given: Iterable[dict[str, Any]]) -> list[list[tuple[str, Any]]]:
    """States in an order of their own."""
    return sorted((list(state.items()) for state in given), key=repr)


@settings(max_examples=examples(15))
@given(system_seeds())
def test_a_product_by_hand_enumerates_the_same_states_and_runs(seed: int) -> None:
    drawn = wide_system(seed)
    made, found = robosc.synthesize(drawn), robosc.explore(drawn)
    assert found.status is made.status
    if made.supervisor is None:
        assert found.graph is None
        assert (found.reason, found.explanation) == (made.reason, made.explanation)
        return
    supervisor, naive = made.supervisor, NaiveSystem(drawn)
    if supervisor.states > MAXIMUM_STATES:
        with pytest.raises(robosc.NothingGeneratedError, match="too many to list"):
            robosc.explore(supervisor, maximum_states=MAXIMUM_STATES).write("never.json")
        return
    first = naive.beginnings(supervisor.initial)
    assert by_name(state.parts for state in initial_states_in_words(supervisor)) == by_name(
        parts(drawn, state) for state in first
    )
    reached: dict[State, dict[str, frozenset[State]]] = {}
    left = sorted(first)
    while left:
        state = left.pop()
        if state not in reached:
            reached[state] = {
                event.name: naive.controlled(state, event.name, supervisor.added) for event in drawn.events
            }
            left += [target for targets in reached[state].values() for target in targets]
    graph = robosc.explore(supervisor).graph
    assert graph is not None
    assert graph == found.graph
    numbers = [{**state.components, **state.variables} for state in graph.states]
    place = {repr(item): number for number, item in enumerate(numbers)}
    number_of = {state: place[repr(parts(drawn, state))] for state in reached}
    assert sorted(number_of.values()) == list(range(len(graph.states)))
    assert {number_of[state] for state in first} == set(graph.initial_states)
    assert set(graph.transitions) == {
        (number_of[state], event, number_of[target])
        for state, steps in reached.items()
        for event, targets in steps.items()
        for target in targets
    }
    for state, number in number_of.items():
        assert graph.states[number].is_marked is naive.is_marked(state)
    _lead(supervisor, naive, reached, sorted(first), Random(seed))


def _lead(
    supervisor: robosc.SystemSupervisor,
    naive: NaiveSystem,
    reached: dict[State, dict[str, frozenset[State]]],
    first: list[State],
    dice: Random,
) -> None:
    """Lead a run along the product."""
    drawn = supervisor.system
    now = dice.choice(first)
    run = robosc.simulate(supervisor, initial=parts(drawn, now))
    past = [now]
    for _ in range(STEPS):
        can = [event for event, targets in reached[now].items() if targets]
        assert run.state.parts == parts(drawn, now)
        assert run.is_marked is naive.is_marked(now)
        assert list(run.possible) == can
        assert list(run.enabled) == [event for event in can if drawn.event(event).is_controllable]
        blocked = run.blocked()
        assert list(blocked) == [event for event in run.events if event not in can]
        for event, why in blocked.items():
            assert why
            assert why == run.reasons(event)
            with pytest.raises(robosc.EventNotPossibleError, match="now: "):
                run.step(event)
            assert run.choices(event) == ()
        if not can:
            break
        event = dice.choice(can)
        targets = reached[now][event]
        assert by_name(item.parts for item in run.choices(event)) == by_name(parts(drawn, item) for item in targets)
        target = dice.choice(sorted(targets))
        if len(targets) > 1:
            with pytest.raises(robosc.ChoiceError, match=f"'{event}' can lead to {len(targets)} states: "):
                run.step(event)
            assert run.state.parts == parts(drawn, now)
        data = dice.choice(list(naive.data(event)))
        if data:
            known = tuple(pair for pair in data.items() if dice.random() < 0.7)
            given: dict[Any, Any] = {}
            for path, value in known:
                inside = given
                for step in ("all", *path)[:-1]:
                    inside = inside.setdefault(step, {})
                inside[("all", *path)[-1]] = value
            narrowed = naive.step(now, event, known)[0]
            assert by_name(item.parts for item in run.choices(event, *given.values())) == by_name(
                parts(drawn, item) for item in narrowed
            )
            if narrowed:
                target = dice.choice(sorted(narrowed))
                taken = run.step(event, *given.values(), to=parts(drawn, target))
                assert len(taken.data) == len(known)
                assert run.undo() == taken
        assert run.step(event, to=parts(drawn, target)).state.parts == parts(drawn, target)
        past.append(target)
        now = target
    while run.undo() is not None:
        past.pop()
        assert run.state.parts == parts(drawn, past[-1])
    while run.redo() is not None:
        pass
    assert run.state.parts == parts(drawn, now)
    run.restart()
    assert run.state == run.initial
    assert len(run) == 0


@settings(max_examples=examples(10))
@given(system_seeds())
def test_walks_go_along_the_graph(seed: int) -> None:
    drawn = wide_system(seed)
    supervisor = robosc.synthesize(drawn).supervisor
    if supervisor is None or supervisor.states > MAXIMUM_STATES:
        return
    graph = robosc.explore(supervisor).graph
    assert graph is not None
    names = [{**state.components, **state.variables} for state in graph.states]
    initial = names[graph.initial]
    run = robosc.simulate(supervisor, initial=initial)
    steps = run.walk(STEPS, seed)
    assert steps == run.history
    assert len(steps) == STEPS or not run.possible
    places = [names.index(item) for item in (initial, *(step.state.parts for step in steps))]
    assert {(a, step.event, b) for a, step, b in zip(places, steps, places[1:], strict=False)} <= set(graph.transitions)
    assert robosc.simulate(supervisor, initial=initial).walk(STEPS, seed) == steps
    # Nonblocking, so that the only findings are blocked requests.
    finding = run.walk_until_finding(50, seed)
    assert finding is None or (finding.kind is WalkFindingKind.BLOCKED and finding.event in run.blocked())


def test_a_line_by_hand() -> None:
    run = robosc.simulate(supervised(LINE))
    assert (run.events, run.enabled, run.possible) == (("start", "take", "u_done"), ("start",), ("start",))
    assert repr(run) == "<run of by hand: 0 steps; allowed are start>"
    assert str(run.step("start").state) == "Machine = busy, Buffer = empty"
    assert run.step("u_done").is_controllable is False
    assert str(run).splitlines() == [
        "   1  start: Machine = busy",
        "   2  u_done: Machine = idle, Buffer = full",
        "now Machine = idle, Buffer = full",
        "allowed are take",
    ]
    assert "Buffer = full" in run._repr_html_()
    assert run.blocked() == {
        "start": ("the supervisor forbids it, because of what can follow (Buffer is full)",),
        "u_done": ("Machine is in idle, not in busy",),
    }
    assert not run.is_marked
    with pytest.raises(robosc.UnknownEventError, match="'strat'; did you mean 'start'"):
        run.step("strat")
    with pytest.raises(robosc.EventNotPossibleError, match="'start' is not allowed now: the supervisor forbids it, "):
        run.step("start")
    with pytest.raises(robosc.DataError, match="'take' carries no data, and was given 3"):
        run.step("take", 3)
    with pytest.raises(robosc.UnknownNameError, match="no part of the state 'Bufer'; did you mean 'Buffer'"):
        run.step("take", to={"Bufer": "empty"})
    with pytest.raises(robosc.ChoiceError, match="'take' cannot lead to a state with Buffer = lost; it can lead to: "):
        run.step("take", to={"Buffer": "lost"})
    assert len(run) == 2


def test_every_cause_is_a_sentence() -> None:
    made = replace(
        system(
            automaton(
                "A",
                [
                    edge("l -guarded-> l", StateTest("A", "m")),
                    edge("l -count-> l", n=Binary("+", read("A.n"), Constant(1))),
                    *("l -needed-> l", "l -disabled-> l", "l -watched-> l", "m -elsewhere-> l", "l -u_free-> l"),
                    *("l -barred-> l", "l -u_barred-> l", "l -broken-> k", "l -broken-> m", "l -u_broken-> k"),
                    *("l -partly-> k", "l -partly-> l"),
                ],
                variables=[DiscreteVariable("n", IntegerType(0, 2), (2,))],
                blocks=["never"],
            ),
            automaton("left R", ["r -elsewhere-> r"], blocks=["watched", "u_free", "alone"]),
            automaton("Monitor", ["y -partly-> x"], initial="x", blocks=["nowhere"]),
        ),
        conditions=(EventCondition("needed", StateTest("A", "m")), disables(StateTest("A", "l"), "disabled")),
        plant_conditions=(EventCondition("barred", StateTest("A", "m")), disables(StateTest("A", "l"), "u_barred")),
        plant_invariants=(Unary("not", StateTest("A", "k")), Unary("not", StateTest("A", "m"))),
    )
    requirement = replace(made.automata[1], role=Role.REQUIREMENT, alphabet=frozenset({"watched", "alone"}), edges=())
    monitor = replace(made.automata[2], alphabet=frozenset({"partly"}), monitors=frozenset({"partly"}))
    made = replace(made, automata=(made.automata[0], requirement, monitor))
    run = robosc.simulate(supervised(made))
    cannot_be = "it leads only to what the plants cannot be: there not A.{} does not hold"
    assert run.possible == ("partly", "u_free")
    assert run.blocked() == {
        "alone": ("requirement left R has no edge for it",),
        "barred": ("it needs A.m, which does not hold (A is l)",),
        "broken": (cannot_be.format("k"), cannot_be.format("m")),
        "count": ("it could take A.n, which is 2, out of its range 0..2",),
        "disabled": ("A.l disables it, and that holds (A is l)",),
        "elsewhere": ("A is in l, not in m",),
        "guarded": ("A: A.m does not hold (A is l)",),
        "needed": ("it needs A.m, which does not hold (A is l)",),
        "never": ("A has no edge for it",),
        "nowhere": ("no automaton has it in its alphabet",),
        "u_barred": ("A.l disables it, and that holds (A is l)",),
        "u_broken": (cannot_be.format("k"),),
        "watched": ("requirement left R has no edge for it",),
    }


def test_data_and_edges_are_chosen_or_asked_for() -> None:
    run = robosc.simulate(supervised(CAMERA))
    assert [(field.name, field.choices) for field in run.data_fields("u_seen")] == [
        ("value.colour", ("red", "green")),
        ("value.ranges.1", ()),
    ]
    with pytest.raises(
        robosc.ChoiceError,
        match=r"'u_seen' can lead to 6 states: Camera\.colour = green, Camera\.count = 0; .*; \.\.\.; choose one, for "
        r"instance with to=\{'Camera\.colour': 'green', 'Camera\.count': 0\}",
    ):
        run.step("u_seen")
    assert str(run.step("u_seen", colour="green", ranges=[0, 2])) == "u_seen: Camera = on, Camera.colour = green, " + (
        "Camera.count = 2"
    )
    assert run.history[-1].data == {"value.colour": "green", "value.ranges[1]": 2}
    # Two edges each, and data that does not matter to one of them.
    assert len(run.choices("u_seen")) == 7
    assert run.step("u_seen", {"colour": "red"}, to={"Camera": "off"}).state.parts["Camera.colour"] == "green"
    assert run.enabled == ("go",)
    assert run.undo() is not None
    # A list that is too short leaves its elements unknown.
    assert run.step("u_seen", colour="red", ranges=[], to={"Camera": "on"}).state.parts["Camera.count"] == 2
    assert run.history[-1].data == {"value.colour": "red", "value.ranges[1]": None}
    for data, message in (
        ({"colour": "blue"}, "value.colour of 'u_seen' is 'blue', and must be one of red, green"),
        ({"colour": None}, "value.colour of 'u_seen' is unknown, and must be one of red, green"),
        ({"color": "red"}, "value of 'u_seen' has no part 'color'; did you mean 'colour'?"),
        ({"ranges": 3}, "value.ranges of 'u_seen' is 3, and must be a list"),
        ({"ranges": [0, True]}, "value.ranges[1] of 'u_seen' is True, and must be int[0..2]"),
        ("red", "value of 'u_seen' is 'red', and must be a mapping with colour, ranges"),
    ):
        with pytest.raises(robosc.DataError) as caught:
            run.step("u_seen", data)
        assert str(caught.value) == message
    with pytest.raises(robosc.DataError, match="either as one value or as keywords"):
        run.step("u_seen", {"colour": "red"}, colour="red")


def test_ways_to_begin() -> None:
    two = system(automaton("A", ["a -go-> a", "b -go-> a"], initial=["a", "b"], marked=["a", "b"]))
    supervisor = supervised(two)
    with pytest.raises(robosc.ChoiceError, match=r"can begin in 2 states: A = a; A = b; .* initial=\{'A': 'a'\}"):
        robosc.simulate(supervisor)
    with pytest.raises(robosc.ChoiceError, match="by hand cannot begin in a state with A = c; it can begin in: A = a"):
        robosc.simulate(supervisor, initial={"A": "c"})
    assert robosc.simulate(supervisor, initial={"A": "b"}).step("go").state.components == {"A": "a"}
    assert [state.parts for state in initial_states_in_words(supervisor)] == [{"A": "a"}, {"A": "b"}]
    found = robosc.explore(supervisor)
    assert found.graph is not None
    assert (found.graph.initial_states, found.graph.initial) == ((0, 1), 0)
    assert "it starts in state 0 or 1" in str(found)
    assert found.graph.to_json()["initial_states"] == [0, 1]
    assert "start -> 1;" in found.graph.dot


def test_what_needs_a_model_says_so() -> None:
    supervisor = supervised(LINE)
    uses: tuple[tuple[Callable[[Any], object], Any], ...] = (
        (robosc.check, LINE),
        (robosc.check, supervisor),
        (robosc.explain, supervisor),
    )
    for given_ in (LINE, supervisor):
        assert "the target ros2 needs a model of a robot" in robosc.generate(given_, "ros2").reason
    for use, given_ in uses:
        with pytest.raises(TypeError, match=r"this takes a RoboSC model, not automata .*, which have no text"):
            use(given_)
    with pytest.raises(TypeError, match=r"make it with robosc\.synthesize\(system\)\.supervisor"):
        robosc.simulate(LINE)  # type: ignore[call-overload]
    robot = robosc.synthesize(robosc.load(text="robot R { component C { incoming message m with type: none } }"))
    assert robot.supervisor is not None
    with pytest.raises(TypeError, match="a robot begins in one state"):
        robosc.simulate(robot.supervisor, initial={})  # type: ignore[call-overload]


def test_too_much_to_choose_from_is_said() -> None:
    wide = IntegerType(0, 2**20)
    made = system(
        automaton("A", [edge("a -u_in-> a", n=received())], variables=[DiscreteVariable("n", wide, (0,))]),
        inputs=[InputVariable("u_in", (), wide)],
    )
    run = robosc.simulate(supervised(made))
    with pytest.raises(robosc.UnsupportedModelError, match="u_in cannot be simulated: 1048577 choices are too many"):
        run.step("u_in", 3)
    assert robosc.explore(made).status is robosc.SynthesisStatus.UNSUPPORTED_MODEL


def test_a_graph_is_written_as_its_name_says(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = robosc.explore(LINE)
    assert found.graph is not None
    assert json.loads(found.write(tmp_path / "g.json").read_text()) == found.graph.to_json()
    assert found.write(tmp_path / "g.txt").read_text() == str(found.graph)
    for name in ("g.dot", "g.gv"):
        assert found.write(tmp_path / name).read_text() == found.graph.dot
    with pytest.raises(robosc.FileAccessError, match=r"g\.jpg: .* graph ends in one of \.json, \.txt,"):
        found.write(tmp_path / "g.jpg")
    monkeypatch.setenv("PATH", str(tmp_path))
    assert found._repr_svg_() is None
    with pytest.raises(robosc.DrawingUnavailableError, match="'dot' is not installed"):
        found.write(tmp_path / "g.svg")
    # A program that draws what it is given by its arguments: the graph, then the format.
    dot = tmp_path / "dot"
    script = """#!/bin/sh
while IFS= read -r line; do printf '%s\\n' "$line"; done
printf '%s\\n' "$1"
"""
    dot.write_text(script)
    dot.chmod(0o755)
    assert found.write(tmp_path / "g.png").read_text() == found.graph.dot + "-Tpng\n"
    assert found._repr_svg_() == found.graph.dot + "-Tsvg\n"
    dot.write_text("#!/bin/sh\nexit 3\n")
    with pytest.raises(robosc.DrawingUnavailableError, match="cannot draw this graph"):
        found.write(tmp_path / "g.pdf")
    assert sorted(item.name for item in tmp_path.iterdir()) == ["dot", "g.dot", "g.gv", "g.json", "g.png", "g.txt"]


def test_a_run_is_kept_as_an_event_log(tmp_path: Path) -> None:
    run = robosc.simulate(supervised(CAMERA))
    run.step("u_seen", colour="green", ranges=[0, 1])
    entry = json.loads(run.save(tmp_path / "run.jsonl").read_text())
    assert (entry["event"], entry["data"]) == ("u_seen", {"value.colour": "green", "value.ranges[1]": 1})
    assert entry["state"] == {"Camera": {"state": "on", "variables": {"colour": "green", "count": 1}}}
    with pytest.raises(robosc.FileAccessError, match=r"ends in \.jsonl"):
        run.save(tmp_path / "run.py")


def test_names_of_several_words_stay_whole() -> None:
    left = replace(LINE.automata[1], name="left Buffer")
    supervisor = supervised(replace(LINE, automata=(LINE.automata[0], left)))
    assert str(supervisor.conditions["start"]) == "not left Buffer.full"
