"""Tokens that expire, and the commands that keep a token file."""

import argparse
import hmac
import json
import logging
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from robosc_api.security import Quota, Scope, SecurityError, TokenFile, add_tokens_arguments, make_token, run_tokens
from robosc_api.security.tokens import SOON_S, Entry, TokenIndex, parse_tokens, read_time, time_text
from support.waiting import PATIENCE_S

DAY_S = 86400
NOW_S = read_time("2026-11-26T12:00:00Z")


class Clock:
    """Seconds since 1970, and of a monotonic clock, that a test lets pass."""

    def __init__(self) -> None:
        self.now_s = float(NOW_S)

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "tokens"


def write(file: Path, *lines: str) -> None:
    file.write_text("".join(f"{line}\n" for line in lines))
    file.chmod(0o600)


def tokens_of(file: Path, clock: Clock) -> TokenFile:
    return TokenFile(file, clock, needed=Scope.SYNTHESIZE, wall_clock=clock)


type Run = Callable[..., Any]


@pytest.fixture
def run(clock: Clock, capsys: pytest.CaptureFixture[str], file: Path) -> Run:
    """Run a command on the file: its document, or the message of its error."""

    def run_(command: str, *words: str) -> Any:
        parser = argparse.ArgumentParser("robosc-server tokens")
        add_tokens_arguments(parser, (Scope.SYNTHESIZE,), has_quotas=True)
        status = run_tokens(parser.parse_args([command, str(file), *words, "--json"]), clock)
        out, err = capsys.readouterr()
        document = json.loads(out)
        if status:
            assert (status, document["error"]["status"]) == (2, 2)
            assert err == f"robosc-server: {document['error']['message']}\n"
            return document["error"]["message"]
        return document

    return run_


def test_a_token_is_valid_until_it_expires(file: Path, clock: Clock, caplog: pytest.LogCaptureFixture) -> None:
    token, line = make_token("laptop", (Scope.SYNTHESIZE,), expires_s=NOW_S + 60 * DAY_S)
    write(file, line)
    tokens = tokens_of(file, clock)
    clock.now_s += 60 * DAY_S - 1
    found = tokens.find(token)
    assert found is not None and found.name == "laptop"
    assert tokens.find_expired(token) is None
    clock.now_s += 1
    caplog.clear()
    for _ in range(3):
        assert tokens.find(token) is None
        assert tokens.find_expired(token) == found
    assert tokens.find_expired("robosc_x") is None
    used = f"the token {found.id} of 'laptop' has expired at 2027-01-25T12:00:00Z and is still used"
    assert caplog.text.count(used) == 1
    assert caplog.text.count("no valid token has the scope 'synthesize'") == 1


