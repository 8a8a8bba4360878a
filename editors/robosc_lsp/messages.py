"""Messages between the language server and the process that synthesizes for it."""

import msgspec

from robosc.source import Location


class FindingMessage(msgspec.Struct, frozen=True):
    """A finding of synthesis, as `robosc.errors.Diagnostic`."""

    severity: str
    code: str
    message: str
    fix: str
    location: Location | None
    related: tuple[tuple[str, Location], ...] = ()


class SynthesisResponse(msgspec.Struct, frozen=True):
    """Result of synthesis for a robot.

    Attributes:
        unknown: Reason why nothing is known; empty where something is.
        states: States of the controlled robot; None where there is no supervisor.
        reason: Reason why there is no supervisor; empty where there is one.
        added: Additions of the supervisor to each controllable event, in words.
        findings: Findings that only synthesis can make.
    """

    unknown: str = ""
    states: int | None = None
    reason: str = ""
    added: dict[str, str] = {}
    findings: tuple[FindingMessage, ...] = ()


class SynthesisRequest(msgspec.Struct, frozen=True):
    """A robot on its way to the process.

    Attributes:
        main: Name and text of its file.
        libraries: Those of each library.
        known: Codes of findings that the checks have told already.
    """

    main: tuple[str, str]
    libraries: tuple[tuple[str, str], ...]
    known: tuple[str, ...]


__all__ = ["FindingMessage", "SynthesisRequest", "SynthesisResponse"]
