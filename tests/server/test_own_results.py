"""Tests of whose results a cache answers with: those of the caller, unless the operator shares them."""

from pathlib import Path

import pytest

from robosc import load
from robosc_api.security import Credentials, Scope, make_token
from robosc_client import Check, Client
from robosc_server.tasks.task import own_key, shared_key
from support.service import served

MODEL = "robot Lamp {\n    component Switch {\n        outgoing message on with type: none\n    }\n}\n"


def test_the_key_of_a_caller() -> None:
    assert own_key("ab", "anna") == own_key("ab", "anna") != own_key("ab", "bert")
    assert shared_key(own_key("ab", "anna")) == shared_key("ab") == "ab"


@pytest.mark.parametrize(("is_shared", "expected"), [(False, [False, True, False]), (True, [False, True, True])])
def test_a_caller_finds_no_results_of_others(tmp_path: Path, is_shared: bool, expected: list[bool]) -> None:
    lines, files = [], []
    for name in ("anna", "bert"):
        token, line = make_token(name, (Scope.SYNTHESIZE,))
        lines.append(line + "\n")
        files.append(tmp_path / name)
        files[-1].write_text(token)
    tokens = tmp_path / "tokens"
    tokens.write_text("".join(lines))
    for file in (*files, tokens):
        file.chmod(0o600)
    found = []
    with served(tokens=tokens, share_results=is_shared) as address:
        for file in (files[0], files[0], files[1]):
            with Client(address, credentials=Credentials(token_file=file)) as client:
                submitted = client.submit(Check(load(text=MODEL)))
                found.append(client.wait(submitted.job.id).from_store)
    assert found == expected
