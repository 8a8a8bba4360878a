"""Semantics 3.6: messages that keep acting after they were sent."""

import pytest

from robosc.execution.interpreter import InterpretedSystem
from support.execution import Bench, Sent, bench, example_system
from support.missions import strategic
from support.models import model_of

HEAD = """
  interface twist use Twist from geometry_msgs
  datatype object Vector { x: double y: double z: double }
  datatype object Twist { linear: Vector angular: Vector }
"""

DRIVE = f"""
robot Drive {{ {HEAD}
  component Sensor {{
    outgoing message clear with type: boolean
    outgoing message power with type: boolean
    behaviour {{
      variable is_clear: boolean = true
      variable has_power: boolean = true
      on response from clear do is_clear := value
      on response from power do has_power := value
      initial marked state awake {{ }}
    }}
  }}
  component Arm {{
    incoming message grip with type: none
    outgoing message gripped with type: none
    behaviour {{
      initial marked state free {{ on request to grip goto gripping }}
      state gripping {{ on response from gripped goto free }}
    }}
  }}
  component Platform {{ incoming message move with identifier: "/cmd_vel", type: Twist links twist }}
  requirement move needs Sensor.is_clear and Arm.free
  requirement grip needs Sensor.has_power
  provide move with {{ linear: {{ x: 0.5 }} }}
}}
"""
MOVE: Sent = ("publish", "move", {"linear": {"x": 0.5}})
GRIP: Sent = ("publish", "grip", None)
ZERO: Sent = ("default", "/cmd_vel")


def driving() -> Bench:
    b = bench(DRIVE, policy="priority", priority=("move",))
    assert b.tick() == [MOVE]
    return b


def test_the_default_goes_out_at_once_when_the_sender_is_no_longer_enabled() -> None:
    b = driving()
    assert b.receive("clear", False) == [ZERO]
    assert [entry["identifier"] for entry in b.entries("release")] == ["/cmd_vel"]
    assert "release" not in " ".join(b.events)


def test_a_release_is_carried_out_once() -> None:
    b = driving()
    b.receive("clear", False)
    assert b.receive("power", False) == []
    assert b.receive("clear", False) == []
    assert b.tick() == []


def test_nothing_is_released_while_nothing_acts() -> None:
    b = bench(DRIVE)
    assert b.receive("clear", False) == []
    assert b.receive("clear", True) == []


def test_a_new_message_acts_again() -> None:
    b = driving()
    b.receive("clear", False)
    b.receive("clear", True)
    assert b.tick() == [MOVE]
    assert b.receive("clear", False) == [ZERO]


def test_a_release_that_a_request_makes_due_goes_out_before_it() -> None:
    b = bench(DRIVE, policy="fair")
    assert b.tick() == [GRIP]
    b.receive("gripped")
    assert b.tick() == [MOVE]
    assert b.tick() == [ZERO, GRIP]
    assert b.events[-1] == "grip.request"


def test_an_unrelated_request_releases_nothing() -> None:
    b = driving()
    assert b.receive("power", False) == []
    assert b.tick(3) == [MOVE] * 3


def test_the_default_message_itself_needs_no_release() -> None:
    b = bench(DRIVE.replace("x: 0.5", "x: 0.0"), policy="priority", priority=("move",))
    assert len(b.tick()) == 1
    assert b.receive("clear", False) == []


SELF = f"""
robot Self {{ {HEAD}
  component Rotator {{
    incoming message rotate with identifier: "/cmd_vel", type: Twist links twist
    outgoing message done with type: none
    outgoing message fault with type: none
    behaviour {{
      variable healthy: boolean = true
      on response from fault do healthy := false
      initial marked state idle {{ on request to rotate goto turning }}
      state turning {{ on response from done goto idle }}
    }}
  }}
  requirement rotate needs Rotator.idle and Rotator.healthy
  provide rotate with {{ angular: {{ z: 1.0 }} }}
}}
"""


def test_what_the_request_itself_makes_false_releases_nothing() -> None:
    b = bench(SELF)
    assert len(b.tick()) == 1
    assert b.tick(3) == []
    # Back to idle the request is enabled again, so nothing has turned against it.
    assert b.receive("done") == []


@pytest.mark.parametrize(
    "requirement",
    [
        "requirement rotate needs Rotator.idle and Rotator.healthy",
        "requirement Rotator.turning or !Rotator.healthy disables rotate",
    ],
    ids=["needs", "disables"],
)
def test_another_conjunct_that_turns_releases_while_the_request_is_not_enabled_anyway(requirement: str) -> None:
    b = bench(SELF.replace("requirement rotate needs Rotator.idle and Rotator.healthy", requirement))
    b.tick()
    assert b.receive("fault") == [ZERO]


def test_a_conjunct_is_watched_only_from_the_message_on() -> None:
    b = bench(SELF)
    b.receive("fault")
    assert b.tick(2) == []
    assert b.receive("fault") == []


