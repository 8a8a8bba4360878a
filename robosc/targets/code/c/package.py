"""The files of the target `c99`."""

from collections.abc import Iterator

from robosc.errors import UnsupportedModelError
from robosc.expressions import Constant, Expression, Received, StringType, leaves
from robosc.model.received import path_type
from robosc.model.structure import Model, ObjectValue
from robosc.supervisor import Supervisor
from robosc.targets.code.c.example import example_file
from robosc.targets.code.c.header import head, header_file
from robosc.targets.code.c.layer_example import layer_example_file
from robosc.targets.code.c.layout import event_data
from robosc.targets.code.c.naming import prefix_for
from robosc.targets.code.c.readme import readme_file
from robosc.targets.code.c.source import source_file
from robosc.targets.code.c.text import is_nested_too_deeply
from robosc.targets.code.c.unit import make_unit
from robosc.targets.code.naming import package_name
from robosc.targets.files import GeneratedFiles
from robosc.targets.registry import GenerateOptions

_MAXIMUM_TEXT = 4095
"""Bytes of a string literal that every compiler takes (C99 5.2.4.1)."""

_CMAKE = """\
cmake_minimum_required(VERSION 3.13)
project({prefix} C)

add_library({prefix} STATIC {prefix}.c)
target_include_directories({prefix} PUBLIC ${{CMAKE_CURRENT_SOURCE_DIR}})
set_target_properties({prefix} PROPERTIES C_STANDARD 99 C_STANDARD_REQUIRED ON C_EXTENSIONS OFF)
if(CMAKE_C_COMPILER_ID MATCHES "GNU|Clang")
  # A contracted product and sum is rounded once instead of twice: other results than the model's.
  target_compile_options({prefix} PRIVATE -Wall -Wextra -Wpedantic -ffp-contract=off)
endif()

add_executable({prefix}_example main.c)
set_target_properties({prefix}_example PROPERTIES C_STANDARD 99 C_STANDARD_REQUIRED ON C_EXTENSIONS OFF)
target_link_libraries({prefix}_example PRIVATE {prefix})
if(UNIX)
  target_link_libraries({prefix} PUBLIC m)
endif()
"""


def generate(supervisor: Supervisor, options: GenerateOptions) -> GeneratedFiles:
    """The files for a supervisor.

    Raises:
        UnsupportedModelError: The model is outside what the target handles.
    """
    _refuse(supervisor)
    name = supervisor.model.name if options.package is None else package_name(supervisor, options, "")
    prefix = prefix_for(name)
    too_deep = f"the model {supervisor.model.name} has an expression that is nested too deeply for C"
    try:
        unit = make_unit(supervisor, prefix)
        source = source_file(unit)
    except RecursionError as error:
        raise UnsupportedModelError(too_deep) from error
    if is_nested_too_deeply(source):
        raise UnsupportedModelError(too_deep)
    return GeneratedFiles(
        {
            f"{prefix}.h": header_file(unit),
            f"{prefix}.c": source,
            "main.c": layer_example_file(unit) if unit.layout.is_layer else example_file(unit),
            "CMakeLists.txt": head(supervisor, "# ", "# ", "") + "\n" + _CMAKE.format(prefix=prefix),
            "README.md": head(supervisor, "<!-- ", "     ", " -->") + "\n" + readme_file(unit),
        }
    )


def _refuse(supervisor: Supervisor) -> None:
    """Refuse what this target does not do.

    Raises:
        UnsupportedModelError: The model needs something of that.
    """
    model = supervisor.model
    for component in model.components:
        for variable in component.behaviour.variables if component.behaviour else ():
            if isinstance(variable.type, StringType) and _takes_received(model, component.name, variable.name):
                raise UnsupportedModelError(
                    f"the target c99 does not do received texts that are kept: the variable "
                    f"{component.name}.{variable.name} takes one; use an enum made from the text"
                )
    if any(len(text.encode("utf-8", "surrogatepass")) > _MAXIMUM_TEXT for text in _texts(model)):
        raise UnsupportedModelError(f"the target c99 does not do texts of more than {_MAXIMUM_TEXT} bytes in UTF-8")
    if "\0" in "".join(_texts(model)):
        raise UnsupportedModelError("the target c99 does not do texts with a NUL character in them")


def _takes_received(model: Model, component: str, variable: str) -> bool:
    """Return True if an update of a text reads received data."""
    behaviour = model.component(component).behaviour
    return behaviour is not None and any(
        isinstance(leaf, Received) and _is_text(model, transition.event, leaf)
        for transition in behaviour.transitions
        for update in transition.updates
        if update.variable == variable
        for leaf in leaves(update.expression)
    )


def _is_text(model: Model, event: str, leaf: Received) -> bool:
    """Return True if a part of an event's data is a text."""
    data = event_data(model, event)
    return data is not None and isinstance(path_type(model, data, leaf.path), StringType)


def _texts(model: Model) -> Iterator[str]:
    """Every text that is written into the code."""
    for component in model.components:
        for variable in component.behaviour.variables if component.behaviour else ():
            if isinstance(variable.initial, str):
                yield variable.initial
    for expression in _expressions(model):
        for leaf in leaves(expression):
            if isinstance(leaf, Constant) and isinstance(leaf.value, str):
                yield leaf.value


def _expressions(model: Model) -> Iterator[Expression]:
    for component in model.components:
        for transition in component.behaviour.transitions if component.behaviour else ():
            yield from (update.expression for update in transition.updates)
            if transition.guard is not None:
                yield transition.guard
    yield from (requirement.expression for requirement in model.requirements)
    yield from (rule.condition for enum in model.enums for rule in enum.rules)
    for statement in model.provides:
        if statement.condition is not None:
            yield statement.condition
        stack = [statement.value]
        while stack:
            match stack.pop():
                case ObjectValue(properties=properties):
                    stack += [item for _, item in properties]
                case expression:
                    yield expression
