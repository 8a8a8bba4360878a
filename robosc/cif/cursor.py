"""A place among the tokens of a CIF text, and the syntax errors found there."""

import re
from bisect import bisect_right

from robosc.cif import syntax
from robosc.cif.reserved_words import KEYWORDS
from robosc.cif.tokens import Kind, tokenize
from robosc.errors import Diagnostic, Severity
from robosc.language.limits import MAXIMUM_NAME, MAXIMUM_NESTING, MAXIMUM_SYNTAX_ERRORS
from robosc.source import Location, SourceFile

_NAME, _INTEGER, _STRING, _OTHER, _END = (
    int(kind) for kind in (Kind.NAME, Kind.INTEGER, Kind.STRING, Kind.OTHER, Kind.END)
)
_MAXIMUM_SHOWN = 40
_ESCAPE = re.compile(r"\\(.)")


class Fault(Exception):
    """A syntax error, already reported; the innermost list of declarations catches it and goes on behind it."""


class Stop(Exception):
    """A syntax error, already reported, behind which nothing would be read right."""


# Not that of `robosc.language`, which remembers what could stand where, and goes on behind faults in another way.
class Cursor:
    """Cursor that reads tokens one after the other.

    Attributes:
        texts: The tokens as written.
        kinds: Their kinds.
        place: Index of the next token.
        diagnostics: Findings so far.
    """

    def __init__(self, file: SourceFile) -> None:
        self.texts, self.kinds, self._starts = tokenize(file.text)
        self.place = 0
        self.diagnostics: list[Diagnostic] = []
        self._file = file
        self._lines = [0, *(match.end() for match in re.finditer("\n", file.text))]
        self._depth = 0

    def at(self, index: int) -> Location:
        """The place of one token, up to the end of its line."""
        start = self._starts[index]
        line = bisect_right(self._lines, start)
        length = len(self.texts[index].split("\n", 1)[0])
        return Location(self._file.name, line, start - self._lines[line - 1] + 1, max(1, length))

    @property
    def here(self) -> Location:
        """The place of the next token."""
        return self.at(self.place)

    def report(self, message: str, location: Location, fix: str) -> None:
        """Report a syntax error.

        Raises:
            Stop: There are so many that the rest is left unread.
        """
        self.diagnostics.append(Diagnostic(Severity.ERROR, "cif-syntax-error", message, location, fix))
        if len(self.diagnostics) >= MAXIMUM_SYNTAX_ERRORS:
            raise Stop

    def fault(self, expected: str, fix: str = "") -> Fault:
        """Return the error that the next token is not what was expected; raise it.

        Args:
            expected: Words for what would have fitted.
            fix: Advice, if more is known than the token shows.
        """
        index = self.place
        token = self.texts[index]
        if self.kinds[index] == _OTHER:
            self._report_other(index)
        else:
            met = "the end of the file" if self.kinds[index] == _END else f"'{_shown(token)}'"
            if token in KEYWORDS and expected == "a name":
                fix = f"'{token}' is a word of the language: choose another name, or write '${token}'."
            self.report(f"{met} does not fit here; expected {expected}", self.at(index), fix or f"Write {expected}.")
        return Fault()

    def _report_other(self, index: int) -> None:
        token, location = self.texts[index], self.at(index)
        if token.startswith("/*"):
            self.report("this comment is never closed", location, "Close it with '*/'.")
        elif token == '"':
            message = 'this text is not closed on its line, or has an escape other than \\n, \\t, \\" and \\\\'
            self.report(message, location, "Close it with '\"' on the same line.")
        else:
            self.report(f"the character '{token}' means nothing here", location, "Remove it.")

    # Depth

    def deeper(self) -> None:
        """Count a construct in a construct.

        Raises:
            Stop: They are nested too deeply.
        """
        self._depth += 1
        if self._depth > MAXIMUM_NESTING:
            self.report(f"this is nested deeper than {MAXIMUM_NESTING} levels", self.here, "Split it.")
            raise Stop

    def shallower(self) -> None:
        """Count the end of such a construct."""
        self._depth -= 1

    @property
    def depth(self) -> int:
        """Number of constructs that are open."""
        return self._depth

    def back_to(self, depth: int) -> None:
        """Forget constructs that a syntax error has left open."""
        self._depth = depth

    # Single tokens

    def take(self, text: str) -> int:
        """Read the sign or word `text`; its index.

        Raises:
            Fault: Something else comes next.
        """
        index = self.place
        if self.texts[index] != text:
            raise self.fault(f"'{text}'")
        self.place = index + 1
        return index

    def takes(self, text: str) -> bool:
        """Read `text` if it comes next."""
        if self.texts[self.place] != text:
            return False
        self.place += 1
        return True

    def sees(self, text: str) -> bool:
        """Return True if `text` comes next."""
        return self.texts[self.place] == text

    def identifier(self) -> syntax.Identifier:
        """Read the name of something that is declared.

        Raises:
            Fault: Something else comes next.
        """
        index = self.place
        text = self.texts[index]
        if self.kinds[index] != _NAME or not text.replace("$", "", 1).isidentifier():
            is_reference = self.kinds[index] == _NAME
            raise self.fault("a name", "Write a name without dots." if is_reference else "")
        self.place = index + 1
        if len(text) > MAXIMUM_NAME:
            self.report(f"the name has more than {MAXIMUM_NAME} characters", self.at(index), "Shorten the name.")
        return syntax.Identifier(text.removeprefix("$"), self.at(index))

    def name(self) -> syntax.Name:
        """Read a reference.

        Raises:
            Fault: Something else comes next.
        """
        index = self.place
        if self.kinds[index] != _NAME:
            raise self.fault("a name")
        self.place = index + 1
        text = self.texts[index]
        root = syntax.Root(text[0]) if text[0] in ".^" else syntax.Root.HERE
        parts = tuple(part.removeprefix("$") for part in text[len(root) :].split("."))
        if max(map(len, parts)) > MAXIMUM_NAME:
            self.report(f"the name has more than {MAXIMUM_NAME} characters", self.at(index), "Shorten the name.")
        return syntax.Name(parts, root, self.at(index))

    def string(self) -> str:
        """Read a text in quotes.

        Raises:
            Fault: Something else comes next.
        """
        index = self.place
        if self.kinds[index] != _STRING:
            raise self.fault("a text in quotes")
        self.place = index + 1
        return _ESCAPE.sub(lambda match: {"n": "\n", "t": "\t"}.get(match[1], match[1]), self.texts[index][1:-1])

    def integer(self) -> int:
        """Read a whole number; 0 after reporting that it is too large."""
        index = self.place
        self.place = index + 1
        digits = self.texts[index]
        # Compared by length first: turning a million digits into a number would take minutes.
        if len(digits) > 10 or int(digits) > 2**31 - 1:
            self.report("the number does not fit into 32 bits", self.at(index), "Use a number up to 2147483647.")
            return 0
        return int(digits)


def _shown(token: str) -> str:
    return token if len(token) <= _MAXIMUM_SHOWN else f"{token[:_MAXIMUM_SHOWN]}..."
