"""From the file to a checked configuration."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path as FilePath

from robosc_bridge.configuration.decoding import decode
from robosc_bridge.configuration.document import Document, parse_document, read_file
from robosc_bridge.configuration.problems import ConfigurationError, Path, Problem
from robosc_bridge.configuration.structure import Configuration, Remote, Safety


@dataclass(frozen=True, slots=True)
class Loaded:
    """Configuration and the text that it was read from.

    Attributes:
        configuration: Content of the text.
        document: Document with the place of each key, for messages.
    """

    configuration: Configuration
    document: Document


def load(path: FilePath) -> Loaded:
    """Read a configuration file.

    Raises:
        ConfigurationError: It cannot be read, is not YAML, or is no valid configuration; lists all that is wrong.
    """
    return parse(read_file(path), str(path))


def parse(data: bytes, name: str) -> Loaded:
    """Read a configuration.

    Args:
        data: YAML in UTF-8.
        name: Of its file, for messages.

    Raises:
        ConfigurationError: It is not YAML or no valid configuration; lists all that is wrong.
    """
    document = parse_document(data, name)
    configuration = decode(document, Configuration)
    problems = [Problem(text, path, document.line(path)) for path, text in _contradictions(configuration)]
    if problems:
        raise ConfigurationError(name, problems)
    return Loaded(configuration, document)


def _contradictions(configuration: Configuration) -> Iterator[tuple[Path, str]]:
    """Values that are valid alone but contradict each other."""
    skills, safety = configuration.skills, configuration.safety
    pairs = (
        (skills.rotate, ("skills", "rotate"), "slowest_rad_s", "speed_rad_s", True),
        (skills.line, ("skills", "line"), "top", "bottom", False),
        (skills.line, ("skills", "line"), "smallest", "largest", False),
        (safety, ("safety",), "battery_stop_v", "battery_warning_v", True),
    )
    for section, path, low, high, may_be_equal in pairs:
        first, second = getattr(section, low), getattr(section, high)
        if first is None or second is None:
            continue
        if first > second or (first == second and not may_be_equal):
            words = "at most" if may_be_equal else "below"
            yield (*path, low), f"is {first:g}; it must be {words} '{high}', which is {second:g}"
    stop = skills.emergency_stop
    for kind in ("keys", "buttons"):
        for name in sorted({*getattr(stop, f"stop_{kind}")} & {*getattr(stop, f"resume_{kind}")}):
            yield ("skills", "emergency_stop", f"resume_{kind}"), f"'{name}' stops the robot already"
    yield from _times(configuration)
    yield from _idle(configuration)
    if configuration.execution.priority and configuration.execution.policy != "priority":
        yield ("execution", "priority"), "has no effect unless 'policy' is priority"


def _times(configuration: Configuration) -> Iterator[tuple[Path, str]]:
    """Timeouts that even a loop on schedule would exceed, which would stop the wheels again and again."""
    period_s, plain = configuration.execution.period_s, Safety()
    for name in ("overrun_s", "command_timeout_s"):
        limit_s = getattr(configuration.safety, name)
        if limit_s < 2 * period_s:
            if limit_s == getattr(plain, name):  # Not written, most often: what is, is the other one.
                text = f"is {period_s:g}; it must be at most half of 'safety.{name}', which is {limit_s:g}"
                yield ("execution", "period_s"), text
            else:
                text = f"is {limit_s:g}; it must be at least twice 'execution.period_s', which is {period_s:g}"
                yield ("safety", name), text


def _idle(configuration: Configuration) -> Iterator[tuple[Path, str]]:
    """Settings without effect, from which a person may expect one."""
    remote, plain = configuration.remote, Remote()
    needing = {
        "grpc_address": ("tls_certificate", "tls_key", "client_ca", "tokens", "insecure_beyond_loopback"),
        "mavlink_url": ("mavlink_key", "mavlink_unsigned_commands"),
    }
    for needed, names in needing.items():
        for name in names:
            if getattr(remote, needed) is None and getattr(remote, name) != getattr(plain, name):
                yield ("remote", name), f"has no effect without '{needed}'"
    view = configuration.view
    if (view.tls_certificate is None) != (view.tls_key is None):
        missing = "tls_key" if view.tls_key is None else "tls_certificate"
        yield ("view",), f"a certificate and its key belong together: '{missing}' is missing"
