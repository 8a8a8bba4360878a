"""Settings of a deployment, checked alone and against the model of the robot."""

from __future__ import annotations

import difflib
import math
from typing import Any, Dict, Iterable, Mapping, NamedTuple, Optional, Tuple

from robosc.execution.runtime.protocol import Description

POLICIES = ('fair', 'priority', 'random', 'strategy')
EVERY = ('period', 'event')
ON_UNKNOWN = ('default', 'keep', 'fault')

MINIMUM_PERIOD_S = 0.0001
_REQUEST_KINDS = ('incoming message', 'service', 'action')
_ACTING_TYPES = ('Twist', 'TwistStamped')


class SettingsError(ValueError):
    """A setting has no such name or a wrong value; says which and what it may be."""


class Settings(NamedTuple):
    """
    Settings that a deployment may choose; `validated` makes them out of plain values.

    :ivar period_s: Time between decisions, in seconds.
    :ivar policy: Policy that chooses the enabled request to issue: `fair`, `priority`, `random` or
        `strategy`; None: `strategy` where the supervisor has one, else `fair`.
    :ivar priority: Names of communications, most urgent first, for the policy `priority`.
    :ivar seed: Seed of the policy `random`.
    :ivar every: Times of decisions: each `period`, or after each batch as well (`event`).
    :ivar release_identifiers: Identifiers whose last message keeps acting; None: every incoming
        message that is linked to geometry_msgs Twist or TwistStamped.
    :ivar max_age_s: Seconds without a message after which an outgoing message is stale, by its
        identifier.
    :ivar service_timeout_s: Seconds until a service call without a reply counts as failed; None:
        never.
    :ivar action_timeout_s: Seconds until a goal without a result counts as failed, unless it is
        being cancelled; None: never.
    :ivar cancel_timeout_s: Seconds after the cancel of a goal was decided until it is reported
        that the goal has not ended; 0: never.
    :ivar on_unknown: Reaction if an enum gets its default because a rule is unknown: `default`,
        `keep`, `fault`.
    :ivar command_timeout_s: Seconds without a message from the existing controller on a release
        identifier after which its last one is released, in a supervision layer; 0: never.
    :ivar assumption_timeout_s: Seconds after which an assumption of the model that is owed is
        reported, where there is a strategy; 0: never.
    """

    period_s: float = 0.1
    policy: Optional[str] = None
    priority: Tuple[str, ...] = ()
    seed: int = 0
    every: str = 'period'
    release_identifiers: Optional[Tuple[str, ...]] = None
    max_age_s: Mapping[str, float] = {}
    service_timeout_s: Optional[float] = 10.0
    action_timeout_s: Optional[float] = None
    cancel_timeout_s: float = 5.0
    on_unknown: str = 'default'
    command_timeout_s: float = 1.0
    assumption_timeout_s: float = 30.0


OTHER_DEPLOYMENT = {
    'controller': ('command_timeout_s',),
    'layer': ('policy', 'priority', 'seed', 'every', 'assumption_timeout_s'),
}
"""
For each deployment the settings that mean something in the other one only.

A layer decides nothing.
"""


def settings_from(given: Mapping[str, Any]) -> Settings:
    """
    Return valid settings from named plain values; missing settings have their defaults.

    :raises SettingsError: A name is unknown or a value is wrong.
    """
    for name in given:
        if name not in Settings._fields:
            raise SettingsError(
                "there is no setting '{}'; {}".format(name, _hint(name, Settings._fields))
            )
    return validated(Settings(**given))


def validated(settings: Settings) -> Settings:
    """
    Return the same settings with numbers as floats and lists as tuples.

    :raises SettingsError: A value is wrong.
    """
    release = settings.release_identifiers
    return Settings(
        period_s=_seconds('period_s', settings.period_s, MINIMUM_PERIOD_S),
        policy=None if settings.policy is None else _choice('policy', settings.policy, POLICIES),
        priority=_names('priority', settings.priority),
        seed=_integer('seed', settings.seed),
        every=_choice('every', settings.every, EVERY),
        release_identifiers=None if release is None else _names('release_identifiers', release),
        max_age_s=_ages(settings.max_age_s),
        service_timeout_s=_optional_seconds('service_timeout_s', settings.service_timeout_s),
        action_timeout_s=_optional_seconds('action_timeout_s', settings.action_timeout_s),
        cancel_timeout_s=_seconds_or_zero('cancel_timeout_s', settings.cancel_timeout_s),
        on_unknown=_choice('on_unknown', settings.on_unknown, ON_UNKNOWN),
        command_timeout_s=_seconds_or_zero('command_timeout_s', settings.command_timeout_s),
        assumption_timeout_s=_seconds_or_zero(
            'assumption_timeout_s', settings.assumption_timeout_s
        ),
    )


