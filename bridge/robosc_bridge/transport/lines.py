"""A line by its address, whatever it runs over."""

from robosc_bridge.transport.network_line import NetworkLine, is_network_address
from robosc_bridge.transport.serial_line import SerialLine

type Line = SerialLine | NetworkLine


def open_line(address: str, baud: int) -> Line:
    """Open a line.

    Args:
        address: Of `transport.network_line`, or a serial port's path.
        baud: Of a serial port.

    Raises:
        LineError: It cannot be used.
    """
    return NetworkLine(address) if is_network_address(address) else SerialLine(address, baud)
