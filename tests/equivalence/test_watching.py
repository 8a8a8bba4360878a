"""The interpreter that looks again only at what may have changed finds what one finds that looks at everything."""

from random import Random

import msgspec
from hypothesis import given, settings
from hypothesis import strategies as st

from robosc.execution.interpreter import InterpretedSystem, WatchingSystem
from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from support.effort import examples
from support.equivalence.python_targets import observe, reference
from support.equivalence.random_scenarios import random_scenario
from support.equivalence.targets import compare
from support.execution import unsupervised
from support.random_controllers import random_controller, random_robot
from support.random_layers import random_layer
from support.random_supervisors import random_supervisor
from support.random_travels import random_travels


class _Checked(WatchingSystem):
    """Compares each answer with a full look."""

    def changed_requests(self) -> tuple[int, ...]:
        found = super().changed_requests()
        assert self.enabled_requests() == InterpretedSystem.enabled_requests(self)
        return found

    def enabled_silent(self) -> str | None:
        found = super().enabled_silent()
        assert found == InterpretedSystem.enabled_silent(self)
        return found


def _some_supervisor(seed: int) -> Supervisor:
    """A random robot, of one kind or another."""
    match Random(seed).randrange(5):
        case 0:
            return msgspec.structs.replace(random_supervisor(seed), deployment=Deployment.CONTROLLER)
        case 1:
            return random_robot(seed)
        case 2:
            return random_travels(seed)
        case 3:
            return random_layer(Random(seed))
        case _:
            return random_controller(seed) or random_robot(seed)


@settings(max_examples=examples(60))
@given(st.integers(0, 2**32 - 1))
def test_a_random_robot_does_the_same(seed: int) -> None:
    supervisor = _some_supervisor(seed)
    scenario = random_scenario(supervisor, seed, 60)
    compare(reference(supervisor, _Checked(supervisor)), scenario, observe(supervisor, scenario))


@settings(max_examples=examples(60))
@given(st.integers(0, 2**32 - 1), st.data())
def test_it_knows_what_has_changed_wherever_it_comes_back_to(seed: int, data: st.DataObject) -> None:
    supervisor = random_robot(seed)
    watching = _Checked(supervisor)
    snapshots, known = [watching.snapshot()], set[int]()
    events = [event for event, rule in watching._events.items() if not rule.paths]
    for _ in range(20):
        match data.draw(st.sampled_from(["step", "step", "step", "keep", "return", "restart"])):
            case "step" if events:
                watching.step(data.draw(st.sampled_from(events)))
            case "keep":
                snapshots.append(watching.snapshot())
            case "return":
                watching.restore(data.draw(st.sampled_from(snapshots)))
            case "restart":
                watching.restart()
                known.clear()
        watching.enabled_silent()
        known ^= set(watching.changed_requests())
        assert tuple(sorted(known)) == watching.enabled_requests()


class _Counting(WatchingSystem):
    """Counts how often it looks whether an event is allowed."""

    looks = 0

    def enabled(self, event: str) -> bool:
        self.looks += 1
        return super().enabled(event)


def test_few_looks_follow_a_change_however_many_parts_there_are() -> None:
    part = """
        component C{0} {{
            incoming message go{0} with identifier: "/go{0}", type: none
            incoming message back{0} with identifier: "/back{0}", type: none
            behaviour {{
                initial marked state idle {{ on request to go{0} goto out }}
                marked state out {{ on request to back{0} goto idle transition if C{1}.out goto idle }}
            }}
        }}
        requirement go{0} needs C{1}.idle
    """
    count = 50
    parts = "".join(part.format(number, (number + 1) % count) for number in range(count))
    system = _Counting(unsupervised(f"robot Ring {{{parts}}}"))
    assert system.changed_requests() == tuple(range(0, 2 * count, 2))
    assert system.enabled_silent() is None
    system.looks = 0
    system.step("go7.request")
    assert system.enabled_silent() is None
    # The requests of the part itself, one of the part before it, and the silent steps of both.
    assert system.changed_requests() == (12, 14, 15)
    assert system.looks <= 5
