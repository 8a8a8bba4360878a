"""The target `ros1`: a complete catkin package around the generated supervisor."""

from robosc.errors import UnsupportedModelError
from robosc.model.structure import Communication, Deployment
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
from robosc.targets.ros.runtime.parameters import USE_SIM_TIME, declarations
from robosc.targets.ros.topics import Topic, servers, topics

_OWN_DEPENDENCIES = ("actionlib", "diagnostic_msgs", "rosgraph", "rospy", "std_msgs")

# Where each module of a package's runtime comes from.
_RUNTIME_MODULES = {
    "early": "robosc.targets.ros.runtime",
    "goals": "robosc.targets.ros1.runtime",
    "health": "robosc.targets.ros.runtime",
    "inbox": "robosc.targets.ros1.runtime",
    "late_controller": "robosc.targets.ros.runtime",
    "messages": "robosc.targets.ros.runtime",
    "parameters": "robosc.targets.ros.runtime",
    "presence": "robosc.targets.ros.runtime",
    "reports": "robosc.targets.ros.runtime",
    "scans": "robosc.targets.ros.runtime",
    "services": "robosc.targets.ros1.runtime",
    "timers": "robosc.targets.ros1.runtime",
    "types": "robosc.targets.ros1.runtime",
}

# Path of each file from a template: the template's name.
_TEMPLATES = {
    "CMakeLists.txt": "CMakeLists.txt.j2",
    "README.md": "README.md.j2",
    "config/parameters.yaml": "parameters.yaml.j2",
    "launch/controller.launch": "controller.launch.j2",
    "package.xml": "package.xml.j2",
    "setup.py": "setup.py.j2",
    "test/run_tests.py": "run_tests.py.j2",
    "test/test_supervisor.py": "test_supervisor.py.j2",
    "{package}/interfaces.py": "interfaces.py.j2",
    "{package}/middleware.py": "middleware.py.j2",
    "{package}/node.py": "node.py.j2",
    "{package}/program.py": "program.py.j2",
    "{package}/start.py": "start.py.j2",
    "{package}/state_topic.py": "state_topic.py.j2",
}


def generate(supervisor: Supervisor, options: GenerateOptions) -> GeneratedFiles:
    """The package's files.

    Raises:
        UnsupportedModelError: The model has something that this version cannot do on ROS 1.
    """
    name = package_name(supervisor, options, "controller")
    with told_by("ros1"):
        _require_controller(supervisor)
        found, asked = topics(supervisor.model), servers(supervisor.model)
        require_own_names(name, found, asked)
        _require_names(found, asked)
        values = context(supervisor, name, found, asked)
    values["dependencies"] = sorted({*_OWN_DEPENDENCIES, *packages(found, asked)})
    declared = chosen(declarations(release_identifiers(found)), options)
    values["parameters"] = [item for item in declared if item.name != USE_SIM_TIME]
    files = python_files(supervisor, name, _RUNTIME_MODULES)
    templates = environment("robosc.targets.ros1")
    for path, template in _TEMPLATES.items():
        files[path.format(package=name)] = templates.get_template(template).render(values)
    robot = supervisor.model.name
    scripts = {
        "scripts/controller": ("node", f"The controller of the robot {robot}."),
        f"scripts/{values['starter']}": ("start", f"The controller of the robot {robot} with its parameter file."),
    }
    for path, (module, purpose) in scripts.items():
        files[path] = templates.get_template("script.py.j2").render(values, module=module, purpose=purpose)
    return GeneratedFiles(files, frozenset(scripts))


def _require_controller(supervisor: Supervisor) -> None:
    if supervisor.deployment is not Deployment.CONTROLLER:
        raise UnsupportedModelError(
            f"the supervisor of {supervisor.model.name} was made for the deployment "
            f"'{supervisor.deployment}', and this version generates controllers only"
        )


def _require_names(found: tuple[Topic, ...], asked: tuple[Communication, ...]) -> None:
    """Do nothing if every identifier is a name in ROS 1, too, where none begins with an underscore."""
    for identifier in [topic.identifier for topic in found] + [item.identifier for item in asked]:
        if identifier.startswith("_"):
            raise UnsupportedModelError(
                f"the identifier {identifier!r} is no name in ROS 1: it begins with an underscore"
            )
