"""`synth -o` and `get -o` with signatures, against a server that answers what a test has written."""

import errno
import os
import tempfile
from pathlib import Path
from typing import Any

import pytest

from robosc.cli.main import main as robosc
from robosc.cli.output import UsageError, write_bytes
from robosc.signatures import make_key_pair, read_private_key, sign
from robosc_api.v1 import jobs_pb2
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_client.commands import supervisor_file
from robosc_client.commands.supervisor_file import write_supervisor
from support.answers import enveloped, exploration, generation, job, supervisor, synthesis, verification
from support.client_commands import MADE, MODEL, SUCCEEDED, Run, encoded_supervisor, job_answers
from support.scripted_service import scripted


class TestSignatures:
    @pytest.fixture
    def made(self, tmp_path: Path) -> Any:
        """A supervisor's file, and keys: `right` has signed it."""
        for name in ("right", "wrong"):
            make_key_pair(tmp_path / f"{name}.key", tmp_path / f"{name}.pub")
        assert robosc(["synth", MODEL, "-o", str(tmp_path / "made.rsup")]) == 0
        content = (tmp_path / "made.rsup").read_bytes()
        return content, sign(content, read_private_key(tmp_path / "right.key"))

    @pytest.mark.parametrize("command", ["synth", "get"])
    def test_checked_and_kept(self, run: Run, tmp_path: Path, made: Any, command: str) -> None:
        content, signature = made
        place = tmp_path / "there.rsup"
        beside = tmp_path / "there.rsup.sig"
        what = ["synth", MODEL] if command == "synth" else ["get", "job-1"]

        def asked(answer: Any, *more: Any) -> Any:
            answers = {
                "Synthesize": [[answer]],
                "GetJob": [[jobs_pb2.GetJobResponse(job=job(9, SUCCEEDED))]],
                "GetJobResult": [enveloped("synthesize", [answer])],
            }
            with scripted(**answers) as (address, _):
                return run(*what, "-o", place, "--server", address, *more)

        trusted = ["--signed-by", tmp_path / "right.pub"]
        assert asked(supervisor(content, signature=signature), *trusted)[0] == 0
        assert (place.read_bytes(), beside.read_bytes()) == (content, signature)
        assert robosc(["verify", str(place), "--signed-by", str(tmp_path / "right.pub")]) == 0
        # The same bytes again, unsigned: their signer vouches for them still.
        assert asked(supervisor(content))[0] == 0
        assert (place.read_bytes(), beside.read_bytes()) == (content, signature)
        # That of another supervisor must not stay.
        place.write_bytes(content + b" ")
        assert asked(supervisor(content))[0] == 0
        assert (place.read_bytes(), beside.exists()) == (content, False)
        place.unlink()
        refused = "the server's supervisor: "
        for answer, keys, words in (
            (supervisor(content), trusted, "the server has not signed the supervisor: it needs a signing_key"),
            (supervisor(content, signature=signature), ["--signed-by", tmp_path / "wrong.pub"], refused),
            (supervisor(content, signature=b"x"), trusted, refused),
            (supervisor(content + b" ", signature=signature), trusted, refused),
        ):
            status, _, err = asked(answer, *keys)
            assert status == 3
            assert err.startswith(f"robosc-client: {words}")
            assert not place.exists()
            assert not beside.exists()

    @pytest.mark.parametrize("signature", [b"", b"by the server"])
    @pytest.mark.parametrize("command", [["synth", MODEL], ["get", "job-1"]])
    def test_what_cannot_be_written(
        self, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Any, signature: bytes
    ) -> None:
        """Leaves the supervisor that was there, and its signature."""
        place, beside = tmp_path / "there.rsup", tmp_path / "there.rsup.sig"
        place.write_bytes(b"old")
        beside.write_bytes(b"its signature")

        def full(*_: Any, **__: Any) -> Any:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        monkeypatch.setattr(tempfile, "mkstemp", full)
        answer = supervisor(encoded_supervisor("line_follower"), signature=signature)
        answers = {**job_answers("synthesize", [answer]), "Synthesize": [[answer]]}
        with scripted(**answers) as (address, _):
            status, out, err = run(*command, "-o", place, "--server", address)
        assert (status, out) == (2, "")
        assert err == f"robosc-client: cannot write {place}: No space left on device\n"
        assert (place.read_bytes(), beside.read_bytes()) == (b"old", b"its signature")

    def test_between_file_and_signature(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        """The file comes first: a signature that is cut off is one that does not fit, never one that fits too much."""
        place, beside = tmp_path / "there.rsup", tmp_path / "there.rsup.sig"
        beside.write_bytes(b"of another")

        def interrupted(path: Path, content: bytes) -> None:
            if path == beside:
                raise KeyboardInterrupt
            write_bytes(path, content)

        monkeypatch.setattr(supervisor_file, "write_bytes", interrupted)
        with pytest.raises(KeyboardInterrupt):
            write_supervisor(place, b"new", b"signature")
        assert (place.read_bytes(), beside.read_bytes()) == (b"new", b"of another")

    def test_a_signature_that_cannot_be_removed(self, tmp_path: Path) -> None:
        place = tmp_path / "there.rsup"
        (tmp_path / "there.rsup.sig").mkdir()
        with pytest.raises(UsageError, match="cannot remove"):
            write_supervisor(place, b"new", b"")
        assert place.read_bytes() == b"new"

    def test_a_pipe_has_nothing_beside_it(self, tmp_path: Path) -> None:
        place = tmp_path / "pipe"
        os.mkfifo(place)
        reader = os.open(place, os.O_RDONLY | os.O_NONBLOCK)
        write_supervisor(place, b"new", b"signature")
        assert os.read(reader, 100) == b"new"
        os.close(reader)
        assert [item.name for item in tmp_path.iterdir()] == ["pipe"]

    def test_no_name_of_a_file(self, run: Run) -> None:
        assert run("synth", MODEL, "-o", ".", "--server", "127.0.0.1:1") == (
            2, "", "robosc-client: -o needs a file path\n"
        )  # fmt: skip

    def test_no_name_for_what_a_job_has_found(self, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        for command in (["get", "job-1"], ["synth", MODEL]):
            status, _, err = run(*command, "-o", "", "--server", "127.0.0.1:1")
            assert status == 2
            assert "the name of a file or folder is empty" in err
        monkeypatch.chdir(tmp_path)
        with scripted(**job_answers("synthesize", [MADE])) as (address, _):
            status, _, err = run("get", "job-1", "-o", ".", "--server", address)
        assert (status, err) == (2, "robosc-client: cannot write .: Is a directory\n")
        assert list(tmp_path.iterdir()) == []

    @pytest.mark.parametrize("command", [["synth", MODEL], ["get", "job-1", "--result"]])
    def test_what_is_no_key(
        self, capfd: pytest.CaptureFixture[str], run: Run, tmp_path: Path, made: Any, command: Any
    ) -> None:
        """Is wrong use, and reported before a server is asked."""
        (tmp_path / "none.pub").write_text("no key\n")
        (tmp_path / "empty.pub").write_text("")
        capfd.readouterr()
        for name in ("none.pub", "empty.pub", "absent.pub", "right.key", "."):
            keys = ["--signed-by", tmp_path / "right.pub", "--signed-by", tmp_path / name]
            status, out, err = run(*command, *keys, "--server", "127.0.0.1:1")
            assert (status, out) == (2, "")
            assert str(tmp_path / name) in err
            assert err.count("\n") == 1

    def test_no_supervisor_to_be_signed(self, run: Run, tmp_path: Path, made: Any) -> None:
        """A wrong model: no signed data are taken."""
        answer = synthesis(reason="no supervisor exists")
        with scripted(Synthesize=[[answer]]) as (address, _):
            options = ["-o", tmp_path / "there.rsup", "--signed-by", tmp_path / "right.pub", "--server", address]
            assert run("synth", MODEL, *options)[0] == 1
        assert not (tmp_path / "there.rsup").exists()

    @pytest.mark.parametrize(
        ("made_of", "options"),
        [
            ("navigation", []),
            ("line_follower", ["--deployment", "layer"]),
        ],
    )
    def test_a_supervisor_that_was_not_asked_for(
        self, run: Run, tmp_path: Path, made: Any, made_of: str, options: Any
    ) -> None:
        """Is refused although its signature is right, and without one, too."""
        content = encoded_supervisor(made_of)
        answer = supervisor(content, signature=sign(content, read_private_key(tmp_path / "right.key")))
        place = tmp_path / "there.rsup"
        with scripted(Synthesize=[[answer]]) as (address, _):
            for trusted in ([], ["--signed-by", tmp_path / "right.pub"]):
                status, _, err = run("synth", MODEL, *options, "-o", place, "--server", address, *trusted)
                assert status == 3
                assert "is refused: it was made" in err
                assert list(tmp_path.glob("there*")) == []

    def test_a_job_s_supervisor(self, run: Run, tmp_path: Path) -> None:
        """Must be one, and of the deployment that is named."""
        place = tmp_path / "there.rsup"
        for answer, options, status in (
            (MADE, ["--deployment", "controller"], 0),
            (MADE, ["--deployment", "layer"], 3),
            (supervisor(b"{}"), [], 3),
        ):
            place.unlink(missing_ok=True)
            with scripted(**job_answers("synthesize", [answer])) as (address, _):
                assert run("get", "job-1", "-o", place, *options, "--server", address)[0] == status
            assert place.exists() == (status == 0)
        assert run("get", "job-1", "--deployment", "layer", "--server", "127.0.0.1:1")[0] == 2

    @pytest.mark.parametrize(
        ("kind", "messages"),
        [
            ("check", [pb.CheckResponse()]),
            ("synthesize", [synthesis()]),
            ("generate", generation()),
            ("explore", exploration()),
            ("verify", [verification()]),
            ("format", [pb.FormatResponse(text="robot R { }\n")]),
        ],
    )
    def test_what_nobody_can_have_signed(self, run: Run, tmp_path: Path, made: Any, kind: str, messages: Any) -> None:
        trusted = ["--signed-by", tmp_path / "right.pub"]
        with scripted(**job_answers(kind, messages)) as (address, _):
            for more in (["-o", tmp_path / "out"], ["--result"], ["--result", "--json"]):
                status, _, err = run("get", "job-1", *more, *trusted, "--server", address)
                assert status == 3
                assert "no supervisor" in err
            assert run("get", "job-1", *trusted, "--server", address)[0] == 2
        assert not (tmp_path / "out").exists()

    def test_results_that_are_printed(self, run: Run, tmp_path: Path, made: Any) -> None:
        content, signature = made
        unknown = b"{}"
        signed = sign(unknown, read_private_key(tmp_path / "right.key"))
        for answer, status in (
            (supervisor(content, signature=signature), 0),
            (supervisor(content), 3),
            (supervisor(unknown, signature=signed), 3),
        ):
            with scripted(**job_answers("synthesize", [answer])) as (address, _):
                options = ["--result", "--signed-by", tmp_path / "right.pub", "--server", address]
                assert run("get", "job-1", *options)[0] == status
