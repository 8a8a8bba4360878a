"""Synthesis of a system of many independent parts: each by itself, which gives the same as all of them together."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from math import prod

from msgspec.structs import replace

from robosc.automata.compile import subjects_read
from robosc.automata.parts import independent_parts
from robosc.automata.structure import System
from robosc.synthesis.engines import EngineOptions
from robosc.synthesis.questions import Answers, Questions, Restriction
from robosc.synthesis.result import SynthesisProgress, SynthesisResult, SynthesisStatus, statistics_of
from robosc.synthesis.synthesize import synthesize

SMALLEST = 50
"""Automata from which a system is taken apart: below that the whole takes milliseconds."""


@dataclass(frozen=True, slots=True)
class _Part:
    """A part with the questions about it.

    Attributes:
        system: The part.
        questions: Those about its events and automata.
        restrictions: Places of its restrictions among all.
        invariants: Places of its invariants among all.
    """

    system: System
    questions: Questions
    restrictions: tuple[int, ...]
    invariants: tuple[int, ...]


def synthesize_in_parts(
    system: System,
    *,
    engine: str | EngineOptions = "auto",
    questions: Questions,
    should_stop: Callable[[], bool],
    on_progress: Callable[[SynthesisProgress], None],
    smallest: int = SMALLEST,
) -> SynthesisResult:
    """Synthesize the supervisor of a system, part by part where it has many that are independent.

    Rivals, and what one requirement restricts, stay in one part, so that every question is about one. Arguments and
    errors are those of `synthesize`, and `smallest` is the number of automata from which a system is taken apart.
    """
    parts = [system]
    if len(system.automata) >= smallest:
        parts = list(independent_parts(system, _together(system, questions)))

    def of(part: System, asked: Questions) -> SynthesisResult:
        return synthesize(part, engine=engine, questions=asked, should_stop=should_stop, on_progress=on_progress)

    if len(parts) == 1:
        return of(system, questions)
    made: list[tuple[_Part, SynthesisResult]] = []
    for part in _asked(system, parts, questions):
        result = of(part.system, part.questions)
        if result.status is SynthesisStatus.EMPTY:
            return result
        if result.initial is not None:
            # One diagram says where the whole may begin.
            return of(system, questions)
        made.append((part, result))
    return _whole(system, made, questions)


def _together(system: System, questions: Questions) -> Iterator[tuple[str, ...]]:
    yield from questions.rivals
    for item in questions.restrictions:
        yield tuple(_events_of(system, item))


def _events_of(system: System, restriction: Restriction) -> Iterator[str]:
    yield from (system.conditions[place].event for place in restriction.conditions)
    yield from (item.event for item in restriction.watched)


def _asked(system: System, parts: list[System], questions: Questions) -> Iterator[_Part]:
    """Each part with its questions, whose places are those of the part."""
    part_of_event = {event.name: number for number, part in enumerate(parts) for event in part.events}
    part_of_automaton = {item.name: number for number, part in enumerate(parts) for item in part.automata}
    # Parts keep the order of conditions and invariants.
    conditions: list[dict[int, int]] = [{} for _ in parts]
    for place, condition in enumerate(system.conditions):
        own = conditions[part_of_event[condition.event]]
        own[place] = len(own)
    invariants: list[dict[int, int]] = [{} for _ in parts]
    part_of_invariant: list[int] = []
    for place, invariant in enumerate(system.invariants):
        number = part_of_automaton[next(iter(subjects_read(invariant))).automaton]
        invariants[number][place] = len(invariants[number])
        part_of_invariant.append(number)
    restrictions: list[list[int]] = [[] for _ in parts]
    for place, item in enumerate(questions.restrictions):
        numbers = {part_of_event[event] for event in _events_of(system, item)}
        numbers |= {part_of_invariant[invariant] for invariant in item.invariants}
        # The first part answers for a restriction of nothing.
        for number in numbers or {0}:
            restrictions[number].append(place)

    def of_events(events: Iterable[str]) -> list[tuple[str, ...]]:
        found: list[list[str]] = [[] for _ in parts]
        for event in events:
            found[part_of_event[event]].append(event)
        return list(map(tuple, found))

    events, prompted, silent = map(of_events, (questions.events, questions.prompted, questions.silent))
    prompts, changing = of_events(questions.prompts), of_events(questions.changing)
    rivals: list[list[tuple[str, ...]]] = [[] for _ in parts]
    for group in filter(None, questions.rivals):
        rivals[part_of_event[group[0]]].append(group)
    locations: list[list[tuple[str, str]]] = [[] for _ in parts]
    for location in questions.locations:
        locations[part_of_automaton[location[0]]].append(location)
    for number, part in enumerate(parts):
        own_restrictions = (
            replace(
                questions.restrictions[place],
                conditions=tuple(conditions[number][item] for item in questions.restrictions[place].conditions),
                invariants=tuple(invariants[number][item] for item in questions.restrictions[place].invariants),
            )
            for place in restrictions[number]
        )
        own_questions = Questions(
            events=events[number],
            restrictions=tuple(own_restrictions),
            rivals=tuple(rivals[number]),
            locations=tuple(locations[number]),
            prompted=prompted[number],
            prompts=frozenset(prompts[number]),
            changing=frozenset(changing[number]),
            silent=silent[number],
        )
        yield _Part(part, own_questions, tuple(restrictions[number]), tuple(invariants[number]))


def _whole(system: System, made: list[tuple[_Part, SynthesisResult]], questions: Questions) -> SynthesisResult:
    """The result of the whole from those of its parts."""
    results = [result for _, result in made]
    figures = [result.statistics for result in results]
    added = {item.event: item for result in results for item in result.added}
    never = {
        item.event: replace(item, invariants=tuple(part.invariants[place] for place in item.invariants))
        for part, result in made
        for item in result.answers.never
    }
    unused = {part.restrictions[place] for part, result in made for place in result.answers.unused}
    unreached = {item for result in results for item in result.answers.unreached}
    unprompted = {item.event: item for result in results for item in result.answers.unprompted}
    together = [item for result in results for item in result.answers.together]
    groups = {event: place for place, group in enumerate(questions.rivals) for event in group}
    answers = Answers(
        never=tuple(never[event] for event in questions.events if event in never),
        unused=tuple(sorted(unused)),
        together=tuple(sorted(together, key=lambda item: groups[item.first])),
        unreached=tuple(item for item in questions.locations if item in unreached),
        unprompted=tuple(unprompted[event] for event in questions.prompted if event in unprompted),
    )
    statistics = statistics_of(figures, states=prod(item.states for item in figures), parts=len(figures))
    return SynthesisResult(
        SynthesisStatus.SUPERVISOR,
        tuple(added[event.name] for event in system.events if event.name in added),
        statistics,
        answers=answers,
        parts=tuple((part.system, result) for part, result in made),
    )
