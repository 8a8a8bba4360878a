"""Small robots whose supervisor was worked out by hand: from text to controlled system.

Each graph lists, for every state of the controlled system, its events and where they lead. A state is the
components' states, the synthesis variables and the locations of services and actions, in that order.
"""

from collections.abc import Callable

import pytest

from robosc.automata import System, to_automata
from robosc.automata.compile import State
from robosc.exploration import explore
from robosc.model.structure import Deployment, Model
from robosc.supervisor.predicates import state_predicates
from robosc.synthesis import SynthesisStatus, synthesize
from robosc.verification import CheckOutcome, ExplicitSupervisor, synthesize_explicit, verify_explicitly
from support.models import model_of

type Graph = dict[str, dict[str, str]]

ENGINES = ("cudd", "oxidd", "autoref")
CONTROLLER, LAYER = Deployment.CONTROLLER, Deployment.LAYER


def _model(text: str) -> Model:
    """The checked model of a robot's body; `hear a, b` and `say a, b` declare messages without data."""
    words = {"hear": "outgoing", "say": "incoming"}
    lines: list[str] = []
    for line in text.splitlines():
        word, _, names = line.strip().partition(" ")
        if word in words:
            lines.extend(f"{words[word]} message {name} with type: none" for name in names.split(", "))
        else:
            lines.append(line)
    body = "\n".join(lines)
    return model_of(f"robot Hand {{\n{body}\n}}\n")


def _synthesize(system: System) -> ExplicitSupervisor:
    supervisor = synthesize_explicit(system, limit=1000)
    assert supervisor is not None
    for engine in ENGINES:
        assert (synthesize(system, engine=engine).status is SynthesisStatus.EMPTY) == supervisor.is_empty
    return supervisor


def _graph(text: str, deployment: Deployment = CONTROLLER) -> Graph:
    """The controlled system as {state: {event: states}}, verified on the way."""
    model = _model(text)
    system = to_automata(model, deployment)
    supervisor = _synthesize(system)

    def condition(event: str) -> Callable[[State], bool]:
        return lambda at: supervisor.allows(at, event)

    added = {event.name: condition(event.name) for event in system.events if event.is_controllable}
    found = verify_explicitly(system, added)
    assert {found.safe, found.controllable, found.nonblocking, found.maximally_permissive} == {CheckOutcome.PASSED}
    graph = explore(system, added, model)
    for engine in ENGINES:
        symbolic = state_predicates(system, synthesize(system, engine=engine).added)
        assert explore(system, symbolic, model) == graph
    names = [
        " ".join(
            str(value) for values in (item.components, item.variables, item.communications) for value in values.values()
        )
        for item in graph.states
    ]
    result: Graph = {name: {} for name in names}
    for source, event, target in graph.transitions:
        row = result[names[source]]
        row[event] = f"{row[event]} | {names[target]}" if event in row else names[target]
    return result


def test_a_request_that_leads_to_a_blocked_state() -> None:
    # Folding the arm with a full gripper, or gripping with the arm folded, leaves neither of them a way back.
    graph = _graph("""
        component Gripper {
            say grip, release
            behaviour {
                initial marked state empty { on request to grip goto full }
                state full { on request to release goto empty }
            }
        }
        component Arm {
            say fold, unfold
            behaviour {
                initial marked state out { on request to fold goto folded }
                state folded { on request to unfold goto out }
            }
        }
        requirement unfold needs Gripper.empty
        requirement release needs Arm.out
    """)
    assert graph == {
        "empty out": {"grip.request": "full out", "fold.request": "empty folded"},
        "full out": {"release.request": "empty out"},
        "empty folded": {"unfold.request": "empty out"},
    }


def test_a_request_after_which_an_uncontrollable_event_could_follow() -> None:
    # Near the edge the robot may fall at any moment, and `lift` is never allowed; retreating could come too late.
    graph = _graph("""
        component Base {
            say approach, retreat, turn, lift
            hear fell
            behaviour {
                initial marked state middle { on request to approach goto edge  on request to turn }
                state edge { on request to retreat goto middle  on response from fell goto fallen }
                state fallen { on request to lift goto middle }
            }
        }
        requirement lift needs Base.middle
    """)
    assert graph == {"middle": {"fell.response": "middle", "turn.request": "middle"}}


