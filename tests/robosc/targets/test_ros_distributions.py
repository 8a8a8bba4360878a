"""Distributions that packages say they fit: the checks of the model are the twin."""

from pathlib import Path

import pytest
from msgspec.structs import replace

from robosc.interfaces import DISTRIBUTIONS
from robosc.model.check import check
from robosc.model.structure import Deployment
from robosc.source import Bundle, SourceFile
from robosc.targets import generate
from robosc.targets.ros.distributions import fits
from robosc.targets.ros.package import ROS2_ERRORS
from support.corpus import bundle_of_case, cases
from support.execution import supervisor_of
from support.models import model_of

MODEL = """robot R {
    interface i use TYPE
    datatype object Inner { x: double }
    datatype object O { PROPERTIES }
    component C { outgoing message m with identifier: "/m", type: O links i }
}"""


def text_of(type_: str, properties: str) -> str:
    return MODEL.replace("TYPE", type_).replace("PROPERTIES", properties)


TEXTS = {
    "pose": text_of("Pose2D from geometry_msgs", "theta: double"),
    "waypoint": text_of("WaypointStatus from nav2_msgs", "error_msg: string"),
    "trajectory": text_of("Trajectory from nav_msgs", ""),
    "stamp": text_of("TransitionEvent from lifecycle_msgs", "timestamp: integer"),
    "scan": text_of("LaserScan from sensor_msgs", "ranges: array(double)"),
    "unknown": text_of("Own from own_msgs", "x: double"),
}


def lacking(text: str) -> dict[str, tuple[str, ...]]:
    return {item.codename: texts for item, texts in fits(model_of(text), Deployment.CONTROLLER)}


def test_what_came_and_went_is_named() -> None:
    assert lacking(TEXTS["pose"]) == {
        "humble": (),
        "jazzy": (),
        "kilted": (),
        "lyrical": ("no geometry_msgs/Pose2D",),
    }
    assert lacking(TEXTS["waypoint"])["jazzy"] == ("no nav2_msgs/WaypointStatus",)
    assert lacking(TEXTS["stamp"])["lyrical"] == ("no field timestamp in lifecycle_msgs/TransitionEvent",)
    assert set(lacking(TEXTS["unknown"]).values()) == {()}


@pytest.mark.parametrize("name", TEXTS)
def test_the_check_against_a_distribution_finds_the_same(name: str) -> None:
    found = lacking(TEXTS[name])
    for distribution in (item for item in DISTRIBUTIONS if item.version == 2):
        bundle = Bundle(SourceFile("model.rscd", TEXTS[name]), distribution=distribution.codename)
        codes = {item.code for item in check(bundle).diagnostics} - {"needless-property"}
        if "needless-property" in {item.code for item in check(bundle).diagnostics}:
            continue
        assert bool(codes & ROS2_ERRORS) is bool(found[distribution.codename]), (distribution.codename, codes)


@pytest.mark.parametrize("case", [case for case in cases() if not case.startswith("errors/")])
def test_the_check_of_a_model_of_the_corpus_finds_the_same(case: str) -> None:
    bundle = replace(bundle_of_case(case), interfaces=())
    model = check(bundle).model
    if model is None:
        return
    for distribution, texts in fits(model, Deployment.CONTROLLER):
        found = check(replace(bundle, distribution=distribution.codename)).diagnostics
        named = {item.message for item in found if f"of {distribution.title} has no" in item.message}
        # Limits of one kind of nodes have nothing to do with the distribution.
        assert {text for text in named if "; it fits ROS 2" in text} == set() or texts, (distribution.codename, named)
        assert not texts or named, (distribution.codename, texts)


def test_the_page_of_a_package_has_the_table() -> None:
    for target in ("ros2", "ros2-cpp"):
        page = generate(supervisor_of(model_of(TEXTS["pose"]), Deployment.CONTROLLER), target)["README.md"]
        assert "| Jazzy | yes |\n| Kilted | yes |\n| Lyrical | no: no geometry_msgs/Pose2D |\n" in page
        assert page.count("## Distributions") == 1


def test_the_documentation_has_the_same_list() -> None:
    text = (Path(__file__).parents[3] / "docs" / "generating.md").read_text(encoding="utf-8")
    rows = [f"| {item.title} | {item.python} | {item.tests} |\n" for item in DISTRIBUTIONS]
    assert all(row in text for row in rows)
