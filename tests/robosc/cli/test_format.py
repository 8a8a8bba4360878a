"""`robosc format` as a user runs it."""

import codecs
import io
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from robosc.cli import format as format_
from robosc.cli.main import main
from robosc.cli.output import UsageError, write_bytes
from robosc.language import reading

UNTIDY = "robot R{component C{}\n\n\n}// end"
TIDY = "robot R {\n    component C { }\n}  // end\n"
BROKEN = "robot R {\n  component {}\n}\n"
DIFF = """\
--- {name}
+++ {name}
@@ -1,4 +1,3 @@
-robot R{{component C{{}}
-
-
-}}// end
\\ No newline at end of file
+robot R {{
+    component C {{ }}
+}}  // end
"""

Files = Callable[[dict[str, str]], None]


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Files:
    """Makes files in an empty folder, which is the current one."""
    monkeypatch.chdir(tmp_path)

    def make(texts: dict[str, str]) -> None:
        for name, text in texts.items():
            path = Path(name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text.encode("utf-8"))

    return make


@pytest.fixture
def give(monkeypatch: pytest.MonkeyPatch) -> Callable[[bytes], None]:
    """Puts bytes on standard input."""
    return lambda content: monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))


def content(name: str) -> str:
    return Path(name).read_bytes().decode("utf-8")


# Formatting in place


def test_files_are_written_in_place_and_listed(files: Files, capsys: pytest.CaptureFixture[str]) -> None:
    files({"b.rscd": UNTIDY, "a.txt": UNTIDY, "c.rscd": TIDY})
    assert main(["format", "b.rscd", "a.txt", "c.rscd"]) == 0
    assert capsys.readouterr() == ("b.rscd\na.txt\n", "")
    assert [content(name) for name in ("b.rscd", "a.txt", "c.rscd")] == [TIDY] * 3
    assert main(["format", "b.rscd", "a.txt", "c.rscd"]) == 0
    assert capsys.readouterr() == ("", "")


def test_a_canonical_file_is_not_touched(files: Files) -> None:
    files({"a.rscd": TIDY})
    os.utime("a.rscd", (1, 1))
    before = Path("a.rscd").stat()
    assert main(["format", "a.rscd"]) == 0
    after = Path("a.rscd").stat()
    assert (after.st_mtime_ns, after.st_ino) == (before.st_mtime_ns, before.st_ino)


def test_permissions_and_links_stay(files: Files) -> None:
    files({"a.rscd": UNTIDY})
    Path("a.rscd").chmod(0o750)
    Path("link.rscd").symlink_to("a.rscd")
    assert main(["format", "link.rscd"]) == 0
    assert Path("link.rscd").is_symlink() and content("a.rscd") == TIDY
    assert Path("a.rscd").stat().st_mode & 0o777 == 0o750
    assert sorted(path.name for path in Path().iterdir()) == ["a.rscd", "link.rscd"]


def test_folders_stand_for_every_model_below(files: Files, capsys: pytest.CaptureFixture[str]) -> None:
    files({"m/z.rscd": UNTIDY, "m/a/y.rscd": UNTIDY, "m/x.txt": UNTIDY, "n.rscd": UNTIDY, "m/folder.rscd/w.rscd": TIDY})
    assert main(["format", "n.rscd", "m"]) == 0
    assert capsys.readouterr().out == "n.rscd\nm/a/y.rscd\nm/z.rscd\n"
    assert content("m/x.txt") == UNTIDY


def test_a_file_that_is_named_twice_is_formatted_once(files: Files, capsys: pytest.CaptureFixture[str]) -> None:
    files({"m/a.rscd": UNTIDY})
    assert main(["format", "--check", "m/a.rscd", "m", "./m/../m/a.rscd"]) == 1
    assert capsys.readouterr().out == "m/a.rscd\n"


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
@pytest.mark.parametrize("mark", [b"", codecs.BOM_UTF8])
def test_line_ends_and_byte_order_mark_stay(files: Files, line_end: str, mark: bytes) -> None:
    files({})
    Path("a.rscd").write_bytes(mark + UNTIDY.replace("\n", line_end).encode())
    assert main(["format", "a.rscd"]) == 0
    assert Path("a.rscd").read_bytes() == mark + TIDY.replace("\n", line_end).encode()


# Looking only


def test_check_lists_and_writes_nothing(files: Files, capsys: pytest.CaptureFixture[str]) -> None:
    files({"a.rscd": UNTIDY, "b.rscd": TIDY})
    assert main(["format", "--check", "a.rscd", "b.rscd"]) == 1
    assert capsys.readouterr() == ("a.rscd\n", "")
    assert content("a.rscd") == UNTIDY
    assert main(["format", "--check", "b.rscd"]) == 0
    assert capsys.readouterr() == ("", "")


