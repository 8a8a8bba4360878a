"""Supervisors are made here, read, or asked for; a foreign one is executed if it is signed or verified."""

import json
import os
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from robosc.certification import make_supervisor
from robosc.language import load_bundle
from robosc.model.structure import Deployment
from robosc.signatures import PublicKey, make_key_pair, read_private_key, sign, signature_file
from robosc.supervisor import Supervisor, encode
from robosc_api.security import Scope, ServerSecurity, make_token
from robosc_bridge.configuration import parse
from robosc_bridge.configuration.structure import SupervisorSource
from robosc_bridge.daemon.supervisors import (
    NoSupervisorError,
    Source,
    cache_folder,
    credentials_of,
    obtain,
    trusted_keys,
)
from support.certificates import Authority
from support.effort import examples
from support.models import STOPPING
from support.service import secured, served

GATE = """robot Carrier {
    component Gate {
        outgoing message open with identifier: "/gate/open", type: none
        outgoing message shut with identifier: "/gate/shut", type: none
        behaviour {
            initial marked state closed { on response from open goto opened }
            marked state opened { on response from shut goto closed }
        }
    }
    component Platform {
        incoming message drive with identifier: "/drive", type: double
    }
    requirement drive needs Gate.opened
    provide drive with 0.2
}
"""
CARRIER = """robot Carrier {
    interface lifts use Lift from carrier_interfaces
    component Platform {
        action lift with identifier: "/lift", request: none, response: none, feedback: none links lifts
        incoming message drive with identifier: "/drive", type: double
        behaviour { initial marked state ready { } }
    }
    provide drive with 0.2
}
"""
LIVELOCK = """robot Carrier {
    component Platform {
        incoming message drive with identifier: "/drive", type: double
        behaviour {
            initial marked state here { transition goto there }
            marked state there { transition goto here }
        }
    }
    provide drive with 0.2
}
"""
CONTROLLER = Deployment.CONTROLLER


def written(folder: Path, text: str = GATE, name: str = "carrier") -> Path:
    file = folder / f"{name}.rscd"
    file.write_text(text, encoding="utf-8")
    return file


def supervisor_of(model: Path, deployment: Deployment = CONTROLLER) -> Supervisor:
    made = make_supervisor(load_bundle(model), deployment=deployment)
    assert made.supervisor is not None
    return made.supervisor


def refusal(source: Source) -> str:
    with pytest.raises(NoSupervisorError) as raised:
        obtain(source)
    assert "\n" not in str(raised.value)
    return str(raised.value)


def test_a_model_is_synthesized_here(tmp_path: Path) -> None:
    model = written(tmp_path)
    messages: list[str] = []
    assert obtain(Source(model, CONTROLLER), messages.append) == supervisor_of(model)
    assert messages == ["carrier.rscd: synthesis"]


def test_a_right_file_is_taken(tmp_path: Path) -> None:
    model = written(tmp_path)
    file = tmp_path / "carrier.rsup"
    file.write_bytes(encode(supervisor_of(model)))
    assert obtain(Source(file, CONTROLLER)) == supervisor_of(model)


def test_a_file_whose_requirement_was_taken_out_is_refused_whatever_it_says_of_itself(tmp_path: Path) -> None:
    model = written(tmp_path)
    careless = written(tmp_path, GATE.replace("requirement drive needs Gate.opened", ""), "careless")
    file = tmp_path / "carrier.rsup"
    file.write_bytes(encode(supervisor_of(careless)))
    assert "not a supervisor of carrier.rscd that can be trusted" in refusal(Source(file, CONTROLLER))
    # Also with the digest of the right texts.
    content = json.loads(file.read_bytes())
    content["supervisor"]["certificate"]["bundle_sha256"] = load_bundle(model).digest
    file.write_text(json.dumps(content))
    assert "carrier.rsup" in refusal(Source(file, CONTROLLER))


