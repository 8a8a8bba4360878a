"""Models whose supervisors' conditions are written down in words.

`python tests/robosc/supervisor/test_golden.py` writes them anew; look at what has changed before it is kept.
"""

import sys
from functools import cache
from itertools import product
from pathlib import Path

import pytest

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[2]))

from robosc.automata import System, to_automata
from robosc.certification import make_supervisor
from robosc.conditions import summary
from robosc.conditions.rendering import Formulas, in_words
from robosc.conditions.summary import added_lines, added_texts, summary_json
from robosc.expressions import Expression, StateTest, Value, VariableRead, leaves
from robosc.expressions.evaluate import evaluate as evaluate_expression
from robosc.model.check import check
from robosc.supervisor import DecisionDiagram, Supervisor
from robosc.supervisor.diagram import Domains, Subject, diagram_domains, evaluate
from robosc.synthesis import synthesize
from robosc.synthesis.engines import installed_engines
from support.models import bundle_of

FOLDER = Path(__file__).parent / "golden"
MODELS = sorted(FOLDER.glob("*.rscd"))


@cache
def made(path: Path) -> tuple[Supervisor, System]:
    supervisor = make_supervisor(bundle_of(path.read_text(encoding="utf-8")), engine="autoref").supervisor
    assert supervisor is not None
    return supervisor, to_automata(supervisor.model, supervisor.deployment)


@pytest.fixture(autouse=True)
def _searched_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cache with which anything that is reported in several ways is searched for once."""
    monkeypatch.setattr(summary, "added_formulas", cache(summary.added_formulas))


def words(supervisor: Supervisor, system: System) -> str:
    return "".join(f"{line}\n" for line in added_lines(supervisor, system))


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_conditions_in_words(path: Path) -> None:
    """They are those of the golden text, mean what is stored, and are the same whichever engine is used.

    One test, because to make the supervisor takes longest.
    """
    supervisor, system = made(path)
    for engine in set(installed_engines()) - {"autoref"}:
        assert synthesize(system, engine=engine).added == supervisor.added, engine
    assert words(supervisor, system) == path.with_suffix(".txt").read_text(encoding="utf-8")
    what_is_printed_is_what_is_stored(path, supervisor, system)


def test_there_are_models_of_every_kind() -> None:
    texts = {path.stem: path.with_suffix(".txt").read_text(encoding="utf-8") for path in MODELS}
    assert len(texts) >= 10
    assert "LidarSensor.safe_distance and not EmergencyStop.stopped" in texts["safe_distance"]
    together = "".join(texts.values())
    for part in (" <= ", " >= ", " != ", " or ", "false", "nothing", "decision diagram", ".reset", ".cancel", ".tau_"):
        assert part in together, part


def same_everywhere(system: System, formula: Expression, diagram: DecisionDiagram) -> None:
    """Every valuation of the places that either names: the formula is true where the diagram is."""
    domains = diagram_domains(system)
    named = [(node.automaton, node.variable) for node in diagram.nodes]
    for leaf in leaves(formula):
        if isinstance(leaf, StateTest):
            named.append((leaf.component, None))
        if isinstance(leaf, VariableRead):
            named.append((leaf.component, leaf.variable))
    places: list[Subject] = list(dict.fromkeys(named))
    for indices in product(*(range(len(domains[place])) for place in places)):
        state = dict(zip(places, indices, strict=True))
        assert _plain(formula, state, domains) is _holds(diagram, state)


def _plain(formula: Expression, state: dict[Subject, int], domains: Domains) -> object:
    def value(automaton: str, variable: str | None) -> Value:
        return domains[automaton, variable][state[automaton, variable]]

    return evaluate_expression(formula, value, lambda automaton: str(value(automaton, None)))


def _holds(diagram: DecisionDiagram, state: dict[Subject, int]) -> bool:
    return evaluate(diagram, lambda automaton, variable: state[automaton, variable])


def test_long_conditions_are_given_by_their_size(monkeypatch: pytest.MonkeyPatch) -> None:
    supervisor, system = made(FOLDER / "parity.rscd")
    monkeypatch.setattr("robosc.conditions.summary._NODES", 10)
    assert words(supervisor, system).splitlines()[-1] == (
        "shut.request    a decision diagram of 11 nodes; --json lists its nodes"
    )
    diagrams = summary_json(supervisor)["diagrams"]
    assert isinstance(diagrams, dict)
    assert diagrams["shut.request"][0] == {"node": 1, "cases": [{"if": "S1.off", "then": 3}], "else": 2}
    assert diagrams["shut.request"][-1] == {"node": 11, "cases": [{"if": "S6.off", "then": True}], "else": False}


def what_is_printed_is_what_is_stored(path: Path, supervisor: Supervisor, system: System) -> None:
    """Each formula, put into the model as a requirement where it can be, means the stored diagram."""
    text = path.read_text(encoding="utf-8")
    request = next(item.name for item in supervisor.model.communications if item.request is not None)
    diagrams = summary_json(supervisor)["diagrams"]
    assert isinstance(diagrams, dict)
    for event, words in added_texts(supervisor, system).items():
        diagram = supervisor.added_condition(event) or DecisionDiagram((), 1)
        if event in diagrams:
            assert words == f"a decision diagram of {len(diagram.nodes)} nodes"
            assert len(diagrams[event]) == len(diagram.nodes)
            continue
        if any(" " in node.automaton for node in diagram.nodes):
            # No requirement can name where a service stands.
            formula = Formulas(diagram_domains(system)).formula(diagram)
            assert formula is not None
            assert in_words(formula, ()) == words
            same_everywhere(system, formula, diagram)
            continue
        needs = f"requirement {request} needs {words.replace('not ', '!')}\n}}"
        model = check(bundle_of(text.rstrip().removesuffix("}") + needs)).model_or_raise()
        same_everywhere(system, model.requirements[-1].expression, diagram)


if __name__ == "__main__":
    for model in MODELS:
        model.with_suffix(".txt").write_text(words(*made(model)), encoding="utf-8")
