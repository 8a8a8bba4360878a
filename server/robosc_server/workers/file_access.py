"""Landlock rules of workers: they may read only program files."""

import contextlib
import os
import site
import struct
import sys
import sysconfig
from collections.abc import Iterable
from pathlib import Path

from robosc_server.workers import kernel

# The same numbers on every machine.
_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
_QUERY_VERSION = 1
_PATH_BENEATH = 1

_READ_FILE, _READ_FOLDER = 1 << 2, 1 << 3
# By version of Landlock, the kinds of access to files that it knows: each version the ones before and its own.
_FILE_ACCESSES = {1: (1 << 13) - 1, 2: (1 << 14) - 1, 3: (1 << 15) - 1, 5: (1 << 16) - 1}
_NETWORK_FROM, _NETWORK_ACCESSES = 4, 0b11  # The accesses to listen and to connect.
_SCOPES_FROM, _SCOPES = 6, 0b11  # Sockets without a file, and signals, of processes outside.


class FileRules:
    """Landlock rules, built once; forks of this process restrict themselves by them.

    Raises:
        OSError: The kernel has no Landlock, or it is turned off.
    """

    def __init__(self, places: Iterable[Path]) -> None:
        version = kernel.system_call(_CREATE_RULESET, None, 0, _QUERY_VERSION)
        accesses = max(mask for since, mask in _FILE_ACCESSES.items() if since <= version)
        network = _NETWORK_ACCESSES if version >= _NETWORK_FROM else 0
        scopes = _SCOPES if version >= _SCOPES_FROM else 0
        known = 8 * (1 + (version >= _NETWORK_FROM) + (version >= _SCOPES_FROM))
        rules = struct.pack("=QQQ", accesses, network, scopes)[:known]
        self.descriptor = kernel.system_call(_CREATE_RULESET, rules, len(rules), 0)
        try:
            for place in places:
                self._allow(place)
        except BaseException:
            os.close(self.descriptor)
            raise

    def _allow(self, place: Path) -> None:
        try:
            number = os.open(place, os.O_PATH | os.O_CLOEXEC)
        except OSError:  # A missing file cannot be read.
            return
        try:
            access = _READ_FILE | _READ_FOLDER if place.is_dir() else _READ_FILE
            kernel.system_call(_ADD_RULE, self.descriptor, _PATH_BENEATH, struct.pack("=Qi", access, number), 0)
        finally:
            os.close(number)

    def restrict(self) -> None:
        """Restrict this process permanently to the files of the rules.

        Raises:
            OSError: The kernel refuses it.
        """
        kernel.prctl(kernel.SET_NO_NEW_PRIVILEGES, 1)
        kernel.system_call(_RESTRICT_SELF, self.descriptor, 0)
        os.close(self.descriptor)


def program_places() -> set[Path]:
    """Return the places of the programs of this process: Python's library, what is installed, and loaded packages.

    Not all of `sys.path`, which may include the working directory of the server.
    """
    paths = sysconfig.get_paths()
    names = {paths["stdlib"], paths["platstdlib"], paths["purelib"], paths["platlib"], *site.getsitepackages()}
    if site.ENABLE_USER_SITE:
        names.add(site.getusersitepackages())
    places = {Path(name) for name in names}
    for name, module in sys.modules.copy().items():
        if "." in name or name == "__main__":
            continue
        # A package may have several folders, and a module is a file.
        with contextlib.suppress(TypeError, ValueError):
            places.update(Path(folder) for folder in getattr(module, "__path__", ()))
        if not hasattr(module, "__path__") and isinstance(file := getattr(module, "__file__", None), str):
            places.add(Path(file))
    return {place for place in places if place.is_absolute()}
