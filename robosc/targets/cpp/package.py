"""The files that every C++ package has, and the values for its templates."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache, partial

import jinja2

from robosc.errors import UnsupportedModelError
from robosc.model.structure import Communication, CommunicationKind, Deployment, EventKind, Interface
from robosc.supervisor import Supervisor
from robosc.targets.code import templates
from robosc.targets.code.c.header import head, runtime_text
from robosc.targets.code.c.layout import Layout, sharing
from robosc.targets.code.c.package import generate as generate_c
from robosc.targets.code.c.text import safe, string_literal
from robosc.targets.code.c.unit import Unit, make_unit
from robosc.targets.code.naming import package_name
from robosc.targets.code.python.folding import folded
from robosc.targets.code.templates import shared_values
from robosc.targets.cpp.model import Writer, ask_name, fill_name, first_of, received_topics, take_name
from robosc.targets.cpp.naming import require_namespace, require_package_name
from robosc.targets.cpp.recording import PERIOD_S, record
from robosc.targets.files import GeneratedFiles
from robosc.targets.registry import GenerateOptions, StateMessage
from robosc.targets.ros.distributions import fits
from robosc.targets.ros.layer import Renamed, remapped_names, require_names_of_a_layer, require_own_topics
from robosc.targets.ros.notices import is_known, with_notices
from robosc.targets.ros.package import chosen, error_context, packages, release_identifiers, require_own_names
from robosc.targets.ros.runtime.parameters import Parameter, declarations
from robosc.targets.ros.runtime.supervised import callers_name, robots_name
from robosc.targets.ros.topics import Topic, servers, shapes_of, topics

_RUNTIME = (
    "controller.hpp",
    "event_log.hpp",
    "health.hpp",
    "json.hpp",
    "notes.hpp",
    "parameters.hpp",
    "run.hpp",
    "scans.hpp",
    "signals.hpp",
    "state.hpp",
    "values.hpp",
)
_OF_A_LAYER = ("callers.hpp",)
_DIAGNOSTICS = Interface("DiagnosticArray", "diagnostic_msgs")
_OWN_TYPES = (_DIAGNOSTICS, Interface("String", "std_msgs"))


@dataclass(frozen=True, slots=True)
class Middleware:
    """Description of a target's middleware.

    Attributes:
        target: Name of the target.
        include: The file to include for a type, by its kind (`msg`, `srv`, `action`).
        type_name: The C++ class of a type, by its kind; that of a part of a service or an action by the part's name.
        runtime: Its own headers, in the package `runtime` of the module `module`.
        module: The Python package that has its runtime and its templates.
        templates: Path of each file from a template: the template's name.
        without: Parameters that nodes of this middleware have in another way, or not at all.
        parameters: Parameters that only nodes of this middleware have.
        packages: Packages of messages that its headers use, beside those of every node.
        typed_state: Type of a typed state, or None where nodes of this middleware publish none.
        of_a_layer: Its own headers that only a layer has.
        launch: Ending of a launch file.
        remapped: Names everything that an existing controller before a layer has to call otherwise, given messages and
            services, and actions.
        parts_of_actions: Topics that an action is made of, below its name; none where an action has a name of its own.
        python: The Python package of the target for this middleware in Python, whose launch file of a layer is used.
    """

    target: str
    include: Callable[[str, Interface], str]
    type_name: Callable[[str, Interface], str]
    runtime: tuple[str, ...]
    module: str
    templates: dict[str, str]
    without: frozenset[str]
    parameters: tuple[Parameter, ...] = ()
    packages: tuple[str, ...] = ()
    typed_state: Interface | None = None
    of_a_layer: tuple[str, ...] = ()
    launch: str = ""
    remapped: Callable[[Iterable[str], Iterable[str]], Renamed] | None = None
    parts_of_actions: tuple[str, ...] = ()
    python: str = ""


def generate_package(middleware: Middleware, supervisor: Supervisor, options: GenerateOptions) -> GeneratedFiles:
    """The files of a package.

    Raises:
        UnsupportedModelError: The model is outside what the target handles.
    """
    name = package_name(supervisor, options, str(supervisor.deployment))
    with error_context(middleware.target):
        return _generate(supervisor, name, options, middleware)


def _generate(supervisor: Supervisor, name: str, options: GenerateOptions, middleware: Middleware) -> GeneratedFiles:
    is_layer = supervisor.deployment is Deployment.LAYER
    found, asked = topics(supervisor.model), servers(supervisor.model)
    require_namespace(name)
    require_own_names(name, found, asked)
    if is_layer:
        require_names_of_a_layer(found, asked)
        require_own_topics(found, asked, middleware.parts_of_actions)
    for package in sorted(packages(found, asked)):
        require_package_name(package)
    for item in supervisor.model.communications:
        shapes_of(supervisor.model, item)
    engine = _engine(supervisor)
    prefix = next(path.removesuffix(".h") for path in engine if path.endswith(".h"))
    unit = make_unit(supervisor, prefix)
    top = head(supervisor)
    files = {f"src/{prefix}{ending}": engine[f"{prefix}{ending}"] for ending in (".h", ".c")}
    files["src/engine.h"] = f'{top}\n#include "{prefix}.h"\n'
    files["src/model.hpp"] = f"{top}\n{Writer(unit, name).text()}"
    shared, own = (_OF_A_LAYER, middleware.of_a_layer) if is_layer else ((), ())
    runtime = (
        ("robosc.targets.cpp", (*_RUNTIME, *shared)),
        (middleware.module, (*middleware.runtime, *own)),
    )
    for module, headers in runtime:
        for path in headers:
            # Each package has a namespace of its own: two of them may be loaded into one process.
            text = runtime_text(unit.layout, path, module).replace("namespace robosc", f"namespace {name}")
            files[f"src/runtime/{path}"] = f"{top}\n{text}"
    context = _context(supervisor, unit, name, found, asked, options, middleware)
    for path, template in _templates(middleware, is_layer).items():
        environment = _environment(middleware.module, middleware.python, in_python=path.endswith(".py"))
        files[path.format(package=name)] = environment.get_template(template).render(context)
    noticed = with_notices(files, options.metadata)
    return GeneratedFiles({path: folded(text) if path.endswith(".py") else text for path, text in noticed.items()})


def _templates(middleware: Middleware, is_layer: bool) -> dict[str, str]:
    """Path of each file from a template: the template's name."""
    if not is_layer:
        return middleware.templates
    replaced = {
        f"launch/controller{middleware.launch}": (f"launch/layer{middleware.launch}", f"layer{middleware.launch}.j2"),
        "README.md": ("README.md", "README_layer.md.j2"),
    }
    # The test of a package repeats a run of a controller.
    kept = {path: template for path, template in middleware.templates.items() if not path.startswith("test/")}
    return dict(replaced.get(path, (path, template)) for path, template in kept.items())


