"""ROS domain ids that are free on this machine: an experiment must not reach a robot."""

import itertools
import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager

LAST_DOMAIN = 101
"""Above it, ROS 2 would use ports that the system hands out."""

_TURTLEBOT3 = 30
"""Its handbook has robots on this one."""

_used = itertools.count()


@contextmanager
def own_domain() -> Iterator[int]:
    """A domain id that no other process of this machine has from here, for as long as the block lasts.

    Never that of the environment, nor the one of TurtleBot3's handbook: robots may listen there.

    Raises:
        RuntimeError: Every domain is in use.
    """
    # Processes start looking at different places, so that they rarely meet. The next one of a process gets the next
    # domain: what the last one left behind may take a while to go.
    start = os.getpid() + 7 * next(_used)
    for offset in range(LAST_DOMAIN):
        domain = 1 + (start + offset) % LAST_DOMAIN
        if domain == _TURTLEBOT3 or str(domain) == os.environ.get("ROS_DOMAIN_ID"):
            continue
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as taken:
            try:
                # A name in no folder, unix(7): it is given back however the process ends.
                if sys.platform == "linux":
                    taken.bind(f"\0robosc-ros-domain-{domain}")
            except OSError:
                continue
            yield domain
            return
    raise RuntimeError("every ROS domain is in use")
