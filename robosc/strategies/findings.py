"""Findings about goals: those that cannot be reached, assumptions that are not needed or that the robot can break."""

from collections.abc import Sequence

from robosc.conditions.goals import assumption_text
from robosc.errors import Diagnostic, RelatedPlace, Severity
from robosc.model.places import Places
from robosc.model.structure import Deployment, Model
from robosc.source import Location
from robosc.strategies.blame import GoalBlame
from robosc.strategies.synthesize import StrategyResult


def goal_findings(places: Places, result: StrategyResult, blame: GoalBlame | None = None) -> tuple[Diagnostic, ...]:
    """Return the diagnostics about a model's goals and assumptions.

    Args:
        places: Source locations of the model's parts.
        result: Result of the synthesis of a strategy.
        blame: Findings about what is to blame for goals that are not reached; None if nobody has looked for it.
    """
    found: list[Diagnostic] = []
    if result.unreached:
        found.append(_unreached(places, result, blame))
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


def layer_goal_findings(model: Model, places: Places, deployment: Deployment) -> tuple[Diagnostic, ...]:
    """Return the diagnostic that goals have no effect in a supervision layer, or none."""
    if not model.goals or deployment is not Deployment.LAYER:
        return ()
    return (
        Diagnostic(
            Severity.WARNING,
            "goals-in-layer",
            "goals have no effect in a supervision layer: the existing controller decides what is requested",
            places.goals[0],
            "Use the deployment 'controller', or remove the goals.",
            _related("this goal neither", places.goals[1:]),
        ),
    )


def _unreached(places: Places, result: StrategyResult, blame: GoalBlame | None) -> Diagnostic:
    first, *others = result.unreached
    what = "this goal" if not others else "these goals together"
    if result.is_hopeless:
        message = f"{what} cannot be reached again and again, whatever the surroundings do"
        advice = "Look for the requirement or the transition that keeps the robot from it, or change the goal."
    else:
        message = f"the surroundings can keep {what} from coming true, for ever"
        advice = (
            "Assume what the surroundings do once the robot has done its part, look for what excludes the goal, or "
            "change it."
        )
    related = _related("this goal belongs to them", [places.goals[number] for number in others])
    if blame is not None:
        message += _blamed(blame, is_hopeless=result.is_hopeless)
        found = [places.requirements[number] for number in blame.requirements]
        found += [places.invariants[number] for number in blame.invariants]
        related += _related("this requirement is to blame", found)
        if blame.helpful:
            written = " and ".join(f"'assume {assumption_text(item)}'" for item in blame.helpful)
            advice = f"Write {written}, if that is what the surroundings do, or change the goal."
    return Diagnostic(Severity.ERROR, "unreachable-goal", message, places.goals[first], advice, related)


def _blamed(blame: GoalBlame, *, is_hopeless: bool) -> str:
    """Return the end of a message: which requirements are to blame."""
    count = len(blame.requirements) + len(blame.invariants)
    if not blame.is_known:
        return "; which requirements are to blame is not known: the search was given up"
    if count == 0:
        return ": the behaviours exclude it, without any requirement" if is_hopeless else ", even without requirements"
    if count == 1:
        return ": one requirement alone is enough for that"
    return f": {count} requirements are enough for that, and each of them is needed"


def _related(message: str, locations: Sequence[Location]) -> tuple[RelatedPlace, ...]:
    return tuple(RelatedPlace(message, location) for location in locations[:5])
