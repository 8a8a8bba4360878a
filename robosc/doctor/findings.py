"""Findings about a machine."""

from dataclasses import dataclass
from enum import StrEnum


class Grade(StrEnum):
    """Meaning of a finding."""

    OK = "ok"
    NOTE = "note"
    """Something is not there that is not needed, or is worth knowing."""
    MISSING = "missing"
    """Something that the purpose needs is not there, or does not work."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Finding about one part of a machine.

    Attributes:
        part: Short name of the part.
        grade: Its grade.
        message: One sentence about what is there, or what is not.
        fix: Command or instruction that puts it right; empty: none is needed.
    """

    part: str
    grade: Grade
    message: str
    fix: str = ""
