"""Files of plain automata, checked: every finding, and the automata of a file without errors."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import PurePath

from robosc.automata import System
from robosc.errors import Diagnostic, LanguageError, sorted_diagnostics
from robosc.model.findings import Findings
from robosc.plain_automata.gen import read_gen
from robosc.plain_automata.wmod import read_wmod
from robosc.source import Bundle, SourceFile

_READERS: dict[str, Callable[[SourceFile, Findings], System]] = {".gen": read_gen, ".wmod": read_wmod}


@dataclass(frozen=True, slots=True)
class CheckedAutomata:
    """Result of checking.

    Attributes:
        system: The automata; None if there are errors.
        diagnostics: Every finding, sorted by place.
    """

    system: System | None
    diagnostics: tuple[Diagnostic, ...]


def check_automata(bundle: Bundle) -> CheckedAutomata:
    """Check a file of plain automata, and make a system of it.

    Args:
        bundle: The file, whose ending says what it is; no other belongs to it.
    """
    findings = Findings()
    system = None
    try:
        system = _READERS[PurePath(bundle.main.name).suffix](bundle.main, findings)
    except LanguageError as error:
        findings.diagnostics.extend(error.diagnostics)
    return CheckedAutomata(None if findings.has_errors else system, sorted_diagnostics(findings.diagnostics))
