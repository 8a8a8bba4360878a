"""Models that have a supervisor already: its parts take part as they stand, and nothing is synthesized."""

from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import pytest

import robosc
from robosc.automata import Role, Semantics, System, composed
from robosc.automata.controlled import ControlledGraph, controlled_graph
from robosc.automata.state import subjects
from robosc.cif import check_cif
from robosc.cli.main import main
from robosc.pipeline.exploring import graph_of
from robosc.pipeline.results import SynthesisStatus, VerificationStatus
from robosc.source import Bundle, SourceFile
from robosc.synthesis import synthesize
from robosc.targets.cif import automata
from robosc.verification import Limits, verify
from support.cif_meaning import Meaning
from support.effort import examples
from support.random_cif import EVENTS, random_model
from support.random_cif_instances import random_instances
from support.random_cif_predicates import random_predicates

# In the form that CIF's own tool writes: a requirement became a supervisor, and guards assume its invariants.
TANK = """plant automaton tank:
  controllable c_fill;
  uncontrollable u_drain;
  disc int[0..3] level = 1;
  location:
    initial;
    marked;
    edge c_fill do level := level + 1;
    edge u_drain when level > 1 do level := level - 1;
end
supervisor automaton order:
  monitor tank.u_drain;
  location idle:
    initial;
    marked;
    edge tank.c_fill goto filled;
  location filled:
    edge tank.u_drain goto idle;
end
supervisor tank.u_drain needs tank.level != 3;
supervisor invariant tank.level != 3;
supervisor automaton sup:
  alphabet tank.c_fill;
  initial tank.level != 0;
  location:
    initial;
    marked;
    edge tank.c_fill when true;
end
"""


def system_of(text: str) -> System:
    found = check_cif(Bundle(SourceFile("m.cif", text)))
    assert found.system is not None, [str(item) for item in found.diagnostics]
    return found.system


def random_text(seed: int) -> str:
    """A random model without errors."""
    random = Random(seed)
    while True:
        text = random_model(random)
        if check_cif(Bundle(SourceFile("m.cif", text))).system is not None:
            return text


def supervisor_of(system: System) -> robosc.SystemSupervisor:
    made = robosc.synthesize(system)
    assert made.supervisor is not None, made.reason
    return made.supervisor


def behaviour(supervisor: robosc.SystemSupervisor, automata: set[str]) -> tuple[set[Any], set[Any]]:
    """The initial states and the transitions, as far as some automata show them."""
    graph = graph_of(supervisor)
    states = [
        frozenset(
            item
            for item in (*state.components.items(), *state.variables.items())
            if item[0].partition(".")[0] in automata
        )
        for state in graph.states
    ]
    return {states[number] for number in graph.initial_states}, {
        (states[source], event, states[target]) for source, event, target in graph.transitions
    }


def as_supervisor(text: str) -> str:
    return text.replace("requirement r:", "supervisor r:")


