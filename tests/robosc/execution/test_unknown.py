"""Language B.4 at run time: what a sensor sends can neither crash a controller nor reach a motor as a non-number."""

import math
from contextlib import suppress
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from robosc.execution.interpreter import InterpretedSystem
from robosc.execution.runtime.executor import Executor
from robosc.execution.runtime.protocol import MissingData, Reading
from robosc.execution.runtime.runner import Status
from robosc.expressions import Binary, EnumValue, Received
from robosc.model.structure import EnumRule
from support.effort import examples
from support.execution import Bench, bench, example_system, supervisor_of, system_of
from support.models import model_of

NAN, INFINITY = math.nan, math.inf

RADAR = """
robot Radar {
  interface twist use Twist from geometry_msgs
  interface scan use LaserScan from sensor_msgs
  interface trigger use Trigger from std_srvs
  datatype object Vector { x: double }
  datatype object Twist { linear: Vector }
  datatype object Scan { ranges: array(double) }
  datatype object Answer { width: Width level: integer(0..5) }
  datatype enum Clearance from Scan to {
    value.ranges[0] < 0.2 -> touching
    value.ranges[0] > 1.0 and value.ranges[1] > 1.0 -> clear
    default -> near
  }
  datatype enum Width from double to { value > 1.0 -> wide default -> narrow }
  component Sensor {
    outgoing message scan with identifier: "/scan", type: Clearance links scan
    outgoing message level with type: integer(0..5)
    outgoing message speed with type: double
    outgoing message label with type: string
    service ask with request: none, response: Answer links trigger
    behaviour {
      variable clearance: Clearance = touching
      variable width: Width = narrow
      variable n: integer(0..5)
      variable v: double
      variable text: string
      on response from scan do clearance := value
      on response from level do n := value
      on response from speed do v := value * 2.0
      on response from label do text := value
      on response from ask do width := value.width
      initial marked state awake { }
    }
  }
  component Wheels { incoming message move with identifier: "/cmd_vel", type: Twist links twist }
  requirement move needs Sensor.clearance = clear
  requirement ask needs Sensor.n = 5
  provide move with { linear: { x: Sensor.v } }
}
"""


def scan(*ranges: Any) -> dict[str, Any]:
    return {"ranges": list(ranges)}


@pytest.mark.parametrize(
    ("data", "expected", "unknown"),
    [
        (scan(2.0, 2.0), "clear", 0),
        (scan(0.1, 2.0), "touching", 0),
        (scan(0.5, 0.5), "near", 0),
        (scan(INFINITY, INFINITY), "clear", 0),
        (scan(-INFINITY, 2.0), "touching", 0),
        # The first rule is false, the second unknown.
        (scan(2.0, NAN), "near", 1),
        (scan(2.0), "near", 1),
        # Kleene: false and unknown is false, so nothing was unknown that matters.
        (scan(0.5, NAN), "near", 0),
        (scan(0.5), "near", 0),
        # An earlier rule is true: later ones are not asked.
        (scan(0.1), "touching", 0),
        (scan(NAN, 2.0), "near", 1),
        (scan(), "near", 1),
        (scan(None, "far"), "near", 1),
        ({}, "near", 1),
        (7, "near", 1),
    ],
)
def test_an_enum_takes_the_first_true_rule_else_its_default(data: Any, expected: str, unknown: int) -> None:
    b = bench(RADAR)
    b.receive("/scan", data)
    assert b.variable("Sensor", "clearance") == expected
    assert b.executor.counters.unknown == unknown
    assert len(b.entries("unknown")) == unknown
    assert b.status() is Status.RUNNING


NESTED = """
robot Nested {
  interface pair use Pair from some_msgs
  datatype object Pair { left: Side  right: double }
  datatype enum Side from double to { value > 1.0 -> far default -> close }
  datatype enum Both from Pair to {
    value.right > 1.0 -> right_far
    value.right < -1.0 -> left_far
    default -> neither
  }
  component Sensor {
    outgoing message pair with type: Both links pair
    behaviour {
      variable both: Both = neither
      on response from pair do both := value
      initial marked state awake { }
    }
  }
}
"""


