"""The live view: a web page that shows a robot under its supervisor, as it works or as a log tells it.

Sources (a bridge in this process or over gRPC, the topic `/state` of a ROS 2 node, an event log) tell what happens in
one form; a server hands it to all pages that are open. The page itself lies in the folder `page`. aiohttp and igraph
come with the extra `view`; they are imported only where a page is served.
"""

from robosc_bridge.view.face import ViewFace
from robosc_bridge.view.settings import ViewSettings, settings_of
from robosc_bridge.view.sources import ViewError

__all__ = ["ViewError", "ViewFace", "ViewSettings", "settings_of"]