def test_a_file_without_its_model_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "carrier.rsup"
    file.write_bytes(encode(supervisor_of(written(tmp_path, name="other"))))
    assert "the model that it is checked against is missing" in refusal(Source(file, CONTROLLER))


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("x.rscd", "robot {", "x.rscd:1:7: error"),
        ("x.rscd", "library L { }", "a library has no robot"),
        ("x.txt", "", "neither a model (.rscd) nor a supervisor (.rsup)"),
        ("carrier.rsup", "{}", "carrier.rsup: "),
        ("missing.rscd", None, "missing.rscd"),
    ],
)
def test_what_is_no_supervisor_is_one_line(tmp_path: Path, name: str, content: str | None, problem: str) -> None:
    written(tmp_path)
    if content is not None:
        (tmp_path / name).write_text(content)
    assert problem in refusal(Source(tmp_path / name, CONTROLLER))


def test_a_supervisor_for_another_deployment_is_refused_if_its_model_has_actions(tmp_path: Path) -> None:
    file = tmp_path / "carrier.rsup"
    for made, wanted in ((Deployment.LAYER, CONTROLLER), (CONTROLLER, Deployment.LAYER)):
        supervisor = supervisor_of(written(tmp_path, CARRIER), made)
        file.write_bytes(encode(supervisor))
        assert f"made for the deployment {made}, not {wanted}, and its model has actions" in refusal(
            Source(file, wanted)
        )
        # Both deployments are the same without actions.
        supervisor = supervisor_of(written(tmp_path), made)
        file.write_bytes(encode(supervisor))
        assert obtain(Source(file, wanted)) == supervisor


def test_a_layer_that_could_not_tell_messages_apart_is_refused_whatever_it_was_made_for(signed: "Signed") -> None:
    second = 'incoming message crawl with identifier: "/drive", type: double'
    text = GATE.replace("    }\n    requirement", f"        {second}\n    }}\n    requirement")
    text = text.replace("provide drive", "provide crawl with 0.1\n    provide drive")
    model = written(signed.file.parent, text)
    signed.file.write_bytes(encode(supervisor_of(model)))
    as_layer = replace(signed.source(), deployment=Deployment.LAYER)
    problem = "it could not determine whether a request on '/drive' is"
    assert problem in refusal(as_layer)
    assert obtain(signed.source())
    model.unlink()
    signed.sign()
    assert problem in refusal(replace(as_layer, trusted=(signed.ours,)))


# Silent steps that never end.


@pytest.fixture
def endless(tmp_path: Path) -> Path:
    """A file of a supervisor with a livelock, beside its model."""
    file = written(tmp_path, LIVELOCK).with_suffix(".rsup")
    made = make_supervisor(load_bundle(file.with_suffix(".rscd")), allow_livelock=True)
    assert made.supervisor is not None
    assert made.supervisor.certificate.controller is not None
    assert made.supervisor.certificate.controller.finite_response == "failed"
    file.write_bytes(encode(made.supervisor))
    return file


def refused_unless_allowed(source: Source) -> None:
    problem = refusal(source)
    assert "silent steps never end (--allow-livelock overrides this)" in problem
    messages: list[str] = []
    assert obtain(replace(source, allow_livelock=True), messages.append)
    assert "its silent steps may go on for ever" in messages[-1]


def test_silent_steps_that_never_end_are_refused_of_a_model_and_a_file(endless: Path) -> None:
    refused_unless_allowed(Source(endless.with_suffix(".rscd"), CONTROLLER))
    refused_unless_allowed(Source(endless, CONTROLLER))


@pytest.mark.parametrize("said", ["nothing", "not checked"])
def test_a_file_that_hides_them_is_refused(endless: Path, said: str) -> None:
    content = json.loads(endless.read_bytes())
    certificate = content["supervisor"]["certificate"]
    if said == "nothing":
        del certificate["controller"]
    else:
        certificate["controller"]["finite_response"] = said
    endless.write_text(json.dumps(content))
    refused_unless_allowed(Source(endless, CONTROLLER))


