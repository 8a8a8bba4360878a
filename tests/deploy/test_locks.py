"""Locks of all environments: no release on an index changes what is installed."""

from importlib import metadata
from pathlib import Path

import pytest

from support.locks import installations, read_lock, unmet

TOP = Path(__file__).parents[2]
LOCKS = sorted([TOP / "requirements.lock", *(TOP / "deploy").glob("requirements-*.txt")])

COVERAGE = f"""\
# pip-compile --generate-hashes {{options}}
coverage{{extra}}==7.17.3 --hash=sha256:{"0" * 64}
    # via pytest-cov
pytest-cov==7.0.0 \\
    --hash=sha256:{"1" * 64}
"""
"""Lock file that kept every change from landing for a day, when 7.17.4 was released."""

NEEDS = {"pytest-cov": ["coverage[toml]>=7.10.6", 'hunter; extra == "testing"'], "coverage": []}


@pytest.mark.parametrize("file", LOCKS, ids=lambda file: file.stem)
def test_a_lock_leaves_no_choice(file: Path) -> None:
    lock = read_lock(file.read_text("utf-8"))
    assert lock.requirements and lock.faults == ()


def test_the_lock_has_all_that_its_packages_need() -> None:
    lock = read_lock((TOP / "requirements.lock").read_text("utf-8"))
    assert list(unmet(lock, metadata.requires)) == []


def test_an_extra_that_is_not_spelt_out_is_found() -> None:
    stripped = read_lock(COVERAGE.format(options="--strip-extras", extra=""))
    assert stripped.faults == (
        "extras are stripped: whoever asks for one of them gets the newest release of the package",
    )
    assert list(unmet(stripped, NEEDS.get)) == [
        "pytest-cov needs coverage[toml]>=7.10.6, whose extra is not locked: coverage==7.17.3"
    ]
    whole = read_lock(COVERAGE.format(options="--no-strip-extras", extra="[toml]"))
    assert whole.faults == () and list(unmet(whole, NEEDS.get)) == []


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("a>=1 --hash=sha256:" + "0" * 64, "a has no single version"),
        ("a==1.* --hash=sha256:" + "0" * 64, "a has no single version"),
        ("a==1", "a has no hash"),
        ("a==1 --hash=md5:" + "0" * 32, "a has no hash"),
        ("-r others.txt", "an option is not a requirement: -r others.txt"),
    ],
)
def test_what_a_release_could_change_is_found(text: str, fault: str) -> None:
    assert read_lock(text).faults == (fault,)


@pytest.mark.parametrize(
    ("need", "sentence"),
    [("c", "a needs c, which is not locked"), ("b>2", "a needs b>2, and b==2 is locked"), ("b>1", None)],
)
def test_a_package_that_lacks_something_is_found(need: str, sentence: str | None) -> None:
    lock = read_lock("a[x]==1\nb==2\n")
    assert list(unmet(lock, {"a": [f'{need}; extra == "x"', 'd; extra == "y"']}.get)) == [sentence] * bool(sentence)


def test_every_installation_takes_a_whole_lock_or_one_file() -> None:
    """Requirements of packages are followed nowhere, and what comes from an index has its hash in a lock."""
    scripts = [
        TOP / "Makefile",
        TOP / ".ci" / "run",
        *(TOP / "deploy").rglob("*.sh"),
        *(TOP / "deploy").rglob("*.Dockerfile"),
    ]
    commands = [command for file in scripts for command in installations(file.read_text("utf-8"))]
    assert len(commands) > 10
    for command in commands:
        assert "--no-deps" in command, command
        # A lock, or what was made of one (a wheel, the source of a package that was fetched by its hash), or our own.
        own = (".whl", "--editable .", " .", '"$source"')
        assert "--require-hashes" in command or command.endswith(own), command
        # Builds use locked tools, not those of the day.
        assert not {"--no-build-isolation", "--no-build", "--only-binary", "--no-index", '"$@"'}.isdisjoint(
            command.split()
        ), command
