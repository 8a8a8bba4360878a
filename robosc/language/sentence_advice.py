"""Advice on sentences of other languages: the line that says in this language what one of them means.

People who know behaviour trees, SMACH or temporal logic write an order, a time, an implication, a permission, a cancel
or a fallback as a sentence. `phrases` has the words. What stands between them is looked up among the names of the text,
so that the line can be written as it is.
"""

from collections.abc import Container, Sequence

from robosc.language.phrases import MOODS, PHRASES, Link, Time, phrase_at
from robosc.language.requirement_advice import REASONS
from robosc.language.sentence_parts import Advice, age_text
from robosc.language.transition_advice import TransitionReader
from robosc.language.type_path_advice import TypePathReader

MAXIMUM_SENTENCE = 60
"""Tokens of a sentence."""
_HEADS = frozenset({"requirement", "goal", "rule", "assume"})


class SentenceReader(TransitionReader, TypePathReader):
    """Reads sentences."""

    def read(self, begin: int, end: int, items: Container[str]) -> Advice | None:
        """Return what a sentence means.

        Args:
            begin: Its first token.
            end: Token behind its last one.
            items: Words that begin the items of the list that it stands in.
        """
        if end - begin > MAXIMUM_SENTENCE:
            return None
        if "component" in items:
            return self._definition(begin, end)
        if "visit" in items:
            return self._visits(begin, end)
        if "incoming" in items:
            return self._communication(begin, end)
        return self._transition(begin, end) if "transition" in items else None

    def _definition(self, begin: int, end: int) -> Advice | None:
        head = self._texts[begin].casefold()
        if head in ("interface", "import", "from"):
            return self._interface(begin, end)
        first = begin + (head in _HEADS)
        indices, times = self._without_times(list(range(first, end)))
        # Words of temporal logic.
        temporal = [word.casefold() for word in self._texts[first : first + 2]]
        is_eventual = head == "requirement" and "eventually" in (temporal[0], temporal[-1])
        if head == "prefer":
            return self._preference(begin, end)
        clue = self._clue(first, end, times, ("disables", "needs"))
        if clue is None and is_eventual:
            clue = first, self._texts[first], "what is to be reached is a 'goal'"
        if clue is None:
            return None
        index, word, reason = clue
        aged = self._aged(indices, times)
        if aged is not None:
            return Advice(index, word, reason, begin, end, age=aged)
        meant = self._goal(indices, head) if head in ("goal", "assume") else self._meaning(indices)
        if not meant and is_eventual:
            meant = self._goal(indices, "goal")
        if not meant and times and head not in ("goal", "assume"):
            meant = self._timed(indices)
        if not meant:
            meant = self._node(indices)
        return Advice(index, word, reason, begin, end, meant) if meant else None

    def _aged(self, indices: Sequence[int], times: Sequence[tuple[int, Time]]) -> tuple[str, str] | None:
        """The sensor's message that a time is about, and its greatest age; None: it is about something else."""
        if not times or not times[0][1].seconds:
            return None
        for index in indices:
            message = self._vocabulary.messages.get(self._texts[index].casefold())
            if message is not None and not message.is_requested and "." not in self._texts[index - 1 : index]:
                return message.name, age_text(times[0][1].seconds)
        return None

    def _timed(self, indices: Sequence[int]) -> str:
        """A request that has to wait: a component that a timer's message leads on."""
        operand = self._action(indices)
        if operand is None or not operand.request:
            return ""
        timer, elapsed = self._timer()
        return (
            f"component {timer} {{ outgoing message {elapsed} with type: none behaviour {{ initial marked state "
            f"waiting {{ on response from {elapsed} goto over }} marked state over {{ on request to {operand.request} "
            f"goto waiting }} }} }} requirement {operand.request} needs {timer}.over"
        )

    def _goal(self, indices: Sequence[int], head: str) -> str:
        """A goal or an assumption, or a mission where what is to be reached has an order."""
        indices = list(indices)
        words = self._words(indices)
        while words and ((found := phrase_at(words, 0, MOODS)) is not None or not words[0]):
            end = found[1] if found is not None else 1
            indices, words = indices[end:], words[end:]
        visits = self._in_order(indices)
        if not visits:
            return ""
        if len(visits) == 1:
            return f"{head} always eventually {visits[0]}"
        return f"assume {visits[0]} leads to {visits[1]}" if head == "assume" else self._mission(visits)

    def _in_order(self, indices: Sequence[int]) -> list[str]:
        """The conditions that a sentence visits one after the other; none: they are not known."""
        visits: list[str] = []
        words = self._words(indices)
        link, begin = Link.THEN, 0
        at = 0
        while at <= len(words):
            phrase = phrase_at(words, at, PHRASES) if at < len(words) else (Link.THEN, at + 1)
            if phrase is None or phrase[0] not in (Link.THEN, Link.AFTER, Link.ELSE):
                at += 1
                continue
            part = [
                index for index in indices[begin:at] if self._texts[index] not in ("visit", "try", "either", "then")
            ]
            if part:
                operand = self._operand(part)
                text = operand.condition if operand is not None and operand.condition else self._plain(part)
                if not text:
                    return []
                if link is Link.ELSE and visits:
                    visits[-1] = f"{visits[-1]} or {text}"
                else:
                    visits.insert(max(0, len(visits) - 1) if link is Link.AFTER else len(visits), text)
            link = phrase[0] if part or phrase[0] is not Link.THEN else link
            begin = at = phrase[1]
        return visits

    def _visits(self, begin: int, end: int) -> Advice | None:
        """The visits of a mission."""
        while self._texts[end] not in ("}", "on", "") and end - begin <= MAXIMUM_SENTENCE:
            end += 1
        indices, times = self._without_times(list(range(begin, end)))
        clue = self._clue(begin + (self._texts[begin] == "visit"), end, times, ("then", ";"))
        if clue is None:
            return None
        visits = self._in_order(indices)
        if not visits:
            return None
        index, word, reason = clue
        return Advice(index, word, reason, begin, end, f"visit {' then '.join(visits)}")

    def _preference(self, begin: int, end: int) -> Advice | None:
        words = self._words(list(range(begin, end)))
        links = [item for item in self._links(words) if item[0] in (Link.ELSE, Link.THEN, Link.AFTER, Link.UNLESS)]
        if len(links) != 1:
            return None
        _, at, behind = links[0]
        first, second = (self._action(range(begin + 1, begin + at)), self._action(range(begin + behind, end)))
        if first is None or second is None or not (first.request and second.request):
            return None
        meant = f"prefer {first.request} over {second.request}"
        return Advice(begin + at, self._texts[begin + at], REASONS[Link.ELSE], begin, end, meant)


__all__ = ["MAXIMUM_SENTENCE", "Advice", "SentenceReader"]
