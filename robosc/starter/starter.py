"""Texts of a new robot, made from the templates beside this module.

A pure function turns a name into texts, and its caller writes them. Only validated names are put into a template, so
nothing has to be escaped there.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from string import Template
from types import MappingProxyType

from robosc.errors import RoboscError
from robosc.language.words import RESERVED_WORDS
from robosc.targets.code.naming import snake_case

MAXIMUM_STEM = 200
"""Characters of a file name's stem: names of files end at 255 bytes, and what is generated adds to the stem."""

_NAME = re.compile(r"[A-Za-z_][A-Za-z_0-9]*")
_MAXIMUM_SHOWN = 40


class InvalidNameError(RoboscError, ValueError):
    """A text that cannot be the name of a robot."""


@dataclass(frozen=True, slots=True)
class Starter:
    """A new robot.

    Attributes:
        robot: Its name.
        stem: The name of its model's file without the ending; also a fitting name for its folder.
        files: Texts by file name: the model first, its library, the page that says what to do next.
    """

    robot: str
    stem: str
    files: Mapping[str, str]

    @property
    def model(self) -> str:
        """File name of the model."""
        return f"{self.stem}.rscd"


_PLAIN = {
    "twist": "Twist",
    "velocity": "Velocity",
    "stamped": "",
    "begin": "",
    "end": "",
    "long_begin": "",
    "long_end": "",
}
_STAMPED = {
    "twist": "TwistStamped",
    "velocity": 'StampedVelocity, stamped: "base_link"',
    "stamped": "    datatype object StampedVelocity { twist: Velocity }\n",
    "begin": "{ twist: ",
    "end": " }",
    "long_begin": "{\n        twist: ",
    "long_end": "\n    }",
}
"""Parts of the templates that depend on how velocities are sent."""


def make_starter(robot: str, *, is_stamped: bool = False) -> Starter:
    """The starter of a robot called `robot`.

    Args:
        robot: Its name.
        is_stamped: True if velocities are sent as TwistStamped, as robots take them from Kilted on.

    Raises:
        InvalidNameError: The language has no such name, or it is too long for a file.
    """
    _require_name(robot)
    stem = snake_case(robot)
    if len(stem) > MAXIMUM_STEM:
        raise InvalidNameError(
            f"the name of the robot is too long for a file: {_one_line(robot)} becomes {len(stem)} characters, "
            f"and at most {MAXIMUM_STEM} fit"
        )
    names = {"robot": robot, "library": f"{robot}Parts", "stem": stem, **(_STAMPED if is_stamped else _PLAIN)}
    templates = {
        f"{stem}.rscd": "robot.rscd.tmpl",
        f"{stem}_parts.rscd": "library.rscd.tmpl",
        "README.md": "README.tmpl",
    }
    files = {name: _filled(template, names) for name, template in templates.items()}
    return Starter(robot, stem, MappingProxyType(files))


def _require_name(robot: str) -> None:
    if not _NAME.fullmatch(robot):
        raise InvalidNameError(
            f"{_one_line(robot)} is no name for a robot: letters A to Z, digits and '_', the first no digit, as in "
            "'LineFollower'"
        )
    if robot in RESERVED_WORDS:
        raise InvalidNameError(
            f"'{robot}' is a word of the language, so no robot is called that: take another name, such as "
            f"'{robot.capitalize()}Robot'"
        )


def _one_line(text: str) -> str:
    """A text of a user, whatever it holds, as one short line."""
    return ascii(text if len(text) <= _MAXIMUM_SHOWN else f"{text[:_MAXIMUM_SHOWN]}...")


def _filled(template: str, names: Mapping[str, str]) -> str:
    text = resources.files("robosc.starter").joinpath("templates", template).read_text(encoding="utf-8")
    return Template(text).substitute(names)
