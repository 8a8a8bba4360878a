"""Strict conversion of the plain values of a document to frozen structures; one run finds all problems.

msgspec stops at the first mistake; therefore this module walks through the structure, and msgspec checks each leaf.
"""

from collections.abc import Iterator, Mapping
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import msgspec

from robosc_bridge.configuration.document import Document
from robosc_bridge.configuration.problems import ConfigurationError, Path, Problem, hint, value_text

_WRONG = object()
_WORDS = {float: "a number", int: "a whole number", bool: "true or false", str: "a text"}


def decode[Value](document: Document, target: type[Value]) -> Value:
    """Return the value of a type that a document holds.

    Args:
        document: Document as it was read.
        target: A msgspec structure.

    Raises:
        ConfigurationError: A key or value is unknown, missing, of a wrong type or out of range; lists all problems.
    """
    decoder = _Decoder(document)
    found = decoder.value(target, {} if document.value is None else document.value, ())
    if decoder.problems:
        raise ConfigurationError(document.name, decoder.problems)
    return found  # type: ignore[no-any-return]  # built from the annotations of `target`


class _Decoder:
    def __init__(self, document: Document) -> None:
        self._document = document
        self.problems: list[Problem] = []

    def value(self, annotation: Any, given: object, path: Path) -> Any:
        """The value, or `_WRONG` if there is a problem."""
        plain = _plain(annotation)
        if is_struct(plain):
            return self._struct(plain, given, path)
        structures = [item for item in members(plain) if is_struct(item)]
        if len(structures) > 1:
            return self._one_of(structures, given, path)
        if structures and isinstance(given, Mapping):
            return self._struct(structures[0], given, path)
        if NoneType in members(plain):
            if given is None:
                return None
            (other,) = (item for item in members(plain) if item is not NoneType)
            return self.value(other, given, path)
        if get_origin(plain) in (dict, tuple):
            return self._collection(annotation, plain, given, path)
        return self._leaf(annotation, given, path)

    def _struct(self, target: Any, given: object, path: Path, ignored: frozenset[str] = frozenset()) -> Any:
        if not isinstance(given, Mapping):
            return self._wrong(f"is {value_text(given)}; it must be a mapping with {_names(target)}", path)
        fields = {field.name: field for field in msgspec.structs.fields(target)}
        for key in given:
            if key not in fields and key not in ignored:
                self._wrong(f"there is no such key; {hint(key, {*fields, *ignored})}", (*path, key))
        found = {}
        for name, field in fields.items():
            if name in given:
                found[name] = self.value(field.type, given[name], (*path, name))
            elif field.required:
                self._wrong(f"'{name}' is missing: {expected(field.type)}", path)
                found[name] = _WRONG
        return _WRONG if _WRONG in found.values() else target(**found)

    def _one_of(self, structures: list[Any], given: object, path: Path) -> Any:
        """One of several structures, selected by a field, the tag."""
        field = structures[0].__struct_config__.tag_field
        by_tag = {item.__struct_config__.tag: item for item in structures}
        if not isinstance(given, Mapping) or field not in given:
            begin = "is not filled in" if given is None else f"is {value_text(given)}"
            return self._wrong(f"{begin}; it must be {{{field}: NAME}} with one of {', '.join(sorted(by_tag))}", path)
        tag = given[field]
        if not isinstance(tag, str) or tag not in by_tag:
            return self._wrong(f"there is no {field} {value_text(tag)}; {hint(str(tag), by_tag)}", (*path, field))
        return self._struct(by_tag[tag], given, path, frozenset({field}))

    def _collection(self, annotation: Any, plain: Any, given: object, path: Path) -> Any:
        arguments = get_args(plain)
        if get_origin(plain) is tuple:
            if not isinstance(given, list):
                return self._wrong(f"is {value_text(given)}; it must be {expected(annotation)}", path)
            items = tuple(self.value(arguments[0], item, (*path, place)) for place, item in enumerate(given))
            return _WRONG if _WRONG in items else items
        if not isinstance(given, Mapping):
            return self._wrong(f"is {value_text(given)}; it must be {expected(annotation)}", path)
        found = {}
        for key, item in given.items():
            place = (*path, key)
            found[self._leaf(arguments[0], key, place)] = self.value(arguments[1], item, place)
        return _WRONG if _WRONG in found or _WRONG in found.values() else found

    def _leaf(self, annotation: Any, given: object, path: Path) -> Any:
        try:
            return msgspec.convert(given, annotation, strict=True)
        except msgspec.ValidationError:
            return self._wrong(f"is {value_text(given)}; it must be {expected(annotation)}", path)

    def _wrong(self, message: str, path: Path) -> object:
        if not path:
            message = message.replace("is ", "the file is ", 1) if message.startswith("is ") else message
        self.problems.append(Problem(message, path, self._document.line(path)))
        return _WRONG


def expected(annotation: Any) -> str:
    """Describe a value of an annotation in words: `a number from 0 to 10`."""
    plain, bounds = _plain(annotation), list(_bounds(annotation))
    options = members(plain)
    if len(options) > 1:
        words = [expected(item) for item in options if item is not NoneType]
        return " or ".join([*dict.fromkeys(words), *(["nothing (null)"] if NoneType in options else [])])
    match get_origin(plain):
        case origin if origin is Literal:
            return f"one of {', '.join(map(str, get_args(plain)))}"
        case origin if origin is tuple:
            return f"a list: {expected(get_args(plain)[0])} each"
        case origin if origin is dict:
            return "a mapping"
    if is_struct(plain):
        return f"a mapping with {_names(plain)}"
    return " ".join([_WORDS[plain], *bounds])


def _bounds(annotation: Any) -> Iterator[str]:
    if get_origin(annotation) is not Annotated:
        return
    for meta in get_args(annotation)[1:]:
        low, high = (meta.ge, meta.le)
        if low is not None and high is not None:
            yield f"from {low} to {high}"
        elif meta.gt is not None and high is not None:
            yield f"above {meta.gt}, at most {high}"
        elif meta.min_length is not None and meta.max_length is not None:
            yield f"of {meta.min_length} to {meta.max_length} characters"
        elif meta.title is not None:  # The title of a pattern puts it in words.
            yield f"like {meta.title}"


def is_struct(annotation: Any) -> bool:
    """Return True if an annotation is a msgspec structure."""
    return isinstance(annotation, type) and issubclass(annotation, msgspec.Struct)


def members(plain: Any) -> tuple[Any, ...]:
    """The types of a union; of another type, itself."""
    return get_args(plain) if get_origin(plain) in (Union, UnionType) else (plain,)


def _plain(annotation: Any) -> Any:
    return get_args(annotation)[0] if get_origin(annotation) is Annotated else annotation


def _names(target: Any) -> str:
    names = ", ".join(target.__struct_fields__)
    return names or "no keys"
