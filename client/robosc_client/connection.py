"""Options that both clients ask of their channels."""

from robosc_client.convert.assembly import MAXIMUM_BYTES

KEEPALIVE_MS = 60_000
"""A connection on which nothing comes is tried after so long: not more often than servers put up with."""

CHANNEL_OPTIONS: tuple[tuple[str, int | str], ...] = (
    # Behind one name there may be several servers: calls go to all of them by turns, and past one that is gone.
    ("grpc.service_config", '{"loadBalancingConfig": [{"round_robin": {}}]}'),
    # One message holds a whole supervisor; what surrounds it is little.
    ("grpc.max_receive_message_length", MAXIMUM_BYTES + 2**20),
    # The server knows its limit, and tells it.
    ("grpc.max_send_message_length", -1),
    # A proxy for web pages, set in the environment, is none for a service in the next room.
    ("grpc.enable_http_proxy", 0),
    # Whoever calls again wants a new connection soon, not when gRPC's own patience has passed.
    ("grpc.initial_reconnect_backoff_ms", 100),
    ("grpc.max_reconnect_backoff_ms", 5_000),
    # A watch may wait for hours; a connection whose other end has gone without a word must not look like that.
    ("grpc.keepalive_time_ms", KEEPALIVE_MS),
    ("grpc.keepalive_timeout_ms", 10_000),
    ("grpc.http2.max_pings_without_data", 0),
)
