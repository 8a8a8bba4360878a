"""Builds and checks the missions and preferences of a robot."""

from collections.abc import Iterable, Mapping, Sequence

from robosc.errors import RelatedPlace
from robosc.expressions import Expression
from robosc.language import syntax
from robosc.model.expression_checker import ExpressionChecker
from robosc.model.findings import Findings
from robosc.model.places import Places
from robosc.model.preferences import contradiction
from robosc.model.structure import MAXIMUM_VISITS, Communication, Detour, Mission, Preference
from robosc.model.units import unique

_MOST_SHOWN = 6
"""Names of a circle of preferences that are shown."""


def build_missions(
    items: Iterable[syntax.Item], checker: ExpressionChecker, findings: Findings, places: Places
) -> tuple[Mission, ...]:
    """The missions of the model that are sound, in source order; notes where they stand.

    Args:
        items: Definitions of the robot; imports bring no missions.
        checker: Checker that resolves expressions of the robot.
        findings: Findings to which faults are reported.
        places: Places to which those of the sound ones are added.
    """
    trees = [item for item in items if isinstance(item, syntax.Mission)]
    unique([tree.name for tree in trees], "duplicate-mission", "mission", findings)
    missions: list[Mission] = []
    for tree in trees:
        condition = None if tree.condition is None else checker.condition(tree.condition)
        for part in (tree.visits, *(detour.visits for detour in tree.detours)):
            _check_number(part, findings)
        visits = _visits(tree.visits, checker)
        detours = [_detour(detour, checker) for detour in tree.detours]
        sound = tuple(detour for detour in detours if detour is not None)
        is_sound = visits is not None and len(sound) == len(detours)
        if not is_sound or visits is None or (condition is None and tree.condition is not None):
            continue
        missions.append(Mission(tree.name.text, visits, condition, sound))
        places.missions.append(tree.location)
        own = (tree.visits, *(detour.visits for detour in tree.detours))
        places.visits.append(tuple(visit.location for part in own for visit in part))
    return tuple(missions)


def _check_number(trees: Sequence[syntax.Visit], findings: Findings) -> None:
    """Report visits of a mission, or of one of its detours, that are too many."""
    if len(trees) > MAXIMUM_VISITS:
        findings.error(
            "too-many-visits",
            f"these are {len(trees)} visits in a row; a mission, and each of its detours, has at most {MAXIMUM_VISITS}",
            trees[MAXIMUM_VISITS].location,
            "Leave out the visits from here on, or move them to another mission, which is approached beside this one.",
        )


def _visits(trees: Iterable[syntax.Visit], checker: ExpressionChecker) -> tuple[Expression, ...] | None:
    """The conditions of visits; None where one of them is broken."""
    found = [checker.condition(tree.condition) for tree in trees]
    sound = tuple(item for item in found if item is not None)
    return sound if len(sound) == len(found) else None


def _detour(tree: syntax.Detour, checker: ExpressionChecker) -> Detour | None:
    trigger, visits = checker.condition(tree.trigger), _visits(tree.visits, checker)
    return None if trigger is None or visits is None else Detour(trigger, visits)


def build_preferences(
    items: Sequence[syntax.Item],
    communications: Mapping[str, Communication],
    findings: Findings,
    places: Places,
) -> tuple[Preference, ...]:
    """The preferences of the model that are sound, in source order; notes where they stand.

    Args:
        items: Definitions of the robot; imports bring no preferences.
        communications: Every communication of the robot by name.
        findings: Findings to which faults are reported.
        places: Places to which those of the sound ones are added.
    """
    has_goals = any(isinstance(item, syntax.Goal | syntax.Mission) for item in items)
    preferences: list[Preference] = []
    for tree in items:
        if not isinstance(tree, syntax.Preference):
            continue
        sides = [_requests(names, communications, findings) for names in (tree.preferred, tree.others)]
        preferred, others = sides
        if preferred is None or others is None:
            continue
        preferences.append(Preference(preferred, others))
        places.preferences.append(tree.location)
        if not has_goals:
            findings.warning(
                "unused-preference",
                "this preference has no effect: without a goal or a mission, no strategy chooses among requests",
                tree.location,
                "Write a goal or a mission, or remove the preference.",
            )
        elif not preferred or not others:
            findings.warning(
                "unused-preference",
                "this preference has no effect: one of its sides names no request",
                tree.location,
                "Name a request on each side of 'over', or remove the preference.",
            )
    _check_order(preferences, findings, places)
    return tuple(preferences)


def _requests(
    names: Iterable[syntax.Name], communications: Mapping[str, Communication], findings: Findings
) -> tuple[str, ...] | None:
    """The names of communications with a request; None where one is not."""
    found: dict[str, None] = {}
    is_sound = True
    for name in names:
        request = findings.request_of(
            name,
            communications,
            "preference-on-outgoing",
            "a component sends it, and no strategy chooses it",
            "Name an incoming message, a service or an action.",
        )
        if request is None:
            is_sound = False
        else:
            found[name.text] = None
    return tuple(found) if is_sound else None


def _check_order(preferences: Sequence[Preference], findings: Findings, places: Places) -> None:
    """Report preferences that no order of requests obeys."""
    circle = contradiction(preferences)
    if circle is None:
        return
    *others, last = sorted(set(circle.preferences))
    # The words of the last of them are shown first.
    begin = circle.preferences.index(last)
    names = (*circle.names[begin:], *circle.names[:begin], circle.names[begin])
    shown = names if len(names) <= _MOST_SHOWN else (*names[: _MOST_SHOWN - 1], "...", names[-1])
    words = [f"'{name}'" if name != "..." else name for name in shown]
    findings.error(
        "contradictory-preferences",
        f"no order of requests has {' before '.join(words)}"
        if len(names) > 2
        else f"no request comes before itself, as {words[0]} would here",
        places.preferences[last],
        "Remove this preference, or one of those that it contradicts." if others else "Remove the name from one side.",
        *(
            RelatedPlace("this preference belongs to them", places.preferences[number])
            for number in others[:_MOST_SHOWN]
        ),
    )


__all__ = ["build_missions", "build_preferences"]
