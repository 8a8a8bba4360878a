"""Writing generated files: nothing of the user's is lost, nothing leaves the folder, the same text twice is quiet."""

import stat
from pathlib import Path

import pytest

from robosc.targets import GeneratedFiles, OverwriteError, Removal, remove_earlier, write_files
from robosc.targets.files import MANIFEST


def contents(directory: Path) -> dict[str, str]:
    return {
        str(path.relative_to(directory)): path.read_text()
        for path in sorted(directory.rglob("*"))
        if path.is_file() and path.name != MANIFEST
    }


def test_files_are_sorted_and_equal_by_content() -> None:
    files = GeneratedFiles({"b/x.py": "1", "a.py": "2"})
    assert list(files) == ["a.py", "b/x.py"]
    assert files["b/x.py"] == "1"
    assert files == GeneratedFiles({"a.py": "2", "b/x.py": "1"})
    assert hash(files) == hash(GeneratedFiles({"a.py": "2", "b/x.py": "1"}))
    assert files != GeneratedFiles({"a.py": "2", "b/x.py": "1"}, frozenset({"a.py"}))


@pytest.mark.parametrize(
    "path",
    ["", "/etc/passwd", "../x", "a/../../x", "a//b", "./a", "a/", "a\\b", "C:x", "a\0b", "a\nb", MANIFEST, "..", "."],
)
def test_a_path_out_of_the_folder_is_refused(path: str) -> None:
    with pytest.raises(ValueError, match="not a relative path"):
        GeneratedFiles({path: ""})


def test_an_executable_must_be_a_file() -> None:
    with pytest.raises(ValueError, match="not among the files: b"):
        GeneratedFiles({"a": ""}, frozenset({"b"}))


def test_files_are_written_with_their_modes(tmp_path: Path) -> None:
    files = GeneratedFiles({"run": "#!/bin/sh\n", "deep/er/data.txt": "é"}, frozenset({"run"}))
    written = write_files(files, tmp_path / "out")
    assert written == (tmp_path / "out/deep/er/data.txt", tmp_path / "out/run")
    assert (tmp_path / "out/deep/er/data.txt").read_bytes() == "é".encode()
    assert stat.S_IMODE((tmp_path / "out/run").stat().st_mode) == 0o755
    assert stat.S_IMODE((tmp_path / "out/deep/er/data.txt").stat().st_mode) == 0o644


def test_unchanged_files_are_replaced(tmp_path: Path) -> None:
    write_files(GeneratedFiles({"a": "1", "b": "2"}), tmp_path)
    write_files(GeneratedFiles({"a": "3", "c": "4"}), tmp_path)
    assert contents(tmp_path) == {"a": "3", "b": "2", "c": "4"}


def test_several_packages_may_stand_in_one_folder(tmp_path: Path) -> None:
    write_files(GeneratedFiles({"one/a": "1"}), tmp_path)
    write_files(GeneratedFiles({"two/b": "2"}), tmp_path)
    write_files(GeneratedFiles({"one/a": "3"}), tmp_path)
    assert contents(tmp_path) == {"one/a": "3", "two/b": "2"}


def test_a_changed_file_stops_everything(tmp_path: Path) -> None:
    write_files(GeneratedFiles({"a": "1", "b": "2"}), tmp_path)
    (tmp_path / "b").write_text("mine")
    manifest = (tmp_path / MANIFEST).read_text()
    with pytest.raises(OverwriteError, match=r"changed since generated.*: b; nothing was written; use --force"):
        write_files(GeneratedFiles({"a": "new", "b": "new"}), tmp_path)
    assert contents(tmp_path) == {"a": "1", "b": "mine"}
    assert (tmp_path / MANIFEST).read_text() == manifest
    write_files(GeneratedFiles({"a": "new", "b": "new"}), tmp_path, force=True)
    assert contents(tmp_path) == {"a": "new", "b": "new"}


def test_a_file_that_was_never_generated_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("mine")
    with pytest.raises(OverwriteError):
        write_files(GeneratedFiles({"a": "1"}), tmp_path)
    assert contents(tmp_path) == {"a": "mine"}


