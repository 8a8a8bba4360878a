"""Several modules joined to the text of one: generated Python is a single file."""

import ast
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources

_OWN = "robosc."
_COPIED = "\n\nA copy of this module stands in generated packages, which run on Python 3.8 and later."
WIDTH = 99
"""Columns of generated Python: those of ament_flake8."""


@dataclass(frozen=True, slots=True)
class _Module:
    """A module, taken apart.

    Attributes:
        name: Its full name.
        title: Its docstring's lines.
        imports: (module, name) of what it imports from elsewhere; the name is None for a whole module.
        needs: The own modules that it imports from.
        names: Names that it defines at its top level.
        body: Its text without docstring and imports.
    """

    name: str
    title: tuple[str, ...]
    imports: frozenset[tuple[str, str | None]]
    needs: tuple[str, ...]
    names: tuple[str, ...]
    body: str


@dataclass(frozen=True, slots=True)
class Bundle:
    """Modules, put together.

    Attributes:
        imports: Statements that import what they need from Python's library, sorted.
        sections: Name, title and text of each module, each after those that it needs.
        names: Names that they define.
    """

    imports: tuple[str, ...]
    sections: tuple[tuple[str, tuple[str, ...], str], ...]
    names: frozenset[str]

    def text(self) -> str:
        """The modules' texts below their titles."""
        return "\n\n".join(_section(*section) for section in self.sections)


@cache
def bundle(roots: tuple[str, ...]) -> Bundle:
    """Modules of RoboSC and all others of it that they import, as one.

    Args:
        roots: Their full names.

    Raises:
        ValueError: Two define one name, or one imports in a way that cannot be put together.
    """
    modules = list(_in_order(roots))
    owners: dict[str, str] = {}
    for module in modules:
        for name in module.names:
            if name in owners:
                raise ValueError(f"{name} is defined by {owners[name]} and by {module.name}")
            owners[name] = module.name
    found = frozenset(item for module in modules for item in module.imports)
    return Bundle(
        tuple(statements(found)),
        tuple((module.name.rpartition(".")[2], module.title, module.body) for module in modules),
        frozenset(owners),
    )


def statements(imports: frozenset[tuple[str, str | None]]) -> list[str]:
    """Import statements by module, whole modules before names of them."""
    lines: list[str] = []
    for module in sorted({module for module, _ in imports}, key=_place):
        names = sorted(
            (name for source, name in imports if source == module and name), key=lambda name: (name.lower(), name)
        )
        if (module, None) in imports:
            lines.append(f"import {module}")
        if names:
            line = f"from {module} import {', '.join(names)}"
            lines += (
                [line] if len(line) <= WIDTH else [f"from {module} import (", *(f"    {name}," for name in names), ")"]
            )
    return lines


def _place(module: str) -> tuple[int, str]:
    """A module's place among imports, as linters of ROS want them: nearer packages first, then by name, in any case."""
    return len(module) - len(module.lstrip(".")), module.lower()


def section_title(lines: Sequence[str]) -> list[str]:
    """Comment lines that begin a part of a module."""
    rule = "# " + "-" * (WIDTH - 2)
    return [rule, *(f"# {line}".rstrip() for line in lines), rule, "", ""]


def _section(name: str, title: tuple[str, ...], body: str) -> str:
    return "\n".join([*section_title([f"{name}: {title[0]}", *title[1:]]), body])


def _in_order(roots: Sequence[str]) -> Iterator[_Module]:
    """Each module after those that it needs."""
    done: set[str] = set()

    def visit(name: str) -> Iterator[_Module]:
        if name in done:
            return
        done.add(name)
        module = _take_apart(name)
        for needed in module.needs:
            yield from visit(needed)
        yield module

    for root in roots:
        yield from visit(root)


def _take_apart(name: str) -> _Module:
    package, _, stem = name.rpartition(".")
    text = resources.files(package).joinpath(f"{stem}.py").read_text(encoding="utf-8")
    tree = ast.parse(text)
    imports: set[tuple[str, str | None]] = set()
    needs: list[str] = []
    names: list[str] = []
    dropped: set[int] = set()
    for number, node in enumerate(tree.body):
        is_docstring = number == 0 and ast.get_docstring(tree) is not None
        if is_docstring or isinstance(node, ast.Import | ast.ImportFrom):
            dropped.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
        if isinstance(node, ast.Import | ast.ImportFrom):
            _require_plain(name, node)
        if isinstance(node, ast.Import):
            imports.update((alias.name, None) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            source = node.module or ""
            if source.startswith(_OWN):
                needs.append(source)
            elif source != "__future__":
                imports.update((source, alias.name) for alias in node.names)
        else:
            names += _defined(node)
    lines = [line for number, line in enumerate(text.splitlines(), 1) if number not in dropped]
    title = (ast.get_docstring(tree) or stem).replace(_COPIED, "").strip().splitlines()
    return _Module(name, tuple(title), frozenset(imports), tuple(needs), tuple(names), "\n".join(lines).strip() + "\n")


def _require_plain(name: str, node: ast.Import | ast.ImportFrom) -> None:
    """Own modules are imported from by their full names; nothing is renamed."""
    is_relative = isinstance(node, ast.ImportFrom) and (node.level > 0 or node.module == "robosc")
    if is_relative or any(alias.asname or alias.name == "*" or alias.name.startswith(_OWN) for alias in node.names):
        raise ValueError(f"{name} imports in a way that cannot be put together: line {node.lineno}")


def _defined(node: ast.stmt) -> list[str]:
    match node:
        case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
            return [name]
        case ast.Assign(targets=targets):
            return [target.id for target in targets if isinstance(target, ast.Name)]
        case ast.AnnAssign(target=ast.Name(id=name)):
            return [name]
    return []
