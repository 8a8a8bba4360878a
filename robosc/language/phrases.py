"""Words by which other languages, and people, say order, time, permission, cancelling and fallback in a sentence.

`sentence_advice` says the same in this language. The words are those of behaviour trees, SMACH, temporal logic and
plain English; each stands in the family of those that mean the same.
"""

import re
from collections.abc import Collection, Sequence
from enum import StrEnum, auto

import msgspec


class Link(StrEnum):
    """Meaning of a phrase between two parts of a sentence, or before both."""

    IF = auto()
    """Condition behind, of the part before."""
    UNLESS = auto()
    UNTIL = auto()
    THEN = auto()
    """Later part behind."""
    AFTER = auto()
    """Earlier part behind."""
    IMPLIES = auto()
    ENABLES = auto()
    FORBIDS = auto()
    CANCELS = auto()
    FORBIDDEN = auto()
    """Condition behind, which forbids the part before."""
    CANCELLED = auto()
    ELSE = auto()
    FAILURE = auto()
    """Failed request behind."""


class Mood(StrEnum):
    """Meaning of a phrase before what is to happen."""

    NOT = auto()
    CANCEL = auto()
    ALLOW = auto()
    TRY = auto()
    FIRST = auto()
    ALWAYS = auto()


_CANCELLING = "cancel abort stop interrupt preempt halt kill terminate pause suspend quit"
_FORBIDDING = "forbid disable block prevent prohibit inhibit disallow deny avoid exclude"


def _third_person(verbs: str) -> list[str]:
    return [f"{verb}{'es' if verb.endswith('t') and verb == 'x' else 's'}" for verb in verbs.split()]


def _participles(verbs: str) -> list[str]:
    doubled = {
        "stop": ["stopped"],
        "cancel": ["cancelled", "canceled"],
        "forbid": ["forbidden", "forbid"],
        "deny": ["denied"],
        "quit": ["quit"],
    }
    return [
        word for verb in verbs.split() for word in doubled.get(verb, [f"{verb}d" if verb[-1] == "e" else f"{verb}ed"])
    ]


def _with_verbs(words: str) -> list[str]:
    """Phrases such as `must not run while`."""
    verbs = ("", "happen", "run", "start", "occur", "be requested", "be sent", "be called")
    return [" ".join(f"{word} {verb} {by}".split()) for word in words.split(";") for verb in verbs for by in _BY[1:]]


_BY = ("by", "if", "when", "while", "whenever", "on", "once", "in case")
_LINKS: dict[Link, list[str]] = {
    Link.IF: [
        *("if", "when", "whenever", "while", "whilst", "as long as", "so long as", "in case", "provided", "given"),
        *("provided that", "only if", "only when", "only while", "if and only if", "iff", "only", "where", "assuming"),
        *("allowed if", "allowed when", "allowed while", "permitted if", "permitted when", "possible if", "ok if"),
        *("requires", "only with", "once", "as soon as", "enabled by", "enabled when", "enabled if", "triggered by"),
        *("on", "upon", "depends on", "safe if", "safe when", "waits for", "wait for", "waits until", "wait until"),
        *_with_verbs("may;can;must;should;may only;can only;must only;is allowed to"),
    ],
    Link.UNLESS: [
        *("unless", "except if", "except when", "except while", "if not", "when not", "without", "except"),
    ],
    Link.UNTIL: ["until", "till", "up to when"],
    Link.THEN: [
        *("then", "and then", "followed by", "before", "precedes", "prior to", "ahead of", "and afterwards", "next"),
        *("afterwards", ";", "andthen", "leads into", "comes before"),
    ],
    Link.AFTER: ["after", "only after", "following", "follows", "comes after", "right after", "not before", "behind"],
    Link.IMPLIES: ["implies", "imply", "=>", "->", "entails", "means", "ensures", "guarantees", "leads to", "=> >"],
    Link.ENABLES: [
        *("enables", "allows", "permits", "lets", "authorizes", "unlocks", "activates", "triggers", "starts"),
        *("causes", "needed for", "required for", "enable", "allow", "permit"),
    ],
    Link.FORBIDS: [*_third_person(_FORBIDDING), "denies", "rules out", "forbidding"],
    Link.CANCELS: [*_third_person(_CANCELLING), "ends", "overrides", "overrules", "preempting", "cancelling"],
    Link.FORBIDDEN: [
        f"{word} {by}" for word in (*_participles(_FORBIDDING), "not allowed", "not possible") for by in _BY
    ],
    Link.CANCELLED: [
        *(f"{word} {by}" for word in _participles(_CANCELLING) for by in _BY),
        *(f"{word} {by}" for word in _third_person(_CANCELLING) for by in _BY[1:]),
    ],
    Link.ELSE: [
        *("else", "otherwise", "or else", "else if not", "fallback", "fallback to", "falls back to", "if that fails"),
        *("catch", "except then", "if it fails", "instead of", "or otherwise", "failing that", "on failure do"),
    ],
    Link.FAILURE: ["on failure of", "if failed", "on error of", "after failure of", "when failed", "on failure"],
}
_MOODS: dict[Mood, list[str]] = {
    Mood.NOT: ["not", "no", "never", "do not", "must not", "may not", "cannot", "should not", *_FORBIDDING.split()],
    Mood.CANCEL: _CANCELLING.split(),
    Mood.ALLOW: ["allow", "permit", "enable", "let", "start", "request", "run", "execute", "do", "call", "trigger"],
    Mood.TRY: ["try", "attempt", "either"],
    Mood.FIRST: ["first", "do first"],
    Mood.ALWAYS: ["always", "eventually", "once", "finally", "globally", "g", "ag"],
}
_NOISE = frozenset(
    "a an the is be are was were must may can should shall will it that this also just has have been being robot to of "
    "by only then do that's every reach reaches achieve achieves".split()
)
"""Words that say nothing beside the others."""

