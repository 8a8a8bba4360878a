"""Fixes that an editor can apply automatically: the same ones that findings describe in words."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from robosc.errors import Diagnostic, LanguageError
from robosc.formatting import format_text
from robosc.language.tokens import Kind, tokenize
from robosc.source import Location

_WRITE = re.compile(r"(?:Write |or |write )'([^']+)'")
_INSTEAD = re.compile(r"Write '(.+?)' instead of '(.+)'\.", re.DOTALL)
_NODE = re.compile(
    r"(?:Write '(?P<meant>.+?)'(?P<elsewhere> in the robot(?:, and '(?P<here>.+?)')?)? instead of|Remove) "
    r"'(?P<written>.+)'\."
)
_LED_ELSEWHERE = re.compile(r"Write '(goto \w+)' instead of '(goto \w+)' at ")
_ASSUMED = re.compile(r"'(assume [^']+)'")
_BEFORE = re.compile(r"Write '([^']+)' before it\b")
_WORDS = {"&": "and", "|": "or"}
_LONGEST_TITLE = 60
_PREPOSITIONS = {"request": "to"}
_RANGE = re.compile(r"(integer\s*\()([^.]+?)(\s*\.\.\s*)([^.]+?)(\s*\))")


@dataclass(frozen=True, slots=True)
class Fix:
    """One change of a text.

    Attributes:
        title: Effect of the change, as an instruction.
        location: Place of the text that is replaced; its length may reach over the ends of lines.
        text: Replacement that stands there then.
        more: Places of other texts that are replaced, behind the first, and what stands there then.
    """

    title: str
    location: Location
    text: str
    more: tuple[tuple[Location, str], ...] = ()


def fixes(found: Diagnostic, line: str, rest: Callable[[], str] = str) -> tuple[Fix, ...]:
    """Return the changes that would fix a finding, the likeliest first; empty where a person has to think.

    Args:
        found: The finding.
        line: The line of the text that it is in.
        rest: Function that returns the text behind that line and its end, for the few fixes that reach so far; without
            it only what stands on the line is changed.
    """
    return () if found.location is None else tuple(_Line(found.location, line, rest).fixes(found))


def _laid_out(text: str, indent: str) -> str:
    """Definitions, communications or states with the line breaks of the formatter, lines after the first indented."""
    around = {"component": 1, "requirement": 1, "behaviour": 2, "incoming": 2}.get(text.split()[0], 3)
    begin = "robot R { component C { behaviour {".split("{")[:around]
    try:
        formatted = format_text("{".join([*begin, text]) + "}" * around)
    except LanguageError:
        return text
    lines = formatted.rstrip("\n").split("\n")[around:-around]
    return f"\n{indent}".join(line.removeprefix("    " * around) for line in lines)


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST_TITLE else f"{text[:_LONGEST_TITLE]}..."


class _Line:
    """The line of a finding: what it covers there, and what stands before it."""

    def __init__(self, location: Location, line: str, rest: Callable[[], str] = str) -> None:
        self._location = location
        self._rest = rest
        self._line = line
        self._begin = location.column - 1
        self._end = min(self._begin + location.length, len(line))
        self._covered = line[self._begin : self._end]
        self._before = line[: self._begin]

    def fixes(self, found: Diagnostic) -> Iterator[Fix]:
        if " in the 'with' list of '" in found.fix:
            # It changes another place, where a person looks first.
            return
        if found.message.startswith("there is no '") and (node := _NODE.fullmatch(found.fix)):
            yield from self._node(node["meant"] or "", node["written"], node["elsewhere"] and (node["here"] or ""))
            return
        if instead := _INSTEAD.fullmatch(found.fix):
            yield from self._instead(instead[1], instead[2])
            return
        match found.code:
            case (
                "unknown-name"
                | "update-out-of-scope"
                | "unknown-field"
                | "needless-property"
                | "unknown-ros-type"
                | "field-type-mismatch"
            ):
                for name in _WRITE.findall(found.fix):
                    yield self._written(name)
            case "ambiguous-name":
                for name in re.findall(r"'([^']+\.[^']+)'", found.fix):
                    yield self._written(name)
            case "wrong-preposition":
                for right in re.findall(r"goes with '(from|to)'", found.message):
                    yield self._written(right)
            case "wrong-result-kind":
                yield from self._directions(found.fix)
                yield from self._other_results(found.fix)
            case "no-initial-state":
                head = re.search(r"(marked\s+)?state\s+\Z", self._before)
                if head is not None:
                    yield self._inserted("initial ", head.start())
            case "multiple-initial-states":
                head = re.search(r"initial\s+(?=(marked\s+)?state\s+\Z)", self._before)
                if head is not None:
                    yield from self._changed("Remove 'initial'", head.start(), head.end(), "")
            case "type-mismatch":
                yield from self._types(found.fix)
            case "forbidden-cancel" if elsewhere := _LED_ELSEWHERE.match(found.fix):
                begin = self._line.find(elsewhere[2], self._begin, self._end)
                if begin >= 0:
                    title = f"Write '{elsewhere[1]}'"
                    yield from self._changed(title, begin, begin + len(elsewhere[2]), elsewhere[1])
            case "unreachable-goal":
                yield from self._assumptions(_ASSUMED.findall(found.fix))
            case "syntax-error":
                yield from self._syntax(found.fix)
            case code if code.startswith("duplicate-"):
                for name in _WRITE.findall(found.fix):
                    yield self._written(name)

    def _written(self, text: str) -> Fix:
        return Fix(f"Write '{text}'", self._location, text)

    def _changed(self, title: str, begin: int, end: int, text: str) -> Iterator[Fix]:
        """Another text for a stretch of the line, which may not be empty."""
        if end > begin:
            yield Fix(title, Location(self._location.file, self._location.line, begin + 1, end - begin), text)

    def _inserted(self, text: str, begin: int) -> Fix:
        """Text before a place, which may be the end of the line."""
        place = self._location
        following = self._line[begin : begin + 1]
        return Fix(f"Write '{text.strip()}'", Location(place.file, place.line, begin + 1, 1), text + following)

    def _instead(self, meant: str, written: str) -> Iterator[Fix]:
        """Text for what is written at the place."""
        # The place may be where the writing first, or only at its end, does not fit.
        before = next((at for at in range(len(written)) if self._line.startswith(written, self._begin - at)), None)
        if before is not None and before <= self._begin:
            begin = self._begin - before
            end = begin + len(written)
            # Signs need no blanks around them, words do.
            left = " " * bool(re.match(r"\w", meant) and re.search(r"\w\Z", self._line[:begin]))
            right = " " * bool(re.search(r"\w\Z", meant) and re.match(r"\w", self._line[end:]))
            yield from self._changed(f"Write '{meant}'", begin, end, f"{left}{meant}{right}")

    def _node(self, meant: str, written: str, here: str | None) -> Iterator[Fix]:
        """Text for a control node, which may end on a later line; or text at the end of the robot, and some here."""
        rest = self._rest()
        # The place may be behind the begin of what is written.
        at = next(
            (at for at in range(self._begin, -1, -1) if _length(written, f"{self._line[at:]}\n{rest}") is not None),
            None,
        )
        if at is None:
            return
        behind = f"{self._line[at:]}\n{rest}"
        length = _length(written, behind) or 0
        title = f"Write '{_shortened(meant)}'"
        place = Location(self._location.file, self._location.line, at + 1, length)
        if here is None:
            indent = self._line[: len(self._line) - len(self._line.lstrip())]
            yield Fix(title if meant else f"Remove '{written}'", place, meant and _laid_out(meant, indent))
            return
        end = behind.rfind("}")
        if end >= length:
            more = f"    {_laid_out(meant, '    ')}\n}}"
            line, column = behind[:end].count("\n"), end - behind.rfind("\n", 0, end) - 1
            column += 0 if line else at
            behind_it = Location(self._location.file, self._location.line + line, column + 1, 1)
            yield Fix(f"{title} in the robot", place, here, ((behind_it, more),))

    def _assumptions(self, assumptions: Sequence[str]) -> Iterator[Fix]:
        """Assumptions at the end of the robot, since a visit is in the middle of a mission."""
        behind = f"{self._line[self._begin :]}\n{self._rest()}"
        ends = [
            start for token, kind, start in zip(*tokenize(behind), strict=True) if (token, kind) == ("}", Kind.SIGN)
        ]
        if not assumptions or not ends:
            return
        before = f"{self._before}{behind[: ends[-1]]}"
        start = "\n" if before[before.rfind("\n") + 1 :].strip() else ""
        lines = "".join(f"    {item}\n" for item in assumptions)
        yield Fix(
            f"Write '{_shortened(' '.join(assumptions))}'", self._place_behind(behind[: ends[-1]]), f"{start}{lines}}}"
        )

    def _place_behind(self, text: str) -> Location:
        """Return the place of the character behind a text that begins at the place of the finding."""
        before = f"{self._before}{text}"
        line, column = before.count("\n"), len(before) - before.rfind("\n") - 1
        return Location(self._location.file, self._location.line + line, column + 1, 1)

    def _directions(self, fix: str) -> Iterator[Fix]:
        right = re.match(r"Write '(incoming|outgoing) message'", fix)
        head = re.search(r"\b(incoming|outgoing)(?=\s+message\s+\Z)", self._before)
        if right is not None and head is not None:
            yield from self._changed(f"Write '{right[1]}'", head.start(), head.end(), right[1])

    def _other_results(self, fix: str) -> Iterator[Fix]:
        """`on response from x`, of what has no response."""
        given = re.match(r"(on\s+)\w+(\s+)\w+\b(.*)", self._covered)
        if given is None:
            return
        for kind in re.findall(r"\b(?:request|response|feedback|error|cancel)\b", fix):
            right = f"{kind}{given[2]}{_PREPOSITIONS.get(kind, 'from')}"
            yield Fix(f"Write 'on {kind}'", self._location, f"{given[1]}{right}{given[3]}")

    def _types(self, fix: str) -> Iterator[Fix]:
        if value := re.fullmatch(r"Write '([^']+)'(?:\.|, or .*)", fix):
            yield self._written(value[1])
        elif fix == "Write the smaller bound first.":
            bounds = _RANGE.fullmatch(self._covered)
            if bounds is not None:
                opening, first, points, second, closing = bounds.groups()
                yield self._written(f"{opening}{second}{points}{first}{closing}")
        elif fix in ("Remove the property: only objects have properties.", "Remove what follows the name."):
            point = re.search(r"\s*\.\s*\Z", self._before)
            if point is not None:
                yield from self._changed(f"Remove '.{self._covered}'", point.start(), self._end, "")

    def _syntax(self, fix: str) -> Iterator[Fix]:
        token = self._covered
        if token in _WORDS:
            end = self._end + self._line[self._end : self._end + 1].count(token)
            # Signs need no blanks around them, words do.
            left = " " * self._before[-1:].isidentifier()
            right = " " * bool(re.match(r"\w", self._line[end : end + 1]))
            yield from self._changed(f"Write '{_WORDS[token]}'", self._begin, end, f"{left}{_WORDS[token]}{right}")
        elif closed := re.fullmatch(r"Close it with '\)'(?:, before '(.+)')?\.", fix):
            following = closed[1] and re.compile(rf"\s*(?<!\w){re.escape(closed[1])}").search(self._line, self._end)
            end = following.start() if following else len(self._line.rstrip())
            yield self._inserted(")", end)
        elif needless := re.match(r"Remove '(\w+)' before it", fix):
            word = re.search(rf"\s*\b{needless[1]}\s*\Z", self._before)
            if word is not None:
                yield from self._changed(f"Remove '{needless[1]}'", word.start(), self._begin, " ")
        elif fix.startswith(("Remove ", "Write '=' once")):
            yield from self._changed(f"Remove '{token}'", self._begin, self._end, "")
        elif fix.startswith("Write 'incoming message' or"):
            yield from (self._written(f"{direction} {token}") for direction in ("incoming", "outgoing"))
        elif meant := re.fullmatch(r"(?:If '.*' is meant as a name, write|Did you mean) '([^']+)'[.?]", fix):
            yield self._written(meant[1])
        elif missing := _BEFORE.match(fix):
            yield Fix(f"Write '{missing[1]}' before it", self._location, f"{missing[1]} {token}")


def _length(written: str, text: str) -> int | None:
    """The length of what a fix quotes, at the begin of a text; None: it is not there."""
    if text.startswith(written):
        return len(written)
    head, _, closing = written.rpartition(" ... ")
    if closing not in ("}", ")") or not text.startswith(head):
        return None
    opening, depth = head[-1:], 0
    for token, kind, start in zip(*tokenize(text), strict=True):
        if kind == Kind.SIGN:
            depth += (token == opening) - (token == closing)
            if token == closing and not depth:
                return start + 1
    return None


__all__ = ["Fix", "fixes"]
