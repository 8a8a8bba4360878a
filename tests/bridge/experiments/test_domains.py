"""Tests that experiments over ROS 2 stay away from robots."""

import itertools
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from robosc_experiments import domains
from robosc_experiments.domains import own_domain
from robosc_experiments.ros2 import Ros2


def test_two_have_two_domains_and_another_process_a_third(monkeypatch: pytest.MonkeyPatch) -> None:
    # All look for one from the same place on.
    monkeypatch.setattr(domains, "_used", itertools.repeat(0))
    monkeypatch.setattr(os, "getpid", lambda: 40)
    code = """
        import itertools, os
        from robosc_experiments import domains
        domains._used, os.getpid = itertools.repeat(0), lambda: 40
        with domains.own_domain() as found:
            print(found)
    """
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    with own_domain() as first, own_domain() as second:
        command = [sys.executable, "-c", textwrap.dedent(code)]
        third = int(subprocess.check_output(command, env=environment, text=True))
    assert len({first, second, third}) == 3


def test_domains_of_robots_are_never_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(domains, "LAST_DOMAIN", 3)
    monkeypatch.setattr(domains, "_TURTLEBOT3", 2)
    monkeypatch.setenv("ROS_DOMAIN_ID", "3")
    try:
        with own_domain() as found:
            assert found == 1
            with pytest.raises(RuntimeError, match="every ROS domain is in use"), own_domain():
                pass
    except RuntimeError:
        pytest.skip("another process has the only domain")


def test_what_the_environment_says_of_others_does_not_hold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("rclpy")
    monkeypatch.setenv("ROS_DOMAIN_ID", "77")
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    monkeypatch.setenv("ROS_STATIC_PEERS", "192.0.2.1")
    with Ros2().running(tmp_path) as variables:
        assert variables["ROS_DOMAIN_ID"] != "77"
        assert variables["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
        assert "ROS_STATIC_PEERS" not in variables
