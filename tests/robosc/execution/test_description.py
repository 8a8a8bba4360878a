"""Tests of an executor's prior knowledge of a system."""

from robosc.execution.runtime.protocol import CommunicationInfo
from support.execution import example_system, system_of

ROBOT = """
robot Robot {
  interface trigger use Trigger from std_srvs
  datatype object Empty { }
  component A {
    service ask with identifier: "/ask", request: none, response: Empty links trigger
    behaviour {
      transition if A.two goto one
      initial marked state one { transition goto one  transition }
      marked state two { }
      marked state three { transition goto two }
    }
  }
  component B { behaviour { initial marked state one { transition goto two }  marked state two { } } }
  component C { behaviour { initial marked state one { }  marked state two { } } }
  requirement ask needs A.one and !(A.two or A.three)
  requirement B.one or C.two disables ask
}
"""


def test_communications_with_the_size_of_their_requirements() -> None:
    (ask,) = system_of(ROBOT).description.communications
    assert ask == CommunicationInfo("ask", "A", "service", "/ask", "std_srvs", "Trigger", 2, 5)
    system = system_of(ROBOT)
    assert len(system.conjuncts("ask")) == 5
    assert len(system.requirements("ask")) == 2


def test_silent_events_without_taus_that_change_nothing() -> None:
    description = system_of(ROBOT).description
    assert description.resets == ("ask.reset",)
    assert description.taus == ("A.tau_1", "A.tau_4", "B.tau_1")


def test_the_bound_on_silent_steps() -> None:
    # A and B have taus: 3 times 2 states, so 5 steps; a reset in between, and 5 steps again.
    assert system_of(ROBOT).description.silent_bound == 5 * 2 + 1


def test_the_examples_bound() -> None:
    assert example_system("line_follower/line_follower").description.silent_bound == 1
    assert example_system("maze_solver/maze_solver").description.silent_bound == 0
