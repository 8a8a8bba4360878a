"""Circles in which parts of a specification are defined by each other.

The value of an algebraic variable may need others; so may the initial value of a discrete one, and whether a location
is initial. A location that an expression tests, or an automaton that it switches on, counts among what it needs.
"""

from collections.abc import Iterator

from robosc.cif import syntax
from robosc.cif.scopes import Entity, Scope
from robosc.cif.typing import Typing
from robosc.source import Location

Node = Entity | Scope


def report_circles(typing: Typing) -> None:
    """Report every way in which something is defined by itself, once it is known what depends on what."""
    finished = set[Node]()
    for start in list(typing.depends):
        path: list[Node] = []
        steps: list[Iterator[tuple[Node, Location]]] = [iter([(start, start.at)])]
        while steps:
            following = next(steps[-1], None)
            if following is None:
                steps.pop()
                if path:
                    finished.add(path.pop())
                continue
            node, at = following
            if node in path:
                _report(typing, path[path.index(node) :], at)
            elif node not in finished:
                path.append(node)
                steps.append(iter(typing.depends.get(node, {}).items()))


def _report(typing: Typing, circle: list[Node], at: Location) -> None:
    # Algebraic variables alone are reported where their values are worked out.
    is_algebraic = all(isinstance(node, Entity) and isinstance(node.declaration, syntax.Algebraic) for node in circle)
    is_real = all(node.scope.is_real if isinstance(node, Entity) else node.is_real for node in circle)
    if is_algebraic or not is_real:
        return
    node = circle[0]
    name = node.name if isinstance(node, Entity) else node.path
    typing.error("cif-cycle", f"how '{name}' begins is defined by itself", at, "Break the circle.")
