"""Findings about a model, as a tuple that notebooks and terminals display."""

from collections.abc import Iterable
from typing import Self

from robosc.errors import Diagnostic, Severity
from robosc.json_documents import counts_text, diagnostics_json
from robosc.source import Bundle
from robosc.tables import html_table


class Findings(tuple[Diagnostic, ...]):
    """Every finding about a model, sorted by place.

    Attributes:
        has_errors: True if any of them is an error: the model cannot be used.
        accepted: Findings that the model accepts, which are none of these.
    """

    _bundle: Bundle | None
    accepted: tuple[Diagnostic, ...]

    def __new__(
        cls,
        diagnostics: Iterable[Diagnostic] = (),
        bundle: Bundle | None = None,
        accepted: Iterable[Diagnostic] = (),
    ) -> Self:
        """Take the findings.

        Args:
            diagnostics: The findings.
            bundle: The texts that the findings are about, from which their lines are shown; None if there are no texts.
            accepted: Findings that the model accepts.
        """
        made = super().__new__(cls, diagnostics)
        made._bundle, made.accepted = bundle, tuple(accepted)
        return made

    @property
    def has_errors(self) -> bool:
        """True if any of them is an error."""
        return bool(self.errors)

    @property
    def errors(self) -> "Findings":
        """The findings that make the model unusable."""
        return self._of(Severity.ERROR)

    @property
    def warnings(self) -> "Findings":
        """The findings that are very likely mistakes."""
        return self._of(Severity.WARNING)

    @property
    def notes(self) -> "Findings":
        """The findings that are worth knowing."""
        return self._of(Severity.NOTE)

    def to_json(self) -> dict[str, object]:
        """The findings and their counts as JSON values, as `robosc check --json` prints them."""
        return diagnostics_json(self)

    def __repr__(self) -> str:
        return f"<{counts_text(self)}>"

    def __str__(self) -> str:
        return "".join(f"{item.render(self._bundle)}\n" for item in self) + counts_text(self)

    def _repr_html_(self) -> str:
        rows = [(item.severity, item.code, item.location or "", item.message, item.fix) for item in self]
        return html_table(("severity", "code", "place", "message", "fix"), rows, caption=counts_text(self))

    def _of(self, severity: Severity) -> "Findings":
        return Findings((item for item in self if item.severity is severity), self._bundle)
