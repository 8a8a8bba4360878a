"""Names in generated code: distinct names for the parts of a model, and the name of a generated package."""

import keyword
import re
from collections.abc import Iterable

from robosc.errors import UnsupportedModelError
from robosc.supervisor import Supervisor
from robosc.targets.registry import GenerateOptions

MAXIMUM_NAME = 100
"""Characters of a robot's name that are taken for the name of its package."""


class Namer:
    """Hands out distinct names; the same preferred names in the same order give the same names.

    Args:
        taken: Names that must not be handed out.
        hidden: Sets of names of others, which must not be handed out either; they may grow.

    Attributes:
        taken: Names handed out, and those that must not be.
    """

    def __init__(self, taken: Iterable[str] = (), hidden: Iterable[set[str]] = ()) -> None:
        self.taken = set(taken)
        self.hidden = tuple(hidden)

    def legal(self, preferred_name: str) -> str:
        """A legal name for any text."""
        return re.sub(r"[^A-Za-z0-9_]", "_", preferred_name)

    def name(self, preferred_name: str) -> str:
        """A new name as close as possible to `preferred_name`."""
        base = self.legal(preferred_name)
        name, number = base, 2
        while name in self.taken or any(name in other for other in self.hidden):
            name, number = f"{base}_{number}", number + 1
        self.taken.add(name)
        return name


def snake_case(text: str) -> str:
    """A lower-case name with single underscores, starting with a letter: `LineFollower` -> `line_follower`."""
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", text)
    name = re.sub(r"_+", "_", re.sub(r"[^a-z0-9]", "_", spaced.lower())).strip("_")
    return name if name and name[0].isalpha() else f"robot_{name}".rstrip("_")


def package_name(supervisor: Supervisor, options: GenerateOptions, suffix: str) -> str:
    """The chosen name, or one made from the robot's: `line_follower_<suffix>`.

    Raises:
        UnsupportedModelError: The chosen name is no name for a package.
    """
    if options.package is None:
        return f"{snake_case(supervisor.model.name)[:MAXIMUM_NAME].rstrip('_')}_{suffix}"
    require_package_name(options.package)
    return options.package


def require_package_name(name: str) -> None:
    """Do nothing if a package of any target may be called so.

    Raises:
        UnsupportedModelError: It may not.
    """
    if snake_case(name) != name or keyword.iskeyword(name) or len(name) > 2 * MAXIMUM_NAME:
        raise UnsupportedModelError(
            f"'{name}' is not a name for a package: lower-case letters, digits and single underscores, "
            "starting with a letter, and no keyword of Python"
        )
