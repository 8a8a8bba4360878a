"""Notices of generated ROS packages; ament_copyright itself runs in acceptance/."""

from pathlib import PurePosixPath

import pytest

from robosc._version import YEAR
from robosc.targets import GeneratedFiles, GenerateOptions, PackageMetadata, generate
from support.generated import example_supervisor

JANE = PackageMetadata("Jane Doe", "jane@example.org", "Apache-2.0")
TARGETS = ("ros1", "ros1-cpp", "ros2", "ros2-cpp")
SOURCES = frozenset({".c", ".cpp", ".h", ".hpp", ".py"})


def package(target: str, metadata: PackageMetadata) -> GeneratedFiles:
    return generate(example_supervisor("maze_solver/maze_solver"), target, GenerateOptions(metadata=metadata))


@pytest.mark.parametrize("target", TARGETS)
def test_every_source_file_begins_with_copyright_and_licence(target: str) -> None:
    files = package(target, JANE)
    sources = [path for path in files if PurePosixPath(path).suffix in SOURCES]
    assert len(sources) > 15
    for path in sources:
        mark = "#" if path.endswith(".py") else "//"
        notice = (
            f'{mark} Copyright {YEAR} Jane Doe\n{mark}\n{mark} Licensed under the Apache License, Version 2.0 (the "'
        )
        assert files[path].startswith(notice), path
    assert "LICENSE" not in files


def test_the_first_line_of_a_program_stays_the_first() -> None:
    files = package("ros1", JANE)
    assert files.executables
    for path in files.executables:
        assert files[path].startswith(f"#!/usr/bin/python3\n# Copyright {YEAR} Jane Doe\n#\n"), path


@pytest.mark.parametrize("license_", ["MIT", "BSD-3-Clause"])
def test_a_licence_that_a_notice_refers_to_is_there(license_: str) -> None:
    files = package("ros2", PackageMetadata(license=license_, copyright="2024, 2026 Jane Doe"))
    assert "license that can be found in the LICENSE file or at" in files["setup.py"]
    assert "\nCopyright (c) 2024, 2026 Jane Doe\n" in files["LICENSE"]
    assert "THIS SOFTWARE IS PROVIDED" in files["LICENSE"] or "THE SOFTWARE IS PROVIDED" in files["LICENSE"]


def test_a_licence_that_the_linter_does_not_know_is_named() -> None:
    own = PackageMetadata(license="Our/../Own")
    files = package("ros2", own)
    assert files["setup.py"].startswith(f"# Copyright {YEAR} Maintainer\n#\n# License: Our/../Own\n\n#")
    assert "@pytest.mark.skip(" in files["test/test_copyright.py"]
    assert "@pytest.mark.skip(" not in package("ros2", JANE)["test/test_copyright.py"]
    for metadata, is_known in ((own, False), (JANE, True)):
        files = package("ros2-cpp", metadata)
        assert ("set(ament_cmake_copyright_FOUND TRUE)" in files["CMakeLists.txt"]) is not is_known
        assert ("<test_depend>ament_cmake_copyright</test_depend>" in files["package.xml"]) is is_known


def test_a_long_name_makes_no_line_of_python_too_long() -> None:
    files = package("ros2", PackageMetadata("Jane " * 39 + "Doe", "jane@example.org"))
    assert max(map(len, files["setup.py"].splitlines()[:5])) <= 99
