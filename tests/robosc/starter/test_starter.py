"""The files of a new robot: sound, complete and instructive whatever the robot is called."""

import re

import pytest

from robosc.certification import OutcomeStatus, make_supervisor
from robosc.formatting import format_text
from robosc.language.words import RESERVED_WORDS
from robosc.model.check import check
from robosc.source import Bundle, SourceFile
from robosc.starter import MAXIMUM_STEM, InvalidNameError, Starter, make_starter
from robosc.targets import generate

NAMES = (
    "Courier", "_", "__x", "R", "r2D2", "HTTPServer", "Base", "Velocity", "EmergencyStop", "laser_scan", "FAR", "move",
    "class", "__init__", "Lidar", "value_", "constant", "always", "x" * MAXIMUM_STEM, "X" * MAXIMUM_STEM,
)  # fmt: skip

REFUSED = (
    "", " ", "../x", "R;rm", "R robot", "Ü", "Robot\n", "1st", "^state", "$robot", "${robot}", "{{ x }}", "a-b", "a.b",
    "x" * 300, "Ab" * 100, "R\x00", "'; drop", "\ud800", "Ｒ", "٣", *sorted(RESERVED_WORDS),
)  # fmt: skip


def bundle_of(starter: Starter, main: str | None = None) -> Bundle:
    """The bundle that a run on the starter's folder finds."""
    name = main or starter.model
    sources = [SourceFile(file, text) for file, text in starter.files.items() if file.endswith(".rscd")]
    others = tuple(item for item in sources if item.name != name)
    return Bundle(next(item for item in sources if item.name == name), others)


@pytest.mark.parametrize("name", NAMES)
def test_model_and_library_have_no_findings(name: str) -> None:
    starter = make_starter(name)
    found = check(bundle_of(starter))
    assert (found.model_or_raise().name, found.diagnostics) == (name, ())
    assert check(bundle_of(starter, f"{starter.stem}_parts.rscd")).diagnostics == ()


def test_velocities_with_a_stamp_say_what_those_without_one_say() -> None:
    starter = make_starter("StampedVelocity", is_stamped=True)
    made = make_supervisor(bundle_of(starter))
    assert (made.status, made.diagnostics) == (OutcomeStatus.SUPERVISOR, ())
    assert made.supervisor is not None
    assert check(bundle_of(starter, f"{starter.stem}_parts.rscd")).diagnostics == ()
    files = generate(made.supervisor, "ros2")
    assert "TwistStamped" in starter.files["README.md"] and "geometry_msgs" in files["package.xml"]
    for item in made.supervisor.model.communications:
        if item.identifier == "/cmd_vel":
            assert (item.interface and item.interface.type, item.frame) == ("TwistStamped", "base_link")
    plain = make_starter("StampedVelocity").files
    changed = [name for name, text in starter.files.items() if text != plain[name]]
    assert changed == list(plain)


@pytest.mark.parametrize("is_stamped", [False, True])
@pytest.mark.parametrize("name", ["Courier", "_", "class"])
def test_the_files_are_in_canonical_layout(name: str, is_stamped: bool) -> None:
    for file, text in make_starter(name, is_stamped=is_stamped).files.items():
        if file.endswith(".rscd"):
            assert format_text(text) == text


@pytest.mark.parametrize("name", ["Courier", "_", "class", "X" * MAXIMUM_STEM])
def test_there_is_a_supervisor_without_findings_and_packages(name: str) -> None:
    made = make_supervisor(bundle_of(make_starter(name)))
    assert (made.status, made.diagnostics) == (OutcomeStatus.SUPERVISOR, ())
    assert made.supervisor is not None
    for target in ("python", "ros2"):
        assert generate(made.supervisor, target)


def test_the_supervisor_adds_what_the_comments_promise() -> None:
    supervisor = make_supervisor(bundle_of(make_starter("Courier"))).supervisor
    assert supervisor is not None
    assert {item.event for item in supervisor.added} == {"move.request", "turn.request", "light_off.request"}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_name_is_refused_in_one_line(name: str) -> None:
    with pytest.raises(InvalidNameError) as raised:
        make_starter(name)
    message = str(raised.value)
    assert message.isprintable() and message.isascii() and len(message) < 200


def test_the_files_are_named_after_the_robot() -> None:
    starter = make_starter("LineFollower")
    assert list(starter.files) == ["line_follower.rscd", "line_follower_parts.rscd", "README.md"]
    assert starter.model == "line_follower.rscd" and starter.stem == "line_follower"


def test_every_name_is_filled_in_and_nothing_else() -> None:
    for text in make_starter("Courier").files.values():
        assert "$" not in text and text.endswith("\n")
        assert all(line == line.rstrip() and len(line) <= 120 for line in text.split("\n"))
    one, other = make_starter("Courier").files, make_starter("Rover").files
    renamed = {
        name.replace("courier", "rover"): text.replace("Courier", "Rover").replace("courier", "rover")
        for name, text in one.items()
    }
    assert renamed == dict(other)


def test_the_files_show_every_word_of_the_language() -> None:
    starter = make_starter("Courier")
    shown = set(re.findall(r"\w+", "".join(text for name, text in starter.files.items() if name.endswith(".rscd"))))
    assert shown >= RESERVED_WORDS
    extensions = {"constant", "always", "never", "qos", "depth", "max_age", "stamped", "clamp", "all", "then"}
    assert shown >= extensions


def test_the_readme_names_every_topic() -> None:
    starter = make_starter("Courier")
    model = check(bundle_of(starter)).model_or_raise()
    listed = set(re.findall(r"^\| `(/\w+)`", starter.files["README.md"], re.MULTILINE))
    assert listed == {item.identifier for item in model.communications}
