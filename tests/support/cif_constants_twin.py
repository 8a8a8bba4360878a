"""A second reader of CIF's constants: their types, and their values by Python's own operators.

It makes two passes where `robosc.cif` makes one. The first gives each expression its type, and writes a cast where a
whole number becomes real; the second evaluates what came of it, and no more of it than is needed. Rules as in CIF's
type checker: `CifExprsTypeChecker`, `CifTypeUtils`, `CifEvalUtils` of Eclipse ESCET.
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from robosc.cif import syntax
from robosc.cif.parser import parse
from robosc.source import SourceFile

Type = tuple[Any, ...]
"""Kind; for `int` and `list` then bounds, or None twice; then parts; of a tuple all parts in one, and their names."""

LARGEST = 2**31 - 1
BOOL, INT, REAL, STRING = ("bool",), ("int", None, None), ("real",), ("string",)


class RefusedError(Exception):
    """An expression has no type, or no value."""


@dataclass(frozen=True)
class Typed:
    """An expression with its type, which gives its value when it is asked."""

    type: Type
    value: Callable[[], Any]


def constants(text: str) -> dict[str, Any]:
    """The value of every constant of a text, in which each uses earlier ones only.

    Raises:
        RefusedError: One of them is none.
    """
    twin = _Twin()
    for item in parse(SourceFile("m.cif", text)).body:
        assert isinstance(item, syntax.Constant)
        type_ = twin.written(item.type)
        typed = twin.typed(item.value, type_)
        _require(_within(typed.type, type_), f"{typed.type} in {type_}")
        value = typed.value()
        twin.known[item.name.text] = Typed(typed.type if type_ == INT else type_, _always(value))
    return {name: typed.value() for name, typed in twin.known.items()}


def _require(is_right: bool, message: str) -> None:
    if not is_right:
        raise RefusedError(message)


def _bounds(type_: Type) -> tuple[int, int]:
    least = 0 if type_[0] == "list" else -LARGEST - 1
    return (least, LARGEST) if type_[1] is None else (type_[1], type_[2])


def _parts(type_: Type) -> tuple[Type, ...]:
    return {"list": type_[3:4], "set": type_[1:2], "dict": type_[1:3], "tuple": type_[1] if len(type_) > 1 else ()}.get(
        type_[0], ()
    )


def _alike(one: Type, other: Type, test: Callable[[tuple[int, int], tuple[int, int]], bool]) -> bool:
    if one[0] != other[0] or len(_parts(one)) != len(_parts(other)):
        return False
    if one[0] in ("int", "list") and not test(_bounds(one), _bounds(other)):
        return False
    return all(_alike(a, b, test) for a, b in zip(_parts(one), _parts(other), strict=True))


def _within(one: Type, other: Type) -> bool:
    return _alike(one, other, lambda a, b: b[0] <= a[0] and a[1] <= b[1])


def _compatible(one: Type, other: Type) -> bool:
    return _alike(one, other, lambda a, b: True)


def _union(one: Type, other: Type) -> Type:
    parts = [_union(a, b) for a, b in zip(_parts(one), _parts(other), strict=True)]
    if one[0] in ("int", "list"):
        is_open = one[1] is None or other[1] is None
        bounds = (None, None) if is_open else (min(one[1], other[1]), max(one[2], other[2]))
        return (one[0], *bounds, *parts)
    return ("tuple", tuple(parts), None) if one[0] == "tuple" else (one[0], *parts)


def _whole(value: int) -> int:
    _require(-LARGEST - 1 <= value <= LARGEST, f"{value} is beyond 32 bits")
    return value


def _real(value: float) -> float:
    _require(math.isfinite(value), "no real number")
    return value + 0.0


def _ranged(low: int, high: int) -> Type:
    return ("int", _whole(low), _whole(high))


def _truncated(a: int, b: int) -> int:
    _require(b != 0, "division by zero")
    return math.trunc(Fraction(a, b))


def _always(value: Any) -> Callable[[], Any]:
    return lambda: value


def _all(guards: list[Typed]) -> Callable[[], bool]:
    return lambda: all(guard.value() for guard in guards)


def _same(one: Typed, other: Typed) -> Callable[[], bool]:
    return lambda: bool(one.value() == other.value())


class _Twin:
    def __init__(self) -> None:
        self.known: dict[str, Typed] = {}

    def written(self, type_: syntax.Type) -> Type:
        """A type that is written out."""
        parts = tuple(map(self.written, type_.parts))
        if type_.kind in ("int", "list"):
            bounds = [self.number(bound) for bound in type_.bounds]
            return (type_.kind, *((bounds[0], bounds[-1]) if bounds else (None, None)), *parts)
        if type_.kind == "tuple":
            return ("tuple", parts, tuple(field.text for field in type_.fields))
        return (type_.kind, *parts)

    def number(self, node: syntax.Expression) -> int:
        found = self.typed(node, None)
        _require(found.type[0] == "int", "an integer is needed")
        return int(found.value())

    def typed(self, node: syntax.Expression, hint: Type | None) -> Typed:
        """An expression, of which a type is expected."""
        match node:
            case syntax.Literal(value=bool(value)):
                return Typed(BOOL, lambda: value)
            case syntax.Literal(value=int(value)):
                if hint == REAL:
                    return Typed(REAL, lambda: float(value))
                return Typed(("int", value, value), lambda: value)
            case syntax.Literal(value=value):
                return Typed(STRING if isinstance(value, str) else REAL, lambda: value)
            case syntax.Name():
                return self.known[str(node)]
            case syntax.Unary(operator=operator):
                return _negated(operator, self.typed(node.operand, None if operator == "not" else hint))
            case syntax.Binary():
                return self._binary(node, hint)
            case syntax.If():
                rows = [([self.typed(guard, None) for guard in guards], self.typed(then, hint))
                        for guards, then in node.branches]  # fmt: skip
                _require(all(guard.type == BOOL for guards, _ in rows for guard in guards), "a guard is no condition")
                rows.append(([], self.typed(node.otherwise, hint)))
                return _first([(_all(guards), value) for guards, value in rows])
            case syntax.Switch():
                return self._switch(node, hint)
            case syntax.Group():
                return self._group(node, hint)
            case syntax.Index():
                return self._index(node)
            case syntax.Slice():
                return self._slice(node, hint)
            case syntax.Cast():
                return self._cast(node)
            case syntax.Call(function=str(name)):
                return self._call(name, node.arguments, hint)
        raise AssertionError(node)

    def _binary(self, node: syntax.Binary, hint: Type | None) -> Typed:
        operator = node.operator
        is_logic, is_arithmetic = operator in ("and", "or"), operator in ("+", "-", "*", "div", "mod")
        left = self.typed(node.left, hint if is_logic or is_arithmetic else None)
        second: Type | None = None
        if operator in ("and", "or", "=>", "<=>", "=", "!=", "sub"):
            second = left.type
        elif is_arithmetic:
            second = hint
            if operator in "+-" and (hint is None or hint[0] not in ("int", "real")):
                second = None if operator == "-" and hint is not None and hint[0] == "dict" else left.type
        right = self.typed(node.right, second)
        kinds = (left.type[0], right.type[0])
        a, b = left.value, right.value
        if operator in ("and", "or", "=>", "<=>") and kinds == ("bool", "bool"):
            table: dict[str, Callable[[], Any]] = {
                "and": lambda: a() and b(), "or": lambda: a() or b(), "=>": lambda: not a() or b(),
                "<=>": lambda: a() == b(),
            }  # fmt: skip
            return Typed(BOOL, table[operator])
        if operator in ("<", "<=", ">", ">=") and set(kinds) <= {"int", "real"}:
            compare = {"<": float.__lt__, "<=": float.__le__, ">": float.__gt__, ">=": float.__ge__}[operator]
            return Typed(BOOL, lambda: compare(float(a()), float(b())))
        if set(kinds) <= {"int", "real"} and (is_arithmetic or operator == "/"):
            return _calculated(operator, left, right)
        if operator == "in":
            _require(kinds[1] in ("list", "set", "dict"), "'in' needs elements")
            _require(_compatible(left.type, _parts(right.type)[0]), "no such elements")
            return Typed(BOOL, lambda: a() in [item[0] if kinds[1] == "dict" else item for item in b()])
        if operator == "-" and kinds[0] == "dict" and kinds[1] in ("set", "list"):
            _require(_compatible(_parts(left.type)[0], _parts(right.type)[0]), "no such keys")
            return Typed(left.type, lambda: frozenset(item for item in a() if item[0] not in b()))
        _require(_compatible(left.type, right.type), f"{left.type} {operator} {right.type}")
        both = _union(left.type, right.type)
        match operator, kinds[0]:
            case "=", _:
                return Typed(BOOL, lambda: a() == b())
            case "!=", _:
                return Typed(BOOL, lambda: a() != b())
            case "and", "set":
                return Typed(both, lambda: a() & b())
            case "or", "set":
                return Typed(both, lambda: a() | b())
            case "-", "set":
                return Typed(both, lambda: a() - b())
            case "sub", "set":
                return Typed(BOOL, lambda: a() <= b())
            case "+", "string":
                return Typed(STRING, lambda: a() + b())
            case "+", "list":
                if both[1] is not None:
                    both = ("list", left.type[1] + right.type[1], left.type[2] + right.type[2], both[3])
                return Typed(both, lambda: a() + b())
            case "+", "dict":
                return Typed(both, lambda: frozenset({**dict(a()), **dict(b())}.items()))
            case "-", "dict":
                return Typed(both, lambda: frozenset(item for item in a() if item[0] not in dict(b())))
        raise RefusedError(f"{left.type} {operator} {right.type}")

    def _switch(self, node: syntax.Switch, hint: Type | None) -> Typed:
        subject = self.typed(node.subject, None)
        rows: list[tuple[Callable[[], bool], Typed]] = []
        seen = []
        for key, value in node.cases:
            found = self.typed(key, subject.type)
            _require(_compatible(subject.type, found.type), "a case of another type")
            try:
                value_of_key = [found.value()]
            except RefusedError:
                value_of_key = []
            _require(not value_of_key or value_of_key[0] not in seen, "a case twice")
            seen += value_of_key
            made = self.typed(value, rows[0][1].type if rows else hint)
            rows.append((_same(subject, found), made))
        if node.otherwise is not None:
            rows.append((lambda: True, self.typed(node.otherwise, rows[0][1].type if rows else hint)))
        else:
            _require(all(value in seen for value in _values(subject.type)), "a value without a case")
        return _first(rows)

    def _group(self, node: syntax.Group, hint: Type | None) -> Typed:
        if node.kind == "tuple":
            hints = list(hint[1]) if hint is not None and hint[0] == "tuple" else []
            hints += [None] * len(node.items)
            items = [self.typed(item, expected) for item, expected in zip(node.items, hints, strict=False)]
            return Typed(("tuple", tuple(item.type for item in items), None), lambda: tuple(x.value() for x in items))
        if not node.items:
            _require(hint is not None and hint[0] in (("list",) if node.kind == "list" else ("set", "dict")), "empty")
            assert hint is not None
            return Typed(("list", 0, 0, hint[3]) if node.kind == "list" else hint,
                         lambda: () if node.kind == "list" else frozenset())  # fmt: skip
        columns = 2 if node.kind == "dict" else 1
        made: list[list[Typed]] = [[] for _ in range(columns)]
        for place, item in enumerate(node.items):
            column = made[place % columns]
            expected = _parts(hint)[place % columns] if hint is not None and hint[0] == node.kind else None
            column.append(self.typed(item, column[0].type if column else expected))
        types = []
        for column in made:
            type_ = column[0].type
            for typed in column[1:]:
                _require(_compatible(column[0].type, typed.type), "elements of several types")
                type_ = _union(type_, typed.type)
            types.append(type_)
        values = [lambda column=column: [item.value() for item in column] for column in made]
        match node.kind:
            case "list":
                return Typed(("list", len(node.items), len(node.items), types[0]), lambda: tuple(values[0]()))
            case "set":
                return Typed(("set", types[0]), lambda: frozenset(values[0]()))
        return Typed(("dict", *types), lambda: _pairs(values[0](), values[1]()))

    def _index(self, node: syntax.Index) -> Typed:
        base = self.typed(node.base, None)
        if base.type[0] == "tuple":
            if isinstance(node.index, syntax.Name) and str(node.index) in (base.type[2] or ()):
                place = base.type[2].index(str(node.index))
            else:
                place = self.number(node.index)
            _require(0 <= place < len(base.type[1]), "no such field")
            return Typed(base.type[1][place], lambda: base.value()[place])
        index = self.typed(node.index, base.type[1] if base.type[0] == "dict" else None)
        if base.type[0] == "dict":
            _require(_compatible(base.type[1], index.type), "no such key")
            return Typed(base.type[2], lambda: _got(dict(base.value()), index.value()))
        _require(base.type[0] in ("list", "string") and index.type[0] == "int", "no elements")
        if base.type[0] == "list" and base.type[1] is not None and index.type[1] is not None:
            _require(index.type[1] < base.type[2] and index.type[2] >= -base.type[2], "no such element")
        return Typed(STRING if base.type[0] == "string" else base.type[3], lambda: _got(base.value(), index.value()))

    def _slice(self, node: syntax.Slice, hint: Type | None) -> Typed:
        base = self.typed(node.base, hint)
        ends = [None if end is None else self.typed(end, None) for end in (node.low, node.high)]
        _require(base.type[0] in ("list", "string"), "no slices")
        _require(all(end is None or end.type[0] == "int" for end in ends), "no bound")
        type_ = base.type
        if type_[0] == "list" and type_[1] is not None:
            exact = [end is None or (end.type[1] is not None and end.type[1] == end.type[2]) for end in ends]
            inside = [end is None or 0 <= (end.type[1] or 0) <= base.type[1] for end in ends]
            if all(exact) and (all(inside) or type_[1] == type_[2]):
                cut = slice(*(None if end is None else end.type[1] for end in ends))
                sizes = sorted(len(([None] * length)[cut]) for length in type_[1:3])
                type_ = ("list", *sizes, type_[3])
            else:
                type_ = ("list", 0, type_[2], type_[3])
        return Typed(type_, lambda: base.value()[slice(*(None if end is None else end.value() for end in ends))])

    def _cast(self, node: syntax.Cast) -> Typed:
        type_ = self.written(node.type)
        inner = self.typed(node.operand, None if type_ in (BOOL, INT, REAL, STRING) else type_)
        if _alike(inner.type, type_, lambda a, b: a == b):
            return Typed(type_, inner.value)
        match inner.type[0], type_:
            case "int", ("real",):
                return Typed(REAL, lambda: float(inner.value()))
            case "int", ("string",):
                return Typed(STRING, lambda: str(inner.value()))
            case "bool", ("string",):
                return Typed(STRING, lambda: str(inner.value()).lower())
        raise RefusedError("no such cast")

    def _call(self, name: str, arguments: tuple[syntax.Expression, ...], hint: Type | None) -> Typed:
        passed = {"abs": hint, "min": hint, "max": hint, "pow": hint, "sqrt": REAL, "floor": REAL, "round": REAL}
        items = [self.typed(item, passed.get(name)) for item in arguments]
        kinds = [item.type[0] for item in items]
        is_number = all(kind in ("int", "real") for kind in kinds)
        is_whole = all(kind == "int" for kind in kinds)

        def values() -> list[Any]:
            return [item.value() for item in items]

        bounds = [_bounds(item.type) for item in items] if is_whole else []
        is_ranged = is_whole and all(item.type[1] is not None for item in items)
        match name, len(items):
            case "fmt", _:
                pattern = str(items[0].value())
                _fitting(pattern, items[1:])
                return Typed(STRING, lambda: _filled(pattern, [item.value() for item in items[1:]]))
            case "size", 1 if kinds[0] in ("list", "set", "dict", "string"):
                is_known = kinds[0] == "list" and items[0].type[1] is not None
                return Typed(("int", *items[0].type[1:3]) if is_known else INT, lambda: len(items[0].value()))
            case "empty", 1 if kinds[0] in ("list", "set", "dict"):
                return Typed(BOOL, lambda: not items[0].value())
            case (("min" | "max"), 2) if is_number:
                pick = min if name == "min" else max
                type_ = ("int", *map(pick, *bounds)) if is_ranged else INT if is_whole else REAL
                return Typed(type_, lambda: pick(values()) if is_whole else float(pick(values())))
            case "abs", 1 if is_number:
                if is_ranged:
                    ends = [abs(end) for end in bounds[0]]
                    return Typed(_ranged(0 if bounds[0][0] <= 0 <= bounds[0][1] else min(ends), max(ends)),
                                 lambda: abs(items[0].value()))  # fmt: skip
                return Typed(
                    INT if is_whole else REAL, lambda: abs(_whole(items[0].value()) if is_whole else values()[0])
                )
            case "sign", 1 if is_number:
                signs = [(end > 0) - (end < 0) for end in bounds[0]] if is_ranged else [-1, 1]
                return Typed(("int", *signs), lambda: (items[0].value() > 0) - (items[0].value() < 0))
            case "sqrt", 1 if kinds == ["real"]:
                return Typed(REAL, lambda: _real(math.sqrt(_positive(items[0].value()))))
            case "floor", 1 if kinds == ["real"]:
                return Typed(INT, lambda: _whole(math.floor(items[0].value())))
            case "round", 1 if kinds == ["real"]:
                return Typed(INT, lambda: _whole(math.floor(items[0].value() + 0.5)))
        raise RefusedError(f"{name} of {kinds}")


def _first(rows: list[tuple[Callable[[], bool], Typed]]) -> Typed:
    """The value of the first row whose condition holds, or of the last."""
    type_ = rows[0][1].type
    for _, typed in rows[1:]:
        _require(_compatible(rows[0][1].type, typed.type), "values of several types")
        type_ = _union(type_, typed.type)
    return Typed(
        type_, lambda: next(typed for holds, typed in [*rows[:-1], (lambda: True, rows[-1][1])] if holds()).value()
    )


def _negated(operator: str, inner: Typed) -> Typed:
    if operator == "not":
        _require(inner.type == BOOL, "'not' needs a condition")
        return Typed(BOOL, lambda: not inner.value())
    _require(inner.type[0] in ("int", "real"), "a sign needs a number")
    if operator == "+":
        return inner
    if inner.type[0] == "real":
        return Typed(REAL, lambda: _real(-inner.value()))
    type_ = INT if inner.type[1] is None else _ranged(-inner.type[2], -inner.type[1])
    return Typed(type_, lambda: _whole(-inner.value()))


_EXACT: dict[str, Callable[[int, int], int]] = {
    "+": int.__add__, "-": int.__sub__, "*": int.__mul__, "div": _truncated,
    "mod": lambda x, y: x - y * _truncated(x, y),
}  # fmt: skip


def _calculated(operator: str, left: Typed, right: Typed) -> Typed:
    a, b = left.value, right.value
    if operator == "/":
        return Typed(REAL, lambda: _real(float(a()) / _nonzero(float(b()))))
    if "real" in (left.type[0], right.type[0]):
        _require(operator in ("+", "-", "*"), "no real operator")
        work = {"+": float.__add__, "-": float.__sub__, "*": float.__mul__}[operator]
        return Typed(REAL, lambda: _real(work(float(a()), float(b()))))
    exact = _EXACT[operator]

    def value() -> int:
        return _whole(exact(a(), b()))

    if left.type[1] is None or right.type[1] is None:
        return Typed(INT, value)
    (p, q), (r, s) = left.type[1:3], right.type[1:3]
    if operator in ("+", "-", "*"):
        ends = [exact(x, y) for x in (p, q) for y in (r, s)]
        return Typed(_ranged(min(ends), max(ends)), value)
    _require((r, s) != (0, 0), "division by zero")
    if operator == "mod":
        largest = max(abs(r), abs(s)) - 1
        return Typed(("int", -largest if p < 0 else 0, largest if q >= 0 else 0), value)
    ends = [_truncated(x, y) for x in (p, q) for y in {r, s, -2, -1, 1} if r <= y <= s and y]
    return Typed(_ranged(min(ends), max(ends)), value)


_SPECIFIER = re.compile(r"%(?:(\d)\$)?([-+ 0,]*)(\d*)(\.\d+)?([a-z])")


def _fitting(pattern: str, items: list[Typed]) -> None:
    """Refuse a pattern that does not fit the types of its values, or has flags that mean nothing."""
    for place, flags, width, precision, kind in _SPECIFIER.findall(pattern.replace("%%", "")):
        wanted = {"d": "int", "x": "int", "f": "real", "b": "bool"}.get(kind)
        _require(wanted in (None, items[int(place or 1) - 1].type[0]), "a value of another type")
        _require(set(flags) <= set({"d": "-+ 0,", "f": "-+ 0,", "x": "-0"}.get(kind, "-")), "a flag of other kinds")
        _require(not {"-", "0"} <= set(flags) and not {"+", " "} <= set(flags), "flags against each other")
        _require(bool(width) or not {"-", "0"} & set(flags), "a flag without a width")
        _require(not precision or kind == "f", "a precision of no real number")


def _filled(pattern: str, values: list[Any]) -> str:
    """Python's own operator `%` does what is not for thousands alone."""

    def shown(match: re.Match[str]) -> str:
        place, flags, width, precision, kind = match.groups()
        value = values[int(place or 1) - 1]
        if kind == "b":
            value, kind = str(value).lower(), "s"
        if kind == "x":
            value %= 2**32
        if "," not in flags:
            return str(f"%{flags}{width}{precision or ''}{kind}" % value)
        sign = "+" if "+" in flags else " " if " " in flags else ""
        digits = format(value, f"{sign},{precision or ('.6' if kind == 'f' else '')}{kind}")
        if "0" in flags:
            head = digits[: digits[0] in "+- "]
            return head + digits[len(head) :].rjust(int(width) - len(head), "0")
        return digits.ljust(int(width)) if "-" in flags else digits.rjust(int(width or 0))

    return "%".join(_SPECIFIER.sub(shown, part) for part in pattern.split("%%"))


def _nonzero(value: float) -> float:
    _require(value != 0, "division by zero")
    return value


def _positive(value: float) -> float:
    _require(value >= 0, "no root")
    return value


def _got(values: Any, index: Any) -> Any:
    try:
        return values[index]
    except LookupError as error:
        raise RefusedError("no such element") from error


def _pairs(keys: list[Any], values: list[Any]) -> frozenset[Any]:
    _require(len(set(keys)) == len(keys), "a key twice")
    return frozenset(zip(keys, values, strict=True))


def _values(type_: Type) -> list[Any]:
    """Every value of a type."""
    match type_[0]:
        case "bool":
            return [False, True]
        case "int" if type_[1] is not None:
            return list(range(type_[1], type_[2] + 1))
        case "tuple":
            rows: list[tuple[Any, ...]] = [()]
            for part in type_[1]:
                rows = [(*row, value) for row in rows for value in _values(part)]
            return rows
        case "list" if type_[1] is not None:
            lists: list[tuple[Any, ...]] = []
            for length in range(type_[1], type_[2] + 1):
                lists += _values(("tuple", (type_[3],) * length, None))
            return lists
    raise RefusedError("values without end")
