"""Acceptances: comments that say why a finding at a place is meant, `// robosc: accept CODE: reason`.

One on a line of its own is for the next line that holds something else than acceptances, one behind something is for
its own line. Errors cannot be accepted.
"""

import re
from collections.abc import Callable, Iterable, Iterator

import msgspec
from msgspec.structs import replace

from robosc.errors import Diagnostic, Severity, sorted_diagnostics
from robosc.language.tokens import COMMENT
from robosc.source import Bundle, Location, SourceFile

LATER = frozenset(
    {
        "ambiguous-layer-topic",
        "blocking-under-control",
        "competing-requests",
        "deadlock",
        "forbidden-cancel",
        "goals-in-layer",
        "idle-goal",
        "impossible-assumption",
        "layer-passes-motion",
        "livelock",
        "never-enabled",
        "no-supervisor",
        "not-confluent",
        "only-uncontrollable",
        "preventable-assumption",
        "unneeded-assumption",
        "unprompted-request",
        "unreachable-goal",
        "unreachable-state",
        "unused-requirement",
        "visit-never-made",
        "visit-put-off",
    }
)
"""Codes that stages after the model's check give: a check alone says nothing about them."""

AFTER_SYNTHESIS = frozenset(
    {
        "blocking-under-control",
        "competing-requests",
        "never-enabled",
        "not-confluent",
        "unprompted-request",
        "unreachable-state",
        "unused-requirement",
    }
)
"""Those that every synthesis of a controller gives or does not give."""

_MARK = "robosc:"
_COMMENT = re.compile(rf"\"(?:[^\"\\\n]|\\.)*+\"|'(?:[^'\\\n]|\\.)*+'|(?P<comment>{COMMENT.pattern})")
_ACCEPTANCE = re.compile(r"//\s*robosc:\s*accept\s+(?P<code>[\w-]+)\s*(?::\s*(?P<reason>.*\S)?\s*)?$")


class Acceptance(msgspec.Struct, frozen=True):
    """A comment that accepts a finding.

    Attributes:
        code: Code of the finding.
        reason: Reason for which it is meant; empty where the comment says none.
        location: Place of the comment.
        line: Line, from 1, whose finding it accepts.
    """

    code: str
    reason: str
    location: Location
    line: int


def acceptances(file: SourceFile) -> tuple[Acceptance, ...]:
    """Return the acceptances of a text, in order."""
    return tuple(_acceptances(file)) if _MARK in file.text else ()


def _acceptances(file: SourceFile) -> Iterator[Acceptance]:
    alone: list[Acceptance] = []
    line, counted = 1, 0
    for found in _COMMENT.finditer(file.text):
        match = _ACCEPTANCE.match(found["comment"] or "")
        if match is None:
            continue
        line, counted = line + file.text.count("\n", counted, found.start()), found.start()
        column = found.start() - file.text.rfind("\n", 0, found.start())
        location = Location(file.name, line, column, len(match.group().rstrip()))
        item = Acceptance(match["code"], match["reason"] or "", location, line)
        if file.line(line)[: column - 1].strip():
            yield item
        else:
            alone.append(item)
    own = {item.location.line for item in alone}
    for item in alone:
        below = item.line + 1
        while below in own:
            below += 1
        yield replace(item, line=below)


def accept(
    bundle: Bundle, diagnostics: Iterable[Diagnostic], is_judged: Callable[[str], bool]
) -> tuple[tuple[Diagnostic, ...], tuple[Diagnostic, ...]]:
    """Return the findings without those that are accepted, then these, with the reasons.

    Args:
        bundle: The texts.
        diagnostics: The findings.
        is_judged: Function that says of a code whether its acceptances that accept nothing are needless.
    """
    found = [item for file in bundle.files for item in acceptances(file)]
    if not found:
        return tuple(diagnostics), ()
    by_place: dict[tuple[str, int, str], Acceptance] = {}
    for item in found:
        if item.reason:
            by_place.setdefault((item.location.file, item.line, item.code), item)
    left: list[Diagnostic] = []
    accepted: list[Diagnostic] = []
    used: set[Acceptance] = set()
    failing: set[tuple[str, int, str]] = set()
    for diagnostic in diagnostics:
        place = diagnostic.location
        key = ("", 0, "") if place is None else (place.file, place.line, diagnostic.code)
        if diagnostic.severity is Severity.ERROR:
            failing.add(key)
        by = None if diagnostic.severity is Severity.ERROR else by_place.get(key)
        if by is None:
            left.append(diagnostic)
        else:
            used.add(by)
            accepted.append(replace(diagnostic, accepted=by.reason))
    for item in found:
        if item not in used and item.location.file == bundle.main.name and is_judged(item.code):
            is_error = (item.location.file, item.line, item.code) in failing
            left.append(_needless(item, is_error=is_error))
    return sorted_diagnostics(left), sorted_diagnostics(accepted)


def _needless(item: Acceptance, *, is_error: bool) -> Diagnostic:
    if is_error:
        message, fix = f"'{item.code}' is an error here, which cannot be accepted", "Correct the error instead."
    elif not item.reason:
        message = f"this accepts nothing, because it says no reason: 'accept {item.code}: reason'"
        fix = "Write a colon and why the finding is meant, or remove the comment."
    else:
        message = f"this accepts nothing: there is no finding '{item.code}' on line {item.line}"
        fix = "Remove the comment, or put it at the end of the line of the finding, or on the line before."
    return Diagnostic(Severity.NOTE, "needless-acceptance", message, item.location, fix)
