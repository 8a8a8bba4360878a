"""Options of a driver in a configuration, with the names and types of the driver's signature."""

import inspect
from collections.abc import Mapping
from functools import partial
from typing import Any, get_type_hints

import msgspec

from robosc_bridge.driver_registry import Driver
from robosc_bridge.errors import BridgeError

_SAID_ELSEWHERE = ("path", "robot")


class DriverOptionError(BridgeError, ValueError):
    """A driver does not know an option, or does not accept its value."""


def option_types(driver: Driver) -> dict[str, Any] | None:
    """The type of every option that a file can give; None: the driver takes whatever it is given.

    Arguments that are no data, such as functions, are only for programs and left out.
    """
    signature = inspect.signature(driver.make)
    if any(parameter.kind is parameter.VAR_KEYWORD for parameter in signature.parameters.values()):
        return None
    make: Any = driver.make.func if isinstance(driver.make, partial) else driver.make
    try:
        hints = get_type_hints(make.__init__ if inspect.isclass(make) else make)
    except (NameError, TypeError):
        # A plug-in that names types which are not there, or says nothing that has types.
        hints = {}
    found = {name: hints.get(name, Any) for name in signature.parameters if name not in _SAID_ELSEWHERE}
    return {name: kind for name, kind in found.items() if _is_data(kind)}


def _is_data(kind: Any) -> bool:
    try:
        msgspec.json.schema(kind)
    except (TypeError, ValueError):
        return False
    return True


def checked_options(driver: Driver, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options in the types of the driver's arguments.

    Args:
        driver: Driver that takes them.
        options: Options of a configuration.

    Raises:
        DriverOptionError: There is no such option, or its value is of another type; the message lists the options.
    """
    for name in _SAID_ELSEWHERE:
        if name in options:
            raise DriverOptionError(f"'{name}' is not an option: it has a key of its own outside of the options")
    types = option_types(driver)
    if types is None:
        return dict(options)
    found = {}
    for name, value in options.items():
        if name not in types:
            raise DriverOptionError(f"there is no option '{name}'; there is {', '.join(sorted(types)) or 'none'}")
        try:
            found[name] = msgspec.convert(value, types[name])
        except msgspec.ValidationError as error:
            raise DriverOptionError(f"option '{name}': {error}") from error
    return found
