import argparse
import os
from pathlib import Path

import pytest

from robosc_api.security import (
    Credentials,
    Quota,
    Scope,
    SecurityError,
    TokenFile,
    add_token_arguments,
    issue_token,
    make_token,
    open_channel,
)
from robosc_api.security.tokens import MAXIMUM_BYTES, MAXIMUM_TOKEN, parse_tokens, stamp_of


class Clock:
    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def written(folder: Path, *lines: str) -> Path:
    file = folder / "tokens"
    file.write_text("# who may do what\n\n" + "\n".join(lines) + "\n")
    file.chmod(0o600)
    return file


def test_a_token_is_found_by_itself_and_stands_nowhere(tmp_path: Path) -> None:
    token, line = make_token("laptop", (Scope.WATCH, Scope.OPERATE))
    other, other_line = make_token("screen", (Scope.WATCH,))
    file = written(tmp_path, line + "  # of the lab", other_line)
    tokens = TokenFile(file)
    assert token not in file.read_text()
    found = tokens.find(token)
    assert found is not None
    assert found.name == "laptop"
    assert found.scopes == frozenset({Scope.WATCH, Scope.OPERATE})
    second = tokens.find(other)
    assert second is not None
    assert second.name == "screen"
    assert second.scopes == frozenset({Scope.WATCH})


@pytest.mark.parametrize("wrong", ["", "robosc_", "x" * MAXIMUM_TOKEN, "é", "\ud800"])
def test_what_is_no_token_is_nobodys(wrong: str, tmp_path: Path) -> None:
    assert TokenFile(written(tmp_path, make_token("a", (Scope.WATCH,))[1])).find(wrong) is None


def test_a_token_with_something_behind_is_nobodys(tmp_path: Path) -> None:
    token, line = make_token("a", (Scope.WATCH,))
    tokens = TokenFile(written(tmp_path, line))
    assert tokens.find(token + "x") is None
    assert tokens.find(token[:-1]) is None
    assert tokens.find(token + "x" * MAXIMUM_TOKEN) is None


def test_tokens_differ() -> None:
    assert len({make_token("a", (Scope.WATCH,))[0] for _ in range(50)}) == 50


@pytest.mark.parametrize("name", ["", "a b", "x" * 65, "a#", "a\nb"])
def test_a_name_must_fit_into_the_file(name: str) -> None:
    with pytest.raises(SecurityError):
        make_token(name, (Scope.WATCH,))


def test_a_token_has_a_scope() -> None:
    with pytest.raises(SecurityError):
        make_token("a", ())


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("robosc_secret", "tokens:1: expected NAME SCOPE,SCOPE sha256:DIGEST"),
        ("a watch sha256:1234", "tokens:1: expected NAME"),
        (f"a fly sha256:{'0' * 64}", "unknown scope 'fly': use watch, operate, synthesize, admin"),
        (f"a watch sha256:{'0' * 64} secret", "tokens:1: only expires=TIME, waiting=N, per_minute=N, cpu_"),
        (f"a watch sha256:{'0' * 64} waiting=secret", "tokens:1: waiting must be a whole number from 1 to"),
        (f"a watch sha256:{'0' * 64} waiting=0", "tokens:1: waiting must be a whole number from 1 to"),
        (f"a watch sha256:{'0' * 64} waiting=1 waiting=2", "tokens:1: waiting occurs twice"),
        (f"a watch sha256:{'0' * 64}\nb watch sha256:{'0' * 64}", "tokens:2: the same token occurs twice"),
        (f"a watch sha256:{'0' * 64}\na watch sha256:{'1' * 64} calls=1", "tokens:2: another token of 'a' has other"),
        (f"a watch sha256:{'0' * 64} expires=2027-01-31", "tokens:1: expires must be a time in UTC such as"),
        (f"a watch sha256:{'0' * 64} expires=2027-02-30T00:00:00Z", "tokens:1: expires must be a time in UTC such as"),
        (f"a watch sha256:{'0' * 64}{2 * ' expires=2027-01-31T00:00:00Z'}", "tokens:1: expires occurs twice"),
    ],
)
def test_a_wrong_line_is_reported_without_what_stands_there(text: str, problem: str) -> None:
    with pytest.raises(SecurityError) as caught:
        parse_tokens(text, "tokens")
    assert problem in str(caught.value)
    assert "secret" not in str(caught.value)


def test_a_token_is_withdrawn_while_the_service_runs(tmp_path: Path) -> None:
    clock = Clock()
    token, line = make_token("a", (Scope.WATCH,))
    file = written(tmp_path, line)
    tokens = TokenFile(file, clock)
    written(tmp_path)
    assert tokens.find(token) is not None, "the file is not looked at for each call"
    clock.now_s = 1.0
    assert tokens.find(token) is None


