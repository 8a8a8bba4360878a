"""The package `robosc_msgs`: the typed state of every generated node. Nothing in it depends on a model."""

from importlib import resources

from robosc.supervisor import Supervisor
from robosc.targets.files import GeneratedFiles
from robosc.targets.registry import GenerateOptions

_FILES = (
    "CMakeLists.txt",
    "README.md",
    "msg/ComponentState.msg",
    "msg/SupervisorState.msg",
    "msg/VariableValue.msg",
    "package.xml",
)


def generate_package(supervisor: Supervisor, options: GenerateOptions) -> GeneratedFiles:
    """The files of the package; neither a supervisor nor a choice changes them: it is built once for all robots."""
    folder = resources.files("robosc.targets.ros2_msgs") / "robosc_msgs"
    return GeneratedFiles({path: folder.joinpath(path).read_text(encoding="utf-8") for path in _FILES})
