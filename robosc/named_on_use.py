"""Names of a package that are imported on use, so that a program that needs one of them does not load all modules."""

import importlib
from collections.abc import Callable, Mapping
from typing import Any


def named_on_use(package: str, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """Return a package's `__getattr__` (PEP 562) that imports a public name from its module on first use.

    Args:
        package: Name of the package.
        homes: Module of each public name, relative to the package.
    """

    def find(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(importlib.import_module(f"{package}.{homes[name]}"), name)

    return find
