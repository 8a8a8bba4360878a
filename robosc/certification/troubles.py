"""Findings about what synthesis has to forbid: requests that can never happen, and cancels that must be possible.

Each says what would follow, and how to mend the model, as far as a mend was tried out and found to help.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import suppress

import msgspec

from robosc import explanation as explanations
from robosc.automata.compile import State
from robosc.automata.state import Subject, subjects
from robosc.certification.mending import Mend, working_mend
from robosc.controller_properties import ForbiddenCancel, Properties
from robosc.controller_properties.findings import MAXIMUM_EVENTS
from robosc.errors import Diagnostic, NodeLimitError, RelatedPlace, Severity
from robosc.explanation import ModelWords, Trouble
from robosc.model.places import Places
from robosc.model.structure import EventKind, Model
from robosc.source import Location
from robosc.synthesis import Answers, Cause, EngineOptions

CODE = "forbidden-cancel"
"""Code of the finding about a cancel that must be possible."""

MAXIMUM_EVENTS_TOLD = 5
"""Events that can never happen of which it is worked out what would follow them."""

MAXIMUM_NODES = 50_000
"""Nodes of a synthesis beyond which none of these searches, each of which takes some more of them, is begun."""


class Synthesized(msgspec.Struct, frozen=True):
    """A synthesis whose result is told.

    Attributes:
        words: The automata of the model, with the words for them.
        nodes: Most nodes of diagrams that it needed.
        engine: Engine for decision diagrams.
        should_stop: Function called before each step; once true, the work ends.
    """

    words: ModelWords
    nodes: int
    engine: str | EngineOptions
    should_stop: Callable[[], bool]

    def troubles(self, asked: Sequence[tuple[str, State | None]]) -> tuple[Trouble | None, ...]:
        """Return for each event the trouble that it leads to in a state, as far as that is found out."""
        with suppress(NodeLimitError):
            if asked and self._is_small:
                return explanations.troubles_after(self.words, asked, engine=self.engine, should_stop=self.should_stop)
        return (None,) * len(asked)

    def mend(self, event: str, stands: Sequence[tuple[str, str]], wanted: str) -> Mend | None:
        """Return a mend for what an event leads to with which synthesis allows what is wanted, or None."""
        if not self._is_small:
            return None
        model, deployment = self.words.model, self.words.deployment
        return working_mend(model, event, stands, wanted, deployment, engine=self.engine, should_stop=self.should_stop)

    @property
    def _is_small(self) -> bool:
        return self.nodes <= MAXIMUM_NODES


def told_troubles(made: Synthesized, answers: Answers) -> dict[str, tuple[str, str]]:
    """Return reason and remedy for the requests that can never happen because of what could follow them.

    Args:
        made: The synthesis.
        answers: Answers about the controlled system.

    Raises:
        SynthesisCancelled: `should_stop` became true.
    """
    asked = [
        item.event
        for item in answers.never
        if item.cause is Cause.SUPERVISOR and item.is_reached and item.event.endswith(f".{EventKind.REQUEST}")
    ][:MAXIMUM_EVENTS_TOLD]
    found = made.troubles([(event, None) for event in asked])
    told: dict[str, tuple[str, str]] = {}
    for event, trouble in zip(asked, found, strict=True):
        if trouble is not None:
            told[event] = trouble.words, _way_back(made, event, trouble)
    return told


def _way_back(made: Synthesized, request: str, trouble: Trouble) -> str:
    """Return how to mend a model in which something is stuck after a request."""
    words = made.words
    stands = [] if trouble.state is None else list(_stands(words, trouble.state, trouble.stuck))
    if stands and trouble.events and _is_of_call(words.model, trouble.events[-1]):
        mend = made.mend(trouble.events[-1], stands, request)
        if mend is not None:
            return f"{mend}."
    name = request.rpartition(".")[0]
    see = f"run 'robosc explain-synthesis --event {name}' to see the states on the way."
    if stands:
        component, state = stands[0]
        return f"Let something that can happen then lead {component} from '{state}' back to a marked state; {see}"
    return f"Let something lead back to a marked state from there, or keep what leads there from happening; {see}"


def _is_of_call(model: Model, event: str) -> bool:
    """Return True if a behaviour can be told by one more transition where an event leads to."""
    name, _, kind = event.rpartition(".")
    return kind in (EventKind.ERROR, EventKind.CANCEL, EventKind.RESPONSE) and any(
        item.name == name for item in model.communications
    )


def _stands(words: ModelWords, state: State, components: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield components with the state that each is in."""
    values = dict(zip(subjects(words.system), state, strict=True))
    behaving = {item.name for item in words.model.components if item.behaviour is not None}
    for name in components:
        if name in behaving:
            yield name, str(values[Subject(name)])


