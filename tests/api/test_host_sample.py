"""Tests of the sample of events by host."""

from robosc_api.security.host_sample import HostSample


class Clock:
    """A clock that a test moves."""

    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def test_one_event_a_host_and_period_is_reported_with_the_number_of_the_others() -> None:
    clock = Clock()
    sample = HostSample(clock)
    assert [sample.take(f"ipv4:10.0.0.1:{port}") for port in range(4)] == [0, None, None, None]
    assert sample.take("ipv4:10.0.0.2:1") == 0
    clock.now_s = 10.0
    assert [sample.take("ipv4:10.0.0.1:9"), sample.take("ipv4:10.0.0.1:9")] == [3, None]


def test_addresses_of_one_ipv6_network_are_one_host() -> None:
    sample = HostSample(Clock())
    assert [sample.take(f"ipv6:[2001:db8::{number:x}]:1") for number in range(3)] == [0, None, None]


def test_more_hosts_than_are_told_apart_share_one_entry() -> None:
    clock = Clock()
    sample = HostSample(clock)
    peers = [f"ipv4:10.0.{number // 256}.{number % 256}:1" for number in range(2000)]
    assert sum(sample.take(peer) is not None for peer in peers) == 1001
    # Silent hosts are forgotten.
    clock.now_s = 60.0
    assert sample.take("ipv4:10.9.9.9:1") == 0
