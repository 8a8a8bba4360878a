"""Sources of the settings: flags, environment variables and the settings file.

A flag overrides the environment, the environment overrides the file, and the file overrides the default.
"""

import argparse
import os
import re
import sys
import tomllib
from collections.abc import Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Any, ClassVar

from pydantic import ValidationError
from pydantic_settings import BaseSettings, PydanticBaseSettingsSource, SettingsConfigDict

from robosc import __version__
from robosc.cli.output import ExitCode
from robosc.cli.running import Parser
from robosc_server.operations.settings import Settings, default_text, description_of, group_of

ENVIRONMENT_PREFIX = "ROBOSC_SERVER_"
_CONFIG_VARIABLE = ENVIRONMENT_PREFIX + "CONFIG"
MAXIMUM_FILE_BYTES = 256 * 1024


class SettingsError(Exception):
    """Settings that cannot be used.

    Attributes:
        problems: A sentence for each problem, with its place.
    """

    def __init__(self, problems: Sequence[str]) -> None:
        super().__init__("\n".join(problems))
        self.problems = tuple(problems)

    def report(self) -> int:
        """Print the problems on standard error; returns the exit status."""
        sys.stderr.writelines(f"robosc-server: {problem}\n" for problem in self.problems)
        return ExitCode.USAGE


class _SourcedSettings(BaseSettings, Settings):
    """Settings read from flags, environment and file."""

    model_config = SettingsConfigDict(
        frozen=True,
        extra="forbid",
        hide_input_in_errors=True,
        env_prefix=ENVIRONMENT_PREFIX,
        env_ignore_empty=True,
        validate_default=False,
    )

    from_file: ClassVar[Mapping[str, Any]] = {}

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,
        file_secret_settings: PydanticBaseSettingsSource,
    ) -> tuple[Any, ...]:
        """Return the sources of the settings, the one that takes precedence first."""
        return init_settings, env_settings, lambda: dict(cls.from_file)


def settings_from(flags: Mapping[str, Any], config: Path | None) -> Settings:
    """Return the settings of flags, environment and file together.

    Args:
        flags: Values of flags, by name of the field.
        config: File in TOML; None: none.

    Raises:
        SettingsError: The file cannot be read, has an unknown key, or a value is wrong; the error lists all problems.
    """
    content = {} if config is None else read_file(config)

    class SourcedSettings(_SourcedSettings):
        from_file = content

    try:
        given = SourcedSettings(**flags)
    except ValidationError as error:
        problems = []
        for problem in error.errors(include_url=False, include_context=False):
            place = source_of(str(problem["loc"][0]), flags, config)
            problems.append(f"{place}: {_problem_text(problem['type'], problem['msg'])}")
        raise SettingsError(problems) from None
    return Settings.model_construct(given.model_fields_set, **dict(given))


def source_of(name: str, flags: Mapping[str, Any], config: Path | None) -> str:
    """Return a description of the source of a setting's value."""
    if name in flags:
        return flag_of(name)
    variable = variable_of(name)
    # Unknown variables with our prefix are ignored: they may belong to other programs.
    if name in Settings.model_fields and os.environ.get(variable):
        return f"${variable}"
    return f"{config}: {name}"


_PROBLEM_TEXTS = {
    "extra_forbidden": "unknown setting; `robosc-server example-config` lists all settings",
    "int_parsing": "must be a whole number",
    "int_type": "must be a whole number",
    "float_parsing": "must be a number",
    "float_type": "must be a number",
    "bool_parsing": "must be true or false",
    "bool_type": "must be true or false",
    "string_type": "must be a text",
    "path_type": "must be a text",
}


def _problem_text(kind: str, message: str) -> str:
    return _PROBLEM_TEXTS.get(kind) or message.replace("Input should be", "must be")


