"""Tests of the language server's knowledge of several edited files: the same as if it saw them for the first time."""

from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
from lsprotocol import types as lsp

from robosc_lsp.project import MAXIMUM_FILES, Project

NAMES = ("robot.rscd", "parts.rscd", "more.rscd")
TEXTS = {
    "robot.rscd": [
        "robot R { component C from parts import C }",
        "robot R { component C from parts import C requirement C.a disables m }",
        "robot R { component D from more import D }",
        "robot R { component C from parts import }",
        "library parts { component C { incoming message m with type: none } }",
    ],
    "parts.rscd": [
        "library parts { component C from more import D }",
        "library parts { component C { incoming message m with type: none behaviour { initial marked state a { } } } }",
        "library others { component C { } }",
        "library parts { component C { ",
    ],
    "more.rscd": [
        "library more { component D { incoming message m with type: none } }",
        "library more { component E { } }",
        "library parts { component C { } }",
        "robot M { component C from parts import C }",
        "",
    ],
}
STEPS = st.lists(st.tuples(st.sampled_from(NAMES), st.integers(0, 4), st.booleans()), min_size=1, max_size=10)
HOME = Path("/nowhere/at/all")


def uri(name: str) -> str:
    return (HOME / name).as_uri()


@given(STEPS)
def test_what_is_known_is_that_of_the_texts_now(steps: list[tuple[str, int, bool]]) -> None:
    project = Project("utf-16")
    now: dict[str, str] = {}
    for name, number, is_closed in steps:
        text = TEXTS[name][number % len(TEXTS[name])]
        if is_closed and name in now:
            del now[name]
            project.close(uri(name))
        elif name in now:
            now[name] = text
            project.edit(uri(name), [lsp.TextDocumentContentChangeWholeDocument(text)])
        else:
            now[name] = text
            project.open(uri(name), text)
        fresh = Project("utf-16")
        for other, content in now.items():
            fresh.open(uri(other), content)
        for other in now:
            mine, its = project.analysis(uri(other)), fresh.analysis(uri(other))
            assert mine is not None and its is not None
            assert mine.inspected.checked.diagnostics == its.inspected.checked.diagnostics
            assert mine.names.pattern() == its.names.pattern() and mine.uris == its.uris


def searched(project: Project) -> set[str]:
    return {analysis.uri.rpartition("/")[2] for analysis in project.analyses()}


def test_folders_are_searched_without_copies_and_packages(tmp_path: Path) -> None:
    folders = {"src": "a.rscd", "src/deep": "b.rscd", ".git": "c.rscd", "node_modules/x": "d.rscd", "build/e": "e.rscd"}
    for folder, name in folders.items():
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / name).write_text("library L { }", encoding="utf-8")
    (tmp_path / "build" / "COLCON_IGNORE").touch()
    libraries = tmp_path.parent / f"{tmp_path.name}-libraries"
    libraries.mkdir()
    (libraries / "f.rscd").write_text("library F { }", encoding="utf-8")
    project = Project("utf-16", [tmp_path])
    project.library_paths = (libraries,)
    assert searched(project) == {"a.rscd", "b.rscd", "f.rscd"}


def test_too_many_files_are_noticed(tmp_path: Path) -> None:
    project = Project("utf-16", [tmp_path])
    for number in range(MAXIMUM_FILES):
        (tmp_path / f"{number}.rscd").touch()
    assert not project.has_too_many_files()
    (tmp_path / "one_more.rscd").touch()
    assert project.has_too_many_files()
