"""A line by its address, whatever it runs over."""

from robosc_bridge.host import Host, NetworkPort, Port
from robosc_bridge.transport.network_line import is_network_address
from robosc_bridge.transport.system_host import SYSTEM_HOST

type Line = Port | NetworkPort


def open_line(address: str, baud: int, host: Host = SYSTEM_HOST) -> Line:
    """Open a line.

    Args:
        address: Of `transport.network_line`, or a serial port's path.
        baud: Of a serial port.
        host: Host with these serial ports and this network.

    Raises:
        LineError: It cannot be used.
    """
    return host.open_network(address) if is_network_address(address) else host.open_port(address, baud)
