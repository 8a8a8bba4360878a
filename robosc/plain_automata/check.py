"""Check of files of plain automata: every finding, and the automata of a file without errors."""

from collections.abc import Callable
from pathlib import PurePath

from robosc.automata import CheckedSystem, System, SystemPlaces
from robosc.errors import LanguageError, sorted_diagnostics
from robosc.model.findings import Findings
from robosc.plain_automata.gen import read_gen
from robosc.plain_automata.wmod import read_wmod
from robosc.source import Bundle, SourceFile

type _Reader = Callable[[SourceFile, Findings], tuple[System, SystemPlaces]]

_READERS: dict[str, _Reader] = {".gen": read_gen, ".wmod": read_wmod}


def check_automata(bundle: Bundle) -> CheckedSystem:
    """Check a file of plain automata, and make a system of it.

    Args:
        bundle: The file, whose ending says what it is; no other belongs to it.
    """
    findings = Findings()
    system, places = None, SystemPlaces()
    try:
        system, places = _READERS[PurePath(bundle.main.name).suffix](bundle.main, findings)
    except LanguageError as error:
        findings.diagnostics.extend(error.diagnostics)
    return CheckedSystem(None if findings.has_errors else system, sorted_diagnostics(findings.diagnostics), places)
