"""Tests of the libraries of a text, their places, the files of a bundle, and files that cannot be read."""

import os
from pathlib import Path

import pytest

from robosc.errors import LanguageError
from robosc.language import load_bundle
from robosc.language.bundle import declared_libraries, imported_libraries
from robosc.model.check import check

LIBRARY = "library {name} {{ component {component} {{ incoming message {message} with type: none }} }}"
ROBOT = "robot R {{ component C from {library} import {component} }}"


def library(name: str = "Lib", component: str = "Base", message: str = "go") -> str:
    return LIBRARY.format(name=name, component=component, message=message)


def write(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture
def model(tmp_path: Path) -> Path:
    return write(tmp_path / "robots" / "model.rscd", ROBOT.format(library="Lib", component="Base"))


def messages(model: Path, *folders: Path) -> list[str]:
    return [item.name for item in check(load_bundle(model, folders)).model_or_raise().communications]


@pytest.mark.parametrize("place", ["robots/lib.rscd", "shared/lib.rscd", "else/where/lib.rscd"])
def test_libraries_are_found_in_every_place(tmp_path: Path, model: Path, place: str) -> None:
    write(tmp_path / place, library())
    assert messages(model, *([tmp_path / "else/where"] if place.startswith("else") else [])) == ["go"]


def test_an_unknown_library_says_where_it_was_looked_for(model: Path, tmp_path: Path) -> None:
    write(tmp_path / "shared" / "other.rscd", library("Other"))
    (found,) = check(load_bundle(model)).diagnostics
    assert found.code == "unknown-name"
    assert found.location is not None
    assert found.location.column == len("robot R { component C from ") + 1
    assert "., ../shared" in found.fix


def test_libraries_of_libraries_are_found(model: Path, tmp_path: Path) -> None:
    write(tmp_path / "robots" / "lib.rscd", "library Lib { component Base from Deep import Base }")
    write(tmp_path / "shared" / "deep.rscd", library("Deep", message="deep"))
    assert messages(model) == ["deep"]


def test_only_wanted_files_are_in_the_bundle(model: Path, tmp_path: Path) -> None:
    write(tmp_path / "robots" / "lib.rscd", library())
    write(tmp_path / "robots" / "broken.rscd", "library Broken { component")
    write(tmp_path / "robots" / "robot.rscd", "robot Lib { }")
    write(tmp_path / "robots" / "comment.rscd", "// library Lib {\nlibrary Other { }")
    write(tmp_path / "robots" / "notes.txt", library())
    (tmp_path / "robots" / "binary.rscd").write_bytes(b"\xff\xfe library Lib {")
    bundle = load_bundle(model)
    assert [file.name for file in bundle.libraries] == ["lib.rscd"]
    assert check(bundle).diagnostics == ()


def test_two_different_libraries_of_one_name_are_an_error_that_names_both(model: Path, tmp_path: Path) -> None:
    write(tmp_path / "robots" / "one.rscd", library())
    write(tmp_path / "shared" / "two.rscd", library(message="other"))
    (found,) = check(load_bundle(model)).diagnostics
    assert found.code == "ambiguous-library"
    assert "../shared/two.rscd" in found.message
    assert "one.rscd" in found.message


def test_a_file_reached_by_two_paths_counts_once(model: Path, tmp_path: Path) -> None:
    write(tmp_path / "shared" / "lib.rscd", library())
    (tmp_path / "link").symlink_to(tmp_path / "shared")
    bundle = load_bundle(model, [tmp_path / "shared", tmp_path / "link"])
    assert len(bundle.libraries) == 1
    assert check(bundle).diagnostics == ()


def test_a_broken_library_that_is_imported_is_reported(model: Path, tmp_path: Path) -> None:
    write(tmp_path / "robots" / "lib.rscd", "library Lib {\n component Base { message } }")
    (found,) = check(load_bundle(model)).diagnostics
    assert found.location is not None
    assert (found.location.file, found.location.line) == ("lib.rscd", 2)


def test_a_library_broken_from_its_first_brace_on_is_still_found(model: Path, tmp_path: Path) -> None:
    write(tmp_path / "robots" / "lib.rscd", "library Lib component Base { }")
    (found,) = check(load_bundle(model)).diagnostics
    assert (found.code, found.location and found.location.file) == ("syntax-error", "lib.rscd")


def test_a_needed_library_that_is_no_text_is_reported(model: Path, tmp_path: Path) -> None:
    path = tmp_path / "shared" / "lib.rscd"
    path.parent.mkdir()
    path.write_bytes(b"library Lib {\n // \xe9\n component Base { } }")
    with pytest.raises(LanguageError) as raised:
        load_bundle(model)
    (found,) = raised.value.diagnostics
    assert (found.code, str(found.location)) == ("not-utf8", "../shared/lib.rscd:2:5")


def test_a_model_that_imports_nothing_needs_no_other_file(tmp_path: Path) -> None:
    model = write(tmp_path / "model.rscd", "robot R { component C { incoming message m with type: none } }")
    write(tmp_path / "lib.rscd", library())
    assert load_bundle(model).libraries == ()


def test_odd_files_beside_a_model_do_no_harm(model: Path, tmp_path: Path) -> None:
    folder = tmp_path / "robots"
    (folder / "loop.rscd").symlink_to("loop.rscd")
    (folder / "gone.rscd").symlink_to("nowhere")
    (folder / "folder.rscd").mkdir()
    write(folder / "lib.rscd", library())
    assert messages(model) == ["go"]


def test_a_file_name_that_is_no_text_is_shown_escaped(tmp_path: Path) -> None:
    path = tmp_path / os.fsdecode(b"m\xff.rscd")
    path.write_text("robot R { component C { incoming message m with type: none } }", encoding="utf-8")
    bundle = load_bundle(path)
    assert bundle.main.name == "m\\xff.rscd"
    assert len(bundle.digest) == 64


def test_the_digest_depends_on_every_file_and_not_on_the_folder(tmp_path: Path) -> None:
    digests = []
    for place, message in (("a", "go"), ("b", "go"), ("c", "stop")):
        model = write(tmp_path / place / "model.rscd", ROBOT.format(library="Lib", component="Base"))
        write(tmp_path / place / "lib.rscd", library(message=message))
        digests.append(load_bundle(model).digest)
    assert digests[0] == digests[1] != digests[2]


@pytest.mark.parametrize(
    ("content", "code", "line", "column"),
    [(b"robot R {\n  // \xff\n}", "not-utf8", 2, 6), (b" " * (16 * 1024 * 1024 + 1), "file-too-large", 1, 1)],
)
def test_files_that_are_no_text(tmp_path: Path, content: bytes, code: str, line: int, column: int) -> None:
    path = tmp_path / "model.rscd"
    path.write_bytes(content)
    with pytest.raises(LanguageError) as raised:
        load_bundle(path)
    (found,) = raised.value.diagnostics
    assert found.location is not None
    assert (found.code, found.location.line, found.location.column) == (code, line, column)


def test_a_byte_order_mark_is_no_part_of_the_text(tmp_path: Path) -> None:
    path = tmp_path / "model.rscd"
    path.write_bytes(b"\xef\xbb\xbfrobot R { component C { incoming message m with type: none } }")
    assert check(load_bundle(path)).diagnostics == ()


@pytest.mark.parametrize(
    ("text", "libraries"),
    [
        ("library Lib { }", {"Lib"}),
        ("library ^state { }", {"state"}),
        ("library Lib", {"Lib"}),
        ("// library Not {\nlibrary /* x */ Lib { component }", {"Lib"}),
        ('robot R { component C { incoming message m with identifier: "library Not {" } }', set()),
        ("'it\\'s library Not' library Lib {", {"Lib"}),
        ("/* library Not */", set()),
        # A text or comment that is never closed may hide more.
        ("/* library /* Lib", {"Lib"}),
        ("'\nlibrary Lib { 'it' }", {"Lib"}),
        ("mylibrary Not { ^library Not", set()),
    ],
)
def test_declared_libraries(text: str, libraries: set[str]) -> None:
    assert declared_libraries(text) == libraries


def test_imported_libraries_come_in_the_order_of_the_text() -> None:
    text = "component A from Two import X component B from One import Y component C from Two import Z // from No import"
    assert imported_libraries(text) == ("Two", "One")
    assert imported_libraries("on response from m interface i use T from p") == ()


@pytest.mark.timeout(60)
@pytest.mark.parametrize("piece", ["/*", "'\\", '"\\', "library ", "from x "])
def test_hidden_text_is_looked_at_once(piece: str) -> None:
    assert imported_libraries(piece * 300_000) == ()
    assert len(declared_libraries(piece * 300_000)) <= 1
