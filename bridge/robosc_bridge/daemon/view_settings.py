"""Settings of where and how the page is served."""

from dataclasses import dataclass, field
from pathlib import Path

from robosc_api.security import ServerSecurity
from robosc_bridge.configuration.structure import Configuration

ADDRESS = "127.0.0.1:8066"
"""Address at which the page is served unless another one is specified."""


@dataclass(frozen=True, slots=True)
class ViewSettings:
    """Settings of where and how the page is served.

    Attributes:
        address: `HOST:PORT`; port 0 picks a free one.
        security: The certificate.
        names: Further names by which browsers reach the server.
        framed_by: Origins, or schemes with their colon, whose pages may show this one in a frame.
        scene: Name or file of the scene that the map shows; None: no scene.
        scene_seed: Seed of the random parts of the scene.
    """

    address: str = ADDRESS
    security: ServerSecurity = field(default_factory=ServerSecurity)
    names: tuple[str, ...] = ()
    framed_by: tuple[str, ...] = ()
    scene: str | None = None
    scene_seed: int = 0


def settings_of(configuration: Configuration) -> ViewSettings | None:
    """Return the settings of a configuration; None: no page is to be served.

    Args:
        configuration: Configuration of the robot.
    """
    view = configuration.view
    chosen = view.address
    if chosen is None:
        return None
    security = ServerSecurity(
        certificate=None if view.tls_certificate is None else Path(view.tls_certificate),
        key=None if view.tls_key is None else Path(view.tls_key),
        insecure_beyond_loopback=view.insecure_beyond_loopback,
    )
    return ViewSettings(chosen, security, view.names, scene=view.scene, scene_seed=view.scene_seed)
