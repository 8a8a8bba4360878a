"""The page of a bridge, served in a thread of its own."""

import logging

from robosc_bridge.daemon.operations import Operations
from robosc_bridge.daemon.served_endpoint import ServedEndpoint
from robosc_bridge.daemon.view_settings import ViewSettings
from robosc_view.sources import ViewError, require_view

_log = logging.getLogger(__name__)


class ViewEndpoint(ServedEndpoint):
    """The live view of a bridge; an `Endpoint` of the daemon.

    Args:
        operations: The daemon.
        settings: Settings of the server.

    Raises:
        ViewError: The extra `view` is not installed, or there is no such scene.

    Attributes:
        url: URL to open in a browser, with the token; empty: the endpoint does not listen yet.
    """

    def __init__(self, operations: Operations, settings: ViewSettings) -> None:
        require_view()
        from robosc_view.running import RunningBridge
        from robosc_view.scene_map import scene_map
        from robosc_view.server import ViewServer

        super().__init__("live view", "the live view", ViewError)
        self.url = ""
        source = RunningBridge(operations, scene_map(settings.scene, settings.scene_seed))
        # Laid out before the robot moves: a large automaton would hold up everything for a while.
        self._server = ViewServer(settings, lambda: source, is_shared=True, robot=source.robot)

    def start(self) -> None:
        """Listen.

        Raises:
            ViewError: The endpoint cannot listen.
        """
        super().start()
        _log.info("the live view: %s", self.url)

    async def _serve(self) -> None:
        await self._server.start()
        self.address, self.url = self._server.address, self._server.url
        self._is_listening()
        try:
            await self._end.wait()
        finally:
            await self._server.stop()
