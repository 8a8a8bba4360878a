"""A place among the tokens of a text, with the basic operations of a recursive-descent parser.

It remembers the expected words, reports syntax errors, and continues after them.

After an error the parser continues in panic mode (A. V. Aho, M. S. Lam, R. Sethi, J. D. Ullman, Compilers, 2nd ed.,
2006, sec. 4.8): it skips to a word that can begin an item of one of the open lists, or to the brace that closes the
innermost list.
"""

import difflib
import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

from robosc.errors import Diagnostic, RelatedPlace, Severity
from robosc.language import syntax
from robosc.language.advice import fix_syntax, is_said_elsewhere, misplaced
from robosc.language.control_node_advice import Place, advise, why
from robosc.language.control_nodes import Declared, NodeReader, family_of
from robosc.language.limits import MAXIMUM_NAME, MAXIMUM_NESTING, MAXIMUM_SYNTAX_ERRORS
from robosc.language.sentence_advice import MAXIMUM_SENTENCE, Advice, SentenceReader
from robosc.language.tokens import Kind, Places, Tokens
from robosc.language.words import RESERVED_WORDS, STARTS, expected_words, unescape
from robosc.source import Location, SourceFile

_NAME, _WORD, _NUMBER, _STRING, _END = (
    int(kind) for kind in (Kind.NAME, Kind.WORD, Kind.NUMBER, Kind.STRING, Kind.END)
)
_UNQUOTED = re.compile(r"[“”‘’]?([\w/~{}.\-]+)[“”‘’]?")
_MAXIMUM_SHOWN = 40
_MAXIMUM_FIX = 300
MAXIMUM_ADVICE = 600
"""Characters of advice on a sentence, which may have a component in it."""

_WITH_LISTS = frozenset({"component", "behaviour", "datatype", "mission", "robot", "library", ""})
"""Words that begin what contains lists, whose own items are looked at."""

_NEAR = 0.75
"""Share that a misspelt word must have in common with the one that was meant."""


def shown(token: str) -> str:
    """A piece of the text as a message quotes it: in one line, and not too long."""
    line = " ".join(token.split())
    return f"'{line}'" if len(line) <= _MAXIMUM_SHOWN else f"'{line[:_MAXIMUM_SHOWN]}...'"


class Fault(Exception):
    """A syntax error, already reported; the innermost open list catches it and goes on."""


class TooManyFaults(Exception):
    """The text has too many syntax errors: the rest of it is left unread."""


class Extent(NamedTuple):
    """Place of an item of a list in the text.

    Attributes:
        item: Its tree.
        begin: Offset of its first character.
        end: Offset behind its last one.
    """

    item: object
    begin: int
    end: int


