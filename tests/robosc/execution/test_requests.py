"""Semantics 3.5: when requests are issued, and with which data."""

from robosc.execution.interpreter import InterpretedSystem
from robosc.supervisor import AddedCondition, DecisionDiagram, DecisionNode
from support.execution import Bench, bench, example_system, supervisor_of, system_of
from support.models import model_of

THREE = """
robot Three {
  component A {
    incoming message a with type: none
    incoming message b with type: none
    incoming message c with type: none
    outgoing message poke with type: none
  }
}
"""


def test_at_most_one_request_a_period() -> None:
    b = bench(THREE)
    assert [b.tick() for _ in range(4)] == [[("publish", name, None)] for name in ("a", "b", "c", "a")]


def test_no_decision_comes_with_a_batch_unless_the_settings_say_so() -> None:
    assert bench(THREE).receive("poke") == []
    b = bench(THREE, every="event")
    assert b.receive("poke") == [("publish", "a", None)]
    assert b.tick() == [("publish", "b", None)]


def test_the_period_is_a_setting_and_100_ms_by_default() -> None:
    assert bench(THREE).executor.settings.period_s == 0.1
    assert bench(THREE, period_s=0.02).executor.settings.period_s == 0.02


def test_policies_are_settings() -> None:
    b = bench(THREE, policy="priority", priority=("b",))
    assert [sent[1] for sent in b.tick(3)] == ["b", "b", "b"]
    left, right = (bench(THREE, policy="random", seed=3) for _ in range(2))
    assert left.tick(30) == right.tick(30)


def test_data_is_chosen_in_the_state_before_the_request() -> None:
    b = bench(
        """
        robot Data {
          component A {
            incoming message say with type: integer
            outgoing message bump with type: none
            behaviour {
              variable n: integer(0..9)
              on response from bump do n := n + 1
              initial marked state even { on request to say goto odd }
              marked state odd { on request to say goto even }
            }
          }
          provide say with A.n if A.even
          provide say with 100 if A.n > 1
          provide say with -1 if A.n > 0
        }
        """
    )
    said = []
    for _ in range(6):
        said += [sent[2] for sent in b.tick()]
        b.receive("bump")
    # Odd with n = 1: the second statement is not true, the third is; odd with more: the second comes first.
    assert said == [0, -1, 2, 100, 4, 100]


def test_without_a_true_statement_the_middlewares_default_goes_out() -> None:
    b = bench("robot D { component A { incoming message say with type: integer } provide say with 1 if false }")
    assert b.tick() == [("publish", "say", None)]


def test_the_maze_solver_turns_and_waits() -> None:
    b = Bench(example_system("maze_solver/maze_solver"))
    assert b.tick(3) == []
    b.receive("/scan", {"ranges": [0.3] * 360})
    assert [sent[1] for sent in b.tick(3)] == ["rotate_left"]
    b.receive("/rotate_done")
    b.receive("/scan", {"ranges": [2.0] * 360})
    assert [sent[1:] for sent in b.tick(2)] == [("move", {"linear": {"x": 0.1}})] * 2
    # A way to the right that is walled behind: turn right, and do not drive on while turning.
    ranges = [2.0] * 360
    ranges[225] = 0.1
    assert b.receive("/scan", {"ranges": ranges}) == [("default", "/cmd_vel")]
    assert b.tick(2) == [("publish", "rotate_right", 90)]


def test_what_the_supervisor_adds_is_obeyed() -> None:
    text = """
    robot Added {
      component A {
        incoming message go with type: none
        outgoing message level with type: integer(0..5)
        behaviour {
          variable n: integer(0..5)
          on response from level do n := value
          initial marked state one { on request to go goto two }
          marked state two { on request to go goto one }
        }
      }
      requirement go needs A.n >= 0
    }
    """
    # go only while n is 2 or 3 in state one, anything in state two.
    diagram = DecisionDiagram(
        (DecisionNode("A", "n", (0, 2, 4), (0, 1, 0)), DecisionNode("A", None, (0, 1), (2, 1))), 3
    )
    system = InterpretedSystem(supervisor_of(model_of(text), added=(AddedCondition("go.request", diagram),)))
    b = Bench(system)
    enabled = []
    for level in range(6):
        b.receive("level", level)
        enabled.append(system.enabled("go.request"))
    assert enabled == [False, False, True, True, False, False]
    b.receive("level", 3)
    b.tick()
    assert b.state("A") == "two"
    b.receive("level", 0)
    assert system.enabled("go.request")


def test_a_request_is_blocked_where_a_component_that_knows_it_writes_no_transition() -> None:
    system = system_of(
        """
        robot Blocked {
          component A { incoming message go with type: none
            behaviour { initial marked state a { on request to go goto b }  marked state b { } } }
          component B { behaviour { initial marked state b { on request to go } } }
        }
        """
    )
    assert system.enabled("go.request")
    assert system.step("go.request") == ()
    assert not system.enabled("go.request")
    assert system.step("go.request") is None
