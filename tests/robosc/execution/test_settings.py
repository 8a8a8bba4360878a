from typing import Any

import pytest

from robosc.execution.runtime.settings import (
    POLICIES,
    Settings,
    SettingsError,
    require_settings_of,
    settings_for,
    settings_from,
)
from support.execution import bench, system_of

ROBOT = """
robot Robot {
  interface twist use Twist from geometry_msgs
  interface stamped use TwistStamped from geometry_msgs
  interface other use Twist from other_msgs
  datatype object Vector { x: double }
  datatype object Twist { linear: Vector }
  datatype object Stamped { twist: Twist }
  component A {
    outgoing message scan with identifier: "/scan", type: double
    outgoing message odom with identifier: "/odom", type: Twist links twist
    incoming message b with identifier: "/b", type: Stamped links stamped
    incoming message move with identifier: "/cmd_vel", type: Twist links twist
    incoming message halt with identifier: "/cmd_vel", type: Twist links twist
    incoming message lamp with identifier: "/lamp", type: Twist links other
  }
}
"""
DESCRIPTION = system_of(ROBOT).description


def test_defaults() -> None:
    settings = settings_for(Settings(), DESCRIPTION)
    assert settings == Settings(release_identifiers=("/b", "/cmd_vel"))


def test_plain_values_become_settings() -> None:
    given = {"period_s": 1, "priority": ["move"], "max_age_s": {"/scan": 2}, "release_identifiers": ["/lamp"]}
    settings = settings_for(settings_from(given), DESCRIPTION)
    assert settings == Settings(
        period_s=1.0, priority=("move",), max_age_s={"/scan": 2.0}, release_identifiers=("/lamp",)
    )
    assert isinstance(settings.period_s, float)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"perod_s": 1}, "did you mean 'period_s'?"),
        ({"zzz": 1}, "there is action_timeout_s"),
        ({"period_s": 0}, "0.0001 seconds or more"),
        ({"period_s": float("nan")}, "period_s"),
        ({"period_s": "1"}, "period_s"),
        ({"period_s": True}, "period_s"),
        ({"policy": "best"}, "one of fair, priority, random, strategy"),
        ({"every": 3}, "one of period, event"),
        ({"on_unknown": "ignore"}, "one of default, keep, fault"),
        ({"seed": 1.5}, "an integer"),
        ({"priority": "move"}, "a list of names"),
        ({"priority": ["moved"]}, "did you mean 'move'?"),
        ({"priority": ["scan"]}, "is not a request"),
        ({"release_identifiers": ["/scan"]}, "'/scan' is not the identifier of an incoming message"),
        ({"max_age_s": {"/cmd_vel": 1.0}}, "is not the identifier of an outgoing message"),
        ({"max_age_s": {"/scan": 0}}, "a number of seconds above 0"),
        ({"max_age_s": [1]}, "seconds by identifier"),
        ({"service_timeout_s": -1}, "service_timeout_s"),
        ({"action_timeout_s": float("inf")}, "action_timeout_s"),
    ],
)
def test_a_wrong_setting_is_refused_in_words(given: dict[str, Any], message: str) -> None:
    with pytest.raises(SettingsError, match=r".*") as caught:
        settings_for(settings_from(given), DESCRIPTION)
    assert message in str(caught.value)


def test_without_a_policy_it_is_the_strategy_where_there_is_one() -> None:
    assert Settings().policy is None
    assert settings_from({"policy": None}).policy is None
    assert settings_for(Settings(), DESCRIPTION).policy is None
    assert bench(ROBOT).executor.settings.policy == "fair"
    with_goals = DESCRIPTION._replace(has_strategy=True)
    assert settings_for(Settings(policy="strategy"), with_goals).policy == "strategy"
    assert settings_for(Settings(policy="fair"), with_goals).policy == "fair"
    with pytest.raises(SettingsError, match="the supervisor has none: its model has no goals"):
        settings_for(Settings(policy="strategy"), DESCRIPTION)


def test_a_layer_has_no_policy_to_set() -> None:
    require_settings_of(Settings(), "layer")
    for policy in POLICIES:
        with pytest.raises(SettingsError, match="'policy' means nothing in the deployment 'layer'"):
            require_settings_of(Settings(policy=policy), "layer")


def test_an_executor_checks_its_settings() -> None:
    with pytest.raises(SettingsError):
        bench(ROBOT, priority=("nobody",))
