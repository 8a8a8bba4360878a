"""Names in CIF: what the specification of the output says, and what becomes of names that collide."""

import pytest

from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc.targets import generate
from robosc.targets.cif.text import KEYWORDS
from support.cif_system import CifSystem, Table
from support.cif_twin import assert_same_control, assert_same_problem
from support.models import model_of
from support.random_supervisors import CERTIFICATE


def supervisor_of(text: str, **libraries: str) -> Supervisor:
    return Supervisor(model_of(text, **libraries), Deployment.CONTROLLER, (), CERTIFICATE)


def written(text: str, **libraries: str) -> str:
    """`controller.cif` of a model, which says the same as the model."""
    supervisor = supervisor_of(text, **libraries)
    assert_same_problem(supervisor, reachable=40, others=20)
    assert_same_control(supervisor, reachable=40, others=20)
    return generate(supervisor, "cif")["controller.cif"]


PLAIN = """robot R {
    interface link use Scan from my_msgs
    datatype object Scan { near: boolean inner: Inner }
    datatype object Inner { level: integer(0..2) }
    component Arm {
        incoming message move with type: none
        outgoing message seen with type: Scan links link
        outgoing message told with type: boolean
        service call with request: none, response: none links link
        action ride with request: none, response: none, feedback: boolean links link
        behaviour {
            variable near: boolean
            variable level: integer(0..2)
            initial marked state resting {
                on response from seen do near := value.near, level := value.inner.level
                on response from told do near := value
                on feedback from ride do near := value
                transition if near goto away
            }
            state away { transition if level = 1 goto resting }
        }
    }
    requirement move needs Arm.near
}"""


def test_the_names_of_the_specification() -> None:
    text = written(PLAIN)
    assert CifSystem(text).declared_names() == set(
        """
        message_move message_move.c_trigger message_move.idle
        message_seen message_seen.u_response message_seen.i_response_near message_seen.i_response_inner_level
        message_seen.idle
        message_told message_told.u_response message_told.i_response message_told.idle
        service_call service_call.c_trigger service_call.c_reset service_call.u_response service_call.u_error
        service_call.idle service_call.wait_for_response service_call.ready service_call.error
        action_ride action_ride.c_trigger action_ride.c_reset action_ride.c_cancel action_ride.u_response
        action_ride.u_error action_ride.u_feedback action_ride.i_feedback
        action_ride.idle action_ride.executing action_ride.ready action_ride.error
        component_Arm component_Arm.c_tau_1 component_Arm.c_tau_2 component_Arm.v_near component_Arm.v_level
        component_Arm.resting component_Arm.away
        """.split()
    )


def test_the_table_maps_every_name_back() -> None:
    table = Table(written(PLAIN))
    assert table.events["component_Arm.c_tau_2"] == "Arm.tau_2"
    assert table.events["action_ride.u_feedback"] == "ride.feedback"
    assert table.automata["service_call"] == "service call"
    assert table.locations["service_call", "wait_for_response"] == "waiting"
    assert table.variables["component_Arm", "v_level"] == ("level", 0)


def test_equal_literals_are_told_apart_and_others_are_left_alone() -> None:
    text = written(
        """robot R {
        datatype enum Front from double to { value > 1 -> near  value > 2 -> far default -> nothing }
        datatype enum Rear from double to { value > 1 -> near  default -> clear }
        component C {
            incoming message go with type: none
            outgoing message front with type: Front
            outgoing message rear with type: Rear
            behaviour {
                variable front: Front
                variable rear: Rear
                initial marked state far {
                    on response from front do front := value
                    on response from rear do rear := if front = nothing then value else Rear.near
                }
            }
        }
        requirement go needs C.front = near and C.rear = near or C.front = far or C.rear = clear
    }"""
    )
    assert "enum Front = Front_near, Front_far, nothing;" in text
    assert "enum Rear = Rear_near, clear;" in text
    assert "(component_C.v_front = Front_near and component_C.v_rear = Rear_near)" in text


def test_names_that_are_something_else_in_cif() -> None:
    """Keywords, and names that would hide, or be taken for, another one."""
    text = written(
        """robot R {
        datatype enum sup from double to { value > 1 -> tau  value > 2 -> message_go
            value > 3 -> v_level default -> Big }
        datatype enum bdd_1 from double to { value > 1 -> component_move default -> sup_tau }
        component move {
            incoming message ^marked with type: none
            incoming message move with type: double
            outgoing message go with type: sup
            outgoing message stop with type: bdd_1
            behaviour {
                variable level: sup
                variable plant: bdd_1
                initial marked state v_level {
                    on response from go do level := value
                    on response from stop do plant := value goto alg
                }
                marked state alg { on request to ^marked goto message_go }
                marked state message_go { transition if level = tau goto c_tau_1 }
                marked state c_tau_1 { on request to move goto ^message }
                marked state ^message { }
                marked state sup { }
            }
        }
        requirement move needs move.level = message_go or move.level = v_level or move.plant = component_move
        requirement ^marked needs move.level != Big and !(move.plant = sup_tau) and move.alg
        provide move with 1.0 if move.alg
    }"""
    )
    assert "plant automaton message_marked:" in text  # Only whole words are escaped.
    assert "  location $alg:" in text
    assert "  location message:" in text or "  location message;" in text
    assert "  location v_level_2:" in text
    assert "  location message_go_2:" in text
    assert "enum sup_2 = " in text


def test_imported_types_keep_their_library() -> None:
    library = """library Lib {
        datatype enum Kind from double to { value > 1 -> small default -> large }
        component Part {
            outgoing message seen with type: Kind
            behaviour { variable kind: Kind initial marked state a { on response from seen do kind := value } }
        }
    }"""
    text = written(
        """robot R {
            datatype enum Lib_Kind from double to { value > 1 -> small default -> big }
            component One from Lib import Part
            component C {
                incoming message go with type: none
                outgoing message told with type: Lib_Kind
                behaviour { variable kind: Lib_Kind initial marked state a { on response from told do kind := value } }
            }
            requirement go needs C.kind = big and One.kind = large
        }""",
        lib=library,
    )
    assert "enum Lib_Kind = Lib_Kind_small, " in text
    assert "enum Lib_Kind_2 = Lib_Kind_2_small, " in text
    assert "plant automaton component_One:" in text


@pytest.mark.parametrize("word", sorted(KEYWORDS & set("alg disc edge goto tau time end plant initial sqrt".split())))
def test_keywords_as_states(word: str) -> None:
    text = written(
        f"""robot R {{ component C {{
            incoming message go with type: none
            behaviour {{ initial marked state first {{ on request to go goto ^{word} }} marked state ^{word} {{ }} }}
        }}
        requirement go needs !C.^{word} }}"""
    )
    assert f"requirement component_C.${word} disables message_go.c_trigger;" in text
