"""
The parameters of a generated node.

Names, defaults, descriptions, and one clear error for a wrong value.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
import re
import sys
from typing import Any, NamedTuple

from robosc.execution.runtime.protocol import Description
from robosc.execution.runtime.settings import (
    MINIMUM_PERIOD_S,
    Settings,
    settings_for,
    SettingsError,
)

_PREFIX = re.compile(r'(/[A-Za-z_][A-Za-z0-9_]*)+\Z')

MAXIMUM_PERIOD_S = 3600.0

USE_SIM_TIME = 'use_sim_time'
"""Every ROS node has this parameter by itself."""

CONTROLLER, LAYER = 'controller', 'layer'
"""The deployments."""

# Settings that have another name as parameters.
_SETTING_NAMES = {
    'period': 'period_s',
    'max_age': 'max_age_s',
    'cancel_timeout': 'cancel_timeout_s',
    'command_timeout': 'command_timeout_s',
    'assumption_timeout': 'assumption_timeout_s',
}


class ParameterError(Exception):
    """A parameter has a wrong value; says which and what it may be."""


class Parameter(NamedTuple):
    """
    A parameter as users see it.

    :ivar name: Its name.
    :ivar default: Value that it has if none is given.
    :ivar description: Its meaning, in sentences.
    :ivar bounds: The smallest and the greatest value of a number; None for what is no number, or
        any.
    """

    name: str
    default: Any
    description: str
    bounds: tuple[float, float] | None = None


_PERIODS = (MINIMUM_PERIOD_S, MAXIMUM_PERIOD_S)
_SECONDS = (0.0, sys.float_info.max)


_WITH_GOALS = (
    Parameter(
        'assumption_timeout',
        30.0,
        'Seconds after which an assumption that the surroundings owe is reported, in the event '
        'log and on /diagnostics; 0 for never.',
        _SECONDS,
    ),
)


def _of_a_controller(policy: str) -> tuple[Parameter, ...]:
    goals = ', strategy (what reaches the goals of the model)' if policy == 'strategy' else ''
    choices = f'fair, random, priority (the list, then fair){goals}'
    return (
        Parameter(
            'period',
            0.1,
            'Seconds between decisions: at most one request is issued each time.',
            _PERIODS,
        ),
        Parameter('policy', policy, f'Choice among enabled requests: {choices}.'),
        Parameter('priority', [''], 'Messages in order of urgency, for the policy priority.'),
        Parameter('seed', 0, 'Seed of the policy random.'),
        Parameter(
            'every',
            'period',
            'Times of decisions: each period, or after each event as well (event).',
        ),
        *(_WITH_GOALS if policy == 'strategy' else ()),
    )


_OF_A_LAYER = (
    Parameter(
        'period',
        0.1,
        'Seconds between messages on /state (publish_state): a layer decides nothing by itself.',
        _PERIODS,
    ),
    Parameter(
        'command_timeout',
        1.0,
        'Seconds without a message from the existing controller on a release identifier after '
        'which its last one is '
        'taken back with the all-default message; 0 for never.',
        _SECONDS,
    ),
)

_RESAMPLED_IN_A_LAYER = ' Only the supervisor sees it so: what is passed on is unchanged.'


AUTOSTART = Parameter(
    'autostart',
    True,
    'True if the node configures and activates itself at its start; if not, a lifecycle manager '
    'does so, and a fault '
    'leaves the node at rest until it is deactivated and activated again.',
)
"""Parameter of ROS 2, where nodes can be managed."""

STATE_MESSAGE = Parameter(
    'state_message',
    'json',
    'Form of the state (publish_state): json, a text on the topic state; typed, '
    'robosc_msgs/msg/SupervisorState on the topic ~/state; or both.',
)
"""Parameter of ROS 2, where the state can be a typed message."""


class Parameters(NamedTuple):
    """
    Valid values.

    :ivar settings: Settings of the executor.
    :ivar topic_prefix: Prefix of every topic name.
    :ivar log_folder: Folder of the event log; empty for none.
    :ivar publish_state: True if the state is published on `/state`.
    :ivar server_wait_s: Time that the start waits for servers, in seconds.
    :ivar resample_scans: True if laser scans are brought to 360 ranges.
    :ivar use_sim_time: True if time is simulated.
    """

    settings: Settings
    topic_prefix: str
    log_folder: str
    publish_state: bool
    server_wait_s: float
    resample_scans: bool
    use_sim_time: bool


def declarations(
    release_identifiers: Sequence[str], deployment: str = CONTROLLER, policy: str = 'fair'
) -> tuple[Parameter, ...]:
    """
    Return every parameter of a deployment.

    :param release_identifiers: Release identifiers that the model suggests.
    :param deployment: `controller` or `layer`.
    :param policy: Default policy of a controller: `strategy` if its supervisor has one.
    """
    is_layer = deployment == LAYER
    return (
        *(_OF_A_LAYER if is_layer else _of_a_controller(policy)),
        Parameter(
            'release_identifiers',
            list(release_identifiers) or [''],
            'Topics that keep acting after a message (velocities): the all-default message is '
            'sent there as soon as '
            'the last one is no longer allowed, and at every stop; [""] for none.',
        ),
        Parameter(
            'max_age',
            [''],
            'Received topics that count as stale after so many seconds without a message, each as '
            'topic=seconds; '
            'a stale topic stops the robot until it is back.',
        ),
        Parameter(
            'on_unknown',
            'default',
            'Behaviour when received data leaves an enum unknown: default (it takes its default '
            'value), keep (as if '
            'nothing had come), fault (stop).',
        ),
        Parameter(
            'service_timeout',
            10.0,
            'Seconds after which a service call without a reply has failed, also if its server '
            'was lost; 0 for never.',
            _SECONDS,
        ),
        Parameter(
            'action_timeout',
            0.0,
            'Seconds after which a goal without a result has failed and is cancelled, unless it '
            'is being cancelled already; 0 for never.',
            _SECONDS,
        ),
        Parameter(
            'cancel_timeout',
            5.0,
            'Seconds after a cancel was asked for until it is reported, in the event log and as '
            'an error on /diagnostics, that its goal has not ended; 0 for never.',
            _SECONDS,
        ),
        Parameter(
            'server_wait',
            5.0,
            f'Seconds that the start waits for the servers of all services and actions; the '
            f'{deployment} then starts '
            'without those that are missing, and their requests fail until they are there.',
            _SECONDS,
        ),
        Parameter(
            'resample_scans',
            False,
            'True if every received sensor_msgs/LaserScan is brought to 360 ranges, one for each '
            'degree '
            'counter-clockwise from straight ahead (the smallest valid one, NaN if there is '
            'none), so that ranges[270] '
            'is what stands at 270 degrees whatever the LiDAR.'
            + (_RESAMPLED_IN_A_LAYER if is_layer else ''),
        ),
        Parameter(
            'topic_prefix',
            '',
            'Put before every topic, service and action name of the model'
            + (', before /supervised, blocked' if is_layer else '')
            + ' and before state, such as "/robot1".',
        ),
        Parameter('log_folder', '', 'Folder for the event log (JSON Lines); empty for none.'),
        Parameter(
            'publish_state',
            False,
            'True if state and transitions are published on /state each period.',
        ),
        Parameter(
            USE_SIM_TIME,
            False,
            'True if time is that of /clock: in headers, and for periods, ages and timeouts, none '
            'of which passes '
            'while the simulation is paused.',
        ),
    )


def validate(given: Mapping[str, Any], description: Description) -> Parameters:
    """
    Return valid parameters.

    :param given: Value of every declared parameter.
    :param description: The system that they are for.
    :raises ParameterError: A value is wrong.
    """
    settings = _of_deployment(given, description.deployment)._replace(
        period_s=given['period'],
        release_identifiers=_texts(given, 'release_identifiers'),
        max_age_s=_ages(given),
        service_timeout_s=_seconds(given, 'service_timeout') or None,
        action_timeout_s=_seconds(given, 'action_timeout') or None,
        cancel_timeout_s=_seconds(given, 'cancel_timeout'),
        on_unknown=given['on_unknown'],
    )
    try:
        checked = settings_for(settings, description)
    except SettingsError as error:
        raise ParameterError(_in_words_of_parameters(str(error))) from error
    if checked.period_s > MAXIMUM_PERIOD_S:
        raise _wrong('period', checked.period_s, f'at most {MAXIMUM_PERIOD_S:g} seconds')
    return Parameters(
        settings=checked,
        topic_prefix=_prefix(given),
        log_folder=_text(given, 'log_folder'),
        publish_state=_boolean(given, 'publish_state'),
        server_wait_s=_seconds(given, 'server_wait'),
        resample_scans=_boolean(given, 'resample_scans'),
        use_sim_time=_boolean(given, USE_SIM_TIME),
    )


def _of_deployment(given: Mapping[str, Any], deployment: str) -> Settings:
    """Return the settings that only one deployment has."""
    if deployment == LAYER:
        return Settings(command_timeout_s=given['command_timeout'])
    return Settings(
        policy=given['policy'],
        priority=_texts(given, 'priority'),
        seed=given['seed'],
        every=given['every'],
        assumption_timeout_s=given.get('assumption_timeout', Settings().assumption_timeout_s),
    )


def _in_words_of_parameters(text: str) -> str:
    for parameter, setting in _SETTING_NAMES.items():
        text = text.replace("setting '" + setting, "setting '" + parameter, 1)
    return text.replace("setting '", "parameter '", 1)


def _wrong(name: str, value: Any, expected: str) -> ParameterError:
    return ParameterError(f"parameter '{name}' is {value!r}; it must be {expected}")


def _boolean(given: Mapping[str, Any], name: str) -> bool:
    value = given[name]
    if not isinstance(value, bool):
        raise _wrong(name, value, 'true or false')
    return value


def _seconds(given: Mapping[str, Any], name: str) -> float:
    value = given[name]
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 <= value < math.inf:
        raise _wrong(name, value, 'a number of seconds, 0 or more')
    return float(value)


def _text(given: Mapping[str, Any], name: str) -> str:
    value = given[name]
    if not isinstance(value, str):
        raise _wrong(name, value, 'a string')
    return value


def _texts(given: Mapping[str, Any], name: str) -> tuple[str, ...]:
    """Return a list of strings without the empty ones: ROS parameter files know no empty list."""
    value = given[name]
    if not isinstance(value, (list, tuple)) or not all(isinstance(item, str) for item in value):
        raise _wrong(name, value, 'a list of strings')
    texts: list[str] = [item for item in value if item]
    return tuple(texts)


def _ages(given: Mapping[str, Any]) -> dict[str, float]:
    ages = {}
    for entry in _texts(given, 'max_age'):
        identifier, _, text = entry.rpartition('=')
        age = _number(text)
        if not identifier or age is None:
            raise _wrong('max_age', entry, 'topic=seconds, such as /scan=0.5')
        ages[identifier] = age
    return ages


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _prefix(given: Mapping[str, Any]) -> str:
    return valid_prefix(_text(given, 'topic_prefix'))


def valid_prefix(text: str) -> str:
    """
    Return a valid value of the parameter `topic_prefix`, without a slash at its end.

    :raises ParameterError: The value is wrong.
    """
    prefix = text.rstrip('/')
    if prefix and not _PREFIX.match(prefix):
        raise _wrong(
            'topic_prefix', prefix, 'empty or the beginning of a topic name, such as "/robot1"'
        )
    return prefix


def prefixed(prefix: str, identifier: str) -> str:
    """
    Return a topic's, service's or action's name on the wire.

    Private ones (`~/x`) belong to the node and get no prefix.
    """
    if not prefix or identifier.startswith('~'):
        return identifier
    return prefix + '/' + identifier.lstrip('/')
