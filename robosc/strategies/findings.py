"""Findings about goals, missions and assumptions: what cannot be reached, is not needed, or can be broken."""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from robosc.automata.goal_memory import Aim, AimKind
from robosc.conditions.goals import assumption_text
from robosc.errors import Diagnostic, RelatedPlace, Severity
from robosc.model.places import Places
from robosc.model.structure import Deployment, Model
from robosc.source import Location

if TYPE_CHECKING:
    from robosc.strategies.blame import GoalBlame
    from robosc.strategies.synthesize import StrategyResult

MAXIMUM_RELATED = 5
"""Related places of one kind that a finding shows."""


def goal_findings(
    aims: Sequence[Aim], places: Places, result: "StrategyResult", blame: "GoalBlame | None" = None
) -> tuple[Diagnostic, ...]:
    """Return the diagnostics about a model's goals, missions and assumptions.

    Args:
        aims: Goals and visits of the model.
        places: Source locations of the model's parts.
        result: Result of the synthesis of a strategy.
        blame: Findings about what is to blame for goals that are not reached; None if nobody has looked for it.
    """
    found: list[Diagnostic] = []
    if result.unreached:
        found.append(_unreached(aims, places, result, blame))
    for number in result.preventable:
        found.append(
            Diagnostic(
                Severity.ERROR,
                "preventable-assumption",
                "the robot itself can keep this assumption from ever coming true again, and would reach its goals in "
                "name alone by that",
                places.assumptions[number],
                "Make it a goal as well, assume only what the surroundings decide, or write 'assume allow ...'.",
            )
        )
    if result.impossible:
        found.append(_impossible(places, result))
    for number in result.idle:
        found.append(
            Diagnostic(
                Severity.WARNING,
                "idle-goal",
                "this goal is true whenever the controller decides, so nothing is ever done for it",
                _place(places, aims[number]),
                "Compare it with what can happen, such as its numbers with the ranges of variables, or remove it.",
            )
        )
    for number in result.never_made:
        found.append(
            Diagnostic(
                Severity.WARNING,
                "visit-never-made",
                "no run makes this visit: its mission or detour never comes to it, or its condition is never true then",
                _place(places, aims[number]),
                "Compare it with the conditions behind 'while' and 'on', and with the visits before it, or remove it.",
            )
        )
    for number in result.unneeded:
        found.append(
            Diagnostic(
                Severity.WARNING,
                "unneeded-assumption",
                "every goal is reached without this assumption, too",
                places.assumptions[number],
                "Remove it: the less is assumed, the more surroundings the robot is good for.",
            )
        )
    return tuple(found)


def put_off_findings(
    aims: Sequence[Aim], places: Places, result: "StrategyResult", put_off: Iterable[int]
) -> tuple[Diagnostic, ...]:
    """Return the diagnostics about visits that the robot may leave unmade for ever by its own doing.

    Args:
        aims: Goals and visits of the model.
        places: Source locations of the model's parts.
        result: Result of the synthesis of a strategy.
        put_off: Numbers of these visits among the goals and visits, as the check of that strategy found them.
    """
    return tuple(
        Diagnostic(
            Severity.WARNING,
            "visit-put-off",
            "the robot may put this visit off for ever: its way there begins a detour of the mission, or ends what "
            "'while' asks for, and it need not come back to the visit",
            _place(places, aims[number]),
            "Let 'on' and 'while' speak about what the surroundings do, or about places that are not on the way.",
        )
        for number in put_off
        if number not in result.never_made
    )


def layer_goal_findings(model: Model, places: Places, deployment: Deployment) -> tuple[Diagnostic, ...]:
    """Return the diagnostic that goals and missions have no effect in a supervision layer, or none."""
    if not model.has_goals or deployment is not Deployment.LAYER:
        return ()
    what = goals_and_missions(model)
    found = [
        *(("this goal has no effect, either", place) for place in places.goals),
        *(("this mission has no effect, either", place) for place in places.missions),
        *(("this preference has no effect, either", place) for place in places.preferences),
    ]
    return (
        Diagnostic(
            Severity.WARNING,
            "goals-in-layer",
            f"{what} have no effect in a supervision layer: the existing controller decides what is requested",
            found[0][1],
            f"Use the deployment 'controller', or remove the {what}.",
            _related(found[1:]),
        ),
    )


