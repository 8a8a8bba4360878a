"""`robosc new` and `robosc doc` as a user runs them."""

import json
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

from robosc.cli import new
from robosc.cli.main import main
from robosc.cli.output import UsageError
from support.commands import run_json
from support.models import EXAMPLES
from support.pages import read_page

LINE_FOLLOWER = EXAMPLES / "line_follower" / "line_follower.rscd"
FILES = {"one.rscd": "1\n", "two.rscd": "2\n", "README.md": "3\n"}


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def everything(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*"))


# new


def test_new_makes_a_folder_named_after_the_robot(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "LineFollower"]) == 0
    files = ["line_follower/line_follower.rscd", "line_follower/line_follower_parts.rscd", "line_follower/README.md"]
    assert everything(tmp_path) == sorted(["line_follower", *files])
    captured = capsys.readouterr()
    assert captured.err == "" and captured.out.split("\n")[:5] == [*files, "", "Next:"]


@pytest.mark.parametrize("name", ["Courier", "_", "HTTPServer", "Base", "class", "x" * 200])
def test_what_new_makes_passes_every_command(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", name, "--folder", "a/my robot"]) == 0
    model = str(next(path for path in Path("a/my robot").glob("*.rscd") if not path.stem.endswith("_parts")))
    capsys.readouterr()
    assert main(["check", "--strict", model]) == 0
    assert capsys.readouterr().out == f"{model}: no findings\n"
    assert main(["synth", model, "-o", "x.rsup"]) == 0
    for target, chosen in (("python", ()), ("ros2", ("--maintainer", "Jane Doe <jane@example.org>"))):
        assert main(["generate", model, "--target", target, "-o", f"out_{target}", *chosen]) == 0
    assert main(["doc", model, "-o", "page.md"]) == 0
    assert capsys.readouterr().err == ""
    assert read_page(Path("page.md").read_text(encoding="utf-8"))[0].title == name


@pytest.mark.parametrize(
    ("words", "sourced", "is_stamped"),
    [
        ([], "", False),
        ([], "jazzy", False),
        ([], "kilted", True),
        ([], "rolling", False),
        (["--distribution", "lyrical"], "jazzy", True),
        (["--distribution", "humble"], "kilted", False),
        (["--stamped"], "jazzy", True),
        (["--no-stamped", "--distribution", "lyrical"], "", False),
    ],
)
def test_velocities_are_sent_as_the_robots_of_the_distribution_take_them(
    words: list[str],
    sourced: str,
    is_stamped: bool,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("ROS_DISTRO", sourced)
    assert main(["new", "Rover", *words]) == 0
    assert ("TwistStamped" in Path("rover/rover_parts.rscd").read_text(encoding="utf-8")) is is_stamped
    capsys.readouterr()
    assert main(["check", "--strict", "rover/rover.rscd"]) == 0


@pytest.mark.parametrize("folder", ["my robot", "-o", "'quoted'"])
def test_the_next_commands_are_ready_for_a_shell(folder: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "Courier", f"--folder={folder}"]) == 0
    lines = capsys.readouterr().out.partition("Next:\n")[2].splitlines()
    assert len(lines) == 4
    for line in lines:
        program, *arguments = shlex.split(line)
        assert program == "robosc"
        assert main(arguments) == 0


def test_new_in_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "Courier", "--folder", "here", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert list(document) == ["robot", "folder", "files", "next"]
    assert (document["robot"], document["folder"]) == ("Courier", "here")
    assert document["files"] == ["here/courier.rscd", "here/courier_parts.rscd", "here/README.md"]
    assert document["next"][0] == "robosc check here/courier.rscd"


@pytest.mark.parametrize("name", ["../x", "state", "R;rm", "Röbot", "x" * 300, "", "R\n", "a/b", "^state", "\udcff"])
def test_new_refuses_what_is_no_name(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", name]) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.startswith("robosc: ") and captured.err.count("\n") == 1
    assert everything(tmp_path) == []


@pytest.mark.parametrize("taken", ["courier.rscd", "courier_parts.rscd", "README.md"])
def test_new_overwrites_nothing(taken: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path(taken).write_text("mine", encoding="utf-8")
    assert main(["new", "Courier", "--folder", "."]) == 2
    assert capsys.readouterr().err == f"robosc: . already has {taken}; nothing was written\n"
    assert everything(tmp_path) == [taken] and Path(taken).read_text(encoding="utf-8") == "mine"


def test_new_follows_no_link_that_leads_nowhere(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("README.md").symlink_to("elsewhere.md")
    assert main(["new", "Courier", "--folder", "."]) == 2
    assert capsys.readouterr().err == "robosc: . already has README.md; nothing was written\n"
    assert everything(tmp_path) == ["README.md"]


def test_new_needs_a_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("file").write_text("", encoding="utf-8")
    for folder in ("file", "file/inner"):
        assert main(["new", "Courier", "--folder", folder]) == 2
        captured = capsys.readouterr().err
        assert captured.startswith("robosc: cannot write file") and captured.endswith("; nothing was written\n")
    assert everything(tmp_path) == ["file"]


def _full() -> None:
    raise OSError(28, "No space left on device")


def _interrupted() -> None:
    raise KeyboardInterrupt


@pytest.mark.parametrize(("fail", "error"), [(_full, UsageError), (_interrupted, KeyboardInterrupt)])
@pytest.mark.parametrize("reached", [0, 1, 2])
def test_new_writes_all_files_or_none(
    fail: Callable[[], None],
    error: type[BaseException],
    reached: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    Path("there").mkdir()
    usual, written = new._create, 0

    def create(path: Path, text: str, made: list[Path]) -> None:
        nonlocal written
        usual(path, text, made)
        if written == reached:
            fail()
        written += 1

    monkeypatch.setattr(new, "_create", create)
    with pytest.raises(error):
        new.write_new(FILES, Path("there/a/b"))
    assert everything(tmp_path) == ["there"]


def test_new_never_touches_a_file_that_comes_in_between(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    usual = new._make_folders

    def make_folders(folder: Path, made: list[Path]) -> None:
        usual(folder, made)
        (folder / "two.rscd").write_text("somebody's", encoding="utf-8")

    monkeypatch.setattr(new, "_make_folders", make_folders)
    with pytest.raises(UsageError, match=r"two\.rscd: File exists; nothing was written"):
        new.write_new(FILES, Path("a"))
    assert everything(tmp_path) == ["a", "a/two.rscd"]
    assert Path("a/two.rscd").read_text(encoding="utf-8") == "somebody's"


# doc


def test_doc_prints_the_page_or_writes_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doc", str(LINE_FOLLOWER)]) == 0
    printed = capsys.readouterr().out
    assert read_page(printed)[0].title == "LineFollower"
    assert main(["doc", str(LINE_FOLLOWER), "-o", "page.md"]) == 0
    assert capsys.readouterr().out == "page.md\n"
    assert Path("page.md").read_text(encoding="utf-8") == printed
    status, document = run_json(capsys, "doc", str(LINE_FOLLOWER))
    assert (status, document["page"], document["file"], document["errors"]) == (0, printed, None, 0)


def test_doc_prints_warnings_and_still_makes_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    Path("r.rscd").write_text("robot R { component C { service s with request: none, response: none } }", "utf-8")
    assert main(["doc", "r.rscd"]) == 1
    assert "[links-required]" in capsys.readouterr().err
    Path("r.rscd").write_text("robot R { }", "utf-8")
    assert main(["doc", "r.rscd"]) == 0
    captured = capsys.readouterr()
    assert "[empty-model]" in captured.err and "empty-model" in captured.out


def test_doc_of_a_model_with_errors_writes_no_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("r.rscd").write_text("robot R { requirement go needs Nobody.here }", "utf-8")
    assert main(["doc", "r.rscd", "-o", "page.md"]) == 1
    captured = capsys.readouterr()
    assert captured.out == "" and "[unknown-name]" in captured.err
    status, document = run_json(capsys, "doc", "r.rscd", "-o", "page.md")
    assert (status, document["page"], document["file"]) == (1, None, None) and document["errors"] > 0
    assert everything(tmp_path) == ["r.rscd"]


def test_doc_of_what_is_no_robot(capsys: pytest.CaptureFixture[str]) -> None:
    Path("library.rscd").write_text("library L { }", "utf-8")
    assert main(["doc", "library.rscd"]) == 1
    assert "holds a library, not a robot [no-robot]" in capsys.readouterr().err
    Path("bytes.rscd").write_bytes(b"\xff\xfe")
    assert main(["doc", "bytes.rscd"]) == 1
    assert capsys.readouterr().out == ""
    status, document = run_json(capsys, "doc", "bytes.rscd")
    assert (status, document["page"], document["errors"]) == (1, None, 1)


def test_doc_finds_libraries(capsys: pytest.CaptureFixture[str]) -> None:
    Path("parts").mkdir()
    Path("parts/l.rscd").write_text("library L { component P { outgoing message m with type: none } }", "utf-8")
    Path("r.rscd").write_text("robot R { component Q from L import P }", "utf-8")
    assert main(["doc", "r.rscd"]) == 1
    capsys.readouterr()
    assert main(["doc", "r.rscd", "-L", "parts"]) == 0
    assert "### `Q`" in capsys.readouterr().out


def test_wrong_use_of_doc(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in (["nowhere.rscd"], ["."], [str(LINE_FOLLOWER), "-o", "no/folder/page.md"]):
        assert main(["doc", *arguments]) == 2
        captured = capsys.readouterr()
        assert captured.out == "" and captured.err.startswith("robosc: ") and captured.err.count("\n") == 1