class Cursor:
    """Cursor that reads tokens one after the other.

    Attributes:
        texts: The tokens, as written.
        kinds: Their kinds.
        place: Index of the next token.
        diagnostics: Findings so far.
        extents: The items of lists that were read so far.
        expected: Words for what could stand at the end of the text, if it ends too early.
    """

    def __init__(self, file: SourceFile, tokens: Tokens, places: Places) -> None:
        self.texts, self.kinds, self._starts = tokens
        self.place = 0
        self.diagnostics: list[Diagnostic] = []
        self.extents: list[Extent] = []
        self.expected: tuple[str, ...] = ()
        self._file = file
        self._places = places
        self._lists: list[Mapping[str, object]] = []
        self._braces: list[int] = []
        self._possible: tuple[int, tuple[str, ...]] = (-1, ())
        self._resumed = -1
        self._depth = 0
        self._faults = 0
        self._declared = Declared(tokens)
        self._nodes = NodeReader(file.text, tokens, self._declared)
        self._sentences = SentenceReader(file.text, tokens, self._declared)

    # Places

    def at(self, index: int) -> Location:
        """The place of one token."""
        start = self._starts[index]
        return self._places.location(start, start + len(self.texts[index]))

    def since(self, index: int) -> Location:
        """The place from a token to the last one that was read."""
        last = self.place - 1
        return self._places.location(self._starts[index], self._starts[last] + len(self.texts[last]))

    def text_since(self, index: int) -> str:
        """The text from a token to the last one that was read."""
        last = self.place - 1
        return self._file.text[self._starts[index] : self._starts[last] + len(self.texts[last])]

    # Faults

    def report(self, code: str, message: str, location: Location, fix: str, *related: RelatedPlace) -> None:
        """An error that does not keep the parser from reading on."""
        if len(fix) > _MAXIMUM_FIX or "\n" in fix:
            # The text there is longer than anyone would read in a message.
            fix = "Write one of the expected words here, or look for a bracket or comma missing before."
        self.diagnostics.append(Diagnostic(Severity.ERROR, code, message, location, fix, related))

    def possible(self, *words: str, ahead: int = 0) -> None:
        """Remember what could have stood here, or some tokens ahead, for the error that the token may become."""
        index = self.place + ahead
        if self._possible[0] == index:
            words = (*self._possible[1], *words)
        self._possible = (index, words)

    def fault(self, *expected: str, related: tuple[RelatedPlace, ...] = (), fix: str = "") -> Fault:
        """Return the error that the next token is not what was expected; raise it.

        Args:
            expected: Words for what would have fitted, such as `a name` or `'{'`.
            related: Other places that explain it.
            fix: Advice on how to fix it, if more is known than the tokens show.
        """
        index = self.place
        token = self.texts[index]
        if self._possible[0] == index:
            expected = (*self._possible[1], *expected)
        self.expect(*expected)
        met = shown(token) if token else "the end of the file"
        message = f"{met} does not fit here; expected {expected_words(expected)}"
        if token == ")":
            message = "this ')' closes nothing"
        fix = fix or fix_syntax(
            self.texts[index - 1] if index else "", token, expected, self.texts[index + 1 : index + 4]
        )
        self.report("syntax-error", message, self.at(index), fix, *related)
        return self.reported_fault()

    def expect(self, *words: str) -> None:
        """Note what could stand here instead of the end of the text, if this is the end; the first note counts."""
        if self.kinds[self.place] == _END and not self.expected:
            self.expected = words

    def reported_fault(self) -> Fault:
        """Return the error to raise behind one that has been reported with `report`."""
        self._faults += 1
        if len(self.diagnostics) >= MAXIMUM_SYNTAX_ERRORS:
            raise TooManyFaults
        return Fault()

    @property
    def is_whole(self) -> bool:
        """True if nothing had to be skipped so far."""
        return not self._faults

    def deeper(self, opening: int, levels: int = 1) -> None:
        """Count brackets that are opened; the innermost construct calls `shallower` behind their end."""
        self._depth += levels
        if self._depth > MAXIMUM_NESTING:
            message = f"brackets and conditions are nested deeper than {MAXIMUM_NESTING}"
            self.report("nesting-too-deep", message, self.at(opening), "Split the expression or definition.")
            raise self.reported_fault()

    def shallower(self, levels: int = 1) -> None:
        """Count brackets that are closed."""
        self._depth -= levels

    # Single tokens

    def take(self, text: str) -> int:
        """Read the sign or word `text`; its index."""
        index = self.place
        if self.texts[index] != text:
            raise self.fault(f"'{text}'")
        self.place = index + 1
        return index

    def takes(self, text: str) -> bool:
        """Read `text` if it comes next."""
        if self.texts[self.place] == text:
            self.place += 1
            return True
        self.possible(f"'{text}'")
        return False

    def name(self) -> syntax.Name:
        """Read a name."""
        index = self.place
        if self.kinds[index] != _NAME:
            raise self.fault("a name")
        self.place = index + 1
        text, location = self.texts[index], self.at(index)
        if text[0] == "^":
            text = text[1:]
        if len(text) > MAXIMUM_NAME:
            message = f"the name has more than {MAXIMUM_NAME} characters"
            self.report("name-too-long", message, location, "Shorten the name.")
        return syntax.Name(text, location)

    def names(self) -> tuple[syntax.Name, ...]:
        """Read a name, or several in braces with commas between them."""
        if not self.takes("{"):
            return (self.name(),)
        found: list[syntax.Name] = []
        if self.texts[self.place] != "}":
            found.append(self.name())
            while self.takes(","):
                found.append(self.name())
        self.take("}")
        return tuple(found)

    def string(self) -> syntax.Text:
        """Read a text in quotes."""
        index = self.place
        if self.kinds[index] != _STRING:
            raise self._unquoted(index)
        self.place = index + 1
        return syntax.Text(unescape(self.texts[index]), self.at(index))

    def _unquoted(self, index: int) -> Fault:
        """Return the error that a text has no quotes, or curly ones."""
        written = _UNQUOTED.match(self._file.text, self._starts[index])
        if written is None or self.texts[index] in RESERVED_WORDS:
            return self.fault("a text in quotes")
        message = f"{shown(written[0])} does not fit here; expected a text in quotes"
        fix = f"Write '\"{written[1]}\"' instead of '{written[0]}'."
        self.report("syntax-error", message, self._places.location(*written.span()), fix)
        return self.reported_fault()

    def source(self, begin: int) -> str:
        """The text from a token to the last one that was read."""
        last = self.place - 1
        return self._file.text[self._starts[begin] : self._starts[last] + len(self.texts[last])]

    def integer(self) -> int:
        """Read a whole number, perhaps behind a `-`."""
        begin = self.place
        is_negative = self.takes("-")
        index = self.place
        if self.kinds[index] != _NUMBER or "." in self.texts[index]:
            raise self.fault("a whole number")
        self.place = index + 1
        value = self.whole(index, is_negative=is_negative, begin=begin)
        return -value if is_negative else value

    def whole(self, index: int, *, is_negative: bool, begin: int) -> int:
        """The value of a token of digits; 0 after reporting that it is too large."""
        digits = self.texts[index].lstrip("0") or "0"
        # Compared by length first: turning a million digits into a number would take minutes.
        if len(digits) > 10 or int(digits) > 2**31 - 1 + is_negative:
            message = "the number does not fit into 32 bits"
            self.report("integer-too-large", message, self.since(begin), "Use a number from -2147483648 to 2147483647.")
            return 0
        return int(digits)

    # Lists in braces

    def items[Item](self, parsers: Mapping[str, Callable[[], Item]], *expected: str) -> tuple[Item, ...]:
        """Read items in braces, each known by its first word, and go on behind those that are broken."""
        return self._in_braces(parsers, lambda: parsers.get(self.texts[self.place]), expected)

    def entries[Item](self, parser: Callable[[], Item], begins: Callable[[], bool], *expected: str) -> tuple[Item, ...]:
        """Read items in braces that begin with anything for which `begins` is true."""
        return self._in_braces({}, lambda: parser if begins() else None, expected)

    def _in_braces[Item](
        self,
        words: Mapping[str, object],
        parser_here: Callable[[], Callable[[], Item] | None],
        expected: tuple[str, ...],
    ) -> tuple[Item, ...]:
        return self._list(self._brace(words), words, parser_here, expected)

    def go_on[Item](self, parsers: Mapping[str, Callable[[], Item]], *expected: str) -> None:
        """Read on behind a brace that should not have closed the outermost list, for the errors alone."""
        self._list(self.place - 1, parsers, lambda: parsers.get(self.texts[self.place]), expected)

    def _list[Item](
        self,
        opening: int,
        words: Mapping[str, object],
        parser_here: Callable[[], Callable[[], Item] | None],
        expected: tuple[str, ...],
    ) -> tuple[Item, ...]:
        found: list[Item] = []
        self._braces.append(opening)
        self._lists.append(words)
        self._depth += 1
        before = -1
        while True:
            begin, known = self.place, len(self.diagnostics)
            parser = parser_here()
            if parser is None:
                is_end = self._ends(expected)
                self._read_as_sentence(begin, known, before)
                if is_end:
                    break
                continue
            try:
                item = parser()
            except Fault:
                self._recover(begin)
                self._read_as_sentence(begin, known)
                continue
            if "visit" in words:
                self._read_as_sentence(begin, known)
            found.append(item)
            before = begin
            last = self.place - 1
            self.extents.append(Extent(item, self._starts[begin], self._starts[last] + len(self.texts[last])))
        self._braces.pop()
        self._lists.pop()
        self._depth -= 1
        return tuple(found)

    def _read_as_sentence(self, begin: int, known: int, before: int = -1) -> None:
        """Report what is broken as a sentence of another language, if it is one, instead of its first wrong word.

        Args:
            begin: Its first token.
            known: Number of the findings before it.
            before: First token of the item before it, which it may go on with on the same line; -1: there is none.
        """
        words = self._lists[-1] if self._lists else {}
        if len(self.diagnostics) == known or not words or self.texts[begin] in _WITH_LISTS:
            return
        if self.diagnostics[-1].message.startswith("there is no '"):
            # A control node, which has been read as a whole.
            return
        # Words of missions and of assumptions, which are strange elsewhere.
        own = "on" if "visit" in words else "allow" if self.texts[begin] == "assume" else ""
        starts = [begin] if before < 0 or not self._is_on_line(before, begin) else [before, begin]
        end = max(self.place, begin + 1)
        line = next(
            (at for at in range(begin + 1, min(end, begin + MAXIMUM_SENTENCE)) if not self._is_on_line(begin, at)), end
        )
        # A sentence ends with its line if it is one so far.
        ends = [end] if "{" in self.texts[line:end] else [line, end]
        for start, behind in ((start, behind) for behind in dict.fromkeys(ends) for start in starts):
            advice = self._sentences.read(start, behind, words)
            if advice is None or self.texts[advice.index] == own:
                continue
            if len(fix := self._obeyed(advice)) <= MAXIMUM_ADVICE and "\n" not in fix:
                del self.diagnostics[known:]
                message = f"{shown(advice.word)} does not fit here: {advice.reason}"
                if advice.more:
                    message = f"there is no {shown(advice.word)} in the language: {advice.reason}"
                self.diagnostics.append(Diagnostic(Severity.ERROR, "syntax-error", message, self.at(advice.index), fix))
                self.place = max(advice.end, behind)
                return

    def _obeyed(self, advice: Advice) -> str:
        """The sentence that says what to write."""
        written = self._quoted(advice.begin, advice.end)
        if advice.age is not None:
            name, age = advice.age
            return f"Write 'max_age: {age}' in the 'with' list of '{name}' instead of '{written}'."
        if advice.more:
            here = f", and '{advice.meant}'" if advice.meant else ""
            return f"Write '{advice.more}' in the robot{here} instead of '{written}'."
        return f"Write '{advice.meant}' instead of '{written}'." if advice.meant else f"Remove '{written}'."

    def _is_on_line(self, first: int, last: int) -> bool:
        """Return True if two tokens stand on one line, not too far from one another."""
        return (
            last - first <= MAXIMUM_SENTENCE and "\n" not in self._file.text[self._starts[first] : self._starts[last]]
        )

    def _brace(self, words: Mapping[str, object]) -> int:
        """Read the `{` of a list; its index."""
        index = self.place
        if self.texts[index] == "{":
            self.place += 1
            return index
        fault = self.fault("'{'")
        # A text with more ends than begins lacks the '{', and not the whole list.
        is_forgotten = self.texts.count("{") < self.texts.count("}")
        if is_forgotten and (self.texts[index] in words or self.texts[index] == "}"):
            return index
        raise fault

    def _ends(self, expected: tuple[str, ...]) -> bool:
        """Return True if the list ends at a token that begins none of its items.

        Reports a token that should not be there.
        """
        index = self.place
        if self.texts[index] == "}":
            self.place += 1
            return True
        # Behind a brace too many nothing is left to close.
        is_at_end = self.kinds[index] == _END and self.texts[self._braces[-1]] == "}"
        if self._is_control_node(index, expected):
            return False
        if index != self._resumed and not is_at_end:
            related: tuple[RelatedPlace, ...] = ()
            fix = ""
            if self.kinds[index] == _END or self._begins_item(index):
                related = (RelatedPlace("this '{' is not closed", self.at(self._braces[-1])),)
                is_missing = self.texts.count("{") > self.texts.count("}")
                fix = "Write '}' before it." if is_missing else misplaced(self.texts[index])
            self.fault(*expected, "'}'", related=related, fix=fix)
            self._recover(index)
        # Words with which an outer list can go on end this one.
        index = self.place
        if self.kinds[index] == _END:
            return True
        return self.texts[index] not in self._lists[-1] and self._begins_item(index)

    def _is_control_node(self, index: int, expected: tuple[str, ...]) -> bool:
        """Return True if a node of a behaviour tree stands in the list, after reporting it and reading behind it."""
        word = self.texts[index]
        is_verb = self.texts[index + 1] == "to"
        family = family_of(word) if self._lists[-1] and not is_verb and self.kinds[index] in (_NAME, _WORD) else None
        if family is None:
            return False
        read = self._nodes.read(index)
        if read is None:
            return False
        node, end = read
        place = self._place_of_node(index, end)
        is_empty = not any(True for _ in node.leaves())
        if is_empty and place is Place.COMPONENT and is_said_elsewhere(word, expected):
            return False
        fix = advise(node, self._declared, place, self._quoted(index, end))
        message = f"there is no {shown(word)} in the language: {why(family)}"
        # The message, with states and requirements in it, may be longer than `report` lets pass.
        self.diagnostics.append(Diagnostic(Severity.ERROR, "syntax-error", message, self.at(index), fix))
        self.reported_fault()
        self.place = end
        return True

    def _quoted(self, begin: int, end: int) -> str:
        """Some tokens as a fix quotes them; what is in brackets may be of several lines."""
        last = self._starts[end - 1] + len(self.texts[end - 1])
        text = self._file.text[self._starts[begin] : last]
        opening = {"}": "{", ")": "("}.get(self.texts[end - 1])
        if opening is None or (len(text) <= _MAXIMUM_SHOWN and "\n" not in text):
            return text
        return f"{text[: text.index(opening) + 1]} ... {self.texts[end - 1]}"

    def _place_of_node(self, begin: int, end: int) -> Place:
        """Return the kind of the list that a control node stands in."""
        if "component" in self._lists[-1]:
            return Place.ROBOT
        opening = self._braces[-1]
        if "variable" in self._lists[-1] and opening + 1 == begin and self.texts[end] == "}":
            return Place.BEHAVIOUR
        if "behaviour" in self._lists[-1]:
            depth, index = 1, opening + 1
            while depth and self.kinds[index] != _END and self.texts[index] != "behaviour":
                depth += (self.texts[index] == "{") - (self.texts[index] == "}")
                index += 1
            if self.texts[index] != "behaviour" or not depth:
                return Place.COMPONENT
        return Place.ELSEWHERE

    def _begins_item(self, index: int) -> bool:
        """Return True if a token looks like the first word of an item of an open list."""
        word, following = self.texts[index], self.texts[index + 1]
        follow = STARTS.get(word)
        if follow is None or not any(word in parsers for parsers in self._lists):
            return False
        if word == "on" and "visit" in self._lists[-1]:
            # A detour begins with any condition.
            return True
        if follow == "names":
            return self.kinds[index + 1] == _NAME or following == "{"
        return self.kinds[index + 1] == _NAME if follow == "a name" else follow is True or following in follow

    def _reads_body(self, begin: int, opening: int) -> bool:
        """Read the list that a broken item still has, if its first word says what the list contains."""
        words = difflib.get_close_matches(self.texts[begin][:MAXIMUM_NAME], self._lists[-1], n=1, cutoff=_NEAR)
        reader = self.body_of(words[0], self.texts[begin + 1]) if words else None
        if reader is None:
            return False
        self.place = opening
        reader()
        return True

    def body_of(self, word: str, following: str) -> Callable[[], object] | None:
        """Return the reader of the list in braces of an item that begins with these words, or None if it has none."""
        raise NotImplementedError

    def _recover(self, begin: int) -> None:
        """Skip to where an open list can go on, knowing that the item at token `begin` is broken."""
        index = self.place
        self._depth = len(self._lists)
        depth = 0
        for token in self.texts[begin:index]:
            depth += (token == "{") - (token == "}")
        while self.kinds[index] != _END:
            token = self.texts[index]
            if token == "{":
                if depth == 0 and self._reads_body(begin, index):
                    index = self.place
                    continue
                depth += 1
            elif token == "}":
                if depth <= 0:
                    break
                depth -= 1
            elif (index > begin and self._begins_item(index)) or (
                index == begin and token not in self._lists[-1] and self._begins_item(index)
            ):
                break
            index += 1
        self.place = self._resumed = index


__all__ = ["Cursor", "Extent", "Fault", "TooManyFaults", "shown"]
