"""The registry of targets."""

import importlib.metadata

import pytest

from robosc.targets import (
    GeneratedFiles,
    GenerateOptions,
    TargetInfo,
    UnknownTargetError,
    available_targets,
    generate,
    register,
    registry,
    require_target,
)
from robosc.targets.registry import Target
from support.generated import example_supervisor

BUILT_IN = ["c99", "cif", "promela", "python", "ros1", "ros1-cpp", "ros2", "ros2-cpp", "ros2-msgs"]


pytestmark = pytest.mark.usefixtures("own_registry")


def test_the_built_in_targets_are_listed_without_importing_them() -> None:
    assert [info.name for info in available_targets()] == BUILT_IN
    assert all(info.description for info in available_targets())


def test_the_list_says_what_the_targets_themselves_say() -> None:
    for info in available_targets():
        assert registry._load(info.name).info == info


def test_an_unknown_target_is_one_clear_error() -> None:
    with pytest.raises(UnknownTargetError, match=r"^unknown target 'ros3'; did you mean 'ros2'\?$"):
        require_target("ros3")
    with pytest.raises(UnknownTargetError, match=f"^unknown target 'cobol'; there is {', '.join(BUILT_IN)}$"):
        generate(example_supervisor("line_follower/line_follower"), "cobol")


def test_a_registered_target_is_used() -> None:
    def make(supervisor: object, options: GenerateOptions) -> GeneratedFiles:
        return GeneratedFiles({"name.txt": options.package or "none"})

    register(Target(TargetInfo("text", "a text"), make))
    assert [info.name for info in available_targets()] == [*BUILT_IN, "text"]
    assert generate(example_supervisor("line_follower/line_follower"), "text")["name.txt"] == "none"
    assert (
        generate(example_supervisor("line_follower/line_follower"), "text", GenerateOptions(package="x"))["name.txt"]
        == "x"
    )


def test_a_plug_in_is_found_by_its_entry_point(monkeypatch: pytest.MonkeyPatch) -> None:
    def entry(value: str) -> importlib.metadata.EntryPoint:
        return importlib.metadata.EntryPoint("plug", value, registry.ENTRY_POINT_GROUP)

    def find(value: str) -> None:
        monkeypatch.setattr(registry, "_offered", lambda: importlib.metadata.EntryPoints([entry(value)]))

    find("robosc.targets.python:TARGET")
    assert TargetInfo("plug", "plug-in robosc.targets.python:TARGET") in available_targets()
    assert "line_follower_supervisor.py" in generate(example_supervisor("line_follower/line_follower"), "plug")
    find("json:dumps")
    with pytest.raises(UnknownTargetError, match="plug-in of target 'plug'"):
        generate(example_supervisor("line_follower/line_follower"), "plug")