UNITS = {
    **dict.fromkeys("s sec secs second seconds".split(), 1.0),
    **dict.fromkeys("ms msec millis millisecond milliseconds".split(), 0.001),
    **dict.fromkeys("min mins minute minutes".split(), 60.0),
    **dict.fromkeys("h hour hours".split(), 3600.0),
    **dict.fromkeys("ticks tick cycles cycle steps times iterations".split(), 0.0),
}
"""Seconds of each unit of time; 0 of what is no fixed time."""

OUTCOMES = {
    word: event
    for event, words in {
        "response": "succeeded succeeds success successful done finished finishes completed completes complete ok over "
        "ended ends received arrives answered result response reply",
        "error": "failed fails failure error aborted aborts unsuccessful",
        "request": "running runs active executing started busy request requested called sent",
        "cancel": "cancelled canceled preempted",
    }.items()
    for word in words.split()
}
"""Words behind a communication for what has become of it, with the event that says so."""
_RATES = frozenset({"hz", "hertz", "khz"})
_BEFORE_TIMES = frozenset(
    "within after for every at most least in no longer than less more once each timeout timer wait waiting sleep delay "
    "delayed during until max min maximum minimum deadline rate of period older newer = : (".split()
)
"""Words before a time that belong to it."""

_BEHIND_TIMES = frozenset({"later", ")", "long", "old", "ago"})
_TIMERS = frozenset({"timeout", "timer", "elapsed", "expired", "timedout"})
_REPEATING = frozenset({"every", "each", "rate", "period"})

PHRASES: dict[tuple[str, ...], Link] = {
    tuple(phrase.split()): link for link, phrases in _LINKS.items() for phrase in phrases
}
MOODS: dict[tuple[str, ...], Mood] = {
    tuple(phrase.split()): mood for mood, phrases in _MOODS.items() for phrase in phrases
}
_LONGEST = max(map(len, (*PHRASES, *MOODS)))


class Time(msgspec.Struct, frozen=True):
    """A time in a sentence.

    Attributes:
        begin: Index of its first token.
        end: Index behind its last token.
        seconds: Its length; 0 where a sentence does not say so.
        is_repeating: True if it says how often something happens.
    """

    begin: int
    end: int
    seconds: float
    is_repeating: bool


def phrase_at[Meaning](
    words: Sequence[str], index: int, phrases: dict[tuple[str, ...], Meaning]
) -> tuple[Meaning, int] | None:
    """Return the meaning of the longest phrase that begins at a word, and the index behind it."""
    for length in range(min(_LONGEST, len(words) - index), 0, -1):
        found = phrases.get(tuple(words[index : index + length]))
        if found is not None:
            return found, index + length
    return None


def is_noise(word: str) -> bool:
    """Return True if a word says nothing beside the others."""
    return word in _NOISE


def time_in(words: Sequence[str], names: Collection[str]) -> Time | None:
    """Return the first time that a sentence speaks of, or None.

    Args:
        words: Words of the sentence, in lower case.
        names: Names of the model among them.
    """
    for index, word in enumerate(words):
        if re.fullmatch(r"\d+(\.\d+)?", word):
            unit = words[index + 1] if index + 1 < len(words) else ""
            begin = index
            while begin and words[begin - 1] in _BEFORE_TIMES and words[begin - 1] not in names:
                begin -= 1
            is_time = unit in UNITS or unit in _RATES
            if not is_time and not (begin < index and {*words[begin:index]} & {*_TIMERS, "wait", "sleep", "delay"}):
                continue
            end = index + (2 if is_time else 1)
            while end < len(words) and words[end] in _BEHIND_TIMES:
                end += 1
            number = float(word)
            seconds = 1 / number if unit in _RATES and number else number * UNITS.get(unit, 1.0)
            return Time(begin, end, seconds, unit in _RATES or bool(_REPEATING & {*words[begin:index]}))
    for index, word in enumerate(words):
        if word in _TIMERS and word not in names:
            return Time(index, index + 1, 0.0, is_repeating=False)
    return None


__all__ = ["MOODS", "OUTCOMES", "PHRASES", "UNITS", "Link", "Mood", "Time", "is_noise", "phrase_at", "time_in"]