def test_diff_writes_nothing(files: Files, capsys: pytest.CaptureFixture[str]) -> None:
    files({"a.rscd": UNTIDY, "b.rscd": TIDY})
    assert main(["format", "--diff", "a.rscd", "b.rscd"]) == 0
    assert capsys.readouterr() == (DIFF.format(name="a.rscd"), "")
    assert content("a.rscd") == UNTIDY


def test_check_with_diff_prints_the_diff_and_fails(files: Files, capsys: pytest.CaptureFixture[str]) -> None:
    files({"a.rscd": UNTIDY})
    assert main(["format", "--check", "--diff", "a.rscd"]) == 1
    assert capsys.readouterr() == (DIFF.format(name="a.rscd"), "")


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_the_diff_is_a_patch(files: Files, capfdbinary: pytest.CaptureFixture[bytes], line_end: str) -> None:
    text = codecs.BOM_UTF8.decode() + UNTIDY.replace("// end", "/* \u2028 ä */").replace("\n", line_end)
    files({"a.rscd": text, "b.rscd": text})
    assert main(["format", "--diff", "a.rscd"]) == 0
    patch = capfdbinary.readouterr().out
    command = ["git", "apply", "--unidiff-zero", "--whitespace=nowarn", "-p0", "-"]
    subprocess.run(command, input=patch, check=True, timeout=60)
    assert main(["format", "b.rscd"]) == 0
    assert content("a.rscd") == content("b.rscd") != text


# Standard input


def test_standard_input_goes_to_standard_output(
    give: Callable[[bytes], None], capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    given = codecs.BOM_UTF8 + UNTIDY.replace("\n", "\r\n").replace("end", "ä").encode()
    give(given)
    assert main(["format", "-"]) == 0
    expected = codecs.BOM_UTF8 + TIDY.replace("\n", "\r\n").replace("end", "ä").encode()
    assert capfdbinary.readouterr() == (expected, b"")
    give(expected)
    assert main(["format", "-"]) == 0
    assert capfdbinary.readouterr() == (expected, b"")


def test_standard_input_is_checked_and_compared(
    give: Callable[[bytes], None], capsys: pytest.CaptureFixture[str]
) -> None:
    give(UNTIDY.encode())
    assert main(["format", "--check", "-"]) == 1
    assert capsys.readouterr() == ("<stdin>\n", "")
    give(UNTIDY.encode())
    assert main(["format", "--diff", "-"]) == 0
    assert capsys.readouterr() == (DIFF.format(name="<stdin>"), "")
    give(TIDY.encode())
    assert main(["format", "--check", "-"]) == 0
    assert capsys.readouterr() == ("", "")


def test_broken_standard_input_gives_no_output(
    give: Callable[[bytes], None], capsys: pytest.CaptureFixture[str]
) -> None:
    give(BROKEN.encode())
    assert main(["format", "-"]) == 1
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.startswith("<stdin>:2:13: error: ")


def test_closed_standard_input(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "stdin", None)
    assert main(["format", "-"]) == 2
    assert capsys.readouterr() == ("", "robosc: standard input is closed\n")


# Faults


def test_a_broken_file_is_left_alone_and_the_others_are_formatted(
    files: Files, capsys: pytest.CaptureFixture[str]
) -> None:
    files({"a.rscd": UNTIDY, "b.rscd": BROKEN, "c.rscd": UNTIDY})
    assert main(["format", "."]) == 1
    captured = capsys.readouterr()
    assert captured.out == "a.rscd\nc.rscd\n"
    assert captured.err == (
        "b.rscd:2:13: error: '{' does not fit here; expected a name [syntax-error]\n"
        "  |   component {}\n"
        "  |             ^\n"
        "  = fix: Write one of the expected words here, or look for a bracket or comma missing before.\n"
        "1 error\n"
    )
    assert [content(name) for name in ("a.rscd", "b.rscd", "c.rscd")] == [TIDY, BROKEN, TIDY]


def test_what_is_no_text_is_left_alone(files: Files, capsys: pytest.CaptureFixture[str]) -> None:
    files({"b.rscd": "", "c.rscd": UNTIDY})
    Path("a.rscd").write_bytes(b"robot R { // \xff\n}")
    assert main(["format", "a.rscd", "b.rscd", "c.rscd"]) == 1
    captured = capsys.readouterr()
    assert captured.out == "c.rscd\n"
    assert "a.rscd:1:14: error:" in captured.err and "[not-utf8]" in captured.err
    assert "b.rscd:1:1: error: the file is empty [empty-file]" in captured.err
    assert Path("a.rscd").read_bytes() == b"robot R { // \xff\n}" and content("b.rscd") == ""


@pytest.mark.parametrize("limit", [len(UNTIDY) - 1, len(TIDY) - 1])
def test_what_is_or_becomes_too_large_is_left_alone(
    files: Files, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], limit: int
) -> None:
    monkeypatch.setattr(reading, "MAXIMUM_BYTES", limit)
    files({"a.rscd": UNTIDY})
    assert main(["format", "a.rscd"]) == 1
    captured = capsys.readouterr()
    assert captured.out == "" and f"more than {limit} bytes [file-too-large]" in captured.err
    assert content("a.rscd") == UNTIDY