def test_they_are_refused_though_the_file_is_signed(signed: "Signed", endless: Path) -> None:
    signed.sign()
    refused_unless_allowed(signed.source(signed.ours))
    endless.with_suffix(".rscd").unlink()
    refused_unless_allowed(signed.source(signed.ours))
    content = json.loads(endless.read_bytes())
    del content["supervisor"]["certificate"]["controller"]
    endless.write_text(json.dumps(content))
    signed.sign()
    refused_unless_allowed(signed.source(signed.ours))


def test_they_are_refused_of_a_server_and_of_what_it_made_last(endless: Path, tmp_path: Path) -> None:
    with served() as address:
        source = Source(endless.with_suffix(".rscd"), CONTROLLER, address, tmp_path / "kept")
        refused_unless_allowed(source)
    refused_unless_allowed(source)


# Cancels that must be possible.


@pytest.mark.parametrize("said", ["failed", "not checked", "nothing of them", "nothing"])
def test_a_cancel_that_must_be_possible_is_refused(tmp_path: Path, said: str) -> None:
    """Check that nothing overrides it: of a model, of a file that tells it, and of one that does not, as older ones."""
    file = written(tmp_path, STOPPING).with_suffix(".rsup")
    source = Source(file.with_suffix(".rscd"), CONTROLLER, allow_livelock=True)
    problem = refusal(source)
    assert "would have to forbid a cancel that must be possible" in problem
    assert "'travel' cannot be cancelled after travel.request, stop.response" in problem
    made = make_supervisor(load_bundle(file.with_suffix(".rscd")), only_shown=True).supervisor
    assert made is not None and made.certificate.controller is not None
    assert made.certificate.controller.cancels == "failed"
    content = json.loads(encode(made))
    certificate = content["supervisor"]["certificate"]
    if said == "nothing":
        del certificate["controller"]
    elif said == "nothing of them":
        del certificate["controller"]["cancels"]
    else:
        certificate["controller"]["cancels"] = said
    file.write_text(json.dumps(content))
    assert "because it forbids a cancel that must be possible" in refusal(replace(source, file=file))
    certificate.setdefault("controller", json.loads(encode(made))["supervisor"]["certificate"]["controller"])
    certificate["controller"]["cancels"] = "passed"
    file.write_text(json.dumps(content))
    assert "it says 'cancels of the controller: passed', which is false" in refusal(replace(source, file=file))


def test_a_robot_without_a_supervisor_is_reported(tmp_path: Path) -> None:
    text = """robot Stuck {
        component Base {
            incoming message drive with identifier: "/drive", type: double
            behaviour { initial state waiting { on request to drive goto done } marked state done { } }
        }
        requirement drive needs Base.done
        provide drive with 0.2
    }"""
    assert "no supervisor exists" in refusal(Source(written(tmp_path, text), CONTROLLER))


# Signed.


@dataclass(frozen=True)
class Signed:
    """A signed supervisor without its model beside it, and keys."""

    file: Path
    ours: PublicKey
    others: PublicKey

    @property
    def signature(self) -> Path:
        return signature_file(self.file)

    def source(self, *keys: PublicKey) -> Source:
        return Source(self.file, CONTROLLER, trusted=keys)

    def sign(self) -> None:
        """With our key, whatever the file is now."""
        self.signature.write_bytes(sign(self.file.read_bytes(), read_private_key(self.file.with_name("a.key"))))


@pytest.fixture
def signed(tmp_path: Path) -> Signed:
    model = written(tmp_path)
    file = tmp_path / "carrier.rsup"
    file.write_bytes(encode(supervisor_of(model)))
    model.unlink()
    ours, others = (make_key_pair(tmp_path / f"{name}.key", tmp_path / f"{name}.pub", name) for name in ("a", "b"))
    found = Signed(file, ours, others)
    found.sign()
    return found


