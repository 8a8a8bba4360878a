"""Linters of ROS on generated packages: those of Jazzy, and those that Debian has."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from robosc.targets import GenerateOptions, PackageMetadata, generate, write_files
from support.ament_lint import EXAMPLE_ROBOTS, MAZE, PACKAGES, example_packages
from support.colcon import colcon_program
from support.generated import example_supervisor
from support.own_tests import own_tests

# A Python with ROS 2 hands these variables down to programs that have their own.
HANDED_DOWN = ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE", "PYTHONPATH")

OF_JAZZY = ("ament_flake8", "ament_pep257")
OF_DEBIAN = ("ament_copyright", "ament_lint_cmake", "ament_xmllint")
NOTHING_TO_CHECK = ("0 files checked", "No files found")

# Licences by their names in package.xml, with the linter's own names.
LICENSES = {
    "Apache-2.0": "apache2",
    "BSD-2-Clause": "bsd_2clause",
    "BSD-3-Clause": "bsd_3clause",
    "BSL-1.0": "boost1",
    "GPL-3.0-or-later": "gplv3",
    "LGPL-3.0-or-later": "lgplv3",
    "MIT": "mit",
    "MIT-0": "mit0",
}


def program(linter: str) -> Path:
    """The program of a linter; skips the test where there is none."""
    if linter in OF_JAZZY:
        return colcon_program().parent / "bin" / linter
    found = shutil.which(linter)
    if found is None:
        pytest.skip(f"{linter} is not installed (Debian: python3-{linter.replace('_', '-')})")
    return Path(found)


def linted(linter: str, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The outcome of a linter of ROS in a folder."""
    environment = {name: value for name, value in os.environ.items() if name not in HANDED_DOWN}
    return subprocess.run(
        [program(linter), *arguments], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


@pytest.mark.ros2
@pytest.mark.parametrize(
    ("linter", "name"),
    [
        (linter, name)
        for linter in (*OF_JAZZY, *OF_DEBIAN)
        for name in PACKAGES
        # ROS 1 has no linter of CMake, and long names of a model make long lines.
        if linter != "ament_lint_cmake" or not name.startswith("ros1")
    ],
)
def test_a_linter_finds_nothing_in_a_generated_package(linter: str, name: str, tmp_path: Path) -> None:
    write_files(PACKAGES[name](), tmp_path)
    done = linted(linter, tmp_path)
    output = done.stdout + done.stderr
    # A package of messages has no Python, one in Python has no CMake.
    assert done.returncode == 0 or any(words in output for words in NOTHING_TO_CHECK), output
    if linter == "ament_xmllint":
        assert "File 'package.xml' is valid" in output
        launch = [str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.launch")]
        assert not launch or linted(linter, tmp_path, *launch).returncode == 0


@pytest.mark.ros2
@pytest.mark.parametrize("name", EXAMPLE_ROBOTS)
def test_a_linter_finds_nothing_in_any_package_of_an_example(name: str, tmp_path: Path) -> None:
    for kind, files in example_packages(name).items():
        write_files(files, tmp_path / kind)
    for linter in OF_JAZZY:
        done = linted(linter, tmp_path)
        assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.ros2
@pytest.mark.parametrize("name", EXAMPLE_ROBOTS)
def test_every_package_of_an_example_passes_its_own_tests_with_linters(name: str, tmp_path: Path) -> None:
    python = str(colcon_program().parent / "bin" / "python")
    for kind, files in example_packages(name).items():
        if any(path.startswith("test/test_") and path.endswith(".py") for path in files):
            write_files(files, tmp_path / kind)
            expected = ("test_flake8", "test_pep257") if kind.startswith("ros2") else ()
            done = own_tests(tmp_path / kind, ("-m", "pytest", "-v", "-p", "no:cacheprovider", "test"), python)
            assert done.returncode == 0, done.stdout
            for test in expected:
                assert f"::{test} PASSED" in done.stdout


@pytest.mark.ros2
@pytest.mark.parametrize("target", ["ros2", "ros2-cpp"])
@pytest.mark.parametrize("license_", LICENSES)
def test_the_linter_knows_the_licence_of_every_file(license_: str, target: str, tmp_path: Path) -> None:
    metadata = PackageMetadata("Zo\u00eb Doe", "zoe@example.org", license_)
    write_files(generate(example_supervisor(MAZE), target, GenerateOptions(metadata=metadata)), tmp_path)
    done = linted("ament_copyright", tmp_path, "--verbose")
    assert done.returncode == 0, done.stdout + done.stderr
    copyrights = [line.partition(": ")[2] for line in done.stdout.splitlines() if "copyright=" in line]
    assert len(copyrights) > 15
    assert {line.partition(", license=")[2] for line in copyrights} == {LICENSES[license_]}
    assert all(line.startswith("copyright=Zo\u00eb Doe (2") for line in copyrights)


@pytest.mark.smoke
@pytest.mark.ros2
@pytest.mark.parametrize("license_", ["MIT", "BSD-3-Clause"])
def test_the_linter_knows_the_file_of_a_licence(license_: str, tmp_path: Path) -> None:
    metadata = PackageMetadata(license=license_)
    write_files(generate(example_supervisor(MAZE), "ros2", GenerateOptions(metadata=metadata)), tmp_path)
    (tmp_path / ".git").mkdir()  # Only in the root of a repository does it ask for that file.
    assert f"LICENSE: {LICENSES[license_]}\n" in linted("ament_copyright", tmp_path, "--verbose").stdout


@pytest.mark.ros2
@pytest.mark.parametrize("linter", OF_JAZZY)
def test_a_linter_finds_what_is_wrong(linter: str, tmp_path: Path) -> None:
    (tmp_path / "wrong.py").write_text('def wrong():\n    """The wrong one"""\n' + "    return " + "1 + " * 40 + "1\n")
    assert linted(linter, tmp_path).returncode != 0


@pytest.mark.ros2
@pytest.mark.parametrize("linter", OF_DEBIAN)
def test_a_linter_of_debian_finds_what_is_wrong(linter: str, tmp_path: Path) -> None:
    write_files(PACKAGES["ros2-cpp"](), tmp_path)
    for path, text, other in (
        ("src/node.cpp", "// Copyright", "// Written"),
        ("CMakeLists.txt", "project(", "PROJECT (   "),
        ("package.xml", "<maintainer ", "<maintainer unknown='yes' "),
    ):
        file = tmp_path / path
        file.write_text(file.read_text().replace(text, other))
    assert linted(linter, tmp_path).returncode != 0