def settings_for(settings: Settings, description: Description) -> Settings:
    """
    Return valid settings for a model: all names are known, all release identifiers listed.

    :raises SettingsError: A value is wrong, or a name is none of the model's.
    """
    checked = validated(settings)
    if checked.policy == 'strategy' and not description.has_strategy:
        raise SettingsError(
            "setting 'policy' is 'strategy', but the supervisor has none: its model has no goals"
        )
    default_s = Settings().assumption_timeout_s
    if checked.assumption_timeout_s != default_s and not description.has_strategy:
        raise SettingsError(
            "setting 'assumption_timeout_s' means nothing here: the supervisor has no strategy"
        )
    infos = description.communications
    _require_known(
        'priority',
        checked.priority,
        [i.name for i in infos if i.kind in _REQUEST_KINDS],
        'a request',
    )
    received = [info.identifier for info in infos if info.kind == 'outgoing message']
    _require_known(
        'max_age_s', checked.max_age_s, received, 'the identifier of an outgoing message'
    )
    published = [info.identifier for info in infos if info.kind == 'incoming message']
    release = checked.release_identifiers
    if release is None:
        return checked._replace(release_identifiers=default_release_identifiers(description))
    _require_known(
        'release_identifiers', release, published, 'the identifier of an incoming message'
    )
    return checked


def require_settings_of(settings: Settings, deployment: str) -> None:
    """
    Require the default of every setting that has no effect in a deployment.

    :param settings: Valid settings.
    :param deployment: `controller` or `layer`.
    :raises SettingsError: One has not.
    """
    defaults = Settings()._asdict()
    for name in OTHER_DEPLOYMENT[deployment]:
        if getattr(settings, name) != defaults[name]:
            raise SettingsError(
                "setting '{}' means nothing in the deployment '{}'".format(name, deployment)
            )


def default_release_identifiers(description: Description) -> Tuple[str, ...]:
    """List identifiers of incoming messages linked to Twist or TwistStamped, in source order."""
    found = (
        info.identifier
        for info in description.communications
        if info.kind == 'incoming message'
        and info.package == 'geometry_msgs'
        and info.interface in _ACTING_TYPES
    )
    return tuple(dict.fromkeys(found))


def _wrong(name: str, value: Any, expected: str) -> SettingsError:
    return SettingsError("setting '{}' is {!r}; it must be {}".format(name, value, expected))


def _hint(name: Any, known: Iterable[str]) -> str:
    there = sorted(set(known))
    close = difflib.get_close_matches(str(name), there, 1)
    if close:
        return "did you mean '{}'?".format(close[0])
    return 'there is ' + ', '.join(there) if there else 'there is none'


def _require_known(setting: str, names: Iterable[str], known: Iterable[str], what: str) -> None:
    there = list(known)
    for name in names:
        if name not in there:
            raise SettingsError(
                "setting '{}': '{}' is not {}; {}".format(setting, name, what, _hint(name, there))
            )


def _seconds(name: str, value: Any, least: float = 0.0) -> float:
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not is_number or not 0 < value < math.inf or value < least:
        expected = (
            'a number of seconds above 0' if least == 0.0 else '{:g} seconds or more'.format(least)
        )
        raise _wrong(name, value, expected)
    return float(value)


def _optional_seconds(name: str, value: Any) -> Optional[float]:
    return None if value is None else _seconds(name, value)


def _seconds_or_zero(name: str, value: Any) -> float:
    if isinstance(value, (int, float)) and not isinstance(value, bool) and 0 <= value < math.inf:
        return float(value)
    raise _wrong(name, value, 'a number of seconds, or 0 for never')


def _integer(name: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise _wrong(name, value, 'an integer')
    return value


def _choice(name: str, value: Any, choices: Tuple[str, ...]) -> str:
    if value not in choices:
        raise _wrong(name, value, 'one of ' + ', '.join(choices))
    return str(value)


def _names(name: str, value: Any) -> Tuple[str, ...]:
    if not isinstance(value, (list, tuple)) or not all(isinstance(item, str) for item in value):
        raise _wrong(name, value, 'a list of names')
    return tuple(dict.fromkeys(value))


def _ages(value: Any) -> Dict[str, float]:
    if not isinstance(value, Mapping):
        raise _wrong('max_age_s', value, 'seconds by identifier')
    return {
        identifier: _seconds('max_age_s of {}'.format(identifier), age)
        for identifier, age in value.items()
    }
