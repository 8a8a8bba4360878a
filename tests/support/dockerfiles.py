"""Contents of a Dockerfile, and of a `.dockerignore`: as much of them as ours use; anything else is an error."""

import json
import re
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fnmatch import translate
from pathlib import Path


@dataclass(frozen=True)
class Instruction:
    """One instruction.

    Attributes:
        name: Name, such as `RUN`.
        flags: Flags, such as `{"from": "build"}`.
        text: Text that follows them.
    """

    name: str
    flags: dict[str, str]
    text: str

    @property
    def words(self) -> list[str]:
        """Words of the exec form; any other form is an error, since a shell would stand between."""
        words = json.loads(self.text)
        assert isinstance(words, list) and all(isinstance(word, str) for word in words), self.text
        return words


@dataclass
class Stage:
    """One stage of a build."""

    base: str
    name: str
    instructions: list[Instruction] = field(default_factory=list)

    def all(self, name: str) -> list[Instruction]:
        """Its instructions of one name."""
        return [item for item in self.instructions if item.name == name]

    def last(self, name: str) -> Instruction | None:
        """Return the instruction that counts where a later one replaces those before."""
        found = self.all(name)
        return found[-1] if found else None

    def words(self, name: str) -> list[str]:
        """Return the words of `ENTRYPOINT` or `CMD`; none: an empty list."""
        found = self.last(name)
        return [] if found is None else found.words

    def environment(self, inherited: dict[str, str]) -> dict[str, str]:
        """Return an environment as its `ENV` instructions change it."""
        result = dict(inherited)
        for item in self.all("ENV"):
            for word in shlex.split(item.text):
                name, _, value = word.partition("=")
                result[name] = re.sub(r"\$(\w+)", lambda match: result[match[1]], value)
        return result

    @property
    def health_check(self) -> list[str]:
        """The command of its `HEALTHCHECK`."""
        found = self.last("HEALTHCHECK")
        assert found is not None
        name, _, rest = found.text.partition(" ")
        assert name == "CMD", found.text
        return Instruction("CMD", {}, rest).words


def parse_dockerfile(text: str) -> list[Stage]:
    """Its stages."""
    stages: list[Stage] = []
    arguments: dict[str, str] = {}
    for line in _logical_lines(text):
        name, _, rest = line.partition(" ")
        flags = {}
        rest = rest.strip()
        while match := re.match(r"--([a-z-]+)=(\S+)\s+", rest):
            flags[match[1]] = match[2]
            rest = rest[match.end() :]
        if name == "ARG" and not stages:
            key, _, value = rest.partition("=")
            arguments[key] = value
        elif name == "FROM":
            base, _, alias = rest.partition(" AS ")
            stages.append(Stage(re.sub(r"\$\{(\w+)\}", lambda match: arguments[match[1]], base), alias))
        else:
            stages[-1].instructions.append(Instruction(name, flags, rest))
    return stages


def _logical_lines(text: str) -> Iterator[str]:
    waiting = ""
    for line in text.splitlines():
        if line.lstrip().startswith("#") or not line.strip():
            continue
        waiting += line.rstrip().removesuffix("\\").strip() + " "
        if not line.rstrip().endswith("\\"):
            yield waiting.strip()
            waiting = ""
    assert not waiting


class Ignored:
    """Files that a `.dockerignore` keeps out of a build.

    Of the patterns that fit a file or a folder above, the last one decides.

    Args:
        text: Its lines.
    """

    def __init__(self, text: str) -> None:
        self._patterns: list[tuple[bool, re.Pattern[str]]] = []
        for line in text.splitlines():
            if line.strip() and not line.startswith("#"):
                pattern = line.removeprefix("!").strip("/")
                anywhere = pattern.startswith("**/")
                compiled = re.compile(("(?:.*/)?" if anywhere else "") + translate(pattern.removeprefix("**/")))
                self._patterns.append((not line.startswith("!"), compiled))

    def __contains__(self, path: str) -> bool:
        parts = path.split("/")
        prefixes = ["/".join(parts[: end + 1]) for end in range(len(parts))]
        verdict = False
        for is_out, pattern in self._patterns:
            # `*` alone stands for what lies at the top, and so for all below.
            if any(pattern.fullmatch(prefix) for prefix in prefixes):
                verdict = is_out
        return verdict


def context_files(top: Path, sources: Sequence[str], ignored: Ignored) -> Iterator[tuple[str, Path]]:
    """Yield the files that `COPY` takes of a build's folder: the source that each belongs to, and the file."""
    for source in sources:
        found = top / source
        for file in [found] if found.is_file() else sorted(found.rglob("*")):
            if file.is_file() and file.relative_to(top).as_posix() not in ignored:
                yield source, file