def forbidden_cancel_findings(made: Synthesized, properties: Properties, *, only_shown: bool) -> tuple[Diagnostic, ...]:
    """Return the findings about cancels that the executor asks for and that the supervisor forbids.

    Args:
        made: The synthesis.
        properties: Results of the check of the controller.
        only_shown: True if they are warnings, because the supervisor is not to be executed.

    Raises:
        SynthesisCancelled: `should_stop` became true.
    """
    words = made.words
    model, places = words.model, words.places
    if properties.cancels == "not checked":
        return (
            Diagnostic(
                Severity.WARNING,
                CODE,
                "the supervisor forbids a cancel somewhere, and it was not found out whether it is wanted there: "
                f"{properties.method}",
                places.robot,
                "Let no requirement, range or missing way back to a marked state forbid what follows a cancel.",
            ),
        )
    found = made.troubles([(item.event, item.state) for item in properties.forbidden])
    return tuple(
        Diagnostic(
            Severity.WARNING if only_shown else Severity.ERROR,
            CODE,
            f"'{item.action}' cannot be cancelled {_after(item.trace)}, though {_fallen(item)}: "
            + ("synthesis forbids it" if trouble is None else f"after {item.event}, {trouble.words}"),
            _place(model, places, item, words),
            _mended(made, item),
            tuple(_related(model, places, item)),
        )
        for item, trouble in zip(properties.forbidden, found, strict=True)
    )


def without_consequences(model: Model, answers: Answers, forbidden: Collection[str]) -> Answers:
    """Return answers without those that follow from forbidden cancels: these never happen, nor lead anywhere.

    Args:
        model: The model.
        answers: Answers about the controlled system.
        forbidden: The cancels.
    """

    def is_consequence(name: str, state: str) -> bool:
        behaviour = model.component(name).behaviour
        leading = [item.event for item in behaviour.transitions if item.target == state] if behaviour else []
        return bool(leading) and all(event in forbidden for event in leading)

    return msgspec.structs.replace(
        answers,
        never=tuple(item for item in answers.never if item.event not in forbidden),
        unreached=tuple(item for item in answers.unreached if not is_consequence(*item)),
    )


def _after(trace: Sequence[str]) -> str:
    shown = ", ".join(trace[:MAXIMUM_EVENTS])
    return f"after {shown}" + (f", ... ({len(trace)} in all)" if len(trace) > MAXIMUM_EVENTS else "")


def _fallen(item: ForbiddenCancel) -> str:
    if len(item.fallen) == 1:
        return "a requirement on it does not hold any more"
    return f"{len(item.fallen)} requirements on it do not hold any more"


def _requirements(model: Model, places: Places, action: str) -> list[Location]:
    """Return the places of the requirements on an action, in their order."""
    return [
        place
        for requirement, place in zip(model.requirements, places.requirements, strict=True)
        if action in requirement.communications
    ]


def _related(model: Model, places: Places, item: ForbiddenCancel) -> Iterator[RelatedPlace]:
    found = _requirements(model, places, item.action)
    for number in item.fallen:
        yield RelatedPlace("this requirement does not hold there, and asks for the cancel", found[number])


def _place(model: Model, places: Places, item: ForbiddenCancel, words: ModelWords) -> Location:
    """Return the place of the transition that the cancel would take, else of the action."""
    for name, state in _stands(words, item.state, (component.name for component in model.components)):
        behaviour = model.component(name).behaviour
        for place, transition in zip(places.transitions[name], behaviour.transitions if behaviour else (), strict=True):
            if transition.event == item.event and transition.source == state:
                return place
    return places.communications[item.action]


def _mended(made: Synthesized, item: ForbiddenCancel) -> str:
    """Return how to mend a model in which a cancel is forbidden."""
    model = made.words.model
    heard = {f"{item.action}.{kind}" for kind in EventKind}
    following = [
        component.name
        for component in model.components
        if component.behaviour and any(transition.event in heard for transition in component.behaviour.transitions)
    ]
    stands = list(_stands(made.words, item.state, following))
    mend = made.mend(item.event, stands, item.event)
    why = f"'{item.event}' comes when the goal has ended, and nothing follows it"
    if mend is not None:
        return f"{mend}: {why}."
    return (
        f"Let every state that '{item.event}' leads to keep what must always hold, and have a way back to a marked "
        f"state: {why}; run 'robosc explain-synthesis --event {item.event}' to see what it leads into."
    )