def _engine(supervisor: Supervisor) -> GeneratedFiles:
    try:
        return generate_c(supervisor, GenerateOptions())
    except UnsupportedModelError as error:
        # The target that this one is built on refuses the model.
        raise UnsupportedModelError(str(error).replace("the target c99", "it")) from error


def _context(
    supervisor: Supervisor,
    unit: Unit,
    package: str,
    found: tuple[Topic, ...],
    asked: tuple[Communication, ...],
    options: GenerateOptions,
    middleware: Middleware,
) -> dict[str, object]:
    """Return the values that the templates refer to."""
    layout = unit.layout
    released = release_identifiers(found)
    types = [("msg", topic.interface) for topic in found]
    types += [(_kind(item), item.interface) for item in asked if item.interface]
    types += [("msg", type_) for type_ in _OWN_TYPES]
    typed_state = None if options.state_message == StateMessage.JSON else middleware.typed_state
    if typed_state is not None:
        types.append(("msg", typed_state))

    policy = "fair" if supervisor.strategy is None else "strategy"
    offered = declarations(released, str(supervisor.deployment), policy)
    declared = tuple(item for item in offered if item.name not in middleware.without)
    declared += middleware.parameters

    numbers = {identifier: number for number, identifier in enumerate(received_topics(layout))}
    return {
        **shared_values(supervisor, package, options.metadata),
        "prefix": layout.prefix,
        "upper": layout.upper,
        **_recorded(supervisor, unit, middleware),
        **_layered(found, asked, options, middleware),
        "deployment": str(supervisor.deployment),
        "distributions": fits(supervisor.model, supervisor.deployment),
        "is_layer": layout.is_layer,
        "node_class": "LayerNode" if layout.is_layer else "ControllerNode",
        "numbers": _numbers(layout, found, asked, middleware) if layout.is_layer else [],
        "text_type": middleware.type_name("msg", _OWN_TYPES[1]),
        "release_identifiers": released,
        "header": head(supervisor, "# ", "# ", ""),
        "top": head(supervisor),
        "hash_top": head(supervisor, "# ", "# ", ""),
        "includes": sorted({middleware.include(kind, type_) for kind, type_ in types}),
        "packages": sorted({*middleware.packages, *(type_.package for _, type_ in types)}),
        "has_actions": any(item.kind is CommunicationKind.ACTION for item in asked),
        "has_services": any(item.kind is CommunicationKind.SERVICE for item in asked),
        "topics": [_topic(unit, topic, numbers, middleware) for topic in found],
        "servers": [_server(unit, number, asked, middleware) for number in range(len(asked))],
        "is_known_license": is_known(options.metadata.license),
        "typed_state": typed_state and middleware.type_name("msg", typed_state),
        "topic_table": found,
        "server_table": asked,
        "parameters": declared,
        "chosen": chosen(declared, options),
    }


