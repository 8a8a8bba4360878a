"""The functions that generated expressions call: `robosc.expressions.values` in C. A file has only those it calls."""

from collections.abc import Mapping

_MAXIMUM, _MINIMUM = "INT64_C(2147483647)", "(-INT64_C(2147483647) - 1)"

_I, _D = "int64_t a, int64_t b", "double a, double b"


def _comparison(name: str, letter: str, operator: str) -> tuple[str, str]:
    c_type = {"i": "int64_t", "d": "double", "e": "int", "b": "int", "t": "const char *"}[letter]
    star = "" if c_type.endswith("*") else " "
    unknown = {
        "i": "a == INT64_MIN || b == INT64_MIN",
        "d": "isnan(a) || isnan(b)",
        "e": "a < 0 || b < 0",
        "b": "a < 0 || b < 0",
        "t": "a == NULL || b == NULL",
    }[letter]
    test = "strcmp(a, b) == 0" if letter == "t" else f"a {operator} b"
    head = f"static int {name}_{letter}({c_type}{star}a, {c_type}{star}b)"
    return f"{name}_{letter}", f"{head}\n{{\n    return ({unknown}) ? KLEENE_UNKNOWN : ({test});\n}}"


def _integer(name: str, operator: str) -> tuple[str, str]:
    return (
        f"{name}_i",
        f"static int64_t {name}_i({_I})\n{{\n"
        f"    return (a == INT64_MIN || b == INT64_MIN) ? INT64_MIN : whole(a {operator} b);\n}}",
    )


def _double(name: str, operator: str) -> tuple[str, str]:
    return f"{name}_d", f"static double {name}_d({_D})\n{{\n    return finite_d(a {operator} b);\n}}"


def _choice(letter: str, c_type: str, unknown: str) -> tuple[str, str]:
    star = "" if c_type.endswith("*") else " "
    return (
        f"choose_{letter}",
        f"static {c_type}{star}choose_{letter}(int condition, {c_type}{star}a, {c_type}{star}b)\n{{\n"
        f"    return condition < 0 ? {unknown} : (condition ? a : b);\n}}",
    )


def _extreme(name: str, operator: str) -> list[tuple[str, str]]:
    return [
        (
            f"{name}_i",
            f"static int64_t {name}_i({_I})\n{{\n"
            f"    return (a == INT64_MIN || b == INT64_MIN) ? INT64_MIN : (a {operator} b ? a : b);\n}}",
        ),
        (
            f"{name}_d",
            f"static double {name}_d({_D})\n{{\n"
            f"    return (isnan(a) || isnan(b)) ? (double)NAN : (a {operator} b ? a : b);\n}}",
        ),
    ]


