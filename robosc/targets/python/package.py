"""The target `python`: a package with the supervisor, the executor and nothing else to install."""

import re
from importlib import resources

from robosc.errors import UnsupportedModelError
from robosc.model.structure import Deployment
from robosc.supervisor.structure import Supervisor
from robosc.targets.files import GeneratedFiles
from robosc.targets.python.generate import header, supervisor_module
from robosc.targets.python.naming import snake_case
from robosc.targets.registry import GenerateOptions

_USAGE = {
    Deployment.CONTROLLER: '''\
"""The supervisor of the robot {robot} and its executor, as a controller.

    from {package}.runtime.executor import Executor
    from {package}.supervisor import Supervisor

    executor = Executor(Supervisor(), middleware)
    executor.start()

Then call, always from one thread, `executor.tick()` once a period, `executor.receive(identifier, message)` when
the robot sends a message, `on_reply`, `on_goal_ended` and so on when it answers, and `executor.stop(why)` at the end.
What `middleware` must offer is the protocol `Middleware` in `{package}.runtime.protocol`; settings of the deployment
are in `{package}.runtime.settings`, files for the event log in `{package}.runtime.event_log`.
"""
''',
    Deployment.LAYER: '''\
"""The supervisor of the robot {robot} and its executor, as a supervision layer before an existing controller.

    from {package}.runtime.layer import Layer
    from {package}.supervisor import Supervisor

    layer = Layer(Supervisor(), robot, caller)
    layer.start()

Then call, always from one thread, `layer.on_request(identifier, message)`, `on_call`, `on_goal` and `on_cancel`
when the existing controller sends something; `layer.receive(identifier, message)`, `on_reply`, `on_goal_ended` and so
on when the robot does; `layer.tick()` once a period, so that time is noticed; and `layer.stop(why)` at the end. What
is let through goes to `robot`, what the existing controller is told to `caller`: they offer the protocols `RobotSide`
and `LayerMiddleware` in `{package}.runtime.protocol`. Settings of the deployment are in `{package}.runtime.settings`,
files for the event log in `{package}.runtime.event_log`.
"""
''',
}
"""What stands in a package's `__init__.py`."""

_NOT_COPIED = frozenset({"__init__.py"})
_MAXIMUM_NAME = 100

# How modules import each other here, and how their copies do: all copies stand in one folder.
_FROM_FOLDER = re.compile(r"from robosc\.(execution|expressions) import ")
_FROM_MODULE = re.compile(r"from robosc(\.[a-z0-9_]+)*\.(?P<module>[a-z0-9_]+) import ")


def package_name(supervisor: Supervisor, options: GenerateOptions, suffix: str) -> str:
    """The chosen name, or one made from the robot's: `line_follower_<suffix>`.

    Raises:
        UnsupportedModelError: The chosen name is no name for a package.
    """
    if options.package is None:
        return f"{snake_case(supervisor.model.name)[:_MAXIMUM_NAME].rstrip('_')}_{suffix}"
    if snake_case(options.package) != options.package or len(options.package) > 2 * _MAXIMUM_NAME:
        raise UnsupportedModelError(
            f"'{options.package}' is no name for a package: lower-case letters, digits and single underscores, "
            "starting with a letter"
        )
    return options.package


def generate(supervisor: Supervisor, options: GenerateOptions) -> GeneratedFiles:
    """The files of the target `python`, below a folder with the package's name."""
    name = package_name(supervisor, options, "supervisor")
    files = {f"{name}/{path}": text for path, text in python_files(supervisor).items()}
    usage = _USAGE[supervisor.deployment].format(robot=supervisor.model.name, package=name)
    files[f"{name}/__init__.py"] = header(supervisor) + usage
    return GeneratedFiles(files)


def python_files(supervisor: Supervisor) -> dict[str, str]:
    """The files of a package that holds a supervisor and its executor, by path inside the package."""
    top = header(supervisor)
    files = {
        "__init__.py": f'{top}"""The supervisor of the robot {supervisor.model.name} and its executor."""\n',
        "supervisor.py": supervisor_module(supervisor, ".runtime"),
        "runtime/__init__.py": f'{top}"""What the supervisor runs on: no part of it depends on the model."""\n',
    }
    for module, text in _runtime_modules().items():
        files[f"runtime/{module}"] = top + text
    return files


def _runtime_modules() -> dict[str, str]:
    """Copies of the modules that generated code runs on, importing each other instead of RoboSC."""
    texts = {
        "values.py": resources.files("robosc.expressions").joinpath("values.py").read_text(encoding="utf-8"),
        "reading.py": resources.files("robosc.targets.python.runtime")
        .joinpath("reading.py")
        .read_text(encoding="utf-8"),
    }
    for entry in sorted(resources.files("robosc.execution").iterdir(), key=lambda item: item.name):
        if entry.name.endswith(".py") and entry.name not in _NOT_COPIED:
            texts[entry.name] = entry.read_text(encoding="utf-8")
    return {name: with_relative_imports(text) for name, text in texts.items()}


def with_relative_imports(text: str) -> str:
    """A runtime module's text as it stands in a generated package: importing its neighbours, not RoboSC."""
    lines = []
    for line in text.splitlines(keepends=True):
        start = len(line) - len(line.lstrip())
        within = _FROM_FOLDER.sub("from . import ", line[start:], count=1)
        lines.append(line[:start] + _FROM_MODULE.sub(r"from .\g<module> import ", within, count=1))
    return "".join(lines)