def _layered(
    found: tuple[Topic, ...], asked: tuple[Communication, ...], options: GenerateOptions, middleware: Middleware
) -> dict[str, object]:
    """Return the names on the caller's side of a layer."""
    if middleware.remapped is None:
        return {}
    return {"supervised": options.supervised, "remapped": remapped_names(found, asked, middleware.remapped)}


def _numbers(
    layout: Layout, found: tuple[Topic, ...], asked: tuple[Communication, ...], middleware: Middleware
) -> list[dict[str, str]]:
    """Return the numbers that limits move: the enumerator, the type of the message, and the place in it."""
    types = {item.name: middleware.type_name("msg", topic.interface) for topic in found for item in topic.published}
    for item in asked:
        part = "goal" if item.kind is CommunicationKind.ACTION else "request"
        if item.interface is not None:
            types[item.name] = middleware.type_name(part, item.interface)
    return [
        {
            "enumerator": enumerator,
            "type": types[name],
            "place": ".".join(("sent", *path)) if path else "basic_field(sent)",
        }
        for (name, path), enumerator in layout.numbers.items()
    ]


def _recorded(supervisor: Supervisor, unit: Unit, middleware: Middleware) -> dict[str, object]:
    """Return the run that the package's test repeats, if it has one."""
    if unit.layout.is_layer:
        return {}
    if not any(path.startswith("test/") for path in middleware.templates):
        return {}
    return {"recording": record(supervisor, unit.layout), "period_us": int(PERIOD_S * 1e6)}


def _kind(item: Communication) -> str:
    return "action" if item.kind is CommunicationKind.ACTION else "srv"


