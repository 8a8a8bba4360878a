"""Mistakes that people make in models: typical slips in good models, drawn with a fixed seed, and a list by hand.

Each mistake knows its place. `judge` follows the first message: it must name that place, and obeying its fixes to the
letter, as an editor's quick fix does, must lead to a model without errors.
"""

import argparse
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parents[1]))

from robosc.editing.fixes import Fix, fixes
from robosc.errors import Diagnostic, Severity
from robosc.language.tokens import Kind, tokenize
from robosc.model.check import inspect
from robosc.source import Bundle, SourceFile
from support.models import EXAMPLES

FOLDER = Path(__file__).with_name("mistakes")
GOOD = (*sorted(EXAMPLES.glob("*/*.rscd")), *sorted(FOLDER.glob("*.rscd")))
_PAIRS = ("duplicate-", "multiple-")
"""Codes of findings about two places, of which one is too many: either may be."""

STEPS = 12
"""Fixes that are obeyed one after the other; a slip that is made everywhere in a line takes several."""


@dataclass(frozen=True, slots=True)
class Mistake:
    """A text with a mistake.

    Attributes:
        category: Kind of the mistake.
        text: The whole text.
        begin: Offset of what is wrong; of something missing, of the token before it.
        end: Offset behind it; of something missing, behind the token after it.
        meant: Texts of which the first message has to show one; none where any sound model will do.
    """

    category: str
    text: str
    begin: int
    end: int
    meant: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Verdict:
    """Judgement of the messages about a mistake.

    Attributes:
        found: The first error, or None.
        is_placed: True if it is where the mistake is.
        is_mended: True if obeying fixes leads to a model without errors.
    """

    found: Diagnostic | None
    is_placed: bool
    is_mended: bool

    @property
    def is_good(self) -> bool:
        """True if place and fix are right."""
        return self.is_placed and self.is_mended


def first_error(text: str) -> Diagnostic | None:
    """Return the first error of a text, by place."""
    found = inspect(Bundle(SourceFile("model.rscd", text))).checked.diagnostics
    return next((item for item in found if item.severity is Severity.ERROR), None)


def obeyed(text: str, found: Diagnostic) -> str | None:
    """Return the text after the likeliest fix of a finding; None where a machine cannot obey it."""
    place = found.location
    assert place is not None
    lines = text.split("\n")
    for fix in fixes(found, lines[place.line - 1], lambda: "\n".join(lines[place.line :])):
        return changed(text, fix)
    return aged(text, found.fix)


def aged(text: str, fix: str) -> str | None:
    """Return the text after a fix that is obeyed in another line: an option of a communication."""
    found = re.fullmatch(r"Write '(.+?)' in the 'with' list of '(.+?)' instead of '(.+)'\.", fix)
    if found is None:
        return None
    option, name, written = found.groups()
    return re.sub(rf"(message {name} with (.*?)type: \w+)", rf"\1, {option}", text).replace(written, "", 1)


def changed(text: str, fix: Fix) -> str:
    """Return a text with the changes of a fix, the last one first."""
    lines = text.split("\n")
    for place, written in reversed(((fix.location, fix.text), *fix.more)):
        begin = _offset(lines, place.line, place.column)
        text = text[:begin] + written + text[begin + place.length :]
    return text


def judge(mistake: Mistake) -> Verdict:
    """Follow the messages about a mistake."""
    found = first = first_error(mistake.text)
    if first is None or first.location is None:
        return Verdict(first, is_placed=False, is_mended=False)
    lines = mistake.text.split("\n")
    places = [first.location, *(item.location for item in first.related if first.code.startswith(_PAIRS))]
    begins = [_offset(lines, place.line, place.column) for place in places]
    is_placed = any(
        begin < mistake.end and mistake.begin < begin + place.length
        for begin, place in zip(begins, places, strict=True)
    )
    text: str | None = mistake.text
    if mistake.meant and not any(words in first.fix for words in mistake.meant):
        return Verdict(first, is_placed, is_mended=False)
    # Advice that shows a line is obeyed once, and that is all.
    for _ in range(2 if mistake.meant else STEPS):
        if found is None:
            return Verdict(first, is_placed, is_mended=True)
        text = obeyed(text or "", found)
        if text is None:
            break
        found = first_error(text)
    return Verdict(first, is_placed, is_mended=found is None)


def _offset(lines: Sequence[str], line: int, column: int) -> int:
    return sum(len(before) + 1 for before in lines[: line - 1]) + column - 1


# Slips


