"""A camera whose pictures are served on a Unix socket, as a stream of PGM pictures.

Linux has no pseudo-device for cameras without a kernel module (v4l2loopback), so that the bridge reads these pictures
from where they are served. Format: J. Poskanzer and others, "PGM format specification" (netpbm.sourceforge.net): `P5`,
width, height and 255 in a head of text, then the pixels, row by row.
"""

import contextlib
import os
import select
import socket
import tempfile
import threading
from pathlib import Path

from robosc_simulated.pinhole_camera import DARKNESS, Mount, PinholeCamera
from robosc_simulated.world import World

_MOST_CLIENTS = 4


class SimulatedCamera:
    """A camera that looks at what is before the robot, until it is closed.

    Whoever connects gets every picture from then on; one who does not read misses pictures, never parts of them.

    Args:
        world: World in which the robot is.
        link: Place of its socket; None: in a folder of its own.
        mount: The camera and where it sits; None: the usual one.
        seed: Seed of the noise that the world's scene describes.

    Attributes:
        path: Path of the socket.
        is_covered: True if something covers it: its pictures are black.
        is_frozen: True if it has stopped sending pictures.
        sent: Pictures that have gone to a client.

    Raises:
        OSError: There is something at `link` already, or no socket can be there.
    """

    def __init__(self, world: World, link: Path | None = None, mount: Mount | None = None, seed: int = 0) -> None:
        self.is_covered = False
        self.is_frozen = False
        self.sent = 0
        mount = mount or Mount()
        self._world = world
        self._time = world.time
        self._camera = PinholeCamera(mount, world.scene, seed)
        self._period_s = 1.0 / mount.rate_hz
        self._due_s = self._time.now_s()
        self._lock = threading.RLock()
        # Bytes that are still to be sent to each client.
        self._clients: dict[socket.socket, bytes] = {}
        self._listener: socket.socket | None = None
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        if link is None:
            self._folder = tempfile.TemporaryDirectory(prefix="robosc-camera-")
            link = Path(self._folder.name) / "camera"
        self.path = str(link)
        try:
            self._listen()
        except BaseException:
            self._give_back()
            raise
        self._woken, self._waker = os.pipe()
        self._is_open = True
        self._time.join(self._live)
        self._thread = threading.Thread(target=self._serve, name=f"simulated camera {self.path}", daemon=True)
        self._thread.start()

    @property
    def is_connected(self) -> bool:
        """True if it is plugged in."""
        return self._listener is not None

    def disconnect(self) -> None:
        """Pull the plug: the socket is gone, and so are all connections."""
        with self._lock:
            if self._listener is None:
                return
            Path(self.path).unlink(missing_ok=True)
            for each in (self._listener, *self._clients):
                each.close()
            self._listener = None
            self._clients.clear()
        self._wake()

    def reconnect(self) -> None:
        """Plug it in again."""
        with self._lock:
            if self._listener is None and self._is_open:
                self._listen()
        self._wake()

    def close(self) -> None:
        """End it and remove the socket; may be called again."""
        if not self._is_open:
            return
        self._is_open = False
        self._wake()
        self._thread.join()
        self._time.leave(self._live)
        self.disconnect()
        os.close(self._woken)
        os.close(self._waker)
        self._give_back()

    def _give_back(self) -> None:
        if self._folder is not None:
            self._folder.cleanup()

    def _listen(self) -> None:
        # The system's message about an address in use names no path.
        if Path(self.path).exists(follow_symlinks=False):
            raise FileExistsError(f"there is something at {self.path} already")
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            listener.bind(self.path)
            listener.listen(_MOST_CLIENTS)
            listener.setblocking(False)
        except BaseException:
            listener.close()
            raise
        self._listener = listener

    def _wake(self) -> None:
        # A closed pipe: it has ended.
        with contextlib.suppress(OSError):
            os.write(self._waker, b"\0")

    def _serve(self) -> None:
        while self._is_open:
            with self._lock:
                self._live()
                poll = select.poll()
                poll.register(self._woken, select.POLLIN)
                if self._listener is not None:
                    poll.register(self._listener, select.POLLIN)
                # No picture is due without a client.
                waits = self._time.is_manual or not self._clients
                left_s = max(self._due_s - self._time.now_s(), 0.0)
            if self._woken in dict(poll.poll(None if waits else left_s * 1000)):
                os.read(self._woken, 64)

    def _live(self) -> None:
        """Take up who has come, and send the picture that is due."""
        with self._lock:
            self._accept()
            now_s = self._time.now_s()
            if now_s < self._due_s or not self._clients:
                return
            # Pictures that were missed are not made up for.
            self._due_s = max(self._due_s + self._period_s, now_s)
            if not self.is_frozen:
                self._send()

    def _accept(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while self._listener is not None:
                client, _ = self._listener.accept()
                if len(self._clients) >= _MOST_CLIENTS:
                    client.close()
                    continue
                client.setblocking(False)
                self._clients[client] = b""

    def _send(self) -> None:
        shades = self._camera.picture(self._world.pose, self._world.obstacles)
        if self.is_covered:
            shades[:] = DARKNESS
        data = b"P5 %d %d 255\n" % (shades.shape[1], shades.shape[0]) + shades.tobytes()
        for client, rest in list(self._clients.items()):
            try:
                rest = rest[self._passed(client, rest) :]
                if not rest:
                    rest = data[self._passed(client, data) :]
                    self.sent += 1
                self._clients[client] = rest
            except OSError:
                del self._clients[client]
                client.close()

    @staticmethod
    def _passed(client: socket.socket, data: bytes) -> int:
        """Send data and return how much of it went into the client's buffer; raise OSError if the client is gone."""
        with contextlib.suppress(BlockingIOError):
            return client.send(data)
        return 0