def read_file(path: Path) -> dict[str, Any]:
    """Return the content of a file of settings.

    Raises:
        SettingsError: The file cannot be read, is too large, or is not TOML.
    """
    try:
        with path.open("rb") as stream:
            data = stream.read(MAXIMUM_FILE_BYTES + 1)
    except OSError as error:
        raise SettingsError([f"{path}: {error.strerror}"]) from error
    if len(data) > MAXIMUM_FILE_BYTES:
        raise SettingsError([f"{path}: the file is larger than {MAXIMUM_FILE_BYTES} bytes"])
    try:
        return tomllib.loads(data.decode())
    except (UnicodeDecodeError, RecursionError) as error:
        raise SettingsError([f"{path}: not valid TOML"]) from error
    except tomllib.TOMLDecodeError as error:
        # The message has the place and not the line, which may hold a password.
        place = re.search(r"\(at (?:line \d+, column \d+|end of document)\)", str(error))
        raise SettingsError([f"{path}: not valid TOML {place[0] if place else ''}".rstrip()]) from None


def flag_of(name: str) -> str:
    """Return the flag of a setting."""
    return "--" + name.replace("_", "-")


def variable_of(name: str) -> str:
    """Return the environment variable of a setting."""
    return ENVIRONMENT_PREFIX + name.upper()


_EPILOG = f"""\
commands:
  robosc-server token NAME       create a token for a caller
  robosc-server tokens COMMAND   add, rotate, list or revoke the tokens of a file
  robosc-server check-config     check whether the server can start with these settings
  robosc-server example-config   print a settings file with every setting and its default
  robosc-server health           query the health of the server that runs with these settings

Each setting can also be set in the settings file (state_dir = "/var/lib/robosc-server") and by an environment variable
({ENVIRONMENT_PREFIX}STATE_DIR). A flag overrides the environment, and the environment overrides the file. Sizes may
have a unit: 64MiB. Addresses that other machines can reach need TLS. SIGTERM and SIGINT shut it down gracefully.

exit status:
  0  the server was stopped by a signal
  1  the address, a certificate, the tokens, the database or the workers cannot be used
  2  wrong options or settings
"""


def add_settings_arguments(parser: argparse.ArgumentParser) -> None:
    """Add a flag for each setting, and `--config`."""
    parser.add_argument(
        "--config", type=Path, metavar="FILE", help=f"settings file in TOML (default: ${_CONFIG_VARIABLE})"
    )
    groups: dict[str, Any] = {}
    for name, field in Settings.model_fields.items():
        heading = group_of(name)
        group = groups[heading] = groups.get(heading) or parser.add_argument_group(heading)
        extra: Any = field.json_schema_extra
        words = f"{description_of(name)} (default: {default_text(name)})".replace("%", "%%")
        if field.annotation is bool:
            group.add_argument(
                flag_of(name), dest=name, action=argparse.BooleanOptionalAction, default=argparse.SUPPRESS, help=words
            )
        else:
            metavar = extra["metavar"] or _metavar(name)
            group.add_argument(flag_of(name), dest=name, default=argparse.SUPPRESS, metavar=metavar, help=words)


def _metavar(name: str) -> str:
    annotation = Settings.model_fields[name].annotation
    if isinstance(annotation, type) and issubclass(annotation, StrEnum):
        return "|".join(annotation)
    return {"host": "HOST", "port": "PORT"}.get(name, "SECONDS" if name.endswith("_seconds") else "N")


def settings_of(arguments: argparse.Namespace) -> Settings:
    """Return the settings of parsed flags, the environment and the file.

    Raises:
        SettingsError: The settings cannot be used.
    """
    flags = {name: value for name, value in vars(arguments).items() if name in Settings.model_fields}
    return settings_from(flags, config_file_of(arguments))


def config_file_of(arguments: argparse.Namespace) -> Path | None:
    """Return the path of the settings file; None: there is none."""
    if arguments.config is not None:
        return Path(arguments.config)
    variable = os.environ.get(_CONFIG_VARIABLE)
    return Path(variable) if variable else None


def make_parser() -> Parser:
    """Return the parser of the command line that serves."""
    parser = Parser(
        prog="robosc-server",
        usage="robosc-server [--config FILE] [SETTING ...]\n       robosc-server COMMAND ...",
        description="Check models, synthesize supervisors and generate packages over gRPC.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"robosc-server {__version__}")
    add_settings_arguments(parser)
    return parser


def load_settings(argv: Sequence[str]) -> Settings:
    """Return the settings of a command line; ends the program with status 2 if they are wrong."""
    try:
        return settings_of(make_parser().parse_args(argv))
    except SettingsError as error:
        raise SystemExit(error.report()) from None