def nested_system() -> InterpretedSystem:
    """With the rule `value.left = far -> left_far`."""
    model = model_of(NESTED)
    both = model.enum("Both")
    is_far = Binary("=", Received(("left",)), EnumValue("Side", "far"))
    rules = (both.rules[0], EnumRule(is_far, "left_far"))
    enums = tuple(replace(item, rules=rules) if item is both else item for item in model.enums)
    return InterpretedSystem(supervisor_of(replace(model, enums=enums)))


@pytest.mark.parametrize(
    ("left", "right", "expected", "unknown"),
    [
        (2.0, 2.0, "right_far", 0),
        (2.0, 0.5, "left_far", 0),
        (0.5, 0.5, "neither", 0),
        # An earlier rule was unknown, but the enum did not fall to its default.
        (2.0, NAN, "left_far", 0),
        (0.5, NAN, "neither", 1),
        # The enum inside fell to its default; the outer one did so knowing everything.
        (NAN, 0.5, "neither", 1),
        (NAN, NAN, "neither", 2),
        (NAN, 2.0, "right_far", 0),
    ],
)
def test_enums_within_the_source_of_an_enum(left: float, right: float, expected: str, unknown: int) -> None:
    b = Bench(nested_system())
    b.receive("pair", {"left": left, "right": right})
    assert b.variable("Sensor", "both") == expected
    assert b.executor.counters.unknown == unknown
    kept = Bench(nested_system(), on_unknown="keep")
    kept.receive("pair", {"left": left, "right": right})
    assert kept.events == ([] if unknown else ["pair.response"])


def test_keep_means_as_if_nothing_had_come() -> None:
    b = bench(RADAR, on_unknown="keep", max_age_s={"/scan": 0.35})
    b.receive("/scan", scan(2.0, 2.0))
    b.tick(2)
    b.receive("/scan", scan(2.0, NAN))
    assert b.variable("Sensor", "clearance") == "clear"
    assert b.events.count("scan.response") == 1
    assert b.executor.counters.unknown == 1
    # For the maximum age, too.
    b.tick(2)
    assert b.status() is Status.STOPPED
    b.receive("/scan", scan(NAN))
    assert b.status() is Status.STOPPED
    b.receive("/scan", scan(2.0, 2.0))
    assert b.status() is Status.RUNNING


def test_keep_keeps_no_reply() -> None:
    b = bench(RADAR, on_unknown="keep")
    b.receive("level", 5)
    b.tick()
    b.executor.on_reply(1, {"width": NAN})
    assert b.variable("Sensor", "width") == "narrow"
    assert "ask.response" in b.events
    assert b.executor.counters.unknown == 1


def test_fault_stops_at_an_unknown_enum() -> None:
    b = bench(RADAR, on_unknown="fault")
    b.receive("/scan", scan(0.5, NAN))
    assert b.status() is Status.RUNNING
    b.receive("/scan", scan(2.0, NAN))
    assert b.executor.is_faulty
    assert b.middleware.sent == [("default", "/cmd_vel")]
    assert b.variable("Sensor", "clearance") == "near"


@pytest.mark.parametrize("value", [NAN, INFINITY, 1e308, "fast", None])
def test_fault_stops_at_a_skipped_update(value: Any) -> None:
    b = bench(RADAR, on_unknown="fault")
    b.receive("speed", value)
    assert b.executor.is_faulty
    assert "Sensor.v" in b.executor.reasons[0]


@pytest.mark.parametrize("value", [NAN, INFINITY, -INFINITY, 1e308, "fast", None, True, [], 10**400])
def test_an_update_that_is_unknown_leaves_its_variable(value: Any) -> None:
    b = bench(RADAR)
    b.receive("speed", 1.5)
    b.receive("speed", value)
    assert b.variable("Sensor", "v") == 3.0
    assert b.executor.counters.unknown == 1
    assert b.entries("unknown")[0]["unknown"] == ["Sensor.v"]
    assert b.status() is Status.RUNNING