def test_a_blocked_request_releases_like_a_forbidden_one() -> None:
    b = bench(
        f"""
        robot Blocked {{ {HEAD}
          component Platform {{
            incoming message move with identifier: "/cmd_vel", type: Twist links twist
            outgoing message lift with type: none
            behaviour {{
              initial marked state down {{ on request to move  on response from lift goto up }}
              marked state up {{ }}
            }}
          }}
          provide move with {{ linear: {{ x: 0.5 }} }}
        }}
        """
    )
    b.tick()
    assert b.receive("lift") == [ZERO]


def test_only_listed_identifiers_are_released() -> None:
    b = bench(DRIVE, policy="priority", priority=("move",), release_identifiers=())
    assert b.tick() == [MOVE]
    assert b.receive("clear", False) == []
    assert b.executor.settings.release_identifiers == ()
    assert bench(DRIVE).executor.settings.release_identifiers == ("/cmd_vel",)


SCAN = {"ranges": [2.0] * 360}


def following() -> Bench:
    b = Bench(example_system("line_follower/line_follower"))
    b.receive("/line/correction", 0.25)
    b.receive("/scan", SCAN)
    assert [sent[1] for sent in b.tick()] == ["move"]
    return b


def test_while_another_request_on_the_identifier_is_enabled_it_is_the_next_decision() -> None:
    b = following()
    assert b.receive("/line/lost") == []
    assert [sent[1] for sent in b.tick()] == ["halt"]
    assert b.entries("release") == []
    assert b.tick(2) != []
    assert b.entries("release") == []


def test_that_decision_comes_before_any_policy() -> None:
    b = bench(with_halt(), policy="priority", priority=("move", "grip"))
    assert b.tick() == [MOVE]
    assert b.receive("clear", False) == []
    # The list says grip; the release that waits says halt.
    assert b.tick() == [("publish", "halt", None)]
    assert b.tick() == [GRIP]


def test_a_release_that_waits_goes_out_when_nothing_else_can_end_it() -> None:
    b = following()
    assert b.receive("/line/lost") == []
    # The line is back before the decision: halt is no longer enabled, and the old message was due.
    assert b.receive("/line/correction", 0.5) == [ZERO]
    assert [sent[1:] for sent in b.tick()] == [("move", {"linear": {"x": 0.15}, "angular": {"z": 0.5}})]


GOING = f"""
robot Going {{ {HEAD}
  component Sensor {{
    outgoing message clear with type: boolean
    behaviour {{
      variable is_clear: boolean = true
      on response from clear do is_clear := value
      initial marked state awake {{ }}
    }}
  }}
  component Platform {{
    incoming message move with identifier: "/cmd_vel", type: Twist links twist
    incoming message halt with identifier: "/cmd_vel", type: Twist links twist
    outgoing message arrived with type: none
    behaviour {{
      initial marked state here {{ on request to move goto going }}
      marked state going {{ on response from arrived goto there on request to halt }}
      marked state there {{ on request to halt goto here }}
    }}
  }}
  requirement move needs Sensor.is_clear
  provide move with {{ linear: {{ x: 0.5 }} }}
  provide halt with {{ linear: {{ x: 0.0 }} }}
  goal always eventually Platform.there
  goal always eventually Platform.here
  assume always eventually !Platform.going and Sensor.is_clear
}}
"""


def test_a_release_does_not_wait_for_what_a_strategy_does_not_choose() -> None:
    b = Bench(InterpretedSystem(strategic(model_of(GOING))))
    assert b.tick(2) == [MOVE]
    assert b.receive("clear", False) == []
    # The strategy waits for the arrival, though halt is enabled.
    assert b.tick() == [ZERO]
    assert b.tick(2) == []
    assert b.receive("arrived") == []
    assert [sent[1] for sent in b.tick()] == ["halt"]


def test_a_release_ends_by_the_message_that_a_strategy_chooses() -> None:
    b = Bench(InterpretedSystem(strategic(model_of(GOING))))
    assert b.tick() == [MOVE]
    assert b.receive("arrived") == []
    assert b.receive("clear", False) == []
    assert [sent[:2] for sent in b.tick()] == [("publish", "halt")]
    assert b.entries("release") == []


def test_the_layer_example_as_a_controller_releases_at_once() -> None:
    b = Bench(example_system("line_follower/line_follower_layer"))
    b.receive("/line/correction", 0.25)
    b.receive("/scan", SCAN)
    assert [sent[1] for sent in b.tick()] == ["move"]
    assert b.receive("/line/lost") == [ZERO]
    assert b.tick(2) == []


def test_a_message_sent_there_ends_a_waiting_release() -> None:
    b = following()
    b.receive("/emergency_stop/stop")
    b.tick()
    assert b.receive("/emergency_stop/resume") == []
    assert b.entries("release") == []


