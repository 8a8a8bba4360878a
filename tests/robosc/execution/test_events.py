"""Semantics 3.1 and 3.3: batches, silent steps, events that the state cannot accept."""

from functools import partial
from typing import Any

import pytest

from robosc.execution.runtime.livelock import LivelockDetector, LivelockError
from robosc.execution.runtime.protocol import Reading
from robosc.execution.runtime.runner import Status
from support.execution import Bench, bench, system_of

SCANNER = """
robot Scanner {
  interface scan use LaserScan from sensor_msgs
  datatype object Scan { ranges: array(double) }
  datatype enum Front from Scan to { value.ranges[0] > 1.0 -> free default -> wall }
  datatype enum Side from Scan to { value.ranges[1] > 1.0 -> open default -> closed }
  component Sensor {
    outgoing message front with identifier: "/scan", type: Front links scan
    outgoing message side with identifier: "/scan", type: Side links scan
    outgoing message tick with type: none
    behaviour {
      variable f: Front = wall
      variable s: Side = closed
      on response from front do f := value
      on response from side do s := value
      initial marked state shut { transition if f = free and s = closed goto half  transition if f = free goto full }
      marked state half { transition if s = open goto full  transition if f = wall goto shut }
      marked state full { transition if f = wall goto shut }
    }
  }
  component Wheels {
    incoming message go with type: none
    behaviour { initial marked state on_ground { on request to go } }
  }
  requirement go needs Sensor.full
}
"""


def scan(*ranges: Any) -> dict[str, Any]:
    return {"ranges": list(ranges)}


def test_one_message_is_one_batch_in_source_order_without_a_silent_step_between() -> None:
    b = bench(SCANNER)
    b.receive("/scan", scan(2.0, 2.0))
    # A silent step after the first event would have gone through `half`.
    assert b.events == ["front.response", "side.response", "Sensor.tau_2"]
    assert b.state("Sensor") == "full"


def test_a_batch_is_followed_by_its_silent_steps_before_any_decision() -> None:
    b = bench(SCANNER, every="event")
    assert b.receive("/scan", scan(2.0, 0.0)) == []
    assert b.receive("/scan", scan(2.0, 2.0)) == [("publish", "go", None)]
    # The scan that closes the way is felt before the request that it forbids could go out.
    assert b.receive("/scan", scan(0.0, 2.0)) == []
    assert b.state("Sensor") == "shut"


def test_all_updates_of_an_event_read_the_old_state() -> None:
    b = bench(
        """
        robot Swap {
          component A {
            outgoing message swap with type: none
            behaviour {
              variable x: integer = 1
              variable y: integer = 2
              on response from swap do x := y, y := x
              initial marked state only { }
            }
          }
          component B {
            behaviour {
              variable z: integer
              on response from swap do z := A.x
              initial marked state only { }
            }
          }
        }
        """
    )
    b.receive("swap")
    assert b.system.state() == {
        "A": {"state": "only", "variables": {"x": 2, "y": 1}},
        "B": {"state": "only", "variables": {"z": 1}},
    }


def test_silent_steps_run_at_the_start_in_source_order() -> None:
    b = bench(
        """
        robot Start {
          component A { behaviour {
            initial marked state one { transition if B.two goto two }  marked state two { } } }
          component B { behaviour {
            initial marked state one { transition goto two }  marked state two { } } }
          component C { behaviour {
            initial marked state one { transition goto two }  marked state two { } } }
        }
        """
    )
    # A's tau comes first in the text, so it goes as soon as B allows it, before C's.
    assert b.events == ["B.tau_1", "A.tau_1", "C.tau_1"]


def test_a_tau_that_changes_nothing_is_not_taken() -> None:
    b = bench(
        """
        robot Still {
          component A {
            outgoing message m with type: none
            behaviour {
              transition if true goto home
              initial marked state home { transition goto home  transition if true }
              marked state away { }
              on response from m goto away
            }
          }
        }
        """
    )
    assert b.events == []
    b.receive("m")
    assert b.events == ["m.response", "A.tau_1"]
    assert b.state("A") == "home"