def test_files_that_cannot_be_accessed_do_not_keep_the_others_from_it(
    files: Files, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    files({"a.rscd": UNTIDY, "b.rscd": UNTIDY, "c.rscd": UNTIDY, "d.rscd": BROKEN})
    plain_open = Path.open

    def refuse_to_open(path: Path, *arguments: Any, **named: Any) -> Any:
        if path.name == "a.rscd":
            raise PermissionError(13, "Permission denied", str(path))
        return plain_open(path, *arguments, **named)

    def refuse_to_write(path: Path, content: bytes) -> None:
        if path.name == "b.rscd":
            raise UsageError(f"cannot write {path}: No space left on device")
        write_bytes(path, content)

    monkeypatch.setattr(Path, "open", refuse_to_open)
    monkeypatch.setattr(format_, "write_bytes", refuse_to_write)
    assert main(["format", "."]) == 2
    captured = capsys.readouterr()
    assert captured.out == "c.rscd\n"
    assert "robosc: cannot read a.rscd: Permission denied\n" in captured.err
    assert "robosc: cannot write b.rscd: No space left on device\n" in captured.err
    assert "d.rscd:2:13: error: " in captured.err
    assert main(["format", "--json", "a.rscd", "b.rscd"]) == 2
    assert [file["reason"] for file in json.loads(capsys.readouterr().out)["files"]] == [
        "cannot read a.rscd: Permission denied",
        "cannot write b.rscd: No space left on device",
    ]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["none.rscd"], "there is no file none.rscd"),
        (["a.rscd", "none.rscd"], "there is no file none.rscd"),
        (["empty"], "there is no .rscd file in the folder empty"),
        (["/dev/null"], "/dev/null is not a plain file"),
        (["x" * 300], f"cannot read {'x' * 300}: File name too long"),
        (["-", "a.rscd"], "- is standard input: it cannot be formatted together with files"),
        (["-", "-"], "- is standard input: it cannot be formatted together with files"),
    ],
)
def test_wrong_use_changes_nothing(
    files: Files, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    files({"a.rscd": UNTIDY, "empty/b.txt": UNTIDY})
    assert main(["format", *arguments]) == 2
    assert capsys.readouterr() == ("", f"robosc: {message}\n")
    assert content("a.rscd") == UNTIDY


def test_one_document_and_a_text_do_not_go_together(files: Files, capsys: pytest.CaptureFixture[str]) -> None:
    message = "with - the text goes to standard output: --json needs --check or --diff then"
    assert main(["format", "--json", "-"]) == 2
    captured = capsys.readouterr()
    assert captured.err == f"robosc: {message}\n"
    assert json.loads(captured.out) == {"error": {"status": 2, "message": message}}


def test_without_files(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["format"])
    assert caught.value.code == 2 and "FILE" in capsys.readouterr().err


def test_a_name_that_is_no_utf8(files: Files, capsys: pytest.CaptureFixture[str]) -> None:
    files({})
    name = os.fsdecode(b"\xff.rscd")
    Path(name).write_text(UNTIDY, encoding="utf-8")
    assert main(["format", "."]) == 0
    assert capsys.readouterr().out == "\\xff.rscd\n" and content(name) == TIDY


# JSON


def test_json(files: Files, capsys: pytest.CaptureFixture[str]) -> None:
    files({"a.rscd": UNTIDY, "b.rscd": BROKEN, "c.rscd": TIDY})
    assert main(["format", "--json", "--check", "."]) == 1
    captured = capsys.readouterr()
    document = json.loads(captured.out)
    assert captured.err == ""
    assert document["files"] == [
        {"file": "a.rscd", "status": "changed"},
        {"file": "b.rscd", "status": "broken"},
        {"file": "c.rscd", "status": "unchanged"},
    ]
    assert document["errors"] == 1
    assert [(item["file"], item["code"]) for item in document["diagnostics"]] == [("b.rscd", "syntax-error")]
    assert content("a.rscd") == UNTIDY
    assert main(["format", "--json", "--diff", "."]) == 1
    assert [item["diff"] for item in json.loads(capsys.readouterr().out)["files"]] == [
        DIFF.format(name="a.rscd"),
        "",
        "",
    ]
    assert main(["format", "--json", "a.rscd"]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == [{"file": "a.rscd", "status": "changed"}]
    assert content("a.rscd") == TIDY


def test_json_of_standard_input(give: Callable[[bytes], None], capsys: pytest.CaptureFixture[str]) -> None:
    give(UNTIDY.encode())
    assert main(["format", "--json", "--check", "-"]) == 1
    assert json.loads(capsys.readouterr().out)["files"] == [{"file": "<stdin>", "status": "changed"}]
