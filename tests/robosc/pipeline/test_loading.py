"""Models that are loaded: as the command line finds them, from a text, and what is refused."""

import errno
import pickle
from pathlib import Path

import pytest

import robosc
from robosc.language import load_bundle
from robosc.source import Bundle
from support.models import EXAMPLES, bundle_of

NAVIGATION = EXAMPLES / "navigation" / "navigation.rscd"
ROBOT = "robot R {\n component Base from Shared import Base\n}"
SHARED = 'library Shared { component Base { outgoing message m with identifier: "/m", type: double } }'


def test_a_loaded_model_is_the_bundle_of_the_command_line() -> None:
    for path in (NAVIGATION, str(NAVIGATION)):
        model = robosc.load(path)
        expected = load_bundle(NAVIGATION)
        assert isinstance(model, Bundle)
        assert (model.main, model.libraries, model.digest) == (expected.main, expected.libraries, expected.digest)
    assert repr(model) == f"<model navigation.rscd: {len(expected.main.text.splitlines())} lines>"
    assert str(model) == expected.main.text
    assert pickle.loads(pickle.dumps(model)) == model
    with pytest.raises(AttributeError, match="immutable"):
        model.main = expected.main  # type: ignore[misc]


def test_the_page_of_a_robot_and_the_text_of_one_with_errors() -> None:
    assert robosc.load(NAVIGATION)._repr_markdown_().startswith("# `Navigation`\n")
    assert robosc.load(text="robot R {")._repr_markdown_() == "```robosc\nrobot R {\n```\n"


def test_libraries_are_found_where_the_command_line_finds_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "shared.rscd").write_text(SHARED)
    file = tmp_path / "here" / "robot.rscd"
    file.parent.mkdir()
    file.write_text(ROBOT)
    assert robosc.check(file).has_errors
    with_library = robosc.load(file, library_paths=[str(elsewhere)])
    assert not robosc.check(with_library).has_errors
    assert repr(with_library) == "<model robot.rscd: 3 lines, libraries ../elsewhere/shared.rscd>"
    assert not robosc.check(robosc.load(text=ROBOT, library_paths=[elsewhere])).has_errors
    # A text looks for libraries as a file of the current folder does.
    monkeypatch.chdir(elsewhere)
    assert not robosc.check(robosc.load(text=ROBOT)).has_errors


def test_interfaces_come_from_the_folders_that_are_given(tmp_path: Path) -> None:
    message = tmp_path / "my_msgs" / "msg" / "Level.msg"
    message.parent.mkdir(parents=True)
    message.write_text("float64 depth\n")
    text = (
        "robot R { interface level use Level from my_msgs "
        'component C { outgoing message m with identifier: "/m", type: double links level } }'
    )
    assert robosc.load(text=text).interfaces == ()
    (found,) = robosc.load(text=text, interface_paths=(tmp_path,)).interfaces
    assert (found.name, found.text) == ("my_msgs/msg/Level.msg", "float64 depth\n")


def test_a_bundle_of_the_core_is_taken_as_well() -> None:
    assert not robosc.check(bundle_of(ROBOT, shared=SHARED)).has_errors


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("nothing.rscd", "there is no file nothing.rscd"),
        (EXAMPLES, "is a folder, not a model's file"),
        ("", "the name of a file or folder is empty"),
        ("robot R { }", "this is the text of a model, not the path of one: load it with robosc.load(text=...)"),
    ],
)
def test_what_is_no_file_is_reported(path: str | Path, message: str) -> None:
    for use in (robosc.load, robosc.check, robosc.synthesize):
        with pytest.raises(robosc.FileAccessError) as caught:
            use(path)
        assert str(caught.value).endswith(message)
        assert isinstance(caught.value, OSError)


def test_what_is_no_folder_is_reported() -> None:
    for name in ("library", "interface"):
        with pytest.raises(robosc.FileAccessError, match=f"there is no {name} folder nowhere"):
            robosc.load(NAVIGATION, **{f"{name}_paths": ["nowhere"]})  # type: ignore[arg-type]


def test_a_file_that_cannot_be_read_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*arguments: object) -> object:
        raise PermissionError(errno.EACCES, "Permission denied", "secret.rscd")

    monkeypatch.setattr(Path, "open", refused)
    with pytest.raises(robosc.FileAccessError, match=r"^cannot read secret\.rscd: Permission denied$"):
        robosc.load(NAVIGATION)


def test_what_is_no_text_is_a_finding(tmp_path: Path) -> None:
    file = tmp_path / "latin.rscd"
    file.write_bytes(b"robot R { } // \xe9")
    with pytest.raises(robosc.LanguageError, match=r"latin\.rscd:1:16: error: the file is not UTF-8 text"):
        robosc.load(file)
    with pytest.raises(robosc.LanguageError, match="not UTF-8"):
        robosc.load(text="// \udce9")


def test_wrong_use_is_a_type_error() -> None:
    with pytest.raises(TypeError, match="either the path of a model or text="):
        robosc.load()
    with pytest.raises(TypeError, match="either the path of a model or text="):
        robosc.load(NAVIGATION, text="robot R { }")
    with pytest.raises(TypeError, match=r"a model is the path of a file or what robosc\.load returns, not int: 3"):
        robosc.check(3)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="'lair' is not a valid Deployment"):
        robosc.SynthesisOptions(deployment="lair")  # type: ignore[arg-type]
    assert robosc.SynthesisOptions(deployment="layer").deployment is robosc.Deployment.LAYER  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="maximum_nodes is 0, and must be at least 1"):
        robosc.synthesize(NAVIGATION, robosc.SynthesisOptions(maximum_nodes=0))
    with pytest.raises(ValueError, match=r"condition_seconds is -1\.0, and must be at least 0"):
        robosc.synthesize(NAVIGATION, robosc.SynthesisOptions(condition_seconds=-1.0))
