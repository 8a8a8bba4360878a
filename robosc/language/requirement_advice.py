"""Requirements that sentences of other languages mean: conditions, permissions, cancels, orders and choices."""

from collections.abc import Container, Sequence

from msgspec.structs import replace

from robosc.language.control_node_advice import Place, advise
from robosc.language.control_node_states import negation
from robosc.language.control_nodes import Family, Leaf, Node
from robosc.language.phrases import MOODS, PHRASES, Link, Mood, Time, phrase_at
from robosc.language.sentence_parts import SEPARATORS, Operand, SentenceParts

_ORDER = "a requirement knows no order: a state says what was before, and a mission visits states in their order"
_NEEDED = "a request is made where its requirements hold, so say what it 'needs'"
_TOGETHER = "'always' and '=>' say what holds together, and 'needs' what a request needs"
_ENDED = "'disables' forbids a request, and cancels the action if it is running"
_FORBIDDEN = "a request that must not be made 'needs' the opposite, or is disabled"
_CHOICE = (
    "'or' leaves open which state is reached, 'prefer' says which request goes first, 'on error' what follows a failure"
)
TIME = (
    "the language has no times: a message of a timer's node leads to a state, and 'max_age' says how old a sensor's "
    "message may be"
)
REASONS = {
    Link.IF: _TOGETHER,
    Link.UNLESS: _FORBIDDEN,
    Link.UNTIL: _FORBIDDEN,
    Link.THEN: _ORDER,
    Link.AFTER: _ORDER,
    Link.IMPLIES: _TOGETHER,
    Link.ENABLES: _NEEDED,
    Link.FORBIDS: _FORBIDDEN,
    Link.CANCELS: _ENDED,
    Link.FORBIDDEN: _FORBIDDEN,
    Link.CANCELLED: _ENDED,
    Link.ELSE: _CHOICE,
    Link.FAILURE: "what follows a failure is a state that 'on error from' leads to",
}
_MOOD_REASONS = {
    Mood.NOT: _FORBIDDEN,
    Mood.CANCEL: _ENDED,
    Mood.ALLOW: _NEEDED,
    Mood.TRY: _CHOICE,
    Mood.FIRST: _ORDER,
    Mood.ALWAYS: _TOGETHER,
}

_STATEMENTS = ("requirement", "goal", "assume")
"""Statements in which `never` and `always` are words of the language."""


