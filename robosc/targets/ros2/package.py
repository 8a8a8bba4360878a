"""The target `ros2`: a complete ament_python package around the generated supervisor, a controller or a layer."""

from functools import partial

from robosc.model.structure import Deployment
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
from robosc.targets.ros.runtime.parameters import declarations
from robosc.targets.ros.runtime.supervised import callers_name, robots_name
from robosc.targets.ros.topics import servers, topics
from robosc.targets.ros2.runtime.lifecycle import AUTOSTART
from robosc.targets.ros2.runtime.remapping import remapped

_OWN_DEPENDENCIES = (
    "ament_index_python",
    "diagnostic_msgs",
    "launch",
    "launch_ros",
    "rcl_interfaces",
    "rclpy",
    "std_msgs",
)

# Where each module of a package's runtime comes from.
_RUNTIME_MODULES = {
    "clients": "robosc.targets.ros2.runtime",
    "health": "robosc.targets.ros.runtime",
    "lifecycle": "robosc.targets.ros2.runtime",
    "messages": "robosc.targets.ros.runtime",
    "parameters": "robosc.targets.ros.runtime",
    "presence": "robosc.targets.ros.runtime",
    "reports": "robosc.targets.ros.runtime",
    "scans": "robosc.targets.ros.runtime",
    "startup": "robosc.targets.ros.runtime",
}

_RUNTIME_MODULES_OF = {
    Deployment.CONTROLLER: {"startup_controller": "robosc.targets.ros.runtime"},
    Deployment.LAYER: {
        "children": "robosc.targets.ros.runtime",
        "defaults": "robosc.targets.ros2.runtime",
        "remapping": "robosc.targets.ros2.runtime",
        "servers": "robosc.targets.ros2.runtime",
        "startup_layer": "robosc.targets.ros.runtime",
        "supervised": "robosc.targets.ros.runtime",
    },
}

# Path of each file from a template: the template's name.
_TEMPLATES = {
    "config/parameters.yaml": "parameters.yaml.j2",
    "package.xml": "package.xml.j2",
    "setup.cfg": "setup.cfg.j2",
    "setup.py": "setup.py.j2",
    "test/test_supervisor.py": "test_supervisor.py.j2",
    "{package}/connections.py": "connections.py.j2",
    "{package}/diagnostics.py": "diagnostics.py.j2",
    "{package}/host.py": "host.py.j2",
    "{package}/interfaces.py": "interfaces.py.j2",
    "{package}/life.py": "life.py.j2",
    "{package}/parameter_file.py": "parameter_file.py.j2",
    "{package}/spinner.py": "spinner.py.j2",
    "{package}/state_topic.py": "state_topic.py.j2",
}

_TEMPLATES_OF = {
    Deployment.CONTROLLER: {
        "README.md": "README.md.j2",
        "launch/controller.launch.py": "controller.launch.py.j2",
        "{package}/middleware.py": "middleware.py.j2",
        "{package}/node.py": "node.py.j2",
        "{package}/start.py": "start.py.j2",
    },
    Deployment.LAYER: {
        "README.md": "README_layer.md.j2",
        "launch/layer.launch.py": "layer.launch.py.j2",
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
        UnsupportedModelError: The model has something that this version cannot do on ROS 2.
    """
    deployment = supervisor.deployment
    name = package_name(supervisor, options, str(deployment))
    with error_context("ros2"):
        found, asked = topics(supervisor.model), servers(supervisor.model)
        require_own_names(name, found, asked)
        if deployment is Deployment.LAYER:
            require_names_of_a_layer(found, asked)
        values = context(supervisor, name, found, asked)
    values["dependencies"] = sorted({*_OWN_DEPENDENCIES, *packages(found, asked)})
    values["parameters"] = chosen((*declarations(release_identifiers(found), str(deployment)), AUTOSTART), options)
    values["supervised"] = options.supervised
    values["remapped"] = remapped_names(found, asked, remapped)
    files = python_files(supervisor, name, _RUNTIME_MODULES | _RUNTIME_MODULES_OF[deployment])
    templates = environment("robosc.targets.ros2")
    templates.filters["robots"] = partial(robots_name, "")
    templates.filters["callers"] = partial(callers_name, "")
    for path, template in (_TEMPLATES | _TEMPLATES_OF[deployment]).items():
        files[path.format(package=name)] = templates.get_template(template).render(values)
    files[f"resource/{name}"] = ""
    return GeneratedFiles(files)
