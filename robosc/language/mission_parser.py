"""Missions and preferences, read from tokens.

Their words are names everywhere else; here each stands where no expression goes on with a name.
"""

from collections.abc import Callable
from typing import NamedTuple

from robosc.language import syntax
from robosc.language.cursor import Fault, shown
from robosc.language.goal_parser import GoalParser
from robosc.language.tokens import Kind

_NAME, _END = int(Kind.NAME), int(Kind.END)

_BETWEEN_VISITS = frozenset({",", ";", "->", "visit"})
"""Signs and words that stand between visits by mistake, instead of `then`."""

_BEFORE_OPERANDS = frozenset({"!", "if", "true", "false"})
"""Signs and reserved words that an expression begins with, and that never stand behind a name."""

_BEFORE_VISITS = frozenset({",", ":", ";", "->", "do", "goto", "then", "{"})
"""Signs and words that stand behind the condition of a detour by mistake, instead of `from anywhere`."""

_RESULT_KINDS = frozenset({"request", "response", "feedback", "error", "cancel"})
_EVENTS = _RESULT_KINDS | {"message", "incoming", "outgoing"}
"""Reserved words of messages, with which no condition begins."""

_OVER_ELSEWHERE = (["rather", "than"], [">"], ["->"])
"""Words and signs for `over`."""


class _MissionList(NamedTuple):
    """Content of a mission's braces.

    Attributes:
        visits: Its visits.
        detours: Its detours.
    """

    visits: tuple[syntax.Visit, ...]
    detours: tuple[syntax.Detour, ...]


