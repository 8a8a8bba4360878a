"""Generated ROS packages that linters of ROS look at: of each kind, and of a model with long names and texts."""

import re
from collections.abc import Callable
from pathlib import Path

from robosc.certification import make_supervisor
from robosc.model.structure import Deployment
from robosc.targets import GeneratedFiles, GenerateOptions, generate
from robosc.targets.registry import StateMessage
from support.execution import supervisor_of
from support.generated import example_supervisor
from support.goal_porter import porter_supervisor
from support.models import EXAMPLES, example_bundle, model_of

LAYER = "line_follower/line_follower_layer"
MAZE = "maze_solver/maze_solver"
NAVIGATION = "navigation/navigation"
COURIER = Path(__file__).parents[1] / "models" / "courier" / "model.rscd"

EXAMPLE_ROBOTS = tuple(
    sorted(
        path.relative_to(EXAMPLES).with_suffix("").as_posix()
        for path in EXAMPLES.rglob("*.rscd")
        # A folder of libraries.
        if path.parent.name != "shared"
    )
)
"""The example robots, such as `maze_solver/maze_solver`."""


def example_packages(name: str) -> dict[str, GeneratedFiles]:
    """Every ROS package of an example robot, by target and deployment; some robots can have no layer."""
    made = {item: make_supervisor(example_bundle(name), deployment=item).supervisor for item in Deployment}
    assert made[Deployment.CONTROLLER] is not None, name
    return {
        f"{target}-{deployment}": generate(supervisor, target)
        for deployment, supervisor in made.items()
        if supervisor is not None
        for target in ("ros1", "ros1-cpp", "ros2", "ros2-cpp")
    }


def long_names(target: str, deployment: Deployment) -> GeneratedFiles:
    """A package of a model whose names, texts and conditions are longer than a line."""
    text = (EXAMPLES / f"{LAYER}.rscd").read_text(encoding="utf-8")
    for name in (
        "LineFollowerLayer",
        "LineDetector",
        "line_found",
        "current_correction",
        "Clearance",
        "obstructed",
        "move",
    ):
        assert re.search(rf"\b{name}\b", text), name
        text = re.sub(rf"\b{name}\b", name + "_of_a_robot_with_names" * 4, text)
    text = text.replace("/line/correction", "/line/correction" + "/of_a_robot_with_names" * 5)
    return generate(supervisor_of(model_of(text), deployment), target, GenerateOptions(package="long_names"))


def courier(target: str) -> GeneratedFiles:
    """A package of a model with services, actions and nested types."""
    return generate(supervisor_of(model_of(COURIER.read_text(encoding="utf-8"))), target)


PACKAGES: dict[str, Callable[[], GeneratedFiles]] = {
    "ros2": lambda: generate(example_supervisor(NAVIGATION), "ros2", GenerateOptions(state_message=StateMessage.BOTH)),
    "ros2-layer": lambda: generate(example_supervisor(LAYER, Deployment.LAYER), "ros2"),
    "ros2-types": lambda: courier("ros2"),
    "ros2-long": lambda: long_names("ros2", Deployment.CONTROLLER),
    "ros2-layer-long": lambda: long_names("ros2", Deployment.LAYER),
    "ros2-cpp": lambda: generate(example_supervisor(MAZE), "ros2-cpp"),
    "ros2-msgs": lambda: generate(example_supervisor(MAZE), "ros2-msgs"),
    "ros1": lambda: generate(example_supervisor(MAZE), "ros1"),
    "ros2-goals": lambda: generate(porter_supervisor(), "ros2"),
    "ros1-goals": lambda: generate(porter_supervisor(), "ros1"),
    "ros1-layer-long": lambda: long_names("ros1", Deployment.LAYER),
}
