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
    accepted: str | None = None


class SynthesisResponse(msgspec.Struct, frozen=True):
    """Result of synthesis for a robot.

    Attributes:
        unknown: Reason why there is no result; empty if there is one.
        states: States of the controlled robot; None if there is no supervisor.
        reason: Reason why there is no supervisor; empty if there is one.
        added: Conditions that the supervisor adds to each controllable event, as texts.
        findings: Every finding about the robot, those that it accepts, too.
    """

    unknown: str = ""
    states: int | None = None
    reason: str = ""
    added: dict[str, str] = {}
    findings: tuple[FindingMessage, ...] = ()


class SynthesisRequest(msgspec.Struct, frozen=True):
    """Request for the synthesis of a robot.

    Attributes:
        main: Name and text of its file.
        libraries: Those of each library.
    """

    main: tuple[str, str]
    libraries: tuple[tuple[str, str], ...]


__all__ = ["FindingMessage", "SynthesisRequest", "SynthesisResponse"]