def test_a_file_that_becomes_wrong_changes_nothing(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    clock = Clock()
    token, line = make_token("a", (Scope.WATCH,))
    file = written(tmp_path, line)
    tokens = TokenFile(file, clock)
    file.write_text("nonsense")
    clock.now_s = 1.0
    assert tokens.find(token) is not None
    file.unlink()
    clock.now_s = 2.0
    assert tokens.find(token) is not None
    assert caplog.text.count("the changed token file is not used") == 2


def test_that_nobody_is_let_in_is_reported_once_each_time_it_becomes_so(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    clock = Clock()
    useless = [make_token(name, (Scope.WATCH, Scope.ADMIN))[1] for name in ("a", "b")]
    useful = make_token("c", (Scope.SYNTHESIZE,))[1]
    file = written(tmp_path, useless[0])
    tokens = TokenFile(file, clock, needed=Scope.SYNTHESIZE)
    for number, (lines, times) in enumerate(
        [(useless[:1], 1), (useless, 1), ([*useless, useful], 1), (useless, 2), ([], 2), ([useful], 2)], 1
    ):
        written(tmp_path, *lines)
        clock.now_s = number
        assert len(tokens.entries) == len(lines)
        count = caplog.text.count(f"{file}: no valid token has the scope 'synthesize', so every call is refused")
        assert count == times, lines
    caplog.clear()
    TokenFile(written(tmp_path, *useless))
    assert caplog.text == ""


def test_a_scope_that_there_is_not(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as raised:
        arguments("laptop", "--scope", "nonsense")
    assert raised.value.code == 2
    errors = capsys.readouterr().err
    assert "unknown scope 'nonsense': use watch, operate, synthesize, admin" in errors


@pytest.mark.parametrize("mode", [0o620, 0o602])
def test_a_file_that_others_may_write_is_refused(mode: int, tmp_path: Path) -> None:
    file = written(tmp_path)
    file.chmod(mode)
    with pytest.raises(SecurityError, match="other users may write this file"):
        TokenFile(file)


def test_what_cannot_be_a_file_of_tokens_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SecurityError, match="No such file"):
        TokenFile(tmp_path / "none")
    file = tmp_path / "tokens"
    file.write_bytes(b"\xff\xfe")
    file.chmod(0o600)
    with pytest.raises(SecurityError, match="not UTF-8"):
        TokenFile(file)
    file.write_bytes(b"#" * (MAXIMUM_BYTES + 1))
    with pytest.raises(SecurityError, match="larger than"):
        TokenFile(file)


def arguments(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_token_arguments(parser, (Scope.WATCH,))
    return parser.parse_args(words)


def test_a_token_is_written_for_its_owner_alone_and_never_over_a_file(tmp_path: Path) -> None:
    file = tmp_path / "token"
    before = os.umask(0)
    try:
        shown, printed = issue_token(arguments("laptop", "-o", str(file)))
    finally:
        os.umask(before)
    assert shown == ""
    assert file.stat().st_mode & 0o777 == 0o600
    token = file.read_text().strip()
    assert token not in printed
    assert TokenFile(written(tmp_path, printed.splitlines()[-1])).find(token) is not None
    with pytest.raises(SecurityError, match="File exists"):
        issue_token(arguments("laptop", "-o", str(file)))
    assert file.read_text().strip() == token


@pytest.mark.parametrize(("mode", "is_reported"), [(0o600, False), (0o640, True), (0o604, True)])
def test_a_token_that_others_may_read_is_reported(
    mode: int, is_reported: bool, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = tmp_path / "token"
    file.write_text(make_token("a", (Scope.WATCH,))[0])
    file.chmod(mode)
    with open_channel("127.0.0.1:1", Credentials(token_file=file)):
        assert (f"{file}: other users may read this file" in caplog.text) is is_reported


def test_quotas_stand_behind_the_digest(tmp_path: Path) -> None:
    quota = Quota(waiting=20, cpu_seconds_per_hour=3600)
    token, line = make_token("a", (Scope.SYNTHESIZE, Scope.ADMIN), quota)
    assert line.endswith(" waiting=20 cpu_seconds_per_hour=3600")
    tokens = TokenFile(written(tmp_path, line + " # a comment", make_token("b", (Scope.ADMIN,))[1]))
    found = tokens.find(token)
    assert found is not None
    assert found.quota == quota
    assert tokens.named("a") == found
    other = tokens.named("b")
    assert other is not None
    assert other.quota == Quota()
    assert tokens.named("c") is None


def test_quotas_by_flags_where_a_service_has_them() -> None:
    parser = argparse.ArgumentParser()
    add_token_arguments(parser, (Scope.SYNTHESIZE,), has_quotas=True)
    _, printed = issue_token(parser.parse_args(["a", "--per-minute", "60"]))
    assert printed.splitlines()[-1].endswith(" per_minute=60")
    for wrong in ("0", "-1", "x", "9999999999"):
        with pytest.raises(SystemExit):
            parser.parse_args(["a", "--waiting", wrong])
    with pytest.raises(SystemExit):
        arguments("a", "--waiting", "3")


def test_a_file_that_is_written_or_replaced_is_another_one(tmp_path: Path) -> None:
    """Time, size and inode: any of them tells it apart."""
    file, other = tmp_path / "tokens", tmp_path / "other"
    for path, text in ((file, "one"), (other, "two")):
        path.write_text(text)
        os.utime(path, ns=(0, 5))
    before = stamp_of(file.stat())
    os.utime(file, ns=(0, 6))
    assert stamp_of(file.stat()) != before
    file.write_text("more")
    os.utime(file, ns=(0, 5))
    assert stamp_of(file.stat()) != before
    file.write_text("one")
    os.utime(file, ns=(0, 5))
    assert stamp_of(file.stat()) == before
    other.replace(file)
    assert stamp_of(file.stat()) != before
