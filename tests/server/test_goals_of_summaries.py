"""Goals in the summary of a supervisor, as the service sends it and as the core has it."""

import pytest

from robosc.certification import make_supervisor
from robosc.model.structure import Deployment
from robosc.pipeline.results import GoalSummary
from robosc.pipeline.supervisors import Supervisor
from robosc_client.convert.response_fields import summary_of
from robosc_client.errors import ServiceError
from robosc_server.tasks.convert import to_proto
from support.execution import unsupervised
from support.goal_porter import PORTER, porter_supervisor
from support.models import bundle_of

AIMS = ("Caller.waiting leads to Base.inside", "always eventually Base.outside and Door.shut")
ASSUMPTIONS = ("Door.opening leads to Door.ajar", "Door.closing leads to Door.shut")
PLAIN = """robot Plain {
    component Base { incoming message go with type: none behaviour { initial marked state here { } } }
}"""


def test_the_summary_of_a_strategy_has_goals_and_modes() -> None:
    sent = to_proto.summary(porter_supervisor())
    assert summary_of(sent).goals == GoalSummary(AIMS, ASSUMPTIONS, has_strategy=True, modes=2)
    assert summary_of(sent) == Supervisor.of(porter_supervisor()).summary


def test_a_layer_has_goals_and_no_strategy() -> None:
    made = make_supervisor(bundle_of(PORTER), deployment=Deployment.LAYER)
    assert made.supervisor is not None
    assert summary_of(to_proto.summary(made.supervisor)).goals == GoalSummary(AIMS, ASSUMPTIONS, False, 0)


def test_without_goals_the_field_is_absent() -> None:
    sent = to_proto.summary(unsupervised(PLAIN))
    assert not sent.HasField("goals")
    assert summary_of(sent).goals is None


def test_too_many_goals_are_refused() -> None:
    sent = to_proto.summary(porter_supervisor())
    sent.goals.aims.extend([""] * 100_001)
    with pytest.raises(ServiceError, match="goals"):
        summary_of(sent)
