"""The page about Nav2: its models are sound, and its tables say what the definitions that come with RoboSC say."""

import re
from pathlib import Path

import pytest

from robosc.interfaces import DISTRIBUTIONS, Part
from robosc.interfaces.catalogue import Catalogue, FoundInterfaces
from robosc.model.check import check
from robosc.source import Bundle, SourceFile

PAGE = (Path(__file__).parents[1] / "docs" / "nav2.md").read_text(encoding="utf-8")
MODELS = tuple(re.findall(r"^```robosc\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL))
CATALOGUES = {item.title.rpartition(" ")[2]: Catalogue(item, FoundInterfaces({})) for item in DISTRIBUTIONS}
SINCE = ("Humble", "Jazzy", "Kilted", "Lyrical")


def parts(distribution: str, kind: str, type_: str) -> tuple[Part, ...]:
    found = CATALOGUES[distribution].definition(kind, "nav2_msgs", type_)
    assert found is not None, (distribution, type_)
    return found


@pytest.mark.parametrize("model", MODELS)
def test_its_models_have_no_findings(model: str) -> None:
    assert check(Bundle(SourceFile("model.rscd", model))).diagnostics == ()


def test_its_codes_are_those_of_the_definitions() -> None:
    rows = re.findall(r"^\| (`[^|]+) \| (\d[^|]+) \| (\w+)(?: and later)? \|$", PAGE, flags=re.MULTILINE)
    assert len(rows) == 6
    for actions, codes, since in rows:
        written = [{*map(int, pair)} for pair in re.findall(r"(\d+) to (\d+)", codes)]
        written = written or [{*map(int, re.findall(r"\d{3,}", codes))}]
        for position, action in enumerate(re.findall(r"\w+", actions)):
            for distribution in SINCE[SINCE.index(since) :]:
                known = {int(value) for value in parts(distribution, "action", action)[1].constants.values()}
                assert written[min(position, len(written) - 1)] <= known, (distribution, action)


def test_its_differences_are_those_of_the_definitions() -> None:
    for distribution in SINCE:
        result = parts(distribution, "action", "NavigateToPose")[1].fields
        assert ("error_code" in result) is (distribution != "Humble")
        poses = parts(distribution, "action", "NavigateThroughPoses")[0].fields["poses"].type_text
        assert (poses == "nav_msgs/Goals") is (distribution in ("Kilted", "Lyrical"))
        feedback = parts(distribution, "action", "FollowPath")[2].fields
        assert ("tracking_feedback" in feedback) is (distribution == "Lyrical")
        answer = parts(distribution, "srv", "ClearEntireCostmap")[1].fields
        assert ("success" in answer) is (distribution == "Lyrical")
        missed = parts(distribution, "action", "FollowWaypoints")[1].fields["missed_waypoints"].type_text
        assert missed.rpartition("/")[2] in PAGE