def test_writing_the_same_again_touches_nothing(tmp_path: Path) -> None:
    files = GeneratedFiles({"a": "1"})
    write_files(files, tmp_path)
    before = (tmp_path / "a").stat()
    write_files(files, tmp_path)
    after = (tmp_path / "a").stat()
    assert (before.st_mtime_ns, before.st_ino) == (after.st_mtime_ns, after.st_ino)


@pytest.mark.parametrize(
    "manifest",
    [
        "{",
        "[]",
        '{"version": 1}',
        '{"version": 1, "files": []}',
        '{"version": 9, "files": {"a": "x"}}',
        '{"version": 1, "files": {"a": 7}}',
        "[" * 100_000,
        "\udcff",
    ],
)
def test_a_broken_manifest_means_that_nothing_is_known(tmp_path: Path, manifest: str) -> None:
    (tmp_path / MANIFEST).write_bytes(manifest.encode("utf-8", "surrogateescape"))
    (tmp_path / "a").write_text("mine")
    with pytest.raises(OverwriteError, match="not overwritten"):
        write_files(GeneratedFiles({"a": "1"}), tmp_path)


def test_a_linked_folder_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "out").mkdir()
    (tmp_path / "out/pkg").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(OverwriteError, match="symbolic link"):
        write_files(GeneratedFiles({"pkg/a": "1"}), tmp_path / "out", force=True)
    assert not list((tmp_path / "elsewhere").iterdir())


def test_a_linked_file_is_replaced_not_written_through(tmp_path: Path) -> None:
    (tmp_path / "target").write_text("mine")
    (tmp_path / "out").mkdir()
    (tmp_path / "out/a").symlink_to(tmp_path / "target")
    write_files(GeneratedFiles({"a": "1"}), tmp_path / "out", force=True)
    assert (tmp_path / "target").read_text() == "mine"
    assert (tmp_path / "out/a").read_text() == "1"


def test_a_place_that_cannot_be_written_is_one_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OverwriteError, match=r"cannot write to .*not a directory"):
        write_files(GeneratedFiles({"a": "1"}), tmp_path / "file")


def test_a_failed_write_leaves_no_temporary_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(self: Path, target: Path) -> Path:
        raise OSError(28, "No space left on device", str(target))

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(OverwriteError, match="no space left"):
        write_files(GeneratedFiles({"a": "1"}), tmp_path)
    assert not list(tmp_path.iterdir())


def test_what_an_earlier_run_generated_in_a_folder_is_removed(tmp_path: Path) -> None:
    write_files(GeneratedFiles({"a": "1", "one/a": "1", "one/deep/b": "2", "one/c": "3", "two/a": "1"}), tmp_path)
    (tmp_path / "one/c").unlink()
    assert remove_earlier(tmp_path, ["one", "three"]) == Removal((tmp_path / "one/a", tmp_path / "one/deep/b"))
    assert contents(tmp_path) == {"a": "1", "two/a": "1"}
    assert not (tmp_path / "one").exists()
    assert remove_earlier(tmp_path, ["one"]) == Removal()
    (tmp_path / "one").mkdir()
    (tmp_path / "one/a").write_text("1")
    assert remove_earlier(tmp_path, ["one"]) == Removal()


def test_what_is_the_users_is_not_removed(tmp_path: Path) -> None:
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    write_files(GeneratedFiles({"one/a": "1", "one/b": "2", "one/l": "3", "two/a": "1"}), out)
    (out / "one/b").write_text("mine")
    (out / "one/new").write_text("mine")
    (out / "one/l").rename(tmp_path / "target")
    (out / "one/l").symlink_to(tmp_path / "target")
    (out / "two").rename(elsewhere)
    (out / "two").symlink_to(elsewhere)
    removal = remove_earlier(out, ["one", "two"])
    assert removal == Removal((out / "one/a",), (out / "one/b", out / "one/l", out / "two/a"))
    assert (out / "one/b").read_text() == (out / "one/new").read_text() == "mine"
    assert (out / "one/l").read_text() == "3"
    assert (elsewhere / "a").read_text() == "1"
    with pytest.raises(OverwriteError, match="one/b"):
        write_files(GeneratedFiles({"one/a": "1", "one/b": "4"}), out)


def test_without_a_manifest_nothing_is_removed(tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "one/a").write_text("1")
    assert remove_earlier(tmp_path, ["one"]) == Removal()
    assert not (tmp_path / MANIFEST).exists()
