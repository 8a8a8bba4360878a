"""The target `ros2`: a complete ament_python package around the generated supervisor."""

from robosc.errors import UnsupportedModelError
from robosc.model.structure import Deployment
from robosc.supervisor.structure import Supervisor
from robosc.targets.files import GeneratedFiles
from robosc.targets.python.package import package_name
from robosc.targets.registry import GenerateOptions
from robosc.targets.ros.package import (
    chosen,
    context,
    environment,
    packages,
    python_files,
    release_identifiers,
    require_own_names,
    told_by,
)
from robosc.targets.ros.runtime.parameters import declarations
from robosc.targets.ros.topics import servers, topics

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
    "early": "robosc.targets.ros.runtime",
    "health": "robosc.targets.ros.runtime",
    "messages": "robosc.targets.ros.runtime",
    "parameters": "robosc.targets.ros.runtime",
    "reports": "robosc.targets.ros.runtime",
    "scans": "robosc.targets.ros.runtime",
}

# Path of each file from a template: the template's name.
_TEMPLATES = {
    "README.md": "README.md.j2",
    "config/parameters.yaml": "parameters.yaml.j2",
    "launch/controller.launch.py": "controller.launch.py.j2",
    "package.xml": "package.xml.j2",
    "setup.cfg": "setup.cfg.j2",
    "setup.py": "setup.py.j2",
    "test/test_supervisor.py": "test_supervisor.py.j2",
    "{package}/interfaces.py": "interfaces.py.j2",
    "{package}/middleware.py": "middleware.py.j2",
    "{package}/node.py": "node.py.j2",
    "{package}/start.py": "start.py.j2",
    "{package}/state_topic.py": "state_topic.py.j2",
}


def generate(supervisor: Supervisor, options: GenerateOptions) -> GeneratedFiles:
    """The package's files.

    Raises:
        UnsupportedModelError: The model has something that this version cannot do on ROS 2.
    """
    name = package_name(supervisor, options, "controller")
    with told_by("ros2"):
        _require_controller(supervisor)
        found, asked = topics(supervisor.model), servers(supervisor.model)
        require_own_names(name, found, asked)
        values = context(supervisor, name, found, asked)
    values["dependencies"] = sorted({*_OWN_DEPENDENCIES, *packages(found, asked)})
    values["parameters"] = chosen(declarations(release_identifiers(found)), options)
    files = python_files(supervisor, name, _RUNTIME_MODULES)
    templates = environment("robosc.targets.ros2")
    for path, template in _TEMPLATES.items():
        files[path.format(package=name)] = templates.get_template(template).render(values)
    files[f"resource/{name}"] = ""
    return GeneratedFiles(files)


def _require_controller(supervisor: Supervisor) -> None:
    if supervisor.deployment is not Deployment.CONTROLLER:
        raise UnsupportedModelError(
            f"the supervisor of {supervisor.model.name} was made for the deployment "
            f"'{supervisor.deployment}', and this version generates controllers only"
        )