@pytest.mark.parametrize(
    ("value", "expected", "unknown"),
    [
        (3, 3, 0),
        (9, 5, 1),
        (-4, 0, 1),
        (2**31, 5, 1),
        (-(2**70), 0, 1),
    ],
)
def test_a_received_integer_is_moved_into_its_range(value: Any, expected: int, unknown: int) -> None:
    b = bench(RADAR)
    b.receive("level", 3)
    b.receive("level", value)
    assert b.variable("Sensor", "n") == expected
    assert b.executor.counters.unknown == unknown


@pytest.mark.parametrize(
    ("identifier", "value", "what"),
    [
        *(("level", value, "must be an integer") for value in list[Any]((2.0, True, "4", NAN, []))),
        ("level", None, "level.response: value is missing, and cannot be unknown"),
        ("/scan", None, "scan.response: value is missing, and cannot be unknown"),
    ],
)
@pytest.mark.parametrize("has_log", [True, False])
def test_what_cannot_be_unknown_by_its_type_is_an_error_of_the_caller(
    identifier: str, value: Any, what: str, has_log: bool
) -> None:
    b = bench(RADAR, max_age_s={"/scan": 1.0, "level": 1.0})
    if not has_log:
        b.executor = Executor(b.system, b.middleware, b.executor.settings, b.clock)
        b.executor.start()
    before = b.system.signature()
    with pytest.raises(MissingData, match=r"missing|must be") as raised:
        b.executor.receive(identifier, value)
    assert what.removeprefix("level.response: ").removeprefix("scan.response: ") in str(raised.value)
    assert (b.system.signature(), b.status(), b.events) == (before, Status.WAITING, [])
    assert not any(b.executor.counters)
    assert set(b.executor.missing_sensors) == {"/scan", "level"}


def test_no_event_of_a_message_happens_if_another_one_lacks_data() -> None:
    b = bench(
        """
        robot Two {
          datatype object Both { near: boolean  level: integer(0..3) }
          component A {
            outgoing message first with identifier: "/both", type: Both
            outgoing message second with identifier: "/both", type: Both
            behaviour {
              variable near: boolean
              variable level: integer(0..3)
              initial marked state only {
                on response from first do near := value.near
                on response from second do level := value.level
              }
            }
          }
        }
        """.replace("type: Both", "type: Both links both").replace(
            "robot Two {", "robot Two { interface both use Both from some_msgs"
        )
    )
    with pytest.raises(MissingData, match=r"^second.response: value.level is missing"):
        b.executor.receive("/both", {"near": True})
    assert b.events == []
    b.executor.receive("/both", {"near": True, "level": 2})
    assert b.events == ["first.response", "second.response"]


def test_parts_that_no_rule_and_no_update_reads_may_be_missing_and_those_of_rules_not() -> None:
    b = bench(
        """
        robot Rules {
          interface lamp use State from some_msgs
          datatype object State { lit: boolean  level: integer(0..9)  other: boolean  charge: double }
          datatype enum Light from State to {
            value.charge < 0.5 -> dark
            value.lit and value.level > 3 -> bright
            default -> dim
          }
          component A {
            outgoing message light with type: Light links lamp
            behaviour {
              variable light: Light = dim
              initial marked state only { on response from light do light := value }
            }
          }
          component B { incoming message go with type: none }
          requirement go needs A.light = bright
        }
        """
    )
    full = {"lit": True, "level": 5}
    b.receive("light", full)
    # The number may be no number: the first rule is unknown, the second true.
    assert (b.variable("A", "light"), b.executor.counters.unknown) == ("bright", 0)
    for name in full:
        with pytest.raises(MissingData, match=rf"value.{name} is missing"):
            b.executor.receive("light", {**full, "charge": 0.1, name: None})
    assert b.events == ["light.response"]