def test_a_request_blocked_by_the_behaviours_state_alone() -> None:
    graph = _graph("""
        component Lock {
            say unlock, secure
            behaviour {
                on request to secure goto shut
                initial marked state shut { on request to unlock goto open }
                marked state open { }
            }
        }
    """)
    assert graph == {
        "shut": {"secure.request": "shut", "unlock.request": "open"},
        "open": {"secure.request": "shut"},
    }


def test_a_bounded_counter() -> None:
    # Each request is answered by a part that falls into the tray, so the third may not be asked for
    # before the tray is emptied. No requirement says so: the range does.
    graph = _graph("""
        component Tray {
            say feed, lamp
            hear part, emptied
            behaviour {
                variable n: integer(0..2)
                initial marked state ready {
                    on request to feed goto waiting
                    on response from emptied do n := 0
                }
                state waiting { on response from part do n := n + 1 goto ready }
            }
        }
        requirement lamp needs Tray.n = 2
    """)
    assert graph == {
        "ready 0": {"feed.request": "waiting 0", "part.response": "ready 0", "emptied.response": "ready 0"},
        "waiting 0": {"part.response": "ready 1", "emptied.response": "waiting 0"},
        "ready 1": {"feed.request": "waiting 1", "part.response": "ready 1", "emptied.response": "ready 0"},
        "waiting 1": {"part.response": "ready 2", "emptied.response": "waiting 1"},
        "ready 2": {"lamp.request": "ready 2", "part.response": "ready 2", "emptied.response": "ready 0"},
    }


def test_a_tau_that_would_block_is_forbidden() -> None:
    graph = _graph("""
        component Mode {
            say stop, repair
            behaviour {
                initial marked state manual { transition goto automatic }
                marked state automatic { transition goto broken  on request to stop goto manual }
                state broken { on request to repair goto manual }
            }
        }
        requirement repair needs Mode.manual
    """)
    assert graph == {"manual": {"Mode.tau_1": "automatic"}, "automatic": {"stop.request": "manual"}}


def test_a_service_and_what_waits_for_it() -> None:
    graph = _graph("""
        interface trigger use Trigger from std_srvs
        component Arm {
            service home with request: none, response: none links trigger
            say move
            behaviour {
                initial marked state lost { on response from home goto found }
                marked state found { }
            }
        }
        requirement move needs Arm.found
    """)
    assert graph == {
        "lost idle": {"home.request": "lost waiting"},
        "lost waiting": {"home.response": "found ready", "home.error": "lost failed"},
        "lost failed": {"home.reset": "lost idle"},
        "found ready": {"home.reset": "found idle", "move.request": "found ready"},
        "found idle": {"home.request": "found waiting", "move.request": "found idle"},
        "found waiting": {
            "home.response": "found ready",
            "home.error": "found failed",
            "move.request": "found waiting",
        },
        "found failed": {"home.reset": "found idle", "move.request": "found failed"},
    }


ACTION = """
    interface walk use Walk from walking
    component Legs {
        action go with request: none, response: none, feedback: none links walk
    }
"""

HOUSE = f"""
    {ACTION}
    component Door {{
        hear knock, shut
        behaviour {{
            on response from knock goto open
            on response from shut goto closed
            initial marked state closed {{ }}
            marked state open {{ }}
        }}
    }}
    component Light {{
        hear dusk, dawn
        behaviour {{
            on response from dusk goto off
            on response from dawn goto on_
            initial marked state on_ {{ }}
            marked state off {{ }}
        }}
    }}
"""


def _where(graph: Graph, event: str) -> set[str]:
    return {state for state, row in graph.items() if event in row}


def _places(doors: str, location: str, lights: str = "on_ off") -> set[str]:
    return {f"{door} {light} {location}" for door in doors.split() for light in lights.split()}


