"""The live view: a web page that shows a robot under its supervisor, while it works or from its log.

Sources (a bridge in this process or over gRPC, the topic `/state` of a ROS 2 node, an event log) report in one form
what happens; a server sends it to all pages that are open. The page itself lies in the folder `page`. aiohttp and
igraph come with the extra `view`; they are imported only where a page is served. The names here are imported on use,
so that the command line can list this command without loading any of it.
"""

from typing import TYPE_CHECKING

from robosc.named_on_use import named_on_use

if TYPE_CHECKING:
    from robosc_view.endpoint import ViewEndpoint
    from robosc_view.sources import ViewError

_HOMES = {"ViewEndpoint": "endpoint", "ViewError": "sources"}

__all__ = ["ViewEndpoint", "ViewError"]


if not TYPE_CHECKING:
    # A type checker knows the names from above, and is to find every other one wrong.
    __getattr__ = named_on_use(__name__, _HOMES)
