"""The packages of a middleware in Python, made from a record of its differences: ROS 1 or ROS 2."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache, partial
from importlib import resources

import jinja2

from robosc.errors import UnsupportedModelError
from robosc.model.structure import Communication, Deployment
from robosc.supervisor import Supervisor
from robosc.targets.code import templates
from robosc.targets.code.naming import package_name
from robosc.targets.code.python.folding import folded
from robosc.targets.code.python.generate import header
from robosc.targets.code.python.package import beside_supervisor, python_text
from robosc.targets.files import GeneratedFiles
from robosc.targets.registry import GenerateOptions, StateMessage
from robosc.targets.ros.distributions import fits
from robosc.targets.ros.layer import (
    Renamed,
    remapped_names,
    require_names_of_a_layer,
    require_own_topics,
    require_reachable_controller,
)
from robosc.targets.ros.notices import is_known, with_notices
from robosc.targets.ros.package import chosen, context, error_context, packages, release_identifiers, require_own_names
from robosc.targets.ros.runtime.parameters import Parameter, declarations
from robosc.targets.ros.runtime.supervised import callers_name, robots_name
from robosc.targets.ros.topics import Topic, servers, topics

_SHARED = "robosc.targets.ros"

_MODULES = ("startup", "health", "messages", "parameters", "presence", "reports", "scans")
_MODULES_OF = {
    Deployment.CONTROLLER: ("startup_controller",),
    Deployment.LAYER: ("children", "startup_layer", "supervised"),
}
_OWN_MODULES_OF = {Deployment.CONTROLLER: (), Deployment.LAYER: ("defaults", "remapping", "servers")}

# A file's template has the file's name; of these a layer has another one than a controller.
_FILES = (
    "README.md",
    "config/parameters.yaml",
    "package.xml",
    "setup.py",
    "test/test_supervisor.py",
    "{package}/connections.py",
    "{package}/diagnostics.py",
    "{package}/entry.py",
    "{package}/host.py",
    "{package}/interfaces.py",
    "{package}/node.py",
    "{package}/parameter_file.py",
    "{package}/start.py",
    "{package}/state_topic.py",
)
_FILES_OF = {
    Deployment.CONTROLLER: ("{package}/middleware.py",),
    Deployment.LAYER: ("test/test_layer.py", "{package}/caller.py", "{package}/robot.py"),
}
_TEMPLATES_OF_A_LAYER = {"README.md": "README_layer.md", "node.py": "layer_node.py", "start.py": "start_layer.py"}


def _nothing_more(found: tuple[Topic, ...], asked: tuple[Communication, ...]) -> None:
    """Every name that ROS 2 takes is one."""


@dataclass(frozen=True, slots=True)
class Middleware:
    """Description of a target's middleware.

    Attributes:
        target: Name of the target.
        package: The Python package that has its runtime and its templates.
        dependencies: Packages that every generated package needs.
        modules: Its own modules of the runtime.
        files: Paths of its own files from templates.
        launch: Ending of a launch file.
        remapped: Names everything that an existing controller has to call otherwise, given messages and services, and
            actions.
        require_names: Raises UnsupportedModelError for what is no name in this middleware.
        parts_of_actions: Topics that an action is made of, below its name; none where an action has a name of its own.
        parameters: Its own parameters.
        without: Parameters that its nodes have in another way, or not at all.
        typed_state: Packages that a typed state needs.
        not_in_file: Parameters that the parameter file leaves to whoever starts the node.
        script: Template of the programs, or nothing where something else makes them.
        markers: Paths of its files without content.
    """

    target: str
    package: str
    dependencies: tuple[str, ...]
    modules: tuple[str, ...]
    files: tuple[str, ...]
    launch: str
    remapped: Callable[[Iterable[str], Iterable[str]], Renamed]
    require_names: Callable[[tuple[Topic, ...], tuple[Communication, ...]], None] = _nothing_more
    parts_of_actions: tuple[str, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    without: frozenset[str] = frozenset()
    typed_state: tuple[str, ...] = ()
    not_in_file: frozenset[str] = frozenset()
    script: str = ""
    markers: tuple[str, ...] = ()


def generate_package(middleware: Middleware, supervisor: Supervisor, options: GenerateOptions) -> GeneratedFiles:
    """The files of a package.

    Raises:
        UnsupportedModelError: The model has something that this version cannot do on this middleware.
    """
    deployment = supervisor.deployment
    name = package_name(supervisor, options, str(deployment))
    with error_context(middleware.target):
        found, asked = topics(supervisor.model), servers(supervisor.model)
        require_own_names(name, found, asked)
        if name in (*middleware.dependencies, *middleware.typed_state):
            raise UnsupportedModelError(f"the generated package would be called {name}, like a package that it needs")
        middleware.require_names(found, asked)
        if deployment is Deployment.LAYER:
            require_names_of_a_layer(found, asked)
            require_own_topics(found, asked, middleware.parts_of_actions)
            require_reachable_controller(options.supervised, (*found, *asked))
        values = context(supervisor, name, found, asked, options)
    policy = "fair" if supervisor.strategy is None else "strategy"
    declared = (*declarations(release_identifiers(found), str(deployment), policy), *middleware.parameters)
    typed = set() if options.state_message == StateMessage.JSON else set(middleware.typed_state)
    values["dependencies"] = sorted({*middleware.dependencies, *packages(found, asked), *typed})
    values["parameters"] = [item for item in chosen(declared, options) if item.name not in middleware.without]
    values["not_in_file"] = middleware.not_in_file
    values["supervised"] = options.supervised
    values["is_known_license"] = is_known(options.metadata.license)
    values["distributions"] = fits(supervisor.model, deployment)
    values["remapped"] = remapped_names(found, asked, middleware.remapped)
    files = _python_files(supervisor, name, middleware)
    get_template = _environment(middleware.package).get_template
    replaced = _TEMPLATES_OF_A_LAYER if deployment is Deployment.LAYER else {}
    for path in (*_FILES, *_FILES_OF[deployment], *middleware.files, f"launch/{deployment}{middleware.launch}"):
        file = path.rpartition("/")[2]
        files[path.format(package=name)] = get_template(f"{replaced.get(file, file)}.j2").render(values)
    files |= {path.format(package=name): "" for path in middleware.markers}
    scripts = _scripts(supervisor, str(values["starter"])) if middleware.script else {}
    for path, (function, purpose) in scripts.items():
        files[path] = get_template(middleware.script).render(values, function=function, purpose=purpose)
    return GeneratedFiles(
        {
            path: folded(text) if path.endswith(".py") or path in scripts else text
            for path, text in with_notices(files, options.metadata, scripts).items()
        },
        frozenset(scripts),
    )


def _scripts(supervisor: Supervisor, starter: str) -> dict[str, tuple[str, str]]:
    """Path of each program, the entry that it runs, and its purpose."""
    purpose = f"The {supervisor.deployment} of the robot {supervisor.model.name}"
    return {
        f"scripts/{supervisor.deployment}": ("run_node", f"{purpose}."),
        f"scripts/{starter}": ("run_starter", f"{purpose} with its parameter file."),
    }


def _python_files(supervisor: Supervisor, package: str, middleware: Middleware) -> dict[str, str]:
    """A package's Python files without a template, by path: the supervisor, and what a node runs on."""
    top = header(supervisor)
    files = {
        f"{package}/__init__.py": f'{top}"""The supervisor of the robot {supervisor.model.name} and its node."""\n',
        f"{package}/supervisor.py": python_text(supervisor, f"{package}.supervisor"),
        f"{package}/runtime/__init__.py": f'{top}"""Runtime of the node: no part of it depends on the model."""\n',
    }
    shared = (*_MODULES, *_MODULES_OF[supervisor.deployment])
    own = (*middleware.modules, *_OWN_MODULES_OF[supervisor.deployment])
    for folder, modules in ((_SHARED, shared), (middleware.package, own)):
        for module in modules:
            text = resources.files(f"{folder}.runtime").joinpath(f"{module}.py").read_text(encoding="utf-8")
            files[f"{package}/runtime/{module}.py"] = top + beside_supervisor(text)
    return files


_LONG = 10_000
"""Characters from which a literal is written on several lines."""


def _literal(value: object, indent: str = "") -> str:
    """A value in Python; a long one with an item on each line: the tokenizer of Python is slow with very long lines."""
    text = ascii(value)
    within = f"{indent}    "
    if len(text) < _LONG or not isinstance(value, dict | list):
        return text
    if isinstance(value, dict):
        items = [f"{within}{key!a}: {_literal(item, within)},\n" for key, item in value.items()]
        return "{\n" + "".join(items) + indent + "}"
    return "[\n" + "".join(f"{within}{_literal(item, within)},\n" for item in value) + indent + "]"


@cache
def _environment(package: str) -> jinja2.Environment:
    """Templates of a middleware's packages, and those that all of them share."""
    filters: dict[str, Callable[..., object]] = {
        "callers": partial(callers_name, ""),
        "literal": _literal,
        "names": lambda communications: tuple(item.name for item in communications),
        "robots": partial(robots_name, ""),
    }
    return templates.environment(package, _SHARED, filters=filters)
