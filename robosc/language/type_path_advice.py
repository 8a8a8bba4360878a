"""Communications and interfaces whose types are written as paths, as in ROS, or with options that are none here."""

from collections.abc import Sequence

from robosc.language.sentence_parts import Advice, SentenceParts, age_text
from robosc.language.tokens import Kind
from robosc.language.words import FOREIGN_TYPES, spelled

_NAME = int(Kind.NAME)

_FOLDERS = frozenset({"msg", "srv", "action", "msgs"})
_BASIC_PACKAGES = frozenset({"std_msgs", "example_interfaces"})
_AGES = frozenset("timeout deadline lifespan expires ttl stale stale_after max_delay rate frequency hz period".split())
_RATES = frozenset({"rate", "frequency", "hz"})
_OPTIONS = ("qos", "depth", "max_age", "stamped", "when")
_NO_PATH = (
    "an 'interface' names a type and its package, and 'links' uses it; the type in the list says which fields are read "
    "or filled: 'none', or an object with them"
)
_STALE = "'max_age' says after how many seconds without a message a sensor is stale"
_NO_REPLY = "the deployment's settings 'service_timeout' and 'action_timeout' say how long a reply may take"


class TypePathReader(SentenceParts):
    """Reads communications and interfaces."""

    def _path(self, index: int) -> tuple[str, str, int] | None:
        """The package and type of `package/msg/Type` in any spelling, and the index behind it."""
        texts = self._texts
        package = texts[index]
        if self._kinds[index] != _NAME:
            return None
        at = self._behind_separator(index + 1)
        if at is not None and texts[at] in _FOLDERS:
            at = self._behind_separator(at + 1)
        if at is None or (not texts[at][:1].isupper() and texts[at] not in FOREIGN_TYPES and texts[at] != "string"):
            return None
        return package, texts[at], at + 1

    def _behind_separator(self, index: int) -> int | None:
        if self._texts[index] in ("/", "."):
            return index + 1
        return index + 2 if self._texts[index : index + 2] == [":", ":"] else None

    def _link(self, package: str, type_: str) -> tuple[str, str]:
        """The name of the interface of a type, and its definition if the text has none."""
        known = self._vocabulary.interfaces.get((package, type_))
        if known is not None:
            return known, ""
        name = self._vocabulary.free(_snake(type_), self._vocabulary.interfaces.values())
        return name, f"interface {name} use {type_} from {package}"

    def _interface(self, begin: int, end: int) -> Advice | None:
        """An interface whose type is written as a path."""
        for index in range(begin + 1, end):
            path = self._path(index)
            behind = self._behind_separator(index + 1)
            if path is not None:
                package, type_, stop = path
                first = index
            elif self._texts[index - 2 : index - 1] == ["use"] or self._texts[index - 1] != "from" or behind is None:
                continue
            else:
                # `from nav_msgs.msg import Odometry`, `use Odometry from nav_msgs.msg`
                package = self._texts[index]
                is_behind = self._texts[behind + 1] == "import"
                type_ = self._texts[behind + 2 if is_behind else index - 2]
                first, stop = index - 2, behind + 1
            if self._texts[begin] == "interface":
                word = self._written(index, stop)
                return Advice(index, word, _NO_PATH, first, stop, f"{type_} from {package}")
            name = self._vocabulary.free(_snake(type_), self._vocabulary.interfaces.values())
            meant = f"interface {name} use {type_} from {package}"
            return Advice(begin, self._written(index, end), _NO_PATH, begin, end, meant)
        return None

    def _communication(self, begin: int, end: int) -> Advice | None:
        """A communication whose types are written as paths, or with options of other middleware."""
        texts = self._texts
        kind = texts[begin]
        first = begin + 1 + (kind in ("incoming", "outgoing"))
        paths: list[tuple[int, str, str]] = []
        name, given, strange = "", dict[str, str](), dict[str, tuple[int, str]]()
        link, at = "", first
        while at < end:
            path = self._path(at)
            if (path is not None and texts[at - 1] != "links") or (path is not None and texts[at - 1] == "links"):
                paths.append((at, *path[:2]))
                at = path[2]
            elif texts[at] == "links" and self._kinds[at + 1] == _NAME and self._path(at + 1) is None:
                link, at = texts[at + 1], at + 2
            elif texts[at] in ("with", "links", ",", ":"):
                at += 1
            elif texts[at + 1] == ":" and self._path(at + 2) is None:
                stop = self._end_of_value(at + 2, end)
                if texts[at].casefold() in _AGES:
                    strange[texts[at].casefold()] = (at, self._written(at + 2, stop))
                else:
                    given[texts[at]] = self._written(at + 2, stop)
                at = stop
            elif texts[at + 1] == ":":
                at += 2
            elif self._kinds[at] == _NAME and not name:
                name, at = texts[at], at + 1
            else:
                at += 1
        if not name or not (paths or strange):
            return None
        return self._linked(begin, end, (kind, name, link), given, paths, strange)

    def _end_of_value(self, index: int, end: int) -> int:
        depth = 0
        while index < end:
            token = self._texts[index]
            if not depth and token in (",", "links"):
                break
            depth += (token in ("(", "{")) - (token in (")", "}"))
            index += 1
        return index

    def _linked(
        self,
        begin: int,
        end: int,
        head: tuple[str, str, str],
        given: dict[str, str],
        paths: Sequence[tuple[int, str, str]],
        strange: dict[str, tuple[int, str]],
    ) -> Advice:
        """The communication with a linked interface for its paths."""
        kind, name, link = head
        keys = {"service": ("request", "response"), "action": ("request", "response", "feedback")}.get(kind, ("type",))
        more, basic = "", ""
        if paths:
            _, package, type_ = paths[0]
            basic = FOREIGN_TYPES.get(type_, "") if package in _BASIC_PACKAGES and len(keys) == 1 else ""
            if not basic:
                link, more = self._link(package, type_)
        parts = [f"identifier: {given['identifier']}"] if "identifier" in given else []
        parts += [f"{key}: {basic or given.get(key, 'none')}" for key in keys]
        parts += [f"{key}: {value}" for key, value in given.items() if key in _OPTIONS]
        for key, (_, value) in strange.items():
            if kind == "outgoing" and "max_age" not in given and _is_number(value):
                age = 1 / float(value) if key in _RATES and float(value) else float(value)
                parts.append(f"max_age: {age_text(age)}")
        what = f"{kind} message" if kind in ("incoming", "outgoing") else kind
        meant = f"{what} {spelled(name)} with {', '.join(parts)}" + (f" links {link}" if link else "")
        if paths:
            index, package, type_ = paths[0]
            path = self._path(index)
            word = self._written(index, path[2] if path else index + 1)
            reason = "a basic type is written as it is" if basic else _NO_PATH
        else:
            index, _ = next(iter(strange.values()))
            word = self._texts[index]
            reason = _STALE if kind == "outgoing" else _NO_REPLY
        return Advice(index, word, reason, begin, end, meant, more)


def _is_number(text: str) -> bool:
    return text.replace(".", "", 1).isdecimal()


def _snake(type_: str) -> str:
    """A type's name as that of an interface: `laser_scan`."""
    return "".join(f"_{each}" if each.isupper() and at else each for at, each in enumerate(type_)).lower()


__all__ = ["TypePathReader"]
