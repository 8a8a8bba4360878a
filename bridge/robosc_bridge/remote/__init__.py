"""The remote endpoint: the bridge as a gRPC service for watchers, operators and programs of the model.

It runs in a thread of its own and sees the daemon only through its `Operations`; the control loop never waits for it.
"""

from robosc_bridge.remote.endpoint import RemoteEndpoint, RemoteError, RemoteSettings, serve, settings_of

__all__ = ["RemoteEndpoint", "RemoteError", "RemoteSettings", "serve", "settings_of"]