class _Text:
    """A good model, by its tokens."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.texts, self.kinds, self.starts = tokenize(text)
        self.count = self.kinds.index(Kind.END)

    def indices(self, *tokens: str) -> list[int]:
        """The places of some tokens."""
        return [index for index in range(self.count) if self.texts[index] in tokens]

    def end(self, index: int) -> int:
        return self.starts[index] + len(self.texts[index])

    def replaced(self, index: int, new: str, last: int | None = None) -> tuple[str, int, int]:
        """The text with other words for some tokens, and where they stand."""
        begin, end = self.starts[index], self.end(index if last is None else last)
        return self.text[:begin] + new + self.text[end:], begin, begin + len(new)

    def removed(self, index: int, last: int | None = None) -> tuple[str, int, int]:
        """The text without some tokens, and the tokens around the gap; of braces behind it, what follows them."""
        last = index if last is None else last
        begin, end = self.starts[index], self.end(last)
        behind = last + 1
        while self.texts[behind] == "}":
            behind += 1
        before = self.starts[index - 1]
        text = self.text[:begin] + self.text[end:]
        return text, before, max(self.end(behind), self.starts[behind] + 1) - (end - begin)


type _Slip = Callable[[_Text, Random], tuple[str, int, int] | None]


def _instead(tokens: Sequence[str], words: Sequence[str]) -> _Slip:
    """Another word for one of some tokens."""

    def slip(text: _Text, dice: Random) -> tuple[str, int, int] | None:
        places = text.indices(*tokens)
        return text.replaced(dice.choice(places), dice.choice(words)) if places else None

    return slip


def _without(*tokens: str, where: Callable[[_Text, int], bool] = lambda text, index: True) -> _Slip:
    """One of some tokens is forgotten."""

    def slip(text: _Text, dice: Random) -> tuple[str, int, int] | None:
        places = [index for index in text.indices(*tokens) if where(text, index)]
        return text.removed(dice.choice(places)) if places else None

    return slip


def _unclosed(text: _Text, dice: Random) -> tuple[str, int, int] | None:
    """A parenthesis is opened and not closed: both ends are the place."""
    index = dice.choice(text.indices(")"))
    depth, opening = 1, index
    while depth:
        opening -= 1
        depth += (text.texts[opening] == ")") - (text.texts[opening] == "(")
    changed, _, end = text.removed(index)
    return changed, text.starts[opening], end


def _with(pattern: str, new: str | Callable[[re.Match[str]], str], *, is_missing: bool = False) -> _Slip:
    """A stretch of the text that fits a pattern is written in another way, or something in it is missing."""

    def slip(text: _Text, dice: Random) -> tuple[str, int, int] | None:
        found = list(re.finditer(pattern, text.text))
        if not found:
            return None
        match = dice.choice(found)
        written = match.expand(new) if isinstance(new, str) else new(match)
        begin, end = match.span()
        changed = text.text[:begin] + written + text.text[end:]
        if is_missing:
            # The forgotten text is between the words around it.
            before = re.search(r"\S*\s*\Z", text.text[:begin])
            behind = re.match(r"\s*\S*", text.text[end:])
            assert before and behind
            return changed, before.start(), begin + len(written) + len(behind[0])
        return changed, begin, begin + len(written)

    return slip


def _typo(is_word: Callable[[_Text, int], bool]) -> _Slip:
    """Two letters change places, one is lost, doubled or another."""

    def slip(text: _Text, dice: Random) -> tuple[str, int, int] | None:
        places = [index for index in range(text.count) if len(text.texts[index]) > 3 and is_word(text, index)]
        word = text.texts[index := dice.choice(places)]
        at = dice.randrange(1, len(word) - 1)
        changed = dice.choice(
            (
                word[:at] + word[at + 1] + word[at] + word[at + 2 :],
                word[:at] + word[at + 1 :],
                word[:at] + word[at] + word[at:],
                word[:at] + dice.choice("aeionrst") + word[at + 1 :],
            )
        )
        return None if changed in text.texts else text.replaced(index, changed)

    return slip


def _is_used_name(text: _Text, index: int) -> bool:
    """Return True if a name is written once more elsewhere, and does not stand where it is declared."""
    declares = {"component", "state", "message", "service", "action", "variable", "constant", "interface", "enum"}
    declares |= {"object", "robot", "use", "->", "from" if text.texts[index - 3 : index - 2] == ["use"] else ""}
    is_property = text.texts[index - 1] == "."
    return (
        text.kinds[index] == Kind.NAME
        and text.texts[index + 1] != ":"
        and text.texts.count(text.texts[index]) > 1
        and text.texts[index - 1] not in declares
        and (not is_property or text.texts[index - 2][:1].isupper())
        and text.texts[index] not in ("type", "identifier", "constant")
    )


_WORDS = {
    "behaviour": ("behavior", "behaviors", "Behaviour"),
    "component": ("class", "node", "module", "Component"),
    "requirement": ("require", "rule", "requires", "constraint"),
    "message": ("topic", "msg"),
    "incoming": ("input", "in", "subscriber", "sub"),
    "outgoing": ("output", "out", "publisher", "pub"),
    "needs": ("requires", "need", "when", "only_if"),
    "initial": ("init", "start", "Initial"),
    "state": ("State", "states", "location"),
    "goto": ("go_to", "next", "GOTO"),
    "on": ("when", "On", "upon"),
    "variable": ("var", "let", "Variable"),
    "datatype": ("type", "typedef", "data"),
    "object": ("struct", "class", "record"),
    "provide": ("provides", "send", "with_data"),
    "transition": ("trans", "edge", "step"),
    "interface": ("import", "uses"),
    "marked": ("final", "accepting", "mark"),
    "with": ("using", "where", "With"),
    "request": ("req", "requests", "command"),
    "response": ("resp", "reply", "result"),
    "do": ("set", "Do", "assign"),
    "robot": ("Robot", "system", "model"),
    "links": ("link", "linked", "link_to"),
}

_TYPES = {
    "boolean": ("bool", "Boolean", "Bool"),
    "integer": ("int", "Integer", "int32", "uint8", "long"),
    "double": ("float", "float64", "Double", "real"),
    "string": ("str", "String", "text"),
    "none": ("void", "None", "empty", "null"),
}

SLIPS: dict[str, tuple[_Slip, ...]] = {
    "missing closing brace": (_without("}"),) * 2,
    "missing opening brace": (_without("{", where=lambda text, index: text.texts[index - 1] != "with"),),
    "word of another language": tuple(_instead((word,), others) for word, others in _WORDS.items()),
    "missing word": tuple(
        _without(word)
        for word in "goto do needs with links state message on to from use component requirement and or if type".split()
    ),
    "missing comma or bracket": (
        _without(",", where=lambda text, index: text.texts[index + 2] == ":"),
        _without(",", where=lambda text, index: text.texts[index + 2] == ":"),
        _unclosed,
        _with(r"(?<=[\w)])\)(?= )", "))"),
    ),
    "misspelt word": (_typo(lambda text, index: text.kinds[index] == Kind.WORD),) * 2,
    "misspelt name": (_typo(_is_used_name),) * 3,
    "missing colon": (_without(":"),) * 2,
    "= for :=": (_instead((":=",), ("=", "==")),) * 2,
    "== for =": (_with(r"(?<=[\w)] )=(?= \w)", "=="), _with(r"(?<=[\w)] )=(?= \w)", " == ")),
    "&& and || for and, or": (_instead(("and",), ("&&", "&", "AND")), _instead(("or",), ("||", "|", "OR"))),
    "semicolon": (_with(r"(?<=[\w)\"}])(?=\n)", ";"),) * 2,
    "quotes": (
        _with(r'"(/[\w/]+)"', r"\1"),
        _with(r'(/[\w/]+)"', r"\1"),
        _with(r'"(/[\w/]+)', r"\1"),
        _with(r'"(/[\w/]+)"', "“\\\\1”".replace("\\\\", "\\")),
    ),
    "types of other languages": tuple(_instead((word,), others) for word, others in _TYPES.items()),
    "wrong direction": (
        _with(r"\bincoming( message \w+)", r"outgoing\1"),
        _with(r"\boutgoing( message \w+)", r"incoming\1"),
        _with(r"\bon response from\b", "on request to"),
        _with(r"\bon request to\b", "on response from"),
    ),
    "missing initial": (_with(r"\binitial ((marked )?state \w+)", r"\1"),),
    "second initial": (_with(r"(?<=\n            )(marked )?state \w+", r"initial \g<0>"),),
    "duplicate name": (
        _with(r"(?<=\n)( +(?:variable|outgoing message|incoming message|interface) .*\n)(?!.*links)", r"\1\1"),
        _with(r"( +)((?:marked )?state \w+ )\{[^{}]*\}", r"\g<0>\n\1\2{ }"),
        _with(r"(\n    component \w+ )\{(.*\n)*?    \}", r"\g<0>\1{ }"),
        _with(r"(\n    datatype object \w+ \{.*\})", r"\g<0>\1"),
    ),
    "missing type": (
        _with(r"(?<=[\w\"]), type: none", "", is_missing=True),
        _with(r"(?<=variable )(\w+): \w+(\([^)]*\))?(?= =)", r"\1", is_missing=True),
        _with(r"(?<=variable )(\w+): \w+(\([^)]*\))?(?=\n)", r"\1", is_missing=True),
    ),
    "wrong value": (
        _typo(lambda text, index: text.texts[index - 1] in ("=", ":=") and text.kinds[index] == Kind.NAME),
        _with(r"(?<= = )(true|false)\b", lambda match: match[1].capitalize()),
    ),
    "unknown state": (
        _with(r"(?<=goto )\w+", "elsewhere"),
        _typo(lambda text, index: text.texts[index - 1] == "goto"),
    ),
    "guard at the wrong place": (
        _with(r"(?<=on request to )(\w+)(?= goto)", lambda match: f"{match[1]} if true"),
        _with(r"(?<=on response from )(\w+)(?= (do|goto))", lambda match: f"{match[1]} if value"),
        _with(r"transition if ([^\n{}]+?) goto (\w+)", r"transition goto \2 if \1"),
        _with(r"(?<=transition )if ([^\n{}]+?)(?= goto)", r"when \1"),
        _with(r"(?<=transition if )([^\n{}]+?)(?= goto)", r"\1 then"),
    ),
}
"""Slips by category."""

DRAWS = 3
"""Times that each slip is made in each model at most."""
WANTED = 16
"""Mistakes of a category; of one with many slips, one each more."""


def drawn(seed: int = 1) -> Iterator[Mistake]:
    """Mistakes made from good models, the same ones for a seed."""
    texts = [_Text(path.read_text("utf-8")) for path in GOOD]
    for category, slips in SLIPS.items():
        dice = Random(f"{category} {seed}")
        seen: set[str] = set()
        for number in range(DRAWS * max(WANTED, 2 * len(slips))):
            if len(seen) >= max(WANTED, 2 * len(slips)) * 3 // 4:
                break
            made = slips[number % len(slips)](dice.choice(texts), dice)
            # A change that is no mistake after all, such as another name for the robot, does not count.
            if made is not None and made[0] not in seen and first_error(made[0]) is not None:
                seen.add(made[0])
                yield Mistake(category, *made)


# By hand

_MARK = re.compile(r"«([\s\S]*?)»")


def by_hand() -> Iterator[Mistake]:
    """The mistakes of `mistakes/*.txt`: models in which `«...»` encloses what is wrong, under the names of habits."""
    for path in sorted(FOLDER.glob("*.txt")):
        frame, *chapters = re.split(r"^=== (.*)\n", path.read_text("utf-8"), flags=re.MULTILINE)
        for habit, part in zip(chapters[::2], chapters[1::2], strict=True):
            for written in part.strip("\n").split("\n---\n"):
                yield _marked(habit, frame, written)


def _marked(category: str, frame: str, written: str) -> Mistake:
    written, _, meant = written.partition("\n=> ")
    place, _, line = written.partition(": ")
    before, found, after = frame.partition(f"// {place}\n")
    assert found, place
    match = _MARK.search(line)
    assert match, written
    text = before + _MARK.sub(r"\1", line) + "\n" + after
    begin = len(before) + match.start()
    return Mistake(category, text, begin, begin + max(1, len(match[1])), tuple(filter(None, meant.split(" | "))))


def every_mistake(seed: int = 1) -> tuple[Mistake, ...]:
    """All mistakes, drawn and by hand."""
    return (*drawn(seed), *by_hand())


def report(mistakes: Iterable[Mistake], *, is_long: bool) -> Iterator[str]:
    """Yield the lines of a table of shares; before it, where asked for, those without a good message."""
    counts: dict[str, tuple[int, int]] = {}
    for mistake in mistakes:
        verdict = judge(mistake)
        good, count = counts.get(mistake.category, (0, 0))
        counts[mistake.category] = (good + verdict.is_good, count + 1)
        if is_long and not verdict.is_good:
            line = mistake.text.count("\n", 0, mistake.begin)
            yield f"{mistake.category}: {mistake.text.split(chr(10))[line].strip()}"
            yield f"  {verdict.found}" if verdict.found is not None else "  no error"
            if verdict.found is not None:
                yield f"  = fix: {verdict.found.fix}"
    for category, (good, count) in counts.items():
        yield f"{category:<28} {good:>3} of {count}"
    good, count = (sum(column) for column in zip(*counts.values(), strict=True))
    yield f"{'all':<28} {good:>3} of {count} ({good / count:.1%})"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Print how many mistakes get a good message, by category.")
    parser.add_argument("--seed", type=int, default=1, help="seed of the slips that are drawn (default: 1)")
    parser.add_argument("--long", action="store_true", help="also print each mistake without a good message")
    arguments = parser.parse_args()
    for row in report(every_mistake(arguments.seed), is_long=arguments.long):
        print(row)
