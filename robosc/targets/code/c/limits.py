"""Generated functions in C that move numbers of requests into the bounds of limits.

The numbers of a request are an array of doubles while they are moved; an integer of the model is exact in a double.
"""

from robosc.expressions import DoubleType, NoneType, ObjectType, Type
from robosc.model.received import path_type
from robosc.model.structure import Communication
from robosc.targets.code.c.layout import Layout
from robosc.targets.code.c.provide import Field, request_field
from robosc.targets.code.c.text import comment
from robosc.targets.code.c.unit import Lvalue, Reading, Unit
from robosc.targets.code.expressions import FALSE_CODE, TRUE_CODE
from robosc.targets.text import indent, limit_text

Path = tuple[str, ...]


def limited_paths(layout: Layout, communication: str) -> tuple[Path, ...]:
    """The numbers of a communication that limits have bounds for, in the order of the text."""
    bounds = (bound for limit in layout.model.limits_for(communication) for bound in limit.bounds)
    return tuple(dict.fromkeys(bound.path for bound in bounds))


def limited(layout: Layout) -> tuple[tuple[int, Communication], ...]:
    """The requests with limits, each with its number."""
    found = enumerate(layout.requests)
    return tuple((place, item) for place, item in found if layout.model.limits_for(item.name))


def limit_function(unit: Unit, item: Communication) -> list[str]:
    """The function that moves the numbers of a request: how many it moved, or -1 if one can be nowhere."""
    layout, paths = unit.layout, limited_paths(unit.layout, item.name)
    scope, places = Reading(unit), {path: place for place, path in enumerate(paths)}
    lines = [
        f"double low[{len(paths)}];",
        f"double high[{len(paths)}];",
        "(void)s;",
        f"unbounded(low, high, {len(paths)});",
    ]
    for limit in layout.model.limits_for(item.name):
        is_out = FALSE_CODE if limit.condition is None else scope.falsity(limit.condition)
        applies = scope.negated(is_out)
        inner = [
            f"narrow(low, high, {places[bound.path]}, {_number(bound.low)}, {_number(bound.high)});"
            for bound in limit.bounds
        ]
        lines += comment(limit_text(limit))
        lines += inner if applies == TRUE_CODE else [f"if ({unit.text(applies)}) {{", *indent(inner), "}"]
    lines.append(f"return move(numbers, low, high, {len(paths)});")
    head = f"static int {layout.function('limits', item.name)}(const state_t *s, double *numbers)"
    return [head, "{", *indent(lines), "}"]


def _number(value: float) -> str:
    return repr(float(value))


def get_function(unit: Unit, item: Communication) -> list[str]:
    """The function that reads the numbers of a request that is about to be issued."""
    layout = unit.layout
    lines = []
    for place, (flag, value, _) in enumerate(_members(unit, item)):
        lines.append(f"numbers[{place}] = request->{flag} ? (double)request->{value} : 0.0;")
    name, request = layout.function("numbers", item.name), f"const {layout.prefix}_request_t *request"
    head = f"static void {name}({request}, double *numbers)"
    return [head, "{", *indent(lines), "}"]


def set_function(unit: Unit, item: Communication) -> list[str]:
    """The function that writes the numbers of a request that were moved."""
    layout = unit.layout
    lines = [f"double given[{len(limited_paths(layout, item.name))}];"]
    lines.append(f"{layout.function('numbers', item.name)}(request, given);")
    for place, (flag, value, type_) in enumerate(_members(unit, item)):
        cast = "" if isinstance(type_, DoubleType) else "(int32_t)"
        lines += [
            f"if (numbers[{place}] < given[{place}] || numbers[{place}] > given[{place}]) {{",
            f"    request->{flag} = true;",
            f"    request->{value} = {cast}numbers[{place}];",
            "}",
        ]
    head = (
        f"static void {layout.function('moves', item.name)}({layout.prefix}_request_t *request, const double *numbers)"
    )
    return [head, "{", *indent(lines), "}"]


def _members(unit: Unit, item: Communication) -> list[tuple[str, str, Type]]:
    """For each limited number of a request its flag and its value as members of the request, and its type."""
    root = request_field(unit, item)
    if root is None:
        return []
    base = f"data.{unit.layout.request_members[item.name]}"
    return [_member(root, path, base) for path in limited_paths(unit.layout, item.name)]


def _member(root: Field, path: Path, place: str) -> tuple[str, str, Type]:
    field = root
    for name in path:
        member, field = field.parts[name]
        if isinstance(field.type, ObjectType):
            place = f"{place}.{member}"
    return f"{place}.{field.flag}", f"{place}.{field.value}", field.type


def received_function(unit: Unit, item: Communication) -> list[str]:
    """The function that reads the numbers of what the caller of a layer sends; what is not known is 0."""
    layout, type_ = unit.layout, item.request
    if type_ is None or isinstance(type_, NoneType):
        return []
    is_pointer = layout.is_by_pointer(type_)
    lines = []
    for place, path in enumerate(limited_paths(layout, item.name)):
        _, lvalue, _ = unit.access(Lvalue("data", is_pointer), type_, path)
        number = path_type(layout.model, type_, path)
        unknown = f"isnan({lvalue})" if isinstance(number, DoubleType) else f"{lvalue} == INT64_MIN"
        known = f"{lvalue}" if isinstance(number, DoubleType) else f"(double){lvalue}"
        if is_pointer:
            unknown = f"data == NULL || {unknown}"
        lines.append(f"numbers[{place}] = ({unknown}) ? 0.0 : {known};")
    head = f"static void {layout.function('numbers', item.name)}({layout.parameter(type_, 'data')}, double *numbers)"
    return [head, "{", *indent(lines), "}"]


HELPERS_TEXT = """\
static void unbounded(double *low, double *high, int count)
{
    for (int place = 0; place < count; place++) {
        low[place] = -INFINITY;
        high[place] = INFINITY;
    }
}

/* All bounds of a number hold. */
static void narrow(double *low, double *high, int place, double lowest, double highest)
{
    low[place] = lowest > low[place] ? lowest : low[place];
    high[place] = highest < high[place] ? highest : high[place];
}

static int move(double *numbers, const double *low, const double *high, int count)
{
    int moved = 0;
    for (int place = 0; place < count; place++) {
        if (low[place] > high[place]) {
            return -1;
        }
        if (numbers[place] < low[place]) {
            numbers[place] = low[place];
            moved++;
        } else if (numbers[place] > high[place]) {
            numbers[place] = high[place];
            moved++;
        }
    }
    return moved;
}"""
"""Functions that those of the model call."""
