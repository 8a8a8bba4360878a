"""Uses of rclpy's private parts in generated ROS 2 packages; `rclpy_internals.py` tries each on a real one."""

import ast
from collections.abc import Iterator, Mapping

PRIVATE = ("_service_change_state", "_feedback_callbacks", "_parameter_overrides")
"""Attributes that rclpy calls private."""

INTERNAL = ("send_response", "notify_execute", "wait_for_ready_callbacks")
"""Parts of rclpy whose replacement, or use from outside, it does not promise."""


OTHERS = frozenset({"_asdict", "_exit", "_fields", "_replace", "_slot_types", "_type"})
"""Those of Python's own library, and of the messages of ROS 1, whose modules ROS 2 shares."""


def private_uses(files: Mapping[str, str]) -> set[str]:
    """The private attributes that a package's Python reads and nothing in it defines."""
    nodes = {path: list(ast.walk(ast.parse(text))) for path, text in files.items() if path.endswith(".py")}
    defined = {name for found in nodes.values() for name in _defined(found)}
    # The supervisor runs without ROS.
    read = {name for path, found in nodes.items() if not path.endswith("supervisor.py") for name in _read(found)}
    return read - defined - OTHERS


def _read(nodes: list[ast.AST]) -> Iterator[str]:
    for node in nodes:
        match node:
            case ast.Attribute(attr=name, ctx=ast.Load()):
                pass
            case ast.Call(func=ast.Name(id="getattr"), args=[_, ast.Constant(value=str(name)), *_]):
                pass
            case _:
                continue
        if _is_private(name):
            yield name


def _defined(nodes: list[ast.AST]) -> Iterator[str]:
    for node in nodes:
        match node:
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                yield name
            case ast.Attribute(attr=name, ctx=ast.Store()) | ast.Name(id=name, ctx=ast.Store()):
                yield name


def _is_private(name: str) -> bool:
    return name.startswith("_") and not name.endswith("__")


__all__ = ["INTERNAL", "PRIVATE", "private_uses"]
