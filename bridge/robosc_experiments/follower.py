"""`python -m robosc_experiments.follower`: an existing line follower, which cares for nothing but its line.

It attaches to a bridge over gRPC as the caller of a supervision layer, hears the corrections of its camera and asks for
velocities, again and again: before an obstacle, without a line and after the stop button, too. It counts the requests
that the layer reports as held back. It ends when the bridge does, with a line of its counts, or by SIGTERM.
"""

import argparse
import queue
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any

import grpc
from google.protobuf.struct_pb2 import Value

from robosc_api.v1 import bridge_pb2 as pb
from robosc_api.v1 import bridge_pb2_grpc

SPEED_M_S = 0.15
PERIOD_S = 0.02
CORRECTION, COMMAND = "/line/correction", "/cmd_vel"


class Follower:
    """Follower that requests velocities along the last correction that it heard.

    Args:
        speed_m_s: Speed forward, in m/s.
        period_s: Time between two requests, while no correction comes.

    Attributes:
        asked: Number of velocities that it has asked for.
        blocked: Number of them that were held back.
    """

    def __init__(self, speed_m_s: float, period_s: float) -> None:
        self.asked = 0
        self.blocked = 0
        self._speed_m_s = speed_m_s
        self._period_s = period_s
        self._corrections: queue.SimpleQueue[float | None] = queue.SimpleQueue()

    def requests(self) -> Iterator[pb.AttachRequest]:
        """Yield the messages that it sends: who it is, then velocities until `end`."""
        yield pb.AttachRequest(hello=pb.Hello(name="line follower", is_operator=True))
        correction = 0.0
        while True:
            yield _velocity(self._speed_m_s, correction)
            self.asked += 1
            with suppress(queue.Empty):
                heard = self._corrections.get(timeout=self._period_s)
                if heard is None:
                    return
                correction = heard

    def take(self, response: pb.AttachResponse) -> None:
        """Take a message of the bridge."""
        match response.WhichOneof("message"):
            case "passed_on" if response.passed_on.identifier == CORRECTION:
                self._corrections.put(response.passed_on.data.number_value)
            case "blocked":
                self.blocked += 1

    def end(self) -> None:
        """Ask for nothing more."""
        self._corrections.put(None)


def _velocity(linear_m_s: float, angular_rad_s: float) -> pb.AttachRequest:
    data = Value()
    data.struct_value.update({"linear": {"x": linear_m_s}, "angular": {"z": angular_rad_s}})
    return pb.AttachRequest(request=pb.Message(identifier=COMMAND, data=data))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; 0: a signal ended it, or the bridge has ended; 1: the bridge does not accept its requests."""
    parser = argparse.ArgumentParser(
        prog="python -m robosc_experiments.follower",
        description="Drive along a line through a supervision layer, without a care for anything else.",
    )
    parser.add_argument("--address", required=True, metavar="HOST:PORT", help="of the bridge's gRPC service")
    parser.add_argument("--speed", type=float, default=SPEED_M_S, metavar="M/S", help="default: %(default)s")
    options = parser.parse_args(arguments)
    follower = Follower(options.speed, PERIOD_S)
    status = 0
    with grpc.insecure_channel(options.address, (("grpc.enable_http_proxy", 0),)) as channel:
        stub: Any = bridge_pb2_grpc.BridgeServiceStub(channel)  # type: ignore[no-untyped-call]
        call = stub.Attach(follower.requests())

        def end(number: int, frame: object) -> None:
            follower.end()
            # The thread is a new one: the one that the signal has interrupted may hold gRPC's locks.
            threading.Thread(target=call.cancel, daemon=True).start()

        signal.signal(signal.SIGTERM, end)
        signal.signal(signal.SIGINT, end)
        try:
            for response in call:
                follower.take(response)
        except grpc.RpcError as error:
            if error.code() not in (grpc.StatusCode.CANCELLED, grpc.StatusCode.UNAVAILABLE):
                sys.stderr.write(f"the bridge has ended the stream: {error.details()}\n")
                status = 1
    sys.stdout.write(f"asked {follower.asked} times, blocked {follower.blocked} times\n")
    return status


if __name__ == "__main__":
    sys.exit(main())
