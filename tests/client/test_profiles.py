"""Servers by name: what is kept, what is refused, and whom a token is sent to."""

import io
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from robosc_api.security import Credentials
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_client.commands.connection import target_of
from robosc_client.main import make_parser
from robosc_client.profiles import Profile, add_profile, profiles_file, read_profiles
from support.certificates import Authority
from support.client_commands import Run
from support.scripted_service import scripted
from support.waiting import PATIENCE_S


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder for settings of its own, and nothing in the environment."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "settings"))
    for name in ("ROBOSC_PROFILE", "ROBOSC_CA", "ROBOSC_TOKEN_FILE"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path / "settings" / "robosc"


def target(*arguments: str) -> Any:
    """Return the server that a command asks, and the credentials that it shows."""
    return target_of(make_parser().parse_args(["version", *arguments]))


def test_added_listed_shown_removed(run: Run, tmp_path: Path, folder: Path) -> None:
    ca = Authority(tmp_path, "ca").file
    assert run("profile", "add", "lab", "--server", "lab.example:50051", "--ca", ca)[0] == 0
    assert run("profile", "add", "home", "--server", "[::1]:1", "--tls", "--json")[0] == 0
    assert run("profile", "list") == (0, f"* {'lab':20} lab.example:50051\n  {'home':20} [::1]:1\n", "")
    status, out, _ = run("profile", "list", "--json")
    assert (status, json.loads(out)["default"], list(json.loads(out)["profiles"])) == (0, "lab", ["lab", "home"])
    assert json.loads(run("profile", "show", "lab", "--json")[1]) == {
        "name": "lab", "default": True, "server": "lab.example:50051", "ca": str(ca)
    }  # fmt: skip
    assert "server       [::1]:1\n" in run("profile", "show", "home")[1]
    assert run("profile", "add", "lab", "--server", "lab:1")[0] == 2
    assert run("profile", "add", "home", "--server", "lab:2", "--force", "--default")[0] == 0
    assert read_profiles().default == "home"
    assert run("profile", "remove", "home")[0] == 0
    assert (read_profiles().default, list(read_profiles().by_name)) == (None, ["lab"])
    assert run("profile", "remove", "home")[0] == 2
    assert run("profile", "show", "home")[0] == 2
    assert profiles_file() == folder / "client.toml"
    assert profiles_file().stat().st_mode & 0o777 == 0o600


def test_a_token_is_kept_for_its_owner_alone(run: Run, monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("secret-token\n"))
    status, out, err = run("profile", "add", "lab", "--server", "127.0.0.1:1", "--token")
    assert status == 0
    assert "secret" not in out + err
    file = folder / "tokens" / "lab"
    assert (file.read_text(), file.stat().st_mode & 0o777) == ("secret-token\n", 0o600)
    assert file.parent.stat().st_mode & 0o777 == 0o700
    assert target()[1].token_file == file
    assert run("profile", "remove", "lab")[0] == 0
    assert not file.exists()
    for text in ("", "two words", "x" * 5000, "é"):
        monkeypatch.setattr(sys, "stdin", io.StringIO(text))
        assert run("profile", "add", "lab", "--server", "127.0.0.1:1", "--token")[0] == 2
    assert not read_profiles().by_name


def test_what_could_never_be_used(run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, folder: Path) -> None:
    """Is refused when it is kept, not when it is needed; no token is asked for before that."""
    none, token = tmp_path / "none", tmp_path / "token"
    token.write_text("secret")
    token.chmod(0o600)
    monkeypatch.setattr(sys, "stdin", io.StringIO("secret\n"))
    for options, words in (
        (["--ca", none], str(none)),
        (["--ca", token], str(token)),
        (["--certificate", none, "--key", none], str(none)),
        (["--key", token], "given together"),
        (["--tls", "--token-file", none], str(none)),
        (["--token-file", token], "only with TLS"),
        (["--token"], "only with TLS"),
    ):
        status, out, err = run("profile", "add", "lab", "--server", "lab.example:1", *options)
        assert (status, out) == (2, ""), options
        assert words in err
        assert err.count("\n") == 1
    assert list(folder.rglob("*")) == []
    assert run("profile", "add", "lab", "--server", "lab.example:1", "--tls", "--token")[0] == 0
    assert run("profile", "add", "here", "--server", "[::1]:1", "--token-file", token)[0] == 0


def test_comments_stay(run: Run) -> None:
    profiles_file().parent.mkdir(parents=True)
    profiles_file().write_text('# mine\n[profiles.lab]  # in the cellar\nserver = "lab:1"\n', encoding="utf-8")
    assert run("profile", "add", "home", "--server", "home:1")[0] == 0
    text = profiles_file().read_text(encoding="utf-8")
    assert "# mine" in text
    assert "# in the cellar" in text
    assert set(read_profiles().by_name) == {"lab", "home"}


@pytest.mark.parametrize(
    "text",
    [
        "server = 1", "default = 'x'", "[profiles.lab]", "[profiles.lab]\nserver = 'x:'", "profiles = 3", "[", "\udcff",
        "[profiles.'a b']\nserver = 'x:1'", "[profiles.lab]\nserver = 'x:1'\ncolour = 'red'",
        "x = '" + "x" * 70_000 + "'", "[profiles.lab]\nserver = 'x:1'\ntls = 1",
        "[profiles.lab]\nserver = 'x:1'\nca = 5", "a = " + "[" * 5000,
        "default = " + "9" * 5000, "[profiles.lab]\nserver = 'x:1'\nca = '~nobody-of-that-name/x'",
    ],
)  # fmt: skip
def test_odd_files(run: Run, text: str) -> None:
    profiles_file().parent.mkdir(parents=True)
    profiles_file().write_bytes(text.encode("utf-8", "surrogateescape"))
    for command in (["profile", "list"], ["version"], ["profile", "add", "x", "--server", "x:1"]):
        status, out, err = run(*command)
        assert (status, out) == (2, "")
        assert str(profiles_file()) in err
        assert err.count("\n") == 1


def test_which_server_is_asked(monkeypatch: pytest.MonkeyPatch, run: Run) -> None:
    status, _, err = run("version")
    assert status == 2
    assert "no server is given" in err
    for name in ("a", "b", "c"):
        assert run("profile", "add", name, "--server", f"{name}:1")[0] == 0
    assert target()[0] == "a:1"
    monkeypatch.setenv("ROBOSC_PROFILE", "b")
    assert target()[0] == "b:1"
    assert target("--profile", "c")[0] == "c:1"
    assert target("--server", "d:1")[0] == "d:1"
    status, _, err = run("version", "--profile", "none")
    assert status == 2
    assert "'none' (there are a, b, c): see robosc-client profile --help" in err
    profiles_file().write_text('default = "a"\n', encoding="utf-8")
    assert "the default 'a' is not one of its profiles (there are none)" in run("version")[2]


def test_whom_a_token_is_sent_to(monkeypatch: pytest.MonkeyPatch, run: Run, tmp_path: Path) -> None:
    """The environment's is for a server that is named; a profile has its own, or none."""
    environment, own, given = (tmp_path / name for name in ("environment", "own", "given"))
    own.write_text("secret")
    own.chmod(0o600)
    monkeypatch.setenv("ROBOSC_TOKEN_FILE", str(environment))
    monkeypatch.setenv("ROBOSC_CA", str(environment))
    assert run("profile", "add", "own", "--server", "127.0.0.2:1", "--token-file", own)[0] == 0
    assert run("profile", "add", "none", "--server", "b:1", "--tls")[0] == 0
    assert target("--server", "c:1") == ("c:1", Credentials(ca=environment, token_file=environment))
    assert target("--profile", "own") == ("127.0.0.2:1", Credentials(token_file=own))
    assert target("--profile", "none") == ("b:1", Credentials(is_secure=True))
    assert target("--profile", "own", "--token-file", str(given)) == ("127.0.0.2:1", Credentials(token_file=given))


def test_an_address_without_a_port_has_the_default_one(run: Run) -> None:
    assert target("--server", "localhost") == ("localhost:50051", Credentials())
    assert run("profile", "add", "added", "--server", "[::1]")[0] == 0
    assert target("--profile", "added")[0] == "[::1]:50051"
    profiles_file().write_text("[profiles.written]\nserver = 'lab.example'\n", encoding="utf-8")
    assert target("--profile", "written")[0] == "lab.example:50051"
    profiles_file().write_text("[profiles.wrong]\nserver = 'lab:'\n", encoding="utf-8")
    status, _, err = run("version", "--profile", "wrong")
    assert status == 2
    assert "profile 'wrong': 'server' must be HOST or HOST:PORT" in err


def test_what_a_profile_says_is_relative_to_its_file() -> None:
    profiles_file().parent.mkdir(parents=True)
    profiles_file().write_text("[profiles.lab]\nserver = 'x:1'\nca = 'ca.pem'\n", encoding="utf-8")
    assert target("--profile", "lab")[1].ca == profiles_file().parent / "ca.pem"


def test_without_a_home(monkeypatch: pytest.MonkeyPatch, run: Run) -> None:
    monkeypatch.setenv("XDG_CONFIG_HOME", "relative")
    monkeypatch.setattr(Path, "home", lambda: (_ for _ in ()).throw(RuntimeError))
    assert run("version")[0] == 2
    with scripted(GetVersion=[[pb.GetVersionResponse(version="1")]]) as (address, _):
        assert run("version", "--server", address)[0] == 0


def test_a_folder_that_cannot_be_written(run: Run, folder: Path) -> None:
    folder.parent.mkdir(parents=True)
    folder.write_text("a file")
    status, _, err = run("profile", "add", "lab", "--server", "x:1")
    assert status == 2
    assert "Not a directory" in err


def test_a_path_that_is_no_unicode(run: Run, folder: Path, tmp_path: Path) -> None:
    """Cannot stand in the file; nothing is written, and nothing is left."""
    ca = tmp_path / "\udcff.pem"
    Authority(tmp_path).file.rename(ca)
    status, _, err = run("profile", "add", "lab", "--server", "lab:1", "--ca", ca)
    assert status == 2
    assert "not UTF-8" in err
    assert list(folder.rglob("*")) == []


def test_what_is_half_written_does_not_stay(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(source: Path, target: Path) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        add_profile("lab", Profile(server="lab:1"), is_default=False, replaces=False)
    assert list(folder.rglob("*")) == []


def test_ctrl_d_at_the_prompt(folder: Path) -> None:
    main_end, other_end = os.openpty()
    command = [sys.executable, "-m", "robosc_client.main", "profile", "add", "lab", "--server", "[::1]:1", "--token"]
    with subprocess.Popen(
        command, stdin=other_end, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as process:
        # Keys that are typed before the prompt is there do not count.
        assert process.stderr is not None
        assert process.stderr.read(len("token: ")) == "token: "
        os.write(main_end, b"\x04")
        _, err = process.communicate(timeout=PATIENCE_S)
    os.close(main_end)
    os.close(other_end)
    assert process.returncode == 2
    assert err.splitlines()[-1] == "robosc-client: standard input must contain exactly one token"
    assert "Traceback" not in err
    assert not folder.exists()
