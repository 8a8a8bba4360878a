"""Transitions that sentences of other languages mean."""

from robosc.language.phrases import OUTCOMES, PHRASES, Link, phrase_at
from robosc.language.requirement_advice import REASONS, TIME, RequirementReader
from robosc.language.sentence_parts import Advice
from robosc.language.tokens import Kind
from robosc.language.words import spelled

_NAME = int(Kind.NAME)
_LONGEST = 60
"""Tokens of a transition."""

_KINDS = frozenset({"request", "response", "feedback", "error", "cancel"})
_GOING = frozenset(
    ". = := -> : , do goto go set state to be is becomes become next enter entering return switch transition jump then "
    "move change into in current new".split()
)
"""Words that say in other languages which state comes next."""


class TransitionReader(RequirementReader):
    """Reads sentences among transitions."""

    def _transition(self, begin: int, end: int) -> Advice | None:
        """A sentence among transitions."""
        line = self._text.find("\n", self._starts[begin])
        while self._texts[end] not in ("}", "") and self._starts[end] < line and end - begin <= _LONGEST:
            end += 1
        return (
            self._elapsed(begin, end)
            or self._going(begin, end)
            or self._outcome(begin, end)
            or self._guarded(begin, end)
            or self._requirement_elsewhere(begin, end)
        )

    def _state(self, index: int, component: str) -> str:
        """The state of a component that a token names, perhaps in quotes; empty if it has none of that name."""
        name = self._texts[index].strip("\"'").removeprefix("^")
        part = self._vocabulary.components.get(component)
        return (
            next((each for each in part.states if each.casefold() == name.casefold()), "") if part is not None else ""
        )

    def _going(self, begin: int, end: int) -> Advice | None:
        """A transition that says in other words which state it leads to."""
        texts, component = self._texts, self._vocabulary.place(begin).component
        if texts[begin] != "on" or texts[begin + 1] not in _KINDS or texts[begin + 2] not in ("to", "from"):
            return None
        others = self._both_ways(begin, end, component)
        if others is not None:
            return others
        targets = [index for index in range(begin + 4, end) if self._state(index, component)]
        target = next(reversed(targets), None)
        is_state = any(texts[index].casefold().endswith("state") for index in range(begin + 4, end))
        if target is None and is_state and self._kinds[end - 1] == _NAME:
            target = end - 1
        if target is None:
            return None
        name = self._state(target, component) or texts[target]
        # The updates before it may be sound.
        for first in range(begin + 4, target + 1):
            words = [texts[index] for index in range(first, end) if index != target]
            is_going = all(
                word.casefold() in _GOING or word.casefold().endswith("state") or word == component for word in words
            )
            if texts[first] == "goto" and first + 2 == end and target == first + 1 and self._kinds[target] == _NAME:
                # So it is written here, too.
                return None
            if is_going and (first == begin + 4 or ":=" in texts[begin + 4 : first]):
                meant = f"{self._written(begin, first)} goto {spelled(name)}"
                word = self._written(first, end)
                # The first word of its own is the one that is strange.
                strange = first + (texts[first] in ("do", "goto") and first + 1 < end)
                return Advice(strange, word, "'goto' leads to a state, which is no variable", begin, end, meant)
        return None

    def _both_ways(self, begin: int, end: int, component: str) -> Advice | None:
        """A transition with another way after a failure: `on response from R goto A else goto B`."""
        words = self._words(list(range(begin, end)))
        for at in range(5, len(words) - 1):
            phrase = phrase_at(words, at, PHRASES)
            is_behind_target = self._texts[begin + at - 2] == "goto"
            if phrase is not None and phrase[0] is Link.ELSE and is_behind_target:
                state = self._state(end - 1, component)
                if not state or self._texts[begin + 1] != "response":
                    return None
                first = self._written(begin, begin + at)
                meant = f"{first} on error from {self._texts[begin + 3]} goto {spelled(state)}"
                word = self._written(begin + at, begin + phrase[1])
                return Advice(begin + at, word, REASONS[Link.ELSE], begin, end, meant)
        return None

    def _outcome(self, begin: int, end: int) -> Advice | None:
        """An outcome of the request that is running, without its name: `on failure goto lost`."""
        place = self._vocabulary.place(begin)
        event = OUTCOMES.get(self._texts[begin + 1].casefold())
        if self._texts[begin] != "on" or event not in ("response", "error") or self._texts[begin + 2] in ("to", "from"):
            return None
        here = f"{place.component}.{spelled(place.state)}"
        asked = [item for item in self._vocabulary.messages.values() if item.kind in ("service", "action")]
        running = [item for item in asked if item.states.get("request") == here]
        own = [item for item in asked if item.component == place.component]
        message = next(iter((*running, *own)), None)
        if message is None:
            return None
        meant = f"on {event} from {spelled(message.name)} {self._written(begin + 2, end)}"
        word = self._texts[begin + 1]
        return Advice(begin + 1, word, f"say what it comes from, as in 'on {event} from'", begin, end, meant)

    def _guarded(self, begin: int, end: int) -> Advice | None:
        """A transition that nothing but its condition begins: `when L.near goto idle`."""
        texts, component = self._texts, self._vocabulary.place(begin).component
        words = self._words(range(begin, end))
        phrase = phrase_at(words, 0, PHRASES)
        goto = next((index for index in range(begin, end) if texts[index] == "goto"), end)
        if phrase is None or phrase[0] is not Link.IF or goto + 2 != end:
            return None
        operand = self._operand(range(begin + phrase[1], goto))
        state = self._state(goto + 1, component)
        if operand is None or not operand.condition or not state:
            return None
        meant = f"transition if {operand.condition} goto {spelled(state)}"
        reason = "what a condition alone begins is a 'transition if'"
        return Advice(begin, self._written(begin, begin + phrase[1]), reason, begin, end, meant)

    def _elapsed(self, begin: int, end: int) -> Advice | None:
        """A transition after some time."""
        _, times = self._without_times(list(range(begin, end)))
        component = self._vocabulary.place(begin).component
        targets = [state for index in range(begin, end) if (state := self._state(index, component))]
        if not times or not targets:
            return None
        index, time = times[0]
        timer, elapsed = self._timer()
        meant = f"on response from {elapsed} goto {spelled(targets[-1])}"
        more = f"component {timer} {{ outgoing message {elapsed} with type: none }}"
        word = self._written(index, index + time.end - time.begin)
        return Advice(index, word, TIME, begin, end, meant, more)

    def _requirement_elsewhere(self, begin: int, end: int) -> Advice | None:
        """A sentence that is a requirement, which stands in the robot."""
        clue = self._clue(begin, end, ())
        meant = self._meaning(range(begin, end)) if clue is not None else ""
        if clue is None or not meant.startswith("requirement "):
            return None
        return Advice(clue[0], clue[1], clue[2], begin, end, "", meant)


__all__ = ["TransitionReader"]
