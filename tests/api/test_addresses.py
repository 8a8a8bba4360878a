import pytest

from robosc_api.security import is_loopback_host, is_loopback_peer, joined
from robosc_api.security.addresses import split_address, with_port


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


@pytest.mark.parametrize(
    ("given", "whole"),
    [
        ("localhost", "localhost:50051"),
        ("lab.example", "lab.example:50051"),
        ("127.0.0.1", "127.0.0.1:50051"),
        ("[::1]", "[::1]:50051"),
        ("robot-7:1", "robot-7:1"),
        ("[::1]:65535", "[::1]:65535"),
    ],
)
def test_an_address_without_a_port_has_the_services_own(given: str, whole: str) -> None:
    assert with_port(given, 50051) == whole


# A number alone is more likely a port than a host; without brackets the end of an IPv6 address is unknown.
@pytest.mark.parametrize(
    "wrong", ["", ":1", "50051", "::1", "a b", "robot:", "robot:x", "robot:0", "robot:70000", "robot\n", "a:1\n", "x/y"]
)
def test_what_is_no_address_of_a_service(wrong: str) -> None:
    with pytest.raises(ValueError, match="neither HOST nor HOST:PORT: "):
        with_port(wrong, 50051)
