import pytest

from robosc_api.security import is_loopback_host, is_loopback_peer, joined
from robosc_api.security.addresses import split_address


@pytest.mark.parametrize("host", ["127.0.0.1", "127.9.9.9", "localhost", "::1", "[::1]"])
def test_hosts_of_this_machine(host: str) -> None:
    assert is_loopback_host(host)


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.0.2.1", "no such host", "", "name.invalid", "x" * 300])
def test_other_hosts(host: str) -> None:
    assert not is_loopback_host(host)


@pytest.mark.parametrize(
    "peer",
    ["ipv4:127.0.0.1:4711", "ipv6:[::1]:4711", "ipv6:%5B::1%5D:4711", "ipv6:[::ffff:127.0.0.1]:1", "unix:/run/x"],
)
def test_callers_on_this_machine(peer: str) -> None:
    assert is_loopback_peer(peer)


@pytest.mark.parametrize(
    "peer", ["ipv4:192.0.2.1:4711", "ipv6:[2001:db8::1]:1", "ipv6:[::ffff:192.0.2.1]:1", "", "127.0.0.1", "ipv4:x:1"]
)
def test_callers_elsewhere(peer: str) -> None:
    assert not is_loopback_peer(peer)


def test_addresses_are_taken_apart_and_put_together() -> None:
    assert split_address("[::1]:50061") == ("::1", 50061)
    assert split_address("robot:1") == ("robot", 1)
    assert joined("::1", 5) == joined("[::1]", 5) == "[::1]:5"
    assert joined("robot", 5) == "robot:5"
    for wrong in ("robot", ":1", "robot:70000", "::1:5", "a b:1", "robot:1\n"):
        with pytest.raises(ValueError, match="not HOST:PORT"):
            split_address(wrong)
