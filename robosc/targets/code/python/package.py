"""The target `python`: one file with the supervisor and its executor, and nothing else to install."""

import ast
import re

from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc.targets.code.naming import package_name
from robosc.targets.code.python.bundle import statements
from robosc.targets.code.python.generate import supervisor_module
from robosc.targets.files import GeneratedFiles
from robosc.targets.registry import GenerateOptions

_USAGE = {
    Deployment.CONTROLLER: """\
As a controller, in a program on asyncio:

    from {module} import AsyncController, Supervisor

    controller = AsyncController(Supervisor(), robot)
    await controller.run()

What `robot` must offer is the protocol `AsyncRobot`: a function that publishes, and coroutines for
services and actions. Pass each message of the robot to `controller.receive(identifier, message)`,
and call `controller.stop(why)` to end.

In any other program:

    from {module} import Executor, Supervisor

    executor = Executor(Supervisor(), middleware)
    executor.start()

Then call, always from one thread, `executor.tick()` once a period,
`executor.receive(identifier, message)` when the robot sends a message, `on_reply`, `on_goal_ended`
and so on when it answers, and `executor.stop(why)` at the end. What `middleware` must offer is the
protocol `Middleware`.

`Settings` are those of the deployment; `open_event_log` makes the file of an event log.
""",
    Deployment.LAYER: """\
As a supervision layer before an existing controller:

    from {module} import Layer, Supervisor

    layer = Layer(Supervisor(), robot, caller)
    layer.start()

Then call, always from one thread, `layer.on_request(identifier, message)`, `on_call`, `on_goal` and
`on_cancel` when the existing controller sends something; `layer.receive(identifier, message)`,
`on_reply`, `on_goal_ended` and so on when the robot does; `layer.tick()` once a period, so that
time is noticed; and `layer.stop(why)` at the end. What is let through goes to `robot`, what the
existing controller receives to `caller`: they offer the protocols `RobotSide` and `LayerMiddleware`.

`Settings` are those of the deployment; `open_event_log` makes the file of an event log.
""",
}
"""Text that stands at the top of a module."""


_OF_SUPERVISOR = re.compile(r"robosc\.(execution\.runtime\.[a-z0-9_]+|expressions\.values)")


def generate(supervisor: Supervisor, options: GenerateOptions) -> GeneratedFiles:
    """The one file of the target `python`."""
    name = package_name(supervisor, options, "supervisor")
    return GeneratedFiles({f"{name}.py": python_text(supervisor, name)})


def python_text(supervisor: Supervisor, module: str) -> str:
    """The generated module, which is imported as `module`."""
    return supervisor_module(supervisor, _USAGE[supervisor.deployment].format(module=module))


def beside_supervisor(text: str) -> str:
    """A runtime module's text as it stands in a folder of a package that holds `supervisor.py`, the generated module.

    What that one holds is imported from there, other runtime modules from the folder.
    """
    lines = text.splitlines(keepends=True)
    own = [
        node
        for node in ast.parse(text).body
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("robosc.")
    ]
    if not own:
        return text
    names: dict[str, set[str]] = {}
    for node in own:
        names.setdefault(_beside(node.module or ""), set()).update(alias.name for alias in node.names)
    # The formatter keeps imports of the project together, after all others.
    first, last = own[0].lineno - 1, own[-1].end_lineno
    imports = frozenset((module, name) for module, found in names.items() for name in found)
    return "".join([*lines[:first], *(line + "\n" for line in statements(imports)), *lines[last:]])


def _beside(module: str) -> str:
    """The name by which a runtime module imports another one of a package."""
    if _OF_SUPERVISOR.fullmatch(module):
        return "..supervisor"
    return "." + module.rpartition(".")[2]