def test_only_what_changes_the_state_counts_as_a_change() -> None:
    """A stable state that stays is not judged again."""
    system = system_of(
        """
        robot Still {
          component A {
            outgoing message m with type: none
            outgoing message n with type: none
            behaviour {
              initial marked state home { on response from m  on response from n goto away }
              marked state away { }
            }
          }
        }
        """
    )
    counts = [system.changes]
    for event in ("m.response", "n.response", "n.response"):
        assert system.step(event) in ((), None)
        counts.append(system.changes)
    system.restart()
    assert [*counts, system.changes] == [0, 0, 1, 1, 2]


def test_the_states_own_transition_comes_before_the_behaviours() -> None:
    b = bench(
        """
        robot Own {
          component A {
            outgoing message m with type: none
            behaviour {
              on response from m goto general
              initial marked state start { on response from m goto special }
              marked state special { }
              marked state general { }
            }
          }
        }
        """
    )
    b.receive("m")
    assert b.state("A") == "special"
    b.receive("m")
    assert b.state("A") == "general"


LIVELOCK = """
robot Livelock {
  component A {
    outgoing message go with type: none
    behaviour {
      initial marked state calm { on response from go goto ping }
      marked state ping { transition goto pong }
      marked state pong { transition goto ping }
    }
  }
}
"""


def test_a_run_that_does_not_end_is_a_fault() -> None:
    b = bench(LIVELOCK)
    b.receive("go")
    assert b.status() is Status.STOPPED
    assert b.executor.counters.faults == 1
    assert "do not end" in b.executor.reasons[0]


def test_a_restart_ends_a_livelock_for_now() -> None:
    b = bench(LIVELOCK)
    b.receive("go")
    b.executor.restart()
    assert b.status() is Status.RUNNING
    assert b.state("A") == "calm"


@pytest.mark.parametrize("length", [1, 2, 7, 8, 9, 100])
@pytest.mark.parametrize("lead", [0, 1, 30])
def test_a_repeated_state_is_found_soon(length: int, lead: int) -> None:
    detector = LivelockDetector(10**9)
    with pytest.raises(LivelockError):
        for step in range(8 + 4 * (lead + length) + 8):
            state = step if step < lead else lead + (step - lead) % length
            detector.check(partial(int, state), "A.tau_1")


def test_a_long_run_without_repetition_goes_on_up_to_the_bound() -> None:
    detector = LivelockDetector(500)
    for step in range(500):
        detector.check(partial(int, step), "A.tau_1")
    with pytest.raises(LivelockError):
        detector.check(partial(int, 500), "A.tau_1")


def test_a_long_run_that_ends_is_no_fault() -> None:
    states = "\n".join(f"marked state s{n} {{ transition goto s{n + 1} }}" for n in range(200))
    b = bench(
        f"""
        robot Long {{
          component A {{
            outgoing message go with type: none
            behaviour {{
              initial marked state start {{ on response from go goto s0 }} {states} marked state s200 {{ }}
            }}
          }}
        }}
        """
    )
    b.receive("go")
    assert b.state("A") == "s200"
    assert b.executor.counters.faults == 0


class Picky:
    """A system that accepts no `m.response`."""

    def __init__(self, system: Any) -> None:
        self._system = system

    def __getattr__(self, name: str) -> Any:
        return getattr(self._system, name)

    def step(self, event: str, reading: Reading | None = None) -> Any:
        return None if event == "m.response" else self._system.step(event, reading)


PLAIN = """
robot Plain {
  component A {
    outgoing message m with type: none
    behaviour { initial marked state a { on response from m goto b }  marked state b { } }
  }
}
"""


def test_an_event_that_the_state_cannot_accept_is_unexpected_and_changes_nothing() -> None:
    b = Bench(Picky(system_of(PLAIN)))
    b.receive("m")
    assert b.state("A") == "a"
    assert b.executor.counters.unexpected == 1
    assert [entry["event"] for entry in b.entries("unexpected")] == ["m.response"]
    assert b.status() is Status.RUNNING


def test_a_message_that_the_model_does_not_have_is_unexpected() -> None:
    b = bench(PLAIN)
    b.receive("/nobody")
    assert b.executor.counters.unexpected == 1


def test_nothing_happens_before_the_start() -> None:
    b = Bench(system_of(PLAIN), start=False)
    assert b.status() is Status.NEW
    b.receive("m")
    assert b.tick() == []
    assert b.events == []
    b.executor.start()
    b.executor.start()
    b.receive("m")
    assert b.events == ["m.response"]