class RequirementReader(SentenceParts):
    """Reads sentences that are requirements."""

    def _clue(
        self, begin: int, end: int, times: Sequence[tuple[int, Time]], own: Container[str] = ()
    ) -> tuple[int, str, str] | None:
        """The token that a message is about, its phrase as it is written, and what is said about it."""
        if times:
            index, time = times[0]
            return index, self._written(index, index + time.end - time.begin), TIME
        indices = list(range(begin, end))
        words = self._words(indices)
        for at in range(len(words)):
            is_sign = self._texts[begin + at] in SEPARATORS
            link = phrase_at(words, at, PHRASES) if words[at] not in own and not is_sign else None
            is_own = words[0] in ("never", "always") and begin and self._texts[begin - 1] in _STATEMENTS
            mood = phrase_at(words, at, MOODS) if at == 0 and not is_own else None
            if link is not None and (mood is None or link[1] > mood[1]):
                return begin + at, self._written(begin + at, begin + link[1]), REASONS[link[0]]
            is_visit = "then" in own
            if mood is not None and mood[0] is not Mood.ALWAYS and (not is_visit or mood[0] in (Mood.TRY, Mood.FIRST)):
                return begin + at, self._written(begin + at, begin + mood[1]), _MOOD_REASONS[mood[0]]
        return None

    def _meaning(self, indices: Sequence[int]) -> str:
        """The requirements that a sentence is; empty: it is not known."""
        indices = list(indices)
        words = self._words(indices)
        moods: list[Mood] = []
        while (found := self._mood(words)) is not None:
            moods.append(found[0])
            indices, words = indices[found[1] :], words[found[1] :]
        while words and not words[0]:
            indices, words = indices[1:], words[1:]
        if words and (words[0], words[-1]) == ("(", ")") and ")" not in words[:-1]:
            indices, words = indices[1:-1], words[1:-1]
        if not words:
            return ""
        begin = phrase_at(words, 0, PHRASES)
        if begin is not None:
            return self._of_prefix(begin[0], indices[begin[1] :], moods)
        links = self._links(words)
        if not links and moods:
            # `never drive`, `cancel navigate`: nothing says when.
            return ""
        if not links:
            return self._side_by_side(indices)
        link, at, behind = links[0]
        left, right = indices[:at], indices[behind:]
        if Mood.TRY in moods or link is Link.ELSE:
            return self._choice(left, right)
        return self._of_link(link, left, right, moods)

    def _mood(self, words: Sequence[str]) -> tuple[Mood, int] | None:
        """The mood that a sentence begins with, if no phrase says more."""
        mood, phrase = phrase_at(words, 0, MOODS), phrase_at(words, 0, PHRASES)
        if mood is None or (phrase is not None and (phrase[1] > mood[1] or mood[0] is Mood.ALWAYS)):
            return None
        return mood

    def _links(self, words: Sequence[str]) -> list[tuple[Link, int, int]]:
        """The phrases in a sentence, with their begin and the index behind them, those of least weight last."""
        found: list[tuple[Link, int, int]] = []
        at = 1
        while at < len(words):
            phrase = phrase_at(words, at, PHRASES)
            if phrase is not None:
                found.append((phrase[0], at, phrase[1]))
                at = phrase[1]
            else:
                at += 1
        # A comma or brace only parts what another word joins.
        return sorted(found, key=lambda item: words[item[1]] == "then" and len(found) > 1 and item != found[0])

    def _of_prefix(self, link: Link, indices: list[int], moods: Sequence[Mood]) -> str:
        """A sentence that begins with its condition: `if C then R else Q`."""
        words = self._words(indices)
        parted = [item for item in self._links(words) if item[0] in (Link.THEN, Link.ELSE)]
        if parted[:1] and (link is Link.FAILURE or parted[0][0] is Link.THEN):
            _, at, behind = parted[0]
            left, right = indices[:at], indices[behind:]
            return self._of_consequence(link, left, right, moods)
        # Without a word between them, the condition is as long as it can be.
        for at in range(len(indices) - 1, 0, -1):
            if self._operand(indices[:at]) is not None and self._action(indices[at:]) is not None:
                return self._of_consequence(link, indices[:at], indices[at:], moods)
        return ""

    def _of_consequence(self, link: Link, left: Sequence[int], right: Sequence[int], moods: Sequence[Mood]) -> str:
        """A condition and what follows from it, perhaps with what follows from the opposite."""
        others = [item for item in self._links(self._words(right)) if item[0] is Link.ELSE]
        if others:
            _, at, behind = others[0]
            first = self._of_link(link, right[:at], left, moods)
            condition = self._condition(left)
            second = self._action(right[behind:])
            if not (first and condition and second):
                return ""
            if " needs " + negation(condition) in first and not second.is_negative:
                return first
            return f"{first} {self._required(second, negation(condition))}"
        return self._of_link(link, right, left, moods)

    def _of_link(self, link: Link, left: Sequence[int], right: Sequence[int], moods: Sequence[Mood]) -> str:
        """Two parts of a sentence with a phrase between them."""
        words = self._words(left)
        if ".needs" in words or "needs" in words:
            return self._of_more(link, left, right)
        action = self._action(left, guesses=link is Link.IF)
        match link:
            case Link.IF | Link.UNLESS | Link.UNTIL | Link.FORBIDDEN | Link.CANCELLED | Link.FAILURE:
                condition = self._failed(right) if link is Link.FAILURE else self._condition(right, action)
                if action is None or not condition:
                    return ""
                is_negative = action.is_negative or bool({Mood.NOT, Mood.CANCEL} & {*moods})
                is_cancelled = action.is_cancelled or Mood.CANCEL in moods or link in (Link.CANCELLED, Link.UNTIL)
                is_negative = is_negative or link in (Link.FORBIDDEN, Link.CANCELLED, Link.UNTIL)
                action = replace(action, is_negative=is_negative, is_cancelled=is_cancelled)
                return self._required(action, negation(condition) if link is Link.UNLESS else condition)
            case Link.IMPLIES | Link.ENABLES | Link.FORBIDS | Link.CANCELS:
                return self._of_cause(link, left, right)
            case Link.THEN:
                return self._of_order(left, right)
            case Link.AFTER:
                return self._of_order(right, left)
            case _:
                return ""

    def _of_cause(self, link: Link, left: Sequence[int], right: Sequence[int]) -> str:
        """A condition that allows, forbids or ends what follows."""
        action, cause = self._action(right, guesses=True), self._operand(left)
        if link is Link.IMPLIES and cause is not None and cause.request and action is not None and not action.request:
            return f"requirement {cause.request} needs {action.condition}" if action.condition else ""
        condition = self._condition(left, action)
        if action is None or not condition:
            return ""
        is_cancelled = action.is_cancelled or link is Link.CANCELS
        is_negative = action.is_negative or link in (Link.FORBIDS, Link.CANCELS)
        return self._required(replace(action, is_negative=is_negative, is_cancelled=is_cancelled), condition)

    def _required(self, action: Operand, condition: str) -> str:
        """The requirement that something happens, or does not, only where a condition holds."""
        if action.request:
            if action.is_cancelled:
                return f"requirement {condition} disables {action.request}"
            needed = negation(condition) if action.is_negative else condition
            return f"requirement {action.request} needs {needed}"
        if not action.condition:
            return ""
        if action.is_negative:
            return f"requirement never {_bracketed(condition)} and {_bracketed(action.condition)}"
        return f"requirement always ({condition}) => ({action.condition})"

    def _of_more(self, link: Link, left: Sequence[int], right: Sequence[int]) -> str:
        """A requirement with something behind it: `requirement R needs E unless C`."""
        texts = [self._texts[index] for index in left]
        at = texts.index("needs")
        request, needed = self._operand(left[:at]), self._condition(left[at + 1 :])
        if request is None or not request.request or not needed:
            return ""
        if link in (Link.UNLESS, Link.UNTIL):
            condition = self._condition(right, request)
            return f"requirement {request.request} needs {_joined(needed, negation(condition))}" if condition else ""
        if link in (Link.IF, Link.AFTER):
            condition = self._condition(right, request)
            return f"requirement {request.request} needs {_joined(needed, condition)}" if condition else ""
        if link is Link.THEN:
            action = self._action(right)
            after = self._after(request.message) if request.message is not None else ""
            if action is not None and action.request and after:
                return f"requirement {request.request} needs {needed} {self._required(action, after)}"
        return ""

    def _of_order(self, first: Sequence[int], second: Sequence[int]) -> str:
        """An order of two parts: a requirement or a mission."""
        before, then = self._action(first), self._action(second)
        if then is not None and then.request:
            condition = before.condition if before is not None else self._condition(first, then)
            return self._required(then, condition) if condition else ""
        conditions = [self._condition(part) for part in (first, second)]
        return self._mission(conditions) if all(conditions) else ""

    def _mission(self, conditions: Sequence[str]) -> str:
        return f"mission {self._vocabulary.free_mission()} {{ visit {' then '.join(conditions)} }}"

    def _choice(self, left: Sequence[int], right: Sequence[int]) -> str:
        """Two ways, of which the first is the better one."""
        first, second = self._action(left), self._action(right)
        if first is None or second is None or first.message is None or not (first.request and second.request):
            return ""
        if first.message.kind != "incoming":
            # One that can fail has another way after its error.
            return ""
        return f"prefer {first.request} over {second.request}"

    def _side_by_side(self, indices: Sequence[int]) -> str:
        """A requirement of which only a time was wrong."""
        texts = [self._texts[index] for index in indices]
        for word in ("needs", "disables"):
            if word in texts[1:-1]:
                at = texts.index(word)
                left, right = self._operand(indices[:at]), self._operand(indices[at + 1 :])
                request, other = (left, right) if word == "needs" else (right, left)
                if request is None or other is None or not (request.request and other.condition):
                    return ""
                first, second = (
                    (request.request, other.condition) if word == "needs" else (other.condition, request.request)
                )
                return f"requirement {first} {word} {second}"
        return ""

    def _node(self, indices: Sequence[int]) -> str:
        """The component that is an order, or another way after a failure; empty: the sentence is neither."""
        words = self._words(indices)
        leaves: list[Leaf] = []
        family = Family.SEQUENCE
        for at, index in enumerate(indices):
            leaf = self._declared.communications.get(self._texts[index].casefold())
            if leaf is not None and leaf.is_requested and leaf not in leaves:
                leaves.append(leaf)
            phrase = phrase_at(words, at, PHRASES)
            if phrase is not None and phrase[0] in (Link.ELSE, Link.FAILURE):
                family = Family.FALLBACK
        if len(leaves) < 2:
            return ""
        text = advise(Node(family, tuple(leaves)), self._declared, Place.ROBOT, "")
        return text.removeprefix("Write '").removesuffix("' instead of ''.") if text.startswith("Write '") else ""


def _bracketed(condition: str) -> str:
    return f"({condition})" if " or " in condition else condition


def _joined(*conditions: str) -> str:
    return " and ".join(map(_bracketed, conditions))


__all__ = ["REASONS", "TIME", "RequirementReader"]