def test_a_reply_that_lacks_data_is_still_awaited() -> None:
    b = bench(RADAR)
    b.receive("level", 5)
    b.tick()
    with pytest.raises(MissingData, match=r"ask.response: value.width is missing"):
        b.executor.on_reply(1, {"level": 3})
    assert "ask.response" not in b.events
    b.executor.on_reply(1, {"width": 2.0})
    assert b.variable("Sensor", "width") == "wide"


def test_an_update_that_was_counted_on_and_did_not_happen_is_a_fault() -> None:
    """No executor of ours lets it happen: this one is told that nothing is known."""
    b = bench(RADAR)
    event = "level.response"
    assert (event, "Sensor.n") in b.system.description.sure_updates
    b.system.read = lambda *given: Reading({}, {}, (), False)  # type: ignore[method-assign]
    b.executor.receive("level", 3)
    assert b.executor.is_faulty
    assert b.executor.reasons == ("ExecutionError: Sensor.n was not updated at level.response",)


def test_a_clamped_integer_is_no_fault_even_where_unknown_is() -> None:
    b = bench(RADAR, on_unknown="fault")
    b.receive("level", 99)
    assert b.status() is Status.RUNNING
    assert b.variable("Sensor", "n") == 5


UNREAD = """
robot Unread {
  datatype enum Range from double to { value > 1.0 -> far default -> near }
  component Sensor {
    outgoing message range with identifier: "/range", type: Range
    behaviour { initial marked state waiting { on response from range goto seen } marked state seen { } }
  }
}
"""


@pytest.mark.parametrize(
    ("on_unknown", "state", "status"),
    [("default", "seen", Status.RUNNING), ("keep", "waiting", Status.WAITING), ("fault", "seen", Status.STOPPED)],
)
def test_an_enum_that_no_update_reads_counts_as_well(on_unknown: str, state: str, status: Status) -> None:
    b = bench(UNREAD, on_unknown=on_unknown, max_age_s={"/range": 1.0})
    b.receive("/range", NAN)
    assert b.executor.counters.unknown == 1
    assert len(b.entries("unknown")) == 1
    assert b.status() is status
    if on_unknown != "fault":
        assert b.state("Sensor") == state


def test_a_number_that_no_update_reads_is_not_converted() -> None:
    b = bench(RADAR)
    b.receive("level", 5)
    b.tick()
    b.executor.on_reply(1, {"width": 2.0, "level": 99})
    assert b.executor.counters.unknown == 0
    assert b.variable("Sensor", "width") == "wide"


def test_objects_with_attributes_are_read_like_mappings() -> None:
    class Message:
        ranges = (2.0, 2.0)

    b = bench(RADAR)
    b.receive("/scan", Message())
    assert b.variable("Sensor", "clearance") == "clear"


def test_an_integer_overflow_and_a_range_of_a_code_only_variable_skip_the_update() -> None:
    b = bench(
        """
        robot Count {
          component A {
            outgoing message m with type: integer
            outgoing message big with type: integer
            behaviour {
              variable total: integer = 2147483600
              variable small: integer(0..3) = 1
              on response from m do total := total + value, small := value
              initial marked state only { }
            }
          }
        }
        """
    )
    b.receive("m", 3)
    assert (b.variable("A", "total"), b.variable("A", "small")) == (2147483603, 3)
    b.receive("m", 100)
    assert (b.variable("A", "total"), b.variable("A", "small")) == (2147483603, 3)
    assert b.entries("unknown")[0]["unknown"] == ["A.total", "A.small"]