@pytest.mark.random
@pytest.mark.parametrize("limit", [automata.FORMULA_LIMIT, 0])
@pytest.mark.parametrize("seed", range(examples(8)))
def test_a_written_controlled_system_is_the_one_that_was_synthesized(
    seed: int, limit: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(automata, "FORMULA_LIMIT", limit)
    made = robosc.synthesize(system_of(random_text(seed))).supervisor
    if made is None:
        return
    names = {item.name for item in made.system.automata}
    again = supervisor_of(system_of(automata.controlled_system(made)))
    assert again.system.is_controlled
    assert (again.added, again.initial) == ((), None)
    assert again.states == made.states
    assert behaviour(again, names) == behaviour(made, names)
    assert robosc.verify(again).passed
    third = supervisor_of(system_of(automata.controlled_system(again)))
    assert behaviour(third, names) == behaviour(made, names)


@pytest.mark.random
@pytest.mark.parametrize("seed", range(examples(30)))
def test_a_written_system_of_instances_and_predicates_is_read_as_the_same(seed: int) -> None:
    # One way to begin is enough where all is marked.
    texts = random_instances(Random(seed)).replace(" in any", ""), random_predicates(Random(seed), is_open=True)
    for text in texts:
        system = check_cif(Bundle(SourceFile("m.cif", text))).system
        made = robosc.synthesize(system).supervisor if system is not None else None
        if made is not None:
            again = supervisor_of(system_of(automata.controlled_system(made)))
            assert (again.added, again.initial, again.states) == ((), None, made.states)


def explicit_graph(text: str) -> ControlledGraph:
    found = controlled_graph(Semantics(system_of(text)), {}, limit=10_000)
    assert found is not None
    return found


@pytest.mark.random
@pytest.mark.parametrize("seed", range(examples(30)))
def test_whatever_a_supervisor_does_is_found_as_the_slow_twin_says(seed: int) -> None:
    text = as_supervisor(random_text(seed))
    system = system_of(text)
    # All of it synchronizes: the supervisor as one more plant.
    whole = text.replace("supervisor r:", "plant r:")
    expected = explicit_graph(whole)
    made = robosc.synthesize(system)
    assert made.supervisor is not None
    graph = graph_of(made.supervisor)
    assert made.supervisor.states == len(graph.states) == len(expected.states)
    names = [str(item) for item in subjects(system)]
    states = [tuple({**item.components, **item.variables}[name] for name in names) for item in graph.states]
    assert set(states) == set(expected.states)
    assert len(graph.transitions) == sum(len(to) for steps in expected.steps for _, to in steps)
    # The plants alone, and all of it together on the syntax tree.
    plants, together, ranges = Semantics(plants_of(system)), Meaning(whole), Semantics(composed(system))
    harm = any(
        plants.enabled(values, event)
        and not together.targets(dict(zip(names, values, strict=True)), event, is_controllable=False)[1]
        for values in expected.states
        for event, is_controllable in EVENTS.items()
        if not is_controllable
    )
    outside = any(map(ranges.bad, expected.states))
    report = robosc.verify(made.supervisor).report
    assert (report["checks"]["safe"] == "failed") == (harm or outside), text
    if not (harm or outside):
        reaching = {number for number, state in enumerate(expected.states) if ranges.is_marked(state)}
        while True:
            more = {
                number
                for number, steps in enumerate(expected.steps)
                if any(target in reaching for _, to in steps for target in to)
            } | reaching
            if more == reaching:
                break
            reaching = more
        assert (report["checks"]["nonblocking"] == "passed") == (len(reaching) == len(expected.states))
    symbolic = verify(system, {}, Limits(0, 0, 10_000_000)).verification
    assert (str(symbolic.safe), str(symbolic.nonblocking)) == (
        report["checks"]["safe"],
        report["checks"]["nonblocking"],
    )


def plants_of(system: System) -> System:
    """The plants alone; the supervisor only watches."""
    return replace(
        system,
        automata=tuple(
            replace(item, role=Role.PLANT, monitors=item.alphabet) if item.role is Role.REQUIREMENT else item
            for item in system.automata
        ),
        is_controlled=False,
    )


def test_invariants_of_a_supervisor_keep_events_from_happening() -> None:
    system = system_of(TANK)
    graph = graph_of(supervisor_of(system))
    assert [state.variables["tank.level"] for state in graph.states] == [1, 2, 1, 0][: len(graph.states)]
    assert robosc.verify(supervisor_of(system)).passed
    # Without it the level may rise to 3, where the supervisor would have to prevent that the tank drains.
    loose = system_of(TANK.replace("supervisor invariant tank.level != 3;", "").replace("goto filled", ""))
    report = robosc.verify(supervisor_of(loose)).report
    assert report["checks"]["safe"] == "failed"
    assert report["faults"][0]["message"] == "tank.u_drain can happen against the supervisor"


def test_an_uncontrollable_event_against_an_invariant_is_found() -> None:
    system = system_of(TANK.replace("supervisor invariant tank.level != 3;", "supervisor invariant tank.level != 1;")
                       .replace("level = 1", "level = 2"))  # fmt: skip
    assert len(graph_of(supervisor_of(system)).states) == 2
    assert robosc.verify(supervisor_of(system)).report["checks"]["safe"] == "failed"
    symbolic = verify(system, {}, Limits(0, 0, 10_000_000)).verification
    assert str(symbolic.safe) == "failed"


def test_permissiveness_is_unknown() -> None:
    supervisor = supervisor_of(system_of(TANK))
    assert robosc.verify(supervisor).report["checks"]["maximally_permissive"] == "not checked"
    assert robosc.verify(supervisor, is_strict=True).status is VerificationStatus.NOT_CHECKED


def test_there_is_nothing_to_synthesize_in_modules() -> None:
    made = robosc.synthesize(system_of(TANK), is_modular=True)
    assert made.status is SynthesisStatus.UNSUPPORTED_MODEL
    assert "its supervisor already" in made.reason


def test_requirements_beside_a_supervisor_are_refused() -> None:
    found = check_cif(Bundle(SourceFile("m.cif", TANK + "requirement tank.c_fill needs tank.level < 2;")))
    assert [item.code for item in found.diagnostics] == ["cif-unsupported"]
    assert "has a supervisor already" in found.diagnostics[0].message


def test_the_core_adds_nothing() -> None:
    found = synthesize(system_of(TANK.replace("edge tank.c_fill when true", "edge tank.c_fill when tank.level < 1")))
    assert (found.added, found.initial, str(found.status)) == ((), None, "supervisor")


@pytest.fixture
def file(tmp_path: Path) -> str:
    path = tmp_path / "tank.ctrlsys.cif"
    path.write_text(TANK)
    return str(path)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["check"], "no findings"),
        (["check", "--synthesize"], "no findings"),
        (["synth"], "the supervisor is in the model (2 states), and nothing is added to it"),
        (["explore"], "2 states, 2 transitions"),
        (["verify"], "maximally permissive  not checked"),
        (["explain-synthesis"], "invariants of the supervisor exclude; for instance after tank.c_fill"),
        (["explain-synthesis", "--state", "tank.level = 2"], "tank.u_drain (uncontrollable): can happen"),
    ],
)
def test_commands(arguments: list[str], expected: str, file: str, capsys: pytest.CaptureFixture[str]) -> None:
    status = main([arguments[0], file, *arguments[1:]])
    captured = capsys.readouterr()
    assert (status, captured.err) == (0, "")
    assert expected in captured.out


