"""Strategies where goals of actions end as cancelled: when they do is for the surroundings to decide."""

from robosc.automata.goal_memory import own_cancels
from robosc.certification import make_supervisor
from robosc.certification.goals import GoalExplanation
from robosc.pipeline.counter_run import CounterRun
from support.models import bundle_of

WALKER = """robot Walker {
    interface walk use Walk from walking
    component Base {
        action move with request: none, response: none, feedback: none links walk
        behaviour {
            initial marked state start { on request to move goto moving }
            marked state moving {
                on response from move goto there
                on error from move goto start
                on cancel to move goto lost
            }
            marked state there { }
            marked state lost { }
        }
    }
    component Person {
        outgoing message near with identifier: "/near", type: none
        outgoing message far with identifier: "/far", type: none
        behaviour {
            initial marked state away { on response from near goto close }
            marked state close { on response from far goto away }
        }
    }
    requirement move needs Person.away
    goal once Base.there
    assume allow Base.moving leads to Base.there or Base.lost
}"""
"""A robot that is lost once its walk is cancelled."""


def test_the_surroundings_end_a_goal_as_cancelled_once_that_was_asked_for() -> None:
    outcome = make_supervisor(bundle_of(WALKER))
    assert "unreachable-goal" in {item.code for item in outcome.diagnostics}
    assert isinstance(outcome.explanation, GoalExplanation)
    run = CounterRun(outcome.explanation)
    run.step("move.request")
    events = [step.event for step in run.history]
    assert "near.response" in events[: events.index("move.cancel")]
    assert run.actor("move.cancel") == "surroundings"
    assert run.state.components["Base"] == "lost"


def test_what_the_request_itself_makes_false_ends_nothing() -> None:
    outcome = make_supervisor(bundle_of(WALKER.replace("needs Person.away", "needs Base.start")))
    assert outcome.supervisor is not None, outcome.diagnostics


def test_what_silent_steps_may_pass_over_counts_as_asked_for() -> None:
    passing = "{ transition if Person.close goto b } state b { transition if Person.away goto a }"
    watched = f"component Watch {{ behaviour {{ initial marked state a {passing} }} }}"
    text = WALKER.replace("requirement move", f"{watched} requirement move needs Watch.a requirement move")
    outcome = make_supervisor(bundle_of(text.replace("goal once", "// goal once").replace("assume", "// assume")))
    assert outcome.supervisor is not None
    (cancel,) = own_cancels(outcome.supervisor.executable)
    assert cancel.passing == (True, False)
    assert [place.name for place in cancel.places] == [
        "requirement 1 of move was met",
        "requirement 2 of move was met",
        "the cancel of move was asked for",
    ]