HELPERS: dict[str, str] = dict(
    [
        (
            "whole",
            "/* An integer of 32 bits, else unknown. */\n"
            "static int64_t whole(int64_t a)\n{\n"
            f"    return (a < {_MINIMUM} || a > {_MAXIMUM}) ? INT64_MIN : a;\n}}",
        ),
        (
            "finite_d",
            "/* A finite result of arithmetic, else unknown. */\n"
            "static double finite_d(double a)\n{\n    return isfinite(a) ? a : (double)NAN;\n}",
        ),
        (
            "not_b",
            "static int not_b(int a)\n{\n    return a < 0 ? KLEENE_UNKNOWN : !a;\n}",
        ),
        (
            "and_b",
            "static int and_b(int a, int b)\n{\n"
            "    return (a == 0 || b == 0) ? 0 : ((a < 0 || b < 0) ? KLEENE_UNKNOWN : 1);\n}",
        ),
        (
            "or_b",
            "static int or_b(int a, int b)\n{\n"
            "    return (a == 1 || b == 1) ? 1 : ((a < 0 || b < 0) ? KLEENE_UNKNOWN : 0);\n}",
        ),
        *(_comparison("equal", letter, "==") for letter in "idebt"),
        *(_comparison("less", letter, "<") for letter in "id"),
        *(_comparison("at_most", letter, "<=") for letter in "id"),
        _integer("add", "+"),
        _integer("subtract", "-"),
        _integer("multiply", "*"),
        _double("add", "+"),
        _double("subtract", "-"),
        _double("multiply", "*"),
        (
            "divide_d",
            f"static double divide_d({_D})\n{{\n"
            "    return (isnan(a) || isnan(b) || b == 0.0) ? (double)NAN : finite_d(a / b);\n}",
        ),
        (
            "negate_i",
            "static int64_t negate_i(int64_t a)\n{\n    return a == INT64_MIN ? INT64_MIN : whole(-a);\n}",
        ),
        ("negate_d", "static double negate_d(double a)\n{\n    return finite_d(-a);\n}"),
        (
            "abs_i",
            "static int64_t abs_i(int64_t a)\n{\n    return a == INT64_MIN ? INT64_MIN : whole(a < 0 ? -a : a);\n}",
        ),
        ("abs_d", "static double abs_d(double a)\n{\n    return finite_d(fabs(a));\n}"),
        *_extreme("min", "<="),
        *_extreme("max", ">="),
        (
            "clamp_i",
            "static int64_t clamp_i(int64_t a, int64_t low, int64_t high)\n{\n"
            "    return min_i(max_i(a, low), high);\n}",
        ),
        (
            "clamp_d",
            "static double clamp_d(double a, double low, double high)\n{\n    return min_d(max_d(a, low), high);\n}",
        ),
        (
            "integer_of",
            "/* Towards zero, and the nearest integer of 32 bits for what is beyond. */\n"
            "static int64_t integer_of(double a)\n{\n"
            "    if (isnan(a)) {\n        return INT64_MIN;\n    }\n"
            f"    if (a >= 2147483647.0) {{\n        return {_MAXIMUM};\n    }}\n"
            f"    return a <= -2147483648.0 ? {_MINIMUM} : (int64_t)a;\n}}",
        ),
        (
            "double_of",
            "static double double_of(int64_t a)\n{\n    return a == INT64_MIN ? (double)NAN : (double)a;\n}",
        ),
        _choice("b", "int", "KLEENE_UNKNOWN"),
        _choice("i", "int64_t", "INT64_MIN"),
        _choice("d", "double", "(double)NAN"),
        _choice("e", "int", "-1"),
        _choice("t", "const char *", "NULL"),
        (
            "stays_in_range",
            "/* An unknown value leaves its variable alone. */\n"
            "static bool stays_in_range(int64_t a, int64_t low, int64_t high)\n{\n"
            "    return a == INT64_MIN || (low <= a && a <= high);\n}",
        ),
        (
            "boolean_of",
            "static int boolean_of(int8_t a)\n{\n    return (a == 0 || a == 1) ? a : KLEENE_UNKNOWN;\n}",
        ),
        (
            "moved",
            "/* A received integer of a declared range: however far outside, it is moved to the nearest bound. */\n"
            "static int64_t moved(int64_t a, int64_t low, int64_t high, notes_t *notes)\n{\n"
            "    const int64_t found = a < low ? low : (a > high ? high : a);\n"
            "    if (found != a && notes != NULL) {\n        notes->is_unknown = true;\n    }\n    return found;\n}",
        ),
        (
            "clamped",
            "/* The same for one that may be unknown, in an array. */\n"
            "static int64_t clamped(int64_t a, int64_t low, int64_t high, notes_t *notes)\n{\n"
            "    const int64_t moved = a < low ? low : (a > high ? high : a);\n"
            "    if (a == INT64_MIN) {\n        return a;\n    }\n"
            "    if (moved != a && notes != NULL) {\n        notes->is_unknown = true;\n    }\n    return moved;\n}",
        ),
        (
            "part_count",
            "/* Elements from `low` to `high`; if low > high, the array's end is followed by its beginning. */\n"
            "static size_t part_count(size_t length, size_t low, size_t high)\n{\n"
            "    const size_t tail = length > low ? length - low : 0;\n"
            "    const size_t head = length > high ? high + 1 : length;\n"
            "    if (low <= high) {\n        return tail < high - low + 1 ? tail : high - low + 1;\n    }\n"
            "    return tail + head;\n}",
        ),
        (
            "part_index",
            "/* Place of the element number `number` of those. */\n"
            "static size_t part_index(size_t length, size_t low, size_t number)\n{\n"
            "    const size_t tail = length > low ? length - low : 0;\n"
            "    return number < tail ? low + number : number - tail;\n}",
        ),
    ]
)
"""The text of each function by name, each after those that it calls."""

HELPER_CALLS = {
    **{f"{name}_i": {"whole"} for name in ("add", "subtract", "multiply", "negate", "abs")},
    **{f"{name}_d": {"finite_d"} for name in ("add", "subtract", "multiply", "divide", "negate", "abs")},
    **{f"clamp_{letter}": {f"min_{letter}", f"max_{letter}"} for letter in "id"},
}
"""The functions that each of them calls."""


def called(names: set[str], calls: Mapping[str, set[str]]) -> set[str]:
    """The functions of some names, and those that they call: a compiler warns about others.

    Args:
        names: Names that the code uses.
        calls: Functions that others call, by the caller's name, beside those that helpers do.
    """
    found: set[str] = set()
    to_do = [*names]
    while to_do:
        name = to_do.pop()
        if name not in found:
            found.add(name)
            to_do += [*calls.get(name, ()), *HELPER_CALLS.get(name, ())]
    return found