def test_data_that_is_unknown_is_not_sent_and_its_identifier_is_released_at_once() -> None:
    text = (
        DRIVE.replace("x: 0.5", "x: 1.0 / Sensor.divisor")
        .replace(
            "variable is_clear",
            "variable divisor: integer = 2\n on response from zero do divisor := 0\n variable is_clear",
        )
        .replace("outgoing message clear", "outgoing message zero with type: none\n outgoing message clear")
    )
    b = bench(text, policy="priority", priority=("move",))
    assert b.tick() == [MOVE]
    b.receive("zero")
    # The same decision passes to the next enabled request.
    assert b.tick() == [ZERO, GRIP]
    assert [entry["event"] for entry in b.entries("unknown")] == ["move.request"]
    assert b.events.count("move.request") == 1
    assert b.executor.counters.unknown == 1
    assert b.executor.counters.faults == 0


def test_data_that_does_not_fit_is_not_sent_either() -> None:
    b = driving()
    b.middleware.unfit.add("move")
    assert b.tick() == [ZERO, GRIP]
    assert b.executor.counters.unknown == 1
    assert b.tick() == []


def test_after_a_waiting_release_whose_request_does_not_fit_others_are_tried() -> None:
    b = following()
    b.receive("/line/lost")
    b.middleware.unfit.add("halt")
    assert b.tick() == [ZERO]
    assert b.tick() == []


def with_halt(halt: str = "") -> str:
    """The driving robot with a second message on its topic."""
    return DRIVE.replace("requirement grip", "requirement halt needs !Sensor.is_clear requirement grip").replace(
        "component Platform {",
        f'component Platform {{ incoming message halt with identifier: "/cmd_vel", type: Twist links twist {halt}',
    )


def test_if_what_would_end_a_release_cannot_be_sent_the_decision_passes_on() -> None:
    b = bench(with_halt(), policy="priority", priority=("move",))
    assert b.tick() == [MOVE]
    assert b.receive("clear", False) == []
    b.middleware.unfit.add("halt")
    assert b.tick() == [ZERO, GRIP]


def test_a_request_that_ends_a_release_and_disables_itself_ends_it_all_the_same() -> None:
    halt = "behaviour { initial marked state a { on request to halt goto b  on request to move } marked state b { } }"
    b = bench(with_halt(halt), policy="priority", priority=("move",))
    assert b.tick() == [MOVE]
    assert b.receive("clear", False) == []
    assert b.tick() == [("publish", "halt", None)]
    assert b.entries("release") == []


def test_a_request_that_is_sent_again_and_disables_itself_releases_nothing() -> None:
    b = bench(
        f"""
        robot Twice {{ {HEAD}
          component Platform {{
            incoming message move with identifier: "/cmd_vel", type: Twist links twist
            behaviour {{
              initial marked state one {{ on request to move goto two }}
              marked state two {{ on request to move goto three }}
              marked state three {{ }}
            }}
          }}
          provide move with {{ linear: {{ x: 0.5 }} }}
        }}
        """
    )
    assert b.tick(3) == [MOVE, MOVE]


def test_what_never_was_so_since_the_message_releases_nothing_later_either() -> None:
    b = bench(
        SELF.replace(
            "variable healthy", "variable noise: boolean on response from hum do noise := value variable healthy"
        ).replace("outgoing message done", "outgoing message hum with type: boolean  outgoing message done")
    )
    b.tick()
    assert b.receive("hum", True) + b.receive("hum", False) == []


RESTING = (
    SELF.replace("variable healthy: boolean = true", "")
    .replace("on response from fault do healthy := false", "on response from fault goto turning")
    .replace("state turning { on response from done goto idle }", "state turning { on response from done goto LATER }")
    .replace("initial marked state idle", "marked state resting { }  initial marked state idle")
    .replace("Rotator.idle and Rotator.healthy", "!Rotator.turning")
)


@pytest.mark.parametrize("later", ["idle", "resting"], ids=["enabled-meanwhile", "not-enabled-meanwhile"])
def test_what_came_true_after_the_message_releases_when_it_turns_again(later: str) -> None:
    b = bench(RESTING.replace("LATER", later))
    assert len(b.tick()) == 1
    assert b.receive("done") == []
    if later == "resting":
        assert b.tick() == []
    assert b.receive("fault") == [ZERO]


def test_after_a_stop_nothing_acts_any_more() -> None:
    b = driving()
    b.executor.stop("SIGINT")
    assert b.receive("clear", False) == []


def test_a_request_without_requirements_that_was_enabled_meanwhile_releases() -> None:
    b = bench(
        f"""
        robot Lifted {{ {HEAD}
          component Platform {{
            incoming message move with identifier: "/cmd_vel", type: Twist links twist
            outgoing message lift with type: none
            outgoing message lower with type: none
            behaviour {{
              on response from lower goto down
              on response from lift goto up
              initial marked state down {{ on request to move goto up }}
              marked state up {{ }}
            }}
          }}
          provide move with {{ linear: {{ x: 0.5 }} }}
        }}
        """
    )
    assert b.tick() == [MOVE]
    assert b.receive("lift") + b.receive("lower") == []
    assert b.receive("lift") == [ZERO]