def test_an_invariant_is_told_as_the_reason() -> None:
    text = TANK.replace("goto filled", "")
    asked = robosc.explain(system_of(text), event="tank.c_fill")
    assert "restricted" in str(asked)
    assert "invariants of the supervisor exclude" in str(asked)
    run = robosc.simulate(supervisor_of(system_of(text)))
    run.step("tank.c_fill")
    assert run.reasons("tank.c_fill") == (
        "it leads only to what the supervisor or the plants exclude: there tank.level != 3 does not hold",
    )


@pytest.mark.parametrize("ending", ["cif", "gen", "wmod", "rsup"])
def test_it_is_written_in_every_format(ending: str, file: str, tmp_path: Path) -> None:
    output = tmp_path / f"other.{ending}"
    assert main(["synth", file, "-o", str(output)]) == 0
    if ending == "rsup":
        assert main(["verify", str(output), file]) == 0
        return
    again = robosc.explore(robosc.load(output))
    assert again.graph is not None
    assert (len(again.graph.states), len(again.graph.transitions)) == (2, 2)
    assert main(["verify", str(output)]) == 0


@pytest.mark.parametrize("target", ["c99", "cif", "python"])
def test_targets(target: str, tmp_path: Path, file: str) -> None:
    assert main(["generate", file, "--target", target, "-o", str(tmp_path / "out")]) == 0
    if target == "python":
        names: dict[str, Any] = {"__name__": "generated"}
        (module,) = (tmp_path / "out").rglob("*.py")
        exec(compile(module.read_text(), str(module), "exec"), names)
        happened: list[str] = []
        tank = names["Supervisor"](happened=happened.append)
        assert [list(tank.run()), list(tank.run()), tank.possible()] == [["tank.c_fill"], [], ["tank.u_drain"]]
        assert tank.take("tank.u_drain")
        assert tank.possible() == ["tank.c_fill"]


SUPREMICA = """<Module Name="m" xmlns="http://waters.sourceforge.net/xsd/module">
 <EventDeclList><EventDecl Kind="CONTROLLABLE" Name="c"/><EventDecl Kind="UNCONTROLLABLE" Name="u"/></EventDeclList>
 <ComponentList>
  <SimpleComponent Kind="PLANT" Name="p"><Graph>
   <NodeList><SimpleNode Initial="true" Name="a"/><SimpleNode Name="b"/></NodeList>
   <EdgeList>
    <Edge Source="a" Target="b"><LabelBlock><SimpleIdentifier Name="c"/></LabelBlock></Edge>
    <Edge Source="a" Target="a"><LabelBlock><SimpleIdentifier Name="u"/></LabelBlock></Edge>
   </EdgeList></Graph></SimpleComponent>
  <SimpleComponent Kind="SUPERVISOR" Name="s"><Graph>
   <LabelBlock><SimpleIdentifier Name="EVENT"/></LabelBlock>
   <NodeList><SimpleNode Initial="true" Name="a"/></NodeList><EdgeList/></Graph></SimpleComponent>
 </ComponentList></Module>
"""


@pytest.mark.parametrize(("event", "is_right"), [("c", True), ("u", False)])
def test_a_module_with_a_supervisor_and_no_specification(event: str, is_right: bool, tmp_path: Path) -> None:
    path = tmp_path / "m.wmod"
    path.write_text(SUPREMICA.replace("EVENT", event))
    made = robosc.synthesize(robosc.load(path))
    assert made.supervisor is not None
    assert made.supervisor.system.is_controlled
    assert robosc.verify(made.supervisor).passed is is_right
    # A specification beside it has to be kept to, so there is something to synthesize.
    path.write_text(SUPREMICA.replace("EVENT", "c").replace('"SUPERVISOR"', '"SPEC"'))
    made = robosc.synthesize(robosc.load(path))
    assert made.supervisor is not None
    assert not made.supervisor.system.is_controlled


def test_the_role_of_a_supervisor_is_told() -> None:
    system = system_of(TANK)
    assert [system.role_of(item) for item in system.automata] == ["plant", "supervisor", "supervisor"]
    (text,) = [text for name, text in robosc.generate(system, "python").files.items() if name.endswith(".py")]  # type: ignore[union-attr]
    assert "supervisor order" in text
    assert "requirement order" not in text
