"""The target `ros1`: a complete catkin package around the generated supervisor, a controller or a layer."""

from functools import partial

from robosc.errors import UnsupportedModelError
from robosc.model.structure import Communication, CommunicationKind, Deployment
from robosc.supervisor import Supervisor
from robosc.targets.code.naming import package_name
from robosc.targets.files import GeneratedFiles
from robosc.targets.registry import GenerateOptions
from robosc.targets.ros.layer import remapped_names, require_names_of_a_layer
from robosc.targets.ros.package import (
    chosen,
    context,
    environment,
    error_context,
    packages,
    python_files,
    release_identifiers,
    require_own_names,
)
from robosc.targets.ros.runtime.parameters import USE_SIM_TIME, declarations
from robosc.targets.ros.runtime.supervised import callers_name, robots_name
from robosc.targets.ros.topics import Topic, servers, topics
from robosc.targets.ros1.runtime.remapping import PARTS_OF_ACTIONS, remapped

_OWN_DEPENDENCIES = ("actionlib", "diagnostic_msgs", "rosgraph", "rospy", "std_msgs")

# Where each module of a package's runtime comes from.
_RUNTIME_MODULES = {
    "goals": "robosc.targets.ros1.runtime",
    "health": "robosc.targets.ros.runtime",
    "inbox": "robosc.targets.ros1.runtime",
    "messages": "robosc.targets.ros.runtime",
    "parameters": "robosc.targets.ros.runtime",
    "presence": "robosc.targets.ros.runtime",
    "reports": "robosc.targets.ros.runtime",
    "scans": "robosc.targets.ros.runtime",
    "services": "robosc.targets.ros1.runtime",
    "startup": "robosc.targets.ros.runtime",
    "timers": "robosc.targets.ros1.runtime",
    "types": "robosc.targets.ros1.runtime",
}

_RUNTIME_MODULES_OF = {
    Deployment.CONTROLLER: {"startup_controller": "robosc.targets.ros.runtime"},
    Deployment.LAYER: {
        "children": "robosc.targets.ros.runtime",
        "defaults": "robosc.targets.ros1.runtime",
        "remapping": "robosc.targets.ros1.runtime",
        "servers": "robosc.targets.ros1.runtime",
        "startup_layer": "robosc.targets.ros.runtime",
        "supervised": "robosc.targets.ros.runtime",
    },
}

# Path of each file from a template: the template's name.
_TEMPLATES = {
    "CMakeLists.txt": "CMakeLists.txt.j2",
    "config/parameters.yaml": "parameters.yaml.j2",
    "package.xml": "package.xml.j2",
    "setup.py": "setup.py.j2",
    "test/run_tests.py": "run_tests.py.j2",
    "test/test_supervisor.py": "test_supervisor.py.j2",
    "{package}/connections.py": "connections.py.j2",
    "{package}/diagnostics.py": "diagnostics.py.j2",
    "{package}/host.py": "host.py.j2",
    "{package}/interfaces.py": "interfaces.py.j2",
    "{package}/parameter_file.py": "parameter_file.py.j2",
    "{package}/program.py": "program.py.j2",
    "{package}/state_topic.py": "state_topic.py.j2",
}

_TEMPLATES_OF = {
    Deployment.CONTROLLER: {
        "README.md": "README.md.j2",
        "launch/controller.launch": "controller.launch.j2",
        "{package}/middleware.py": "middleware.py.j2",
        "{package}/node.py": "node.py.j2",
        "{package}/start.py": "start.py.j2",
    },
    Deployment.LAYER: {
        "README.md": "README_layer.md.j2",
        "launch/layer.launch": "layer.launch.j2",
        "test/test_layer.py": "test_layer.py.j2",
        "{package}/caller.py": "caller.py.j2",
        "{package}/node.py": "layer_node.py.j2",
        "{package}/robot.py": "robot.py.j2",
        "{package}/start.py": "start_layer.py.j2",
    },
}


def generate(supervisor: Supervisor, options: GenerateOptions) -> GeneratedFiles:
    """The package's files.

    Raises:
        UnsupportedModelError: The model has something that this version cannot do on ROS 1.
    """
    deployment = supervisor.deployment
    name = package_name(supervisor, options, str(deployment))
    with error_context("ros1"):
        found, asked = topics(supervisor.model), servers(supervisor.model)
        require_own_names(name, found, asked)
        _require_names(found, asked)
        if deployment is Deployment.LAYER:
            require_names_of_a_layer(found, asked)
            _require_own_topics(found, asked)
        values = context(supervisor, name, found, asked)
    values["dependencies"] = sorted({*_OWN_DEPENDENCIES, *packages(found, asked)})
    declared = chosen(declarations(release_identifiers(found), str(deployment)), options)
    values["parameters"] = [item for item in declared if item.name != USE_SIM_TIME]
    values["supervised"] = options.supervised
    values["remapped"] = remapped_names(found, asked, remapped)
    files = python_files(supervisor, name, _RUNTIME_MODULES | _RUNTIME_MODULES_OF[deployment])
    templates = environment("robosc.targets.ros1")
    templates.filters["robots"] = partial(robots_name, "")
    templates.filters["callers"] = partial(callers_name, "")
    for path, template in (_TEMPLATES | _TEMPLATES_OF[deployment]).items():
        files[path.format(package=name)] = templates.get_template(template).render(values)
    robot = supervisor.model.name
    scripts = {
        f"scripts/{deployment}": ("node", f"The {deployment} of the robot {robot}."),
        f"scripts/{values['starter']}": ("start", f"The {deployment} of the robot {robot} with its parameter file."),
    }
    for path, (module, purpose) in scripts.items():
        files[path] = templates.get_template("script.py.j2").render(values, module=module, purpose=purpose)
    return GeneratedFiles(files, frozenset(scripts))


def _require_names(found: tuple[Topic, ...], asked: tuple[Communication, ...]) -> None:
    """Do nothing if every identifier is a name in ROS 1, too, where none begins with an underscore."""
    for identifier in [topic.identifier for topic in found] + [item.identifier for item in asked]:
        if identifier.startswith("_"):
            raise UnsupportedModelError(
                f"the identifier {identifier!r} is no name in ROS 1: it begins with an underscore"
            )


def _require_own_topics(found: tuple[Topic, ...], asked: tuple[Communication, ...]) -> None:
    """Do nothing if no topic is one of those that an action is made of: a layer has a server of its own there."""
    parts = {
        robots_name("", f"{item.identifier}/{part}"): item.name
        for item in asked
        if item.kind is CommunicationKind.ACTION
        for part in PARTS_OF_ACTIONS
    }
    for topic in found:
        action = parts.get(robots_name("", topic.identifier))
        if action is not None:
            raise UnsupportedModelError(
                f"the topic {topic.identifier} is a part of the action '{action}', which a supervision layer offers "
                "by itself"
            )