def goals_and_missions(model: Model) -> str:
    """Return a word for what a model's strategy is to reach: goals, missions or both."""
    return " and ".join(word for word, items in (("goals", model.goals), ("missions", model.missions)) if items)


def _impossible(places: Places, result: "StrategyResult") -> Diagnostic:
    """Return the finding about assumptions that cannot come true."""
    first, *others = (places.assumptions[number] for number in result.impossible)
    what = "these assumptions cannot come true together" if others else "this assumption cannot come true"
    when = "whatever happens" if result.is_impossible_alone else "while the goals do"
    return Diagnostic(
        Severity.ERROR,
        "impossible-assumption",
        f"{what} again and again, {when}: every goal would be reached in name alone",
        first,
        "Correct the condition, or remove what does not come true.",
        _related([("this assumption belongs to them", place) for place in others]),
    )


def _unreached(aims: Sequence[Aim], places: Places, result: "StrategyResult", blame: "GoalBlame | None") -> Diagnostic:
    """Return the finding about what cannot be reached together.

    It stands at the last visit of a mission where there is one: the others are those that come before it.
    """
    unreached = [aims[number] for number in result.unreached]
    *others, last = unreached
    first, *others = unreached if last.kind is AimKind.GOAL else (last, *others)
    what = f"this {_word(first)}" if not others else f"these {_words(unreached)} together"
    if result.is_hopeless:
        message = f"{what} cannot be reached again and again, whatever the surroundings do"
        advice = (
            f"Look for the requirement or the transition that keeps the robot from it, or change the {_word(first)}."
        )
    else:
        message = f"the surroundings can keep {what} from coming true, for ever"
        advice = (
            "Assume what the surroundings do once the robot has done its part, look for what excludes the "
            f"{_word(first)}, or change it."
        )
    related = _related([(f"this {_word(aim)} belongs to them", _place(places, aim)) for aim in others])
    if blame is not None:
        message += _blamed(blame, is_hopeless=result.is_hopeless)
        found = [places.requirements[number] for number in blame.requirements]
        found += [places.invariants[number] for number in blame.invariants]
        related += _related([("this requirement is to blame", place) for place in found])
        if blame.helpful:
            written = " and ".join(f"'assume {assumption_text(item)}'" for item in blame.helpful)
            advice = f"Write {written}, if that is what the surroundings do, or change the {_word(first)}."
        elif blame.is_undone:
            advice = (
                "Name a state that only the robot leaves: a request makes this true, but the surroundings can undo it "
                "before the controller's next turn."
            )
    return Diagnostic(Severity.ERROR, "unreachable-goal", message, _place(places, first), advice, related)


def _blamed(blame: "GoalBlame", *, is_hopeless: bool) -> str:
    """Return the end of a message: which requirements are to blame."""
    count = len(blame.requirements) + len(blame.invariants)
    if not blame.is_known:
        return "; which requirements are to blame is not known: the search was given up"
    if count == 0:
        return ": the behaviours exclude it, without any requirement" if is_hopeless else ", even without requirements"
    if count == 1:
        return ": one requirement alone is enough for that"
    return f": {count} requirements are enough for that, and each of them is needed"


def _word(aim: Aim) -> str:
    return "goal" if aim.kind is AimKind.GOAL else "visit"


def _words(aims: Sequence[Aim]) -> str:
    return " and ".join(f"{word}s" for word in dict.fromkeys(map(_word, aims)))


def _place(places: Places, aim: Aim) -> Location:
    return places.goals[aim.number] if aim.mission is None else places.visits[aim.mission][aim.number]


def _related(found: Sequence[tuple[str, Location]]) -> tuple[RelatedPlace, ...]:
    """Return the first few places; the last of them says how many others there are."""
    shown = [RelatedPlace(message, location) for message, location in found[:MAXIMUM_RELATED]]
    if more := len(found) - len(shown):
        last = shown.pop()
        shown.append(
            RelatedPlace(f"{last.message} ({more} more {'is' if more == 1 else 'are'} not shown)", last.location)
        )
    return tuple(shown)
