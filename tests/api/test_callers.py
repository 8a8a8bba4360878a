"""Distinction between callers."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from robosc_api.calls import CALL, Call
from robosc_api.security import Entry, Scope, caller_of, is_admin, network_of
from robosc_api.security.callers import host_of


@contextmanager
def under_way(call: Call) -> Iterator[Call]:
    """A call under way; yields it."""
    token = CALL.set(call)
    try:
        yield call
    finally:
        CALL.reset(token)


class Context:
    def __init__(self, peer: str, *names: bytes) -> None:
        self._peer, self._names = peer, names

    def peer(self) -> str:
        return self._peer

    def auth_context(self) -> dict[str, Any]:
        return {"x509_common_name": list(self._names)} if self._names else {}


@pytest.mark.parametrize(
    ("peer", "host"),
    [
        ("ipv4:192.0.2.1:4711", "192.0.2.1"),
        ("ipv6:[2001:db8::1]:4711", "2001:db8::1"),
        ("ipv6:%5B::1%5D:4711", "::1"),
        ("unix:/run/socket", "unix"),
        ("unix-abstract:name", "unix-abstract"),
        ("unknown", "unknown"),
    ],
)
def test_the_host_of_a_peer(peer: str, host: str) -> None:
    assert host_of(peer) == host


def test_a_token_goes_before_a_certificate_and_that_before_a_host() -> None:
    assert caller_of(Context("ipv4:192.0.2.1:4711")) == "192.0.2.1"
    assert caller_of(Context("ipv4:192.0.2.1:4711", b"laptop")) == "laptop"
    with under_way(Call()) as call:
        call.caller = "named"
        assert caller_of(Context("ipv4:192.0.2.1:4711", b"laptop")) == "named"


def test_only_a_token_of_that_scope_makes_an_admin() -> None:
    assert not is_admin()
    for scopes, expected in (({Scope.SYNTHESIZE}, False), ({Scope.ADMIN}, True)):
        with under_way(Call()) as call:
            call.entry = Entry("a", frozenset(scopes), "0" * 64)
            assert is_admin() is expected


@pytest.mark.parametrize(
    ("caller", "network"),
    [
        ("2001:db8:1:2::1", "2001:db8:1:2::/64"),
        ("2001:db8:1:2:ffff::9", "2001:db8:1:2::/64"),
        ("2001:db8:1:3::1", "2001:db8:1:3::/64"),
        ("fe80::1%eth0", "fe80::/64"),
        ("::1", "::1"),
        ("::ffff:192.0.2.1", "::ffff:192.0.2.1"),
        ("192.0.2.1", "192.0.2.1"),
        ("laptop", "laptop"),
        ("unix", "unix"),
    ],
)
def test_who_has_one_address_has_all_of_its_network(caller: str, network: str) -> None:
    assert network_of(caller) == network