class MissionParser(GoalParser):
    """Reads missions and preferences."""

    # Missions

    def mission(self) -> syntax.Mission:
        """`mission`, its name, and the visits that are made round after round."""
        place = self.first_word("mission")
        name = self._mission_name()
        condition = self.expression() if self.takes("while") else None
        return syntax.Mission(name, condition, *self.mission_list(), place)

    def _mission_name(self) -> syntax.Name:
        fix = "Write 'rounds' before it, or another name."
        if self.texts[self.place] == "{":
            raise self.fault("a name", fix=fix)
        if self.texts[self.place] == "while" and self.texts[self.place + 1] not in ("{", "while", ""):
            raise self.unfit("a mission needs a name before 'while'", fix)
        return self.name()

    def mission_list(self) -> _MissionList:
        """The visits of a mission in braces, and the detours behind them."""
        visits: list[syntax.Visit] = []
        # Only behind a mistake another `visit` is left over.
        words = {"visit": self._left_over, "on": self._detour}
        has_begun = False

        def first() -> None:
            nonlocal has_begun
            has_begun = True
            visits.extend(self._first_visits())

        def here() -> Callable[[], syntax.Detour | None] | None:
            return words.get(self.texts[self.place]) if has_begun else first

        detours = self._in_braces(words, here, ("'on'",))
        return _MissionList(tuple(visits), tuple(item for item in detours if item is not None))

    def _first_visits(self) -> tuple[syntax.Visit, ...]:
        token = self.texts[self.place]
        if token == "}":
            fix = "Write 'visit' and a condition in it, such as 'visit Base.home'."
            self.report("syntax-error", "a mission needs at least one visit", self.at(self.place), fix)
            raise self.reported_fault()
        if token == "on":
            raise self.fault("'visit'", fix="Write a visit before it: detours stand behind those of the mission.")
        if self.kinds[self.place] == _NAME and token != "visit" and self.begins_with_name("then"):
            raise self.fault("'visit'", fix="Write 'visit' before it.")
        return self._visits()

    def _left_over(self) -> None:
        """Visits of a statement with a mistake, which has been reported."""
        self.take("visit")
        self.expression()
        while self.takes("then"):
            self.expression()

    def _visits(self) -> tuple[syntax.Visit, ...]:
        """`visit E then E ...`."""
        self.take("visit")
        found = [self._visit()]
        while self._goes_on():
            found.append(self._visit())
        return tuple(found)

    def _visit(self) -> syntax.Visit:
        if self.texts[self.place] in ("{", "["):
            message = f"{shown(self.texts[self.place])} does not fit here; expected an expression"
            raise self.unfit(message, "Leave the brackets out, and write 'then' between the visits.")
        if self._is_needless(self.place):
            word = self.texts[self.place]
            raise self.unfit(f"{shown(word)} does not fit here; expected a condition", f"Remove '{word}'.")
        begin = self.place
        condition = self.expression()
        return syntax.Visit(condition, self.since(begin))

    def _is_needless(self, index: int) -> bool:
        """Return True if a token is the word `visit` or `then` where a condition is due, and not a name."""
        following = self.texts[index + 1]
        is_operand_behind = self.kinds[index + 1] == _NAME and following != "then"
        return self.texts[index] in ("visit", "then") and (is_operand_behind or following in _BEFORE_OPERANDS)

    def _goes_on(self) -> bool:
        """Read `then`, if it is there, or report what stands there instead of it; True if another visit follows."""
        begin = self.place
        if self.takes("then"):
            return True
        token = self.texts[begin]
        if token in _BETWEEN_VISITS:
            self.place += 1
            while self._is_needless(self.place):
                self.place += 1
            self._no_then(begin)
            return self._is_visit_next()
        if token == "on" or self._begins_item(begin) or not self.begins_expression():
            return False
        if self.texts[begin - 2 : begin] == ["and", "then"]:
            self._no_then(begin - 2)
            return True
        is_clear = self.kinds[begin] != _NAME or self.begins_with_name("then")
        raise self.fault("'then'", fix="Write 'then' before it." if is_clear else "")

    def _is_visit_next(self) -> bool:
        return self.begins_expression() and not self._begins_item(self.place)

    def _no_then(self, begin: int) -> None:
        """Report that something else stands from a token on where `then` should."""
        written = self.source(begin)
        is_last = not self._is_visit_next()
        fix = f"Remove '{written}'." if is_last else f"Write 'then' instead of '{written}'."
        expected = "'on' or '}'" if is_last else "'then'"
        self.report("syntax-error", f"{shown(written)} does not fit here; expected {expected}", self.since(begin), fix)
        self.reported_fault()

    # Detours

    def _detour(self) -> syntax.Detour:
        """`on E from anywhere`, and the visits of the detour."""
        place = self.at(self.take("on"))
        if self.texts[self.place] in _EVENTS:
            raise self._event()
        trigger = self.expression()
        self._from_anywhere()
        return syntax.Detour(trigger, self._visits(), place)

    def _event(self) -> Fault:
        """Return the error that what is received stands instead of a condition."""
        begin = self.place
        kind = self.texts[begin] if self.texts[begin] in _RESULT_KINDS else "response"
        names = [
            text
            for text, kind in zip(self.texts[begin : begin + 3], self.kinds[begin : begin + 3], strict=True)
            if kind == _NAME
        ]
        name = names[0] if names else "order"
        preposition = "to" if kind in ("request", "cancel") else "from"
        message = f"a detour begins with a condition, not with {shown(self.texts[begin])}"
        fix = (
            f"Let a component go to a state with 'on {kind} {preposition} {name}', and name that state here, such as "
            "'Caller.waiting'."
        )
        return self.unfit(message, fix)

    def _from_anywhere(self) -> None:
        """Read `from anywhere` behind the condition of a detour."""
        begin = self.place
        token, following = self.texts[begin : begin + 2]
        if token == "visit":
            # The word can mean nothing else, so that the text behind it is read on.
            self.fault("'from'", fix="Write 'from anywhere' before it.")
        elif token == "from" and following == "visit":
            self.place += 1
            self.fault("'anywhere'", fix="Write 'anywhere' before it.")
        elif token == "anywhere":
            raise self.fault("'from'", fix="Write 'from' before it.")
        elif token in _BEFORE_VISITS and following == "visit":
            raise self.fault("'from'", fix=f"Write 'from anywhere' instead of '{token}'.")
        else:
            self.take("from")
            self.take("anywhere")

    # Preferences

    def preference(self) -> syntax.Preference:
        """`prefer`, and the requests of its two sides."""
        place = self.first_word("prefer")
        preferred = self._side()
        self._over()
        return syntax.Preference(preferred, self._side(), place)

    def _side(self) -> tuple[syntax.Name, ...]:
        if self.kinds[self.place] == _NAME and self.texts[self.place + 1] == ",":
            raise self.fault("'{'", fix="Write '{' before it.")
        names = self.names()
        begin = self.place
        if self.texts[begin] == "." and self.texts[begin + 1] in _RESULT_KINDS:
            self.place += 2
            written = self.source(begin)
            message = f"{shown(written)} does not fit here: what is preferred is always a request"
            self.report("syntax-error", message, self.since(begin), f"Remove '{written}'.")
            raise self.reported_fault()
        if self.texts[begin] in ("and", "or") and names:
            both = f"{names[-1].text}, {self.texts[begin + 1]}"
            fix = f"Name several requests in braces, with commas between them, as in '{{ {both} }}'."
            raise self.unfit(f"{shown(self.texts[begin])} does not fit here; several requests stand in braces", fix)
        return names

    def _over(self) -> None:
        begin = self.place
        for words in _OVER_ELSEWHERE:
            if self.texts[begin : begin + len(words)] == words:
                self.place += len(words)
                written = self.source(begin)
                message = f"{shown(written)} does not fit here; expected 'over'"
                self.report("syntax-error", message, self.since(begin), f"Write 'over' instead of '{written}'.")
                self.reported_fault()
                return
        token = self.texts[begin]
        if token in ("}", "") or (token != "over" and self._begins_item(begin)):
            raise self.fault("'over'", fix="Write 'over' and the requests that come after these.")
        self.take("over")


__all__ = ["MissionParser"]
