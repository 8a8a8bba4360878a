"""Goals and assumptions, read from tokens.

Their words are names everywhere else, so each is taken for a word only where no expression can begin with it.
"""

from collections.abc import Mapping
from typing import NamedTuple

from robosc.language import syntax
from robosc.language.cursor import Fault, shown
from robosc.language.expression_parser import ExpressionParser
from robosc.source import Location

_KINDS = {"goal": "a goal", "assume": "an assumption", "mission": "a mission", "prefer": "a preference"}
"""Statements about a whole robot, by their first words."""

_ANSWERS_ELSEWHERE = frozenset({"->", "leadsto", "leads_to", "leadsTo"})
"""Signs and words of other languages for `leads to`."""

_EVENTUALLY = {
    "eventually": ("'eventually' stands behind 'always': what came true comes true again", "Write 'always' before it.")
}
_IN_GOALS = {
    "never": (
        "a goal is to be reached; what must never be is a requirement",
        "Write 'requirement never' instead of 'goal never'.",
    ),
    "allow": ("only an assumption is allowed to stay untrue, so a goal has no 'allow'", "Remove 'allow'."),
    **_EVENTUALLY,
}
_IN_ASSUMPTIONS = {
    "once": (
        "an assumption says what comes true again and again, so it has no 'once'",
        "Write 'always eventually' instead of 'once'.",
    ),
    "never": (
        "an assumption says what comes true again and again, so it has no 'never'",
        "Leave it out: what never happens has no transition in a behaviour.",
    ),
    "allow": ("'allow' stands here twice", "Remove 'allow'."),
    **_EVENTUALLY,
}
"""Words that do not fit where an expression or `always eventually` is due, with message and fix."""


class _Aim(NamedTuple):
    """Content of a goal or an assumption behind its first words; the fields of their trees."""

    form: syntax.GoalForm
    trigger: syntax.Expression | None
    condition: syntax.Expression


class GoalParser(ExpressionParser):
    """Reads goals and assumptions.

    Attributes:
        is_library: True in a library, which has none of them.
    """

    is_library = False

    def goal(self) -> syntax.Goal:
        """`goal` and what is to be reached."""
        place = self.first_word("goal")
        self.possible("'always'", "'once'")
        if self._is_word("once"):
            self.place += 1
            return syntax.Goal("once", None, self._only_condition(1), place)
        return syntax.Goal(*self._recurring(_IN_GOALS), place)

    def assumption(self) -> syntax.Assumption:
        """`assume` and what the surroundings of the robot owe it."""
        place = self.first_word("assume")
        self.possible("'allow'", "'always'")
        is_allowed = self._is_word("allow")
        self.place += is_allowed
        self.possible("'always'")
        return syntax.Assumption(is_allowed, *self._recurring(_IN_ASSUMPTIONS), place)

    def first_word(self, word: str) -> Location:
        """Read the word that a statement about a whole robot begins with; its place."""
        place = self.at(self.take(word))
        if self.is_library:
            message = f"{_KINDS[word]} is about a whole robot, so it cannot stand in a library"
            self.report("goal-in-library", message, place, "Move it into the robot that imports from here.")
        return place

    def _is_word(self, word: str) -> bool:
        """Return True if the next token is a word of the statement, not a name that its expression begins with."""
        if self.texts[self.place] != word:
            return False
        self.possible("an expression", *(("'always'",) if word == "allow" else ()), ahead=1)
        if self._is_cut():
            self.possible("'to'", ahead=2)
        return not self.begins_with_name("leads")

    def _is_cut(self) -> bool:
        """Return True if the text ends behind a word and `leads`, which may become `leads to`."""
        return self.texts[self.place + 1 : self.place + 3] == ["leads", ""]

    def _recurring(self, unfit: Mapping[str, tuple[str, str]]) -> _Aim:
        """`always eventually E` or `E leads to E`.

        Args:
            unfit: Words that may stand there by mistake, with message and fix.
        """
        begin = self.place
        if self.texts[begin] == "always":
            self.possible("'eventually'", ahead=1)
            if self.texts[begin + 1] == "eventually":
                self.place += 2
                return _Aim("always eventually", None, self._only_condition(2))
            if not (self._is_cut() or self.begins_with_name("leads")):
                self.place += 1
                raise self.fault("'eventually'", fix="Write 'eventually' before it.")
        if self.texts[begin] in unfit and not self._is_cut() and self._is_word(self.texts[begin]):
            raise self.unfit(*unfit[self.texts[begin]])
        trigger = self.expression()
        self._leads_to(begin)
        return _Aim("leads to", trigger, self.expression())

    def _only_condition(self, words: int) -> syntax.Expression:
        """The expression of a form that has but one, behind its words; how many these are."""
        place, written = self.since(self.place - words), " ".join(self.texts[self.place - words : self.place])
        condition = self.expression()
        if self.texts[self.place : self.place + 2] == ["leads", "to"]:
            message = f"'{written}' and 'leads to' do not stand in one statement"
            self.report("syntax-error", message, place, f"Remove '{written}'.")
            raise self.reported_fault()
        return condition

    def _leads_to(self, begin: int) -> None:
        """Read `leads to` behind the expression that begins at a token."""
        token = self.texts[self.place]
        if token in _ANSWERS_ELSEWHERE:
            message = f"{shown(token)} does not fit here; expected 'leads'"
            raise self.unfit(message, f"Write 'leads to' instead of '{token}'.")
        if token == "}" or (token != "leads" and self._begins_item(self.place)):
            # The expression is the end, so the words before it are missing.
            self.place = begin
            message = (
                f"{shown(self.texts[begin])} does not fit here; expected 'always eventually' before the expression, or "
                "'leads to' behind it"
            )
            raise self.unfit(message, "Write 'always eventually' before it.")
        self.take("leads")
        if self.texts[self.place] == "-" and self.texts[self.place + 1] == "to":
            raise self.unfit("'-' does not fit here; expected 'to'", "Write 'to' instead of '-to'.")
        if self.texts[self.place] != "to":
            raise self.fault("'to'", fix="Write 'to' before it.")
        self.place += 1

    def unfit(self, message: str, fix: str) -> Fault:
        """Return the error that the next token does not fit."""
        self.report("syntax-error", message, self.at(self.place), fix)
        self.place += 1
        return self.reported_fault()


__all__ = ["GoalParser"]
