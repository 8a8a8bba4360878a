"""The diagnostic codes that the source code can report, read from its syntax trees."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from robosc.targets import available_targets

SOURCE = Path(__file__).parents[2] / "robosc"

_LOOKS_LIKE_A_CODE = re.compile(r"[a-z0-9]+(-[a-z0-9]+)+")

_IS_A_CODE = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")

NO_CODES = frozenset(
    {
        *("utf-8", "utf-8-sig", "robosc-supervisor", "explain-synthesis"),
        *("ssh-ed25519", "check-log", "convert-log", "until-finding", "site-functions", "bash-completion"),
        # Packages of Debian that nodes depend on.
        "python3-yaml",
        # Words of Matplotlib and Foxglove.
        *("triangle-up", "steps-post", "x-thin", "follow-none"),
        *(info.name for info in available_targets()),
    }
)
"""Texts of the source that look like codes and are none: commands, options, kinds of keys, marks, folders, targets."""

# The pages themselves, the models that a new robot begins with, and names of programs and packages.
_ELSEWHERE = ("diagnostics", "starter", "doctor")

REPORTERS = {"error": 0, "warning": 0, "note": 0, "_warning": 0, "Diagnostic": 1, "Remark": 0, "_remarks": 0}
"""Functions that take a code, and at which position."""

_MAKERS = frozenset({"Diagnostic", "Remark", "_remarks"})
"""Those of them that take nothing else: the names of others are those of a logger's methods, too."""


def trees() -> Iterator[tuple[str, ast.Module]]:
    """Every module that may report something, with its name."""
    for path in sorted(SOURCE.rglob("*.py")):
        place = path.relative_to(SOURCE)
        if place.parts[0] not in _ELSEWHERE:
            yield place.as_posix(), ast.parse(path.read_text(encoding="utf-8"))


def outer_trees() -> Iterator[tuple[str, ast.Module]]:
    """Every module outside of the core, with its name."""
    root = SOURCE.parent
    for folder in ("editors/robosc_lsp", "server", "client", "bridge"):
        for path in sorted((root / folder).rglob("*.py")):
            yield path.relative_to(root).as_posix(), ast.parse(path.read_text(encoding="utf-8"))


def reportable_codes() -> frozenset[str]:
    """Every code that stands in the source.

    A code may reach its finding by ways that no syntax tree shows (a variable, a table, a parameter), so every text
    that looks like one counts: words of lower case with hyphens between them are nothing else in this source. A code of
    one word counts where it is given to what makes a finding or remark as it stands, and outside of the core (in the
    language server, service, client and bridge) any code does.
    """
    given = {
        argument.value
        for _, tree in (*trees(), *outer_trees())
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        and _name_of(node) in _MAKERS
        and isinstance(argument := _code_argument(node), ast.Constant)
        and isinstance(argument.value, str)
        and _IS_A_CODE.fullmatch(argument.value)
    }
    found = given | {
        node.value
        for _, tree in trees()
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and _LOOKS_LIKE_A_CODE.fullmatch(node.value)
    }
    return frozenset(found - NO_CODES)


def assembled_codes() -> tuple[str, ...]:
    """Places where a code is put together from pieces, so that `reportable_codes` cannot see it."""
    return tuple(
        f"{name}:{node.lineno}"
        for name, tree in trees()
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and isinstance(_code_argument(node), ast.JoinedStr | ast.BinOp)
    )


def _name_of(call: ast.Call) -> str:
    match call.func:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name
        case _:
            return ""


def _code_argument(call: ast.Call) -> ast.expr | None:
    position = REPORTERS.get(_name_of(call))
    keyword = next((item.value for item in call.keywords if item.arg == "code"), None)
    if position is None or keyword is not None:
        return keyword
    return call.args[position] if len(call.args) > position else None