def test_the_whole_graph_of_an_action_with_a_requirement() -> None:
    graph = _graph(f"""
        {ACTION}
        component Door {{
            hear knock, shut
            behaviour {{
                initial marked state closed {{ on response from knock goto open }}
                marked state open {{ on response from shut goto closed }}
            }}
        }}
        requirement go needs Door.open
    """)

    def row(location: str, **events: str) -> dict[str, str]:
        door = {"knock.response": f"open {location}", "shut.response": f"closed {location}"}
        return door | {f"go.{kind}": target for kind, target in events.items()}

    assert graph == {
        "closed idle": row("idle"),
        "open idle": row("idle", request="open executing"),
        "open executing": row("executing", response="open ready", error="open failed", feedback="open executing"),
        "closed executing": row(
            "executing",
            response="closed ready",
            error="closed failed",
            feedback="closed executing",
            cancel="closed idle",
        ),
        "open ready": row("ready", reset="open idle"),
        "open failed": row("failed", reset="open idle"),
        "closed ready": row("ready", reset="closed idle"),
        "closed failed": row("failed", reset="closed idle"),
    }


@pytest.mark.parametrize(
    ("requirement", "deployment", "requested", "cancelled"),
    [
        pytest.param("requirement go needs Door.open", CONTROLLER, "open", "closed", id="needs"),
        pytest.param("requirement !Door.open disables {go}", CONTROLLER, "open", "closed", id="disables-negation"),
        pytest.param("requirement Door.open disables go", CONTROLLER, "closed", "open", id="disables"),
        pytest.param("", CONTROLLER, "open closed", "open closed", id="no-requirement"),
        pytest.param("requirement go needs Door.open", LAYER, "open", "open closed", id="layer"),
    ],
)
def test_cancel_is_allowed_where_the_requirement_does_not_hold(
    requirement: str, deployment: Deployment, requested: str, cancelled: str
) -> None:
    graph = _graph(HOUSE + requirement, deployment)
    assert _where(graph, "go.request") == _places(requested, "idle")
    assert _where(graph, "go.cancel") == _places(cancelled, "executing")


def test_cancel_of_several_is_allowed_where_one_of_them_does_not_hold() -> None:
    graph = _graph(HOUSE + "requirement go needs Door.open  requirement Light.on_ disables go")
    assert _where(graph, "go.request") == _places("open", "idle", "off")
    everywhere, kept = _places("open closed", "executing"), _places("open", "executing", "off")
    assert _where(graph, "go.cancel") == everywhere - kept


def test_cancel_of_unknown_requirements_is_allowed() -> None:
    graph = _graph(f"""
        {ACTION}
        component Counter {{
            hear tick
            behaviour {{
                variable n: integer(0..1) = 1
                initial marked state c {{ on response from tick do n := 0 }}
            }}
        }}
        requirement go needs 1 / Counter.n > 0
    """)
    assert _where(graph, "go.request") == {"c 1 idle"}
    assert _where(graph, "go.cancel") == {"c 0 executing"}


def test_in_a_layer_a_cancel_that_leads_into_trouble_forbids_the_request() -> None:
    text = f"""
        {ACTION}
        component Lift {{
            say crank
            behaviour {{
                initial marked state down {{ on request to go goto up }}
                state up {{
                    on cancel to go goto stuck
                    on response from go goto down
                    on error from go goto down
                }}
                state stuck {{ on request to crank goto down }}
            }}
        }}
        requirement crank needs Lift.down
    """
    assert set(_graph(text)) == {"down idle", "up executing", "down ready", "down failed"}
    assert "go.cancel" not in _graph(text)["up executing"]
    assert _graph(text, LAYER) == {"down idle": {}}


def test_what_the_environment_alone_can_ruin_has_no_supervisor() -> None:
    model = _model("""
        component Glass {
            hear drop
            say fix
            behaviour {
                initial marked state whole { on response from drop goto broken }
                state broken { on request to fix goto whole }
            }
        }
        requirement fix needs Glass.whole
    """)
    assert _synthesize(to_automata(model, CONTROLLER)).is_empty


def test_code_only_variables_split_no_states() -> None:
    graph = _graph("""
        component Counter {
            hear tick
            behaviour {
                variable n: integer
                initial marked state c { on response from tick do n := n + 1 }
            }
        }
    """)
    assert graph == {"c": {"tick.response": "c"}}


def test_state_tuples_follow_the_plants() -> None:
    supervisor = _synthesize(to_automata(_model(HOUSE), CONTROLLER))
    initial: State = ("idle", "idle", "idle", "closed", "idle", "idle", "on_")
    assert supervisor.allows(initial, "go.request")
    assert not supervisor.allows(initial, "go.cancel")