def test_a_synthesis_variable_out_of_range_disables_a_controllable_event() -> None:
    system = system_of(
        """
        robot Tank {
          interface trigger use Trigger from std_srvs
          datatype object Empty { }
          component A {
            service fill with request: none, response: Empty links trigger
            behaviour {
              variable level: integer(0..1)
              initial marked state only { on request to fill do level := level + 1 }
            }
          }
          requirement fill needs A.level >= 0
        }
        """
    )
    for expected in (True, False):
        assert system.enabled("fill.request") is expected
        assert system.is_possible("fill.request") is expected
        assert (system.step("fill.request") is not None) is expected
        system.step("fill.response")
        system.step("fill.reset")


class Nasty:
    """Raises at every touch."""

    def __getattr__(self, name: str) -> Any:
        raise RuntimeError(name)

    def __len__(self) -> int:
        raise RuntimeError("len")

    def __getitem__(self, index: object) -> Any:
        raise RuntimeError("item")


def hostile() -> st.SearchStrategy[Any]:
    """Return data that a sensor, or another node on its topic, might send."""
    leaves = st.one_of(
        st.none(),
        st.booleans(),
        st.integers(),
        st.floats(),
        st.text(max_size=5),
        st.binary(max_size=5),
        st.just(10**400),
        st.builds(Nasty),
        st.builds(object),
    )
    names = st.sampled_from(["ranges", "width", "level", "x", "data"])
    return st.recursive(
        leaves, lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(names, inner, max_size=3))
    )


@settings(max_examples=examples(60))
@given(st.lists(st.tuples(st.sampled_from(["/scan", "level", "speed", "label"]), hostile()), max_size=6))
def test_no_data_ever_raises_or_gets_through(messages: list[tuple[str, Any]]) -> None:
    b = Bench(RADAR_SYSTEM)
    b.executor.restart()
    for identifier, data in messages:
        with suppress(MissingData):
            b.receive(identifier, data)
        for sent in b.tick():
            if sent[0] == "publish":
                assert math.isfinite(sent[2]["linear"]["x"])
    b.receive("level", 5)
    b.tick(2)
    with suppress(MissingData):
        b.executor.on_reply(1, messages[0][1] if messages else None)
    assert b.executor.counters.faults == 0
    assert isinstance(b.variable("Sensor", "text"), str)
    assert 0 <= b.variable("Sensor", "n") <= 5
    assert math.isfinite(b.variable("Sensor", "v"))


RADAR_SYSTEM = system_of(RADAR)


@pytest.mark.parametrize("name", ["line_follower/line_follower", "maze_solver/maze_solver", "navigation/navigation"])
@settings(max_examples=examples(40))
@given(data=hostile())
def test_the_examples_stand_hostile_data(name: str, data: Any) -> None:
    b = Bench(SYSTEMS[name])
    for info in b.system.description.communications:
        if info.kind == "outgoing message":
            for given_data in (data, {"ranges": [data] * 360}):
                with suppress(MissingData):
                    b.receive(info.identifier, given_data)
    b.tick(3)
    assert b.executor.counters.faults == 0


SYSTEMS = {
    name: example_system(name)
    for name in ("line_follower/line_follower", "maze_solver/maze_solver", "navigation/navigation")
}


def test_a_synthesis_variable_whose_update_is_unknown_does_not_leave_its_range() -> None:
    system = system_of(
        """
        robot Tank {
          interface trigger use Trigger from std_srvs
          datatype object Empty { }
          component A {
            service fill with request: none, response: Empty links trigger
            behaviour {
              variable level: integer(0..4)
              initial marked state only { on request to fill do level := integer(4 / level) }
            }
          }
          requirement fill needs A.level >= 0
        }
        """
    )
    assert system.enabled("fill.request")
    assert system.step("fill.request") == ("A.level",)


def test_data_with_an_unknown_part_is_not_provided() -> None:
    system = system_of(RADAR.replace("x: Sensor.v }", "x: 1.0 / Sensor.v }"))
    assert system.provide("move") == (False, None)
    system.step("speed.response", system.read("speed.response", 1.0))
    assert system.provide("move") == (True, {"linear": {"x": 0.5}})
