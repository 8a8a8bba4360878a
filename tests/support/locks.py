"""Locks of packages, and what a new release on an index could change in the environments that are made of them."""

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name


@dataclass(frozen=True)
class Lock:
    """A lock in the format of pip.

    Attributes:
        requirements: By package.
        faults: Sentences about what in it is open.
    """

    requirements: dict[str, Requirement]
    faults: tuple[str, ...]


def read_lock(text: str) -> Lock:
    """Return the requirements of a lock, and what in its text leaves a choice to the day of the installation."""
    requirements: dict[str, Requirement] = {}
    faults = []
    if re.search(r"^#.*--strip-extras", text, re.MULTILINE):
        faults.append("extras are stripped: whoever asks for one of them gets the newest release of the package")
    for line in re.sub(r"\\\n", " ", text).splitlines():
        words = re.sub(r"(^|\s)#.*", "", line).split("--hash=")
        if not words[0].strip():
            continue
        if words[0].startswith("-"):
            faults.append(f"an option is not a requirement: {words[0].strip()}")
            continue
        requirement = Requirement(words[0])
        requirements[canonicalize_name(requirement.name)] = requirement
        if not re.fullmatch(r"==[^*,]+", str(requirement.specifier)):
            faults.append(f"{requirement.name} has no single version")
        if len(words) == 1 or not all(re.fullmatch(r"sha256:[0-9a-f]{64}\s*", word) for word in words[1:]):
            faults.append(f"{requirement.name} has no hash")
    return Lock(requirements, tuple(faults))


def unmet(lock: Lock, needs: Callable[[str], Iterable[str] | None]) -> Iterator[str]:
    """Yield a sentence about each requirement of a locked package that the lock does not meet.

    Args:
        lock: Of one kind of machine, this one.
        needs: By the name of a package, its requirements as its metadata lists them.
    """
    for name, locked in lock.requirements.items():
        for need in map(Requirement, needs(name) or ()):
            markers = [need.marker is None or need.marker.evaluate({"extra": extra}) for extra in (*locked.extras, "")]
            if not any(markers):
                continue
            need.marker = None
            found = lock.requirements.get(canonicalize_name(need.name))
            if found is None:
                yield f"{name} needs {need}, which is not locked"
            elif not need.specifier.contains(str(found.specifier).removeprefix("=="), prereleases=True):
                yield f"{name} needs {need}, and {found} is locked"
            elif not need.extras <= found.extras:
                yield f"{name} needs {need}, whose extra is not locked: {found}"


def installations(text: str) -> Iterator[str]:
    """Yield the commands of a script, Makefile or Dockerfile that install, build or fetch packages by pip or uv."""
    for line in re.sub(r"\\\n", " ", text).splitlines():
        for command in re.split(r"&&|;", line):
            if re.search(r"\bpip\W.*?\b(install|wheel|download)\s", re.sub(r"""["']""", " ", command)):
                yield command.strip()