def test_a_signed_file_is_taken_without_its_model_and_without_verification(
    signed: Signed, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr("robosc_bridge.daemon.supervisors.verify_supervisor_file")
    messages: list[str] = []
    found = obtain(signed.source(signed.others, signed.ours), messages.append)
    assert encode(found) == signed.file.read_bytes()
    assert messages == [f"{signed.file}: signed by {signed.ours}"]


def test_a_signature_that_is_not_trusted_is_none(signed: Signed, tmp_path: Path) -> None:
    problem = "is not signed by a trusted key, and the model that it is checked against is missing"
    assert problem in refusal(signed.source(signed.others))
    assert "the model that it is checked against is missing" in refusal(signed.source())
    # The verifier decides with its model.
    written(tmp_path)
    messages: list[str] = []
    obtain(signed.source(signed.others), messages.append)
    assert "which is not a trusted key: it is verified instead" in messages[0]
    assert "verification against carrier.rscd" in messages[1]
    signed.signature.unlink()
    assert obtain(signed.source(signed.ours)) == supervisor_of(tmp_path / "carrier.rscd")


@settings(max_examples=examples(30), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.integers(0, 10**6), change=st.integers(1, 255), is_file=st.booleans())
def test_a_byte_that_is_changed_is_refused(signed: Signed, place: int, change: int, is_file: bool) -> None:
    target = signed.file if is_file else signed.signature
    before = target.read_bytes()
    place %= len(before)
    target.write_bytes(before[:place] + bytes((before[place] ^ change,)) + before[place + 1 :])
    try:
        problem = refusal(signed.source(signed.ours))
        assert is_file is ("the file or its signature has been changed" in problem) or not is_file
    finally:
        target.write_bytes(before)


def test_a_changed_file_is_refused_though_the_verifier_would_pass_it(signed: Signed, tmp_path: Path) -> None:
    """A changed file is not passed over."""
    written(tmp_path)
    signed.file.write_bytes(signed.file.read_bytes().replace(b"\n", b" \n"))
    assert obtain(signed.source())
    assert "does not fit: the file or its signature has been changed" in refusal(signed.source(signed.ours))


def test_a_signed_file_beside_another_model_is_refused(signed: Signed, tmp_path: Path) -> None:
    written(tmp_path, GATE.replace("0.2", "0.3"))
    problem = "it is signed, but was made of other texts than carrier.rscd beside it"
    assert problem in refusal(signed.source(signed.ours))
    written(tmp_path)
    assert obtain(signed.source(signed.ours))


def test_a_signed_file_for_another_deployment_is_refused_if_its_model_has_actions(signed: Signed) -> None:
    as_layer = replace(signed.source(signed.ours), deployment=Deployment.LAYER)
    assert obtain(as_layer).deployment is CONTROLLER
    signed.file.write_bytes(encode(supervisor_of(written(signed.file.parent, CARRIER))))
    signed.sign()
    assert "made for the deployment controller, not layer" in refusal(as_layer)


def test_what_is_signed_and_no_supervisor_is_refused(signed: Signed) -> None:
    signed.file.write_bytes(b"{}")
    signed.sign()
    assert "carrier.rsup: " in refusal(signed.source(signed.ours))


def test_a_signature_that_is_too_large_is_refused(signed: Signed) -> None:
    signed.signature.write_bytes(b"x" * 100_000)
    assert "more bytes than a signature may have (1024)" in refusal(signed.source(signed.ours))


def test_trusted_keys_are_lines_or_files(signed: Signed) -> None:
    file = signed.file.with_name("a.pub")
    assert trusted_keys([str(file), f"{signed.others.line} b"]) == (signed.ours, signed.others)
    assert trusted_keys([]) == ()
    for entry, problem in {
        "ssh-ed25519 AAAA": "supervisor.trusted_keys: no public key (ssh-ed25519 AAAA...)",
        str(file.with_name("none.pub")): "none.pub: No such file or directory",
        str(signed.file): "carrier.rsup: no public key",
    }.items():
        with pytest.raises(NoSupervisorError) as raised:
            trusted_keys([entry])
        assert problem in str(raised.value)


# From a server.


def test_what_a_server_makes_is_checked_kept_and_taken_again_without_it(tmp_path: Path) -> None:
    model, kept = written(tmp_path), tmp_path / "kept"
    with served() as address:
        source = Source(model, CONTROLLER, address, kept)
        assert obtain(source) == supervisor_of(model)
    (file,) = kept.iterdir()
    messages: list[str] = []
    assert obtain(source, messages.append) == supervisor_of(model)
    assert any("what it made last is taken" in text for text in messages)
    # Another model has none.
    other = Source(written(tmp_path, GATE.replace("0.2", "0.3"), "other"), CONTROLLER, address, kept)
    assert "none is kept of an earlier start" in refusal(other)
    # A kept supervisor is not trusted for being there.
    file.write_bytes(encode(supervisor_of(written(tmp_path, GATE.replace("needs Gate.opened", "needs true"), "bad"))))
    assert "that can be trusted" in refusal(source)


def test_without_a_folder_nothing_is_kept(tmp_path: Path) -> None:
    with served() as address:
        obtain(Source(written(tmp_path), CONTROLLER, address))
    assert [path.name for path in tmp_path.iterdir()] == ["carrier.rscd"]


def test_a_disk_that_takes_nothing_does_not_prevent_the_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def full(number: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    model, kept = written(tmp_path), tmp_path / "kept"
    with served() as address:
        assert obtain(Source(model, CONTROLLER, address, kept)) == supervisor_of(model)
    assert [record.levelname for record in caplog.records if "cannot be kept" in record.message] == ["WARNING"]
    assert list(kept.iterdir()) == []


def test_the_folder_is_that_of_the_command_line_the_configuration_or_the_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    given, configured, state = tmp_path / "a", tmp_path / "b", tmp_path / "state"
    monkeypatch.setenv("XDG_STATE_HOME", str(state))
    monkeypatch.setenv("HOME", str(tmp_path))
    chosen = SupervisorSource(keep=str(configured))
    assert cache_folder(given, chosen) == given
    assert cache_folder(None, chosen) == configured
    assert cache_folder(None, SupervisorSource()) == state / "robosc-bridge"
    for nothing in ("", "relative/state"):
        monkeypatch.setenv("XDG_STATE_HOME", nothing)
        assert cache_folder(None, SupervisorSource()) == tmp_path / ".local/state/robosc-bridge"

    def homeless() -> Path:
        raise RuntimeError

    monkeypatch.setattr(Path, "home", homeless)
    assert cache_folder(None, SupervisorSource()) is None
    assert "$HOME is not set" in caplog.text


def test_a_folder_that_may_not_be_looked_into_holds_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def forbidden(path: Path) -> bool:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "is_file", forbidden)
    with served() as address:
        pass
    problem = refusal(Source(written(tmp_path), CONTROLLER, address, tmp_path / "kept"))
    assert "none is kept of an earlier start" in problem


def test_what_a_server_refuses_is_reported(tmp_path: Path) -> None:
    with served() as address:
        assert "x.rscd:1:7: error" in refusal(Source(written(tmp_path, "robot {", "x"), CONTROLLER, address))


def test_a_server_with_tls_and_tokens_is_asked_as_the_configuration_says(tmp_path: Path) -> None:
    authority = Authority(tmp_path)
    certificate, key = authority.sign("server")
    token, line = make_token("robot", (Scope.SYNTHESIZE,))
    (tmp_path / "token").write_text(token)
    (tmp_path / "tokens").write_text(line)
    (tmp_path / "tokens").chmod(0o600)
    security = ServerSecurity(certificate=certificate, key=key, tokens=tmp_path / "tokens")
    text = f"""
    robot: burger
    drive: {{driver: opencr, port: /dev/none}}
    supervisor: {{ca: {authority.file}, token_file: {tmp_path / "token"}}}
    """
    credentials = credentials_of(parse(text.encode(), "test.yaml").configuration.supervisor)
    model = written(tmp_path)
    with served(**secured(security)) as address:
        assert obtain(Source(model, CONTROLLER, address, credentials=credentials)) == supervisor_of(model)
        without = Source(model, CONTROLLER, address, credentials=replace(credentials, token_file=None))
        assert "a valid token is needed" in refusal(without)
        missing = Source(model, CONTROLLER, address, credentials=replace(credentials, token_file=tmp_path / "none"))
        assert "No such file" in refusal(missing)
