"""Findings about a machine."""

from dataclasses import dataclass
from enum import StrEnum


class Grade(StrEnum):
    """Meaning of a finding."""

    OK = "ok"
    NOTE = "note"
    """A part that is not needed is missing, or a remark is worth knowing."""
    MISSING = "missing"
    """A part that the purpose needs is missing or does not work."""


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
