"""Collection of the findings of all checks."""

import re
from collections.abc import Collection, Iterable, Mapping

from robosc.errors import Diagnostic, RelatedPlace, Severity
from robosc.expressions import Type
from robosc.language import syntax
from robosc.language.words import spelled
from robosc.model.structure import Communication
from robosc.source import Location, SourceFile

_MAXIMUM_COMPARISONS = 20_000
"""Names that are compared in one check at most: to look for every unknown name among all names is quadratic."""

_MAXIMUM_COMPARED = 64
"""Characters of a name that is compared."""

MAXIMUM_CHOICES = 6
"""Names that are all listed where none is near."""

WORD = re.compile("[A-Za-z_][A-Za-z_0-9]*+")
"""A word of a text that may be a name."""


class Bindings:
    """Names and their definitions, noted by the checks while they resolve them.

    Attributes:
        uses: Place of a definition, by each place that names it; the definition itself is no use of it.
        communications: Place where each communication of the robot is defined, by name.
    """

    def __init__(self) -> None:
        self.uses: dict[Location, Location] = {}
        self.communications: dict[str, Location] = {}

    def bind(self, name: syntax.Name, definition: Location | None) -> None:
        """Note what a name means; None where nothing is defined that it could mean."""
        if definition is not None and definition != name.location:
            self.uses[name.location] = definition

    def bind_communication(self, name: syntax.Name) -> None:
        """Note that a name is a communication's."""
        self.bind(name, self.communications.get(name.text))


class Findings:
    """A growing list of diagnostics, and meanings of names: the one thing that the checks share and add to.

    Attributes:
        diagnostics: Findings so far.
        bindings: Meanings of names, as far as they mean something.
    """

    def __init__(self) -> None:
        self.diagnostics: list[Diagnostic] = []
        self.bindings = Bindings()
        self._comparisons = _MAXIMUM_COMPARISONS
        self._broken_communications: set[str] = set()
        self._broken_files: set[str] = set()
        self._broken_words: set[str] = set()

    def file_is_broken(self, file: SourceFile, diagnostics: Iterable[Diagnostic]) -> None:
        """Add the syntax errors of a library, and suppress the findings that follow from them.

        Suppressed are all other findings in that file, and unknown names elsewhere that occur in its text.
        """
        self.diagnostics.extend(diagnostics)
        self._broken_files.add(file.name)
        self._broken_words.update(WORD.findall(file.text))

    def is_broken(self, file: str) -> bool:
        """Return True if a file is a library with errors of its grammar."""
        return file in self._broken_files

    def error(self, code: str, message: str, location: Location, fix: str, *related: RelatedPlace) -> None:
        """Add an error."""
        self._add(Severity.ERROR, code, message, location, fix, related)

    def warning(self, code: str, message: str, location: Location, fix: str, *related: RelatedPlace) -> None:
        """Add a warning."""
        self._add(Severity.WARNING, code, message, location, fix, related)

    def note(self, code: str, message: str, location: Location, fix: str, *related: RelatedPlace) -> None:
        """Add a note."""
        self._add(Severity.NOTE, code, message, location, fix, related)

    def _add(
        self,
        severity: Severity,
        code: str,
        message: str,
        location: Location,
        fix: str,
        related: tuple[RelatedPlace, ...],
    ) -> None:
        if not self.is_broken(location.file):
            self.diagnostics.append(Diagnostic(severity, code, message, location, fix, related))

    def unknown(
        self,
        what: str,
        name: str,
        location: Location,
        known: Iterable[str],
        fix: str = "",
        words: Collection[str] = (),
    ) -> None:
        """Add an `unknown-name` error with the nearest known name, if one is near.

        Args:
            what: Kind of thing that it should name.
            name: The name as it is written.
            location: Place of the name.
            known: The names of such things.
            fix: Advice on what to do instead of writing the nearest one.
            words: Words that the language itself has there.
        """
        if name in self._broken_words:
            return
        known = list(known)
        near = self.near(name, [*known, *words])
        written = near if near is None or near in words else spelled(near)
        is_shown = 1 <= len(known) <= MAXIMUM_CHOICES and all(item.isidentifier() for item in known)
        if is_shown and not near and not fix:
            listed = " or ".join(f"'{spelled(item)}'" for item in known)
            fix = f"Write {listed}, or define the {what} '{name}'."
        self.error(
            "unknown-name",
            f"unknown {what} '{name}'" + (f"; did you mean '{near}'?" if near else ""),
            location,
            fix or (f"Write '{written}'." if near else f"Define the {what} '{name}' or use one that exists."),
        )

    def communications_are_broken(self, names: Iterable[str]) -> None:
        """Note communications that are there, but with faults that have been reported."""
        self._broken_communications.update(names)

    def explain(self, communication: str) -> bool:
        """Return True if an error that has been reported explains why a communication is not known."""
        return communication in self._broken_communications or communication in self._broken_words

    def unknown_communication(self, name: str, location: Location, known: Iterable[str]) -> None:
        """Add an `unknown-name` error, unless another error explains it."""
        if not self.explain(name):
            self.unknown("communication", name, location, known)

    def request_of(
        self, name: syntax.Name, communications: Mapping[str, Communication], code: str, why: str, fix: str
    ) -> Type | None:
        """Return the type of the request of the communication that a name denotes; None, with an error, without one.

        Args:
            name: Name that is written; its definition is noted.
            communications: All communications of the robot.
            code: Code of the error about an outgoing message, which has no request.
            why: Reason for which an outgoing message does not fit.
            fix: Advice on what fits.
        """
        found = communications.get(name.text)
        self.bindings.bind_communication(name)
        if found is None:
            self.unknown_communication(name.text, name.location, communications)
            return None
        if found.request is None:
            self.error(code, f"'{name.text}' is an outgoing message: {why}", name.location, fix)
        return found.request

    def near(self, name: str, known: Iterable[str]) -> str | None:
        """The nearest known name; None once so many names have been compared that more would take noticeable time."""
        if self._comparisons <= 0:
            return None
        names = set(known)
        self._comparisons -= len(names)
        return did_you_mean(name, names) if self._comparisons >= 0 else None

    @property
    def has_errors(self) -> bool:
        """True if any finding is an error."""
        return any(item.severity is Severity.ERROR for item in self.diagnostics)


def did_you_mean(name: str, known: Iterable[str]) -> str | None:
    """The known name nearest to a misspelt one, or None."""
    names = sorted({item for item in known if len(item) <= _MAXIMUM_COMPARED})
    folded = {item.casefold(): item for item in names}
    if name.casefold() in folded:
        return folded[name.casefold()]
    if len(name) > _MAXIMUM_COMPARED:
        return None
    import difflib  # needed for misspelt names alone

    near = difflib.get_close_matches(name.casefold(), folded, n=1, cutoff=0.7)
    return folded[near[0]] if near else None
