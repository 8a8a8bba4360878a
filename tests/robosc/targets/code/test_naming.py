"""Names in generated code are distinct and legal."""

import pytest

from robosc.targets.code.c.naming import CNamer
from robosc.targets.code.naming import Namer, snake_case
from robosc.targets.code.python.naming import PythonNamer


def test_a_name_is_given_once() -> None:
    namer = Namer(("b",))
    assert [namer.name(wish) for wish in ("a", "a", "a", "b", "a.c", "a-c")] == [
        "a",
        "a_2",
        "a_3",
        "b_2",
        "a_c",
        "a_c_2",
    ]


def test_names_of_others_are_avoided_when_they_are_there() -> None:
    others: set[str] = set()
    namer = Namer(hidden=(others,))
    assert namer.name("a") == "a"
    others.add("b")
    assert namer.name("b") == "b_2"


def test_each_language_has_its_own_names() -> None:
    assert [PythonNamer().name(wish) for wish in ("class", "2x", "_x", "print", "match")] == [
        "class_",
        "x2x",
        "x_x",
        "print_",
        "match_",
    ]
    assert CNamer().member("class") == "class_"
    assert len(CNamer().name("x" * 500)) == 120


@pytest.mark.parametrize(
    ("text", "name"),
    [("LineFollower", "line_follower"), ("HTTPServer", "http_server"), ("2x", "robot_2x"), ("", "robot")],
)
def test_snake_case(text: str, name: str) -> None:
    assert snake_case(text) == name