def _topic(unit: Unit, topic: Topic, numbers: dict[str, int], middleware: Middleware) -> dict[str, object]:
    layout = unit.layout
    is_scan = topic.interface == Interface("LaserScan", "sensor_msgs")
    return {
        "type": middleware.type_name("msg", topic.interface),
        "literal": string_literal(topic.identifier),
        "caller": string_literal(callers_name("", topic.identifier)),
        "sent": layout.topics.get(topic.identifier),
        "ask": ask_name(layout, topic.published[0]) if topic.published else None,
        "received": numbers.get(topic.identifier) if topic.received else None,
        "publisher": topic.publisher_quality,
        "subscription": topic.subscription_quality,
        "is_scan": is_scan,
        # The message that stops a robot is stamped like the ones that move it.
        "frame": next((string_literal(frame) for frame in topic.frames.values()), None),
        "messages": [
            {
                "enumerator": layout.communications[item.name],
                "fill": fill_name(layout, item),
                "frame": None if item.frame is None or layout.is_layer else string_literal(item.frame),
            }
            for item in topic.published
        ],
    }


def _server(unit: Unit, number: int, asked_of: tuple[Communication, ...], middleware: Middleware) -> dict[str, object]:
    item = asked_of[number]
    layout, model = unit.layout, unit.layout.model
    if item.interface is None:
        raise UnsupportedModelError(f"'{item.name}' needs a link to the type of its {item.kind}")
    is_action = item.kind is CommunicationKind.ACTION
    fields: list[str] = []
    if item.frame is not None and item.request is not None and hasattr(item.request, "name"):
        fields = [f"message.{part.name}" for part in model.object(item.request.name).properties]
    asked, answered = ("goal", "result") if is_action else ("request", "response")
    return {
        "number": number,
        "is_action": is_action,
        "type": middleware.type_name(_kind(item), item.interface),
        "asked": middleware.type_name(asked, item.interface),
        "answered": middleware.type_name(answered, item.interface),
        "reported": middleware.type_name("feedback", item.interface),
        "literal": string_literal(item.identifier),
        "caller": string_literal(callers_name("", item.identifier)),
        "ask": ask_name(layout, item),
        "served": next(place for place, other in enumerate(asked_of) if other.name == first_of(layout, item).name),
        "sharing": len(sharing(model, item.kind, item.identifier)),
        "enumerator": layout.communications[item.name],
        "fill": fill_name(layout, item),
        "answer": take_name(layout, item.event(EventKind.RESPONSE)),
        "feedback": take_name(layout, item.event(EventKind.FEEDBACK)) if is_action else None,
        "frame": None if item.frame is None else string_literal(item.frame),
        "stamped": fields,
    }


def declaration(parameter: Parameter) -> str:
    """A parameter as an entry of the C++ table of declarations."""
    default = parameter.default
    if isinstance(default, bool):
        value = f"Value(std::in_place_type<bool>, {str(default).lower()})"
    elif isinstance(default, int):
        value = f"Value(std::in_place_type<std::int64_t>, {default})"
    elif isinstance(default, float):
        value = f"Value(std::in_place_type<double>, {default!r})"
    elif isinstance(default, str):
        value = f"Value(std::in_place_type<std::string>, {string_literal(default)})"
    else:
        items = ", ".join(string_literal(item) for item in default)
        value = f"Value(std::in_place_type<Texts>, Texts{{{items}}})"
    range_ = "std::nullopt" if parameter.bounds is None else "Range{{{!r}, {!r}}}".format(*parameter.bounds)
    return f"{{{string_literal(parameter.name)}, {value}, {string_literal(parameter.description)}, {range_}}},"


@cache
def _environment(module: str, python: str, *, in_python: bool) -> jinja2.Environment:
    """Templates of a middleware's packages; literals are those of the language of the file."""
    filters: dict[str, Callable[..., object]] = {
        "declaration": declaration,
        "literal": ascii if in_python else string_literal,
        "safe_comment": safe,
        "callers": partial(callers_name, ""),
        "robots": partial(robots_name, ""),
    }
    others = (python,) if python else ()
    return templates.environment(module, "robosc.targets.cpp", "robosc.targets.ros", *others, filters=filters)