def test_the_log_says_once_that_a_token_expires_soon(
    file: Path, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    lines = [make_token("laptop", (Scope.SYNTHESIZE,), expires_s=NOW_S + 20 * DAY_S)[1]]
    write(file, *lines)
    tokens = tokens_of(file, clock)

    def count() -> int:
        assert tokens.entries
        return caplog.text.count("of 'laptop' expires at 2026-12-16T12:00:00Z: rotate it")

    assert count() == 0
    clock.now_s = NOW_S + 20 * DAY_S - SOON_S - 1
    assert count() == 0
    clock.now_s += 1
    assert count() == 1
    clock.now_s += DAY_S
    assert count() == 1


def test_each_token_is_reported_as_soon_as_it_is_due_wherever_it_stands(
    file: Path, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    days = {"a": 40, "b": 20, "c": 30}
    write(file, *(make_token(name, (Scope.SYNTHESIZE,), expires_s=NOW_S + n * DAY_S)[1] for name, n in days.items()))
    tokens = tokens_of(file, clock)
    found = []
    for day in range(40):
        caplog.clear()
        clock.now_s = float(NOW_S + day * DAY_S)
        assert len(tokens.entries) == 3
        found += [(name, day) for name in days if f"of '{name}' expires" in caplog.text]
    soon = int(SOON_S / DAY_S)
    assert found == [("b", 20 - soon), ("c", 30 - soon), ("a", 40 - soon)]


def test_a_token_that_was_taken_out_and_comes_back_is_reported_again(
    file: Path, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    other = make_token("other", (Scope.SYNTHESIZE,))[1]
    token, line = make_token("laptop", (Scope.SYNTHESIZE,), expires_s=NOW_S + DAY_S)
    write(file, other, line)
    tokens = tokens_of(file, clock)
    for now_s, words in ((NOW_S, "of 'laptop' expires"), (NOW_S + DAY_S, "and is still used")):
        clock.now_s = float(now_s)
        tokens.find_expired(token)
        assert caplog.text.count(words) == 1
        for lines in ((other,), (other, line)):
            write(file, *lines)
            clock.now_s += 1
            tokens.find_expired(token)
        assert caplog.text.count(words) == 2


def test_a_token_that_another_one_replaces_is_reported_by_nobody(
    file: Path, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    both, one = (Scope.SYNTHESIZE, Scope.ADMIN), (Scope.SYNTHESIZE,)
    soon = NOW_S + DAY_S
    for scopes, expires_s, is_replaced in (
        (both, None, True),
        (both, soon + 1, True),
        (both, soon, False),
        (one, None, False),
    ):
        caplog.clear()
        earlier, later = make_token("a", both, expires_s=soon), make_token("a", scopes, expires_s=expires_s)
        write(file, earlier[1], later[1], make_token("b", both)[1])
        tokens = tokens_of(file, clock)
        entry = tokens.find(earlier[0])
        assert entry is not None
        assert (entry.id in tokens.seconds_to_expiry()) is not is_replaced
        assert (f"the token {entry.id} of 'a' expires" in caplog.text) is not is_replaced
    assert list(tokens.seconds_to_expiry().values()) == [DAY_S]
    clock.now_s += 2 * DAY_S
    assert list(tokens.seconds_to_expiry().values()) == [-DAY_S]


ENTRIES = st.builds(
    Entry,
    st.text("abc._-XYZ019", min_size=1, max_size=5),
    st.frozensets(st.sampled_from(Scope), min_size=1),
    st.text("0123456789abcdef", min_size=64, max_size=64),
    st.builds(Quota, *[st.none() | st.integers(1, 999_999_999)] * 4),
    st.none() | st.integers(0, 250_000_000_000),
)


@given(ENTRIES)
def test_a_line_says_all_of_a_token(entry: Entry) -> None:
    assert parse_tokens(f"{entry}  # comment", "") == (entry,)
    if entry.expires_s is not None:
        assert read_time(time_text(entry.expires_s)) == entry.expires_s


@given(st.lists(ENTRIES, max_size=12, unique_by=lambda entry: entry.digest))
@example([Entry("a", frozenset((Scope.ADMIN,)), 63 * "0" + digit, Quota(), int(digit)) for digit in "132"])
def test_an_index_finds_what_going_through_all_tokens_finds(entries: list[Entry]) -> None:
    index = TokenIndex(entries)
    for entry in entries:
        assert index.find(entry.digest) is entry
        assert index.named(entry.name) is next(other for other in entries if other.name == entry.name)
        assert index.is_replaced(entry) == any(replaces(other, entry) for other in entries)
    expiring = [entry for entry in entries if entry.expires_s is not None and not index.is_replaced(entry)]
    assert list(index.unreplaced) == sorted(expiring, key=lambda entry: entry.expires_s or 0)
    for scope in Scope:
        for now_s in {0, *(entry.expires_s for entry in entries if entry.expires_s is not None)}:
            is_valid = any(scope in entry.scopes and entry.is_valid(now_s) for entry in entries)
            assert (now_s < index.last_s(scope)) == is_valid
    assert index.find("0" * 63) is index.named("") is None


def replaces(other: Entry, entry: Entry) -> bool:
    """True if a token replaces another one."""
    is_longer = entry.expires_s is not None and other.is_valid(entry.expires_s)
    return is_longer and other.name == entry.name and other.scopes >= entry.scopes


MANY = 10_000


@pytest.mark.parametrize("owners", [1, MANY])
def test_a_token_takes_as_many_steps_among_ten_thousand_as_among_two(
    owners: int, file: Path, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    comparisons = 0

    def compare(one: str, other: str) -> bool:
        nonlocal comparisons
        comparisons += 1
        return one == other

    monkeypatch.setattr(hmac, "compare_digest", compare)
    found: dict[int, list[int]] = {}
    for count in (2, MANY):
        made = [
            make_token(f"caller{number % owners}", (Scope.SYNTHESIZE,), expires_s=NOW_S + DAY_S + number)
            for number in range(count)
        ]
        write(file, *(line for _, line in made))
        tokens = tokens_of(file, clock)
        expired, stays = made[0][0], made[-1][0]
        assert {tokens.find(token) is not None for token, _ in made} == {True}
        comparisons = 0
        steps = []
        for seconds in (0.0, 1.0):
            # After a second, it is checked whether the file has changed and what expires.
            clock.now_s += seconds
            steps += [lines_of(tokens.find, stays), lines_of(tokens.find, "robosc_unknown")]
            steps += [lines_of(tokens.named, f"caller{(count - 1) % owners}"), lines_of(tokens.named, "nobody")]
        assert comparisons == 2
        clock.now_s = float(NOW_S + DAY_S)
        assert tokens.find(expired) is None and tokens.find_expired(expired) is not None
        assert tokens.find(stays) is not None
        found[count] = steps
        clock.now_s = float(NOW_S)
    assert found[2] == found[MANY]


def lines_of(function: Callable[..., Any], *arguments: Any) -> int:
    """Return the number of lines of Python that a call takes."""
    count = 0

    def traced(frame: Any, event: str, argument: Any) -> Any:
        nonlocal count
        count += event == "line"
        return traced

    before = sys.gettrace()
    sys.settrace(traced)
    try:
        function(*arguments)
    finally:
        sys.settrace(before)
    return count


def test_rotation_overlaps(run: Run, file: Path, clock: Clock) -> None:
    made = run("add", "laptop", "--scope", "synthesize", "--scope", "admin", "--per-minute", "5", "--expires", "30d")
    first = made["token"]
    assert made == {
        "name": "laptop",
        "id": made["id"],
        "scopes": ["admin", "synthesize"],
        "expires": "2026-12-26T12:00:00Z",
        "quotas": {"per_minute": 5},
        "token": first,
    }
    assert first not in file.read_text()
    assert file.stat().st_mode & 0o777 == 0o600
    with file.open("a") as stream:
        stream.write("# a comment\n")
    tokens = tokens_of(file, clock)
    assert run("rotate", "laptop").startswith("the latest token of 'laptop' expires: say when the new one does")
    assert "before the end of the overlap" in run("rotate", "laptop", "--expires", "2026-12-01", "--overlap", "10d")
    second = run("rotate", "laptop", "--expires", "90d", "--overlap", "2d")
    assert (second["name"], second["scopes"], second["quotas"]) == ("laptop", made["scopes"], made["quotas"])

    def valid() -> list[bool]:
        clock.now_s += 1  # The file is read again.
        return [tokens.find(token) is not None for token in (first, second["token"])]

    assert valid() == [True, True]
    assert "# a comment\n" in file.read_text()
    states = {entry["id"]: entry["state"] for entry in run("list")["tokens"]}
    assert states == {made["id"]: "replaced", second["id"]: "valid"}
    clock.now_s = NOW_S + 2 * DAY_S - 2.0
    assert valid() == [True, True]
    assert valid() == [False, True]
    assert [entry["state"] for entry in run("list")["tokens"]] == ["expired", "valid"]
    # An expired token goes with the next rotation.
    third = run("rotate", "laptop", "--expires", "never", "--overlap", "0s")
    found = run("list")["tokens"]
    assert [entry["id"] for entry in found] == [second["id"], third["id"]]
    assert [entry["state"] for entry in found] == ["expired", "valid"]
    assert run("rotate", "laptop")["expires"] is None


def test_an_overlap_makes_nothing_valid_for_longer(run: Run) -> None:
    run("add", "laptop", "--expires", "1d")
    run("rotate", "laptop", "--expires", "30d", "--overlap", "7d")
    assert [entry["expires"] for entry in run("list")["tokens"]] == ["2026-11-27T12:00:00Z", "2026-12-26T12:00:00Z"]


def test_tokens_are_revoked_by_owner_or_one_by_one(run: Run, file: Path, clock: Clock) -> None:
    first, second = run("add", "a"), run("rotate", "a")
    other = run("add", "b")
    assert "'a' has a token already" in run("add", "a")
    tokens = tokens_of(file, clock)
    assert tokens.find(first["token"])
    assert [entry["id"] for entry in run("revoke", first["id"])["revoked"]] == [first["id"]]
    clock.now_s += 1
    assert tokens.find(first["token"]) is None
    assert tokens.find(second["token"])
    run("revoke", "a")
    clock.now_s += 1
    assert [tokens.find(made["token"]) is not None for made in (second, other)] == [False, True]
    assert "no token with the name or id 'a'" in run("revoke", "a")
    assert "no token of 'a'" in run("rotate", "a")


def test_a_token_goes_to_a_file_of_its_own(run: Run, file: Path, tmp_path: Path, clock: Clock) -> None:
    place = tmp_path / "token"
    made = run("add", "a", "-o", str(place))
    assert made["token_file"] == str(place) and "token" not in made
    assert place.stat().st_mode & 0o777 == 0o600
    assert tokens_of(file, clock).find(place.read_text().strip())
    before = file.read_text()
    # A token that cannot be written anywhere is not added.
    assert "File exists" in run("rotate", "a", "-o", str(place))
    assert file.read_text() == before


@pytest.mark.parametrize("is_full", [True, False])
@pytest.mark.parametrize("more", [[], ["--json"], ["--json", "-o", "token"]])
def test_a_token_that_cannot_be_shown_is_not_added(more: list[str], is_full: bool, file: Path) -> None:
    """A disk is full, or a reader has left, which is no fault of other commands."""
    write(file, make_token("a", (Scope.SYNTHESIZE,))[1])
    before = file.read_text()
    if is_full:
        place = os.open("/dev/full", os.O_WRONLY)
    else:
        reader, place = os.pipe()
        os.close(reader)
    command = [str(Path(sys.executable).with_name("robosc-server")), "tokens", "rotate", str(file), "a", *more]
    found = subprocess.run(
        command, stdout=place, stderr=subprocess.PIPE, text=True, cwd=file.parent, timeout=PATIENCE_S, check=False
    )
    os.close(place)
    reason = "No space left on device" if is_full else "Broken pipe"
    message = f"robosc-server: the token cannot be written ({reason}), so {file} is unchanged\n"
    assert (found.returncode, found.stderr) == (2, message)
    assert file.read_text() == before
    assert [path.name for path in file.parent.iterdir()] == ["tokens"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--expires", "2020-01-01"), "would have expired already"),
        (("--expires", "0d"), "would have expired already"),
    ],
)
def test_times_that_are_past(words: tuple[str, ...], message: str, run: Run, file: Path) -> None:
    assert message in run("add", "a", *words)
    assert not file.exists()


@pytest.mark.parametrize("word", ["soon", "5", "5 d", "-1d", "2026-13-01", "2026-01-01T00:00:00", ""])
def test_times_that_are_none(word: str, run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        run("add", "a", f"--expires={word}")
    assert "neither a time such as 90d" in capsys.readouterr().err


def test_the_file_stays_what_it_is(run: Run, file: Path, tmp_path: Path) -> None:
    """A link stays one, and readers keep their rights."""
    real = tmp_path / "real"
    real.mkdir()
    write(real / "tokens", "# first")
    (real / "tokens").chmod(0o640)
    file.symlink_to(real / "tokens")
    run("add", "a")
    assert file.is_symlink()
    assert (real / "tokens").stat().st_mode & 0o777 == 0o640
    assert (real / "tokens").read_text().startswith("# first\na synthesize sha256:")
    assert sorted(path.name for path in real.iterdir()) == ["tokens"]


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can change the owner of a file")
def test_the_file_stays_that_of_the_service(run: Run, file: Path) -> None:
    write(file)
    os.chown(file, 4711, 4712)
    run("add", "a")
    assert (file.stat().st_uid, file.stat().st_gid) == (4711, 4712)


def test_files_that_cannot_be_kept(run: Run, file: Path) -> None:
    assert "No such file" in run("list")
    assert "No such file" in run("rotate", "a")
    write(file, "nonsense")
    assert f"{file}:1: expected NAME" in run("add", "a")
    write(file)
    file.chmod(0o622)
    assert "other users may write this file" in run("add", "a")
    assert file.read_text() == ""


def test_a_list_for_people(file: Path, clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    digest = "0f5cabcd" + 56 * "0"
    write(file, f"laptop synthesize sha256:{digest} expires=2026-12-01T00:00:00Z calls=7")
    parser = argparse.ArgumentParser("robosc-server tokens")
    add_tokens_arguments(parser, (Scope.SYNTHESIZE,))
    assert run_tokens(parser.parse_args(["list", str(file)]), clock) == 0
    assert capsys.readouterr().out.splitlines() == [
        "NAME    ID        SCOPES      EXPIRES               STATE         QUOTAS",
        "laptop  0f5cabcd  synthesize  2026-12-01T00:00:00Z  expires soon  calls=7",
    ]


def test_an_invalid_change_keeps_the_tokens_that_are_known(
    file: Path, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    token, line = make_token("a", (Scope.SYNTHESIZE,))
    write(file, line)
    tokens = tokens_of(file, clock)
    write(file, line, "a synthesize sha256:0")
    clock.now_s += 1
    assert tokens.find(token)
    assert "the changed token file is not used" in caplog.text
    with pytest.raises(SecurityError):
        TokenFile(file)
