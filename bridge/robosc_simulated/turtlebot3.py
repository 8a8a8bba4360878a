"""A whole TurtleBot3 in a world: a drive base and a LiDAR, each on a serial line of its own, and maybe a camera.

Its body may also have the autopilot of a MAVLink rover in place of its own base; the wheels are the autopilot's then.
"""

from pathlib import Path

from robosc.execution.runtime.clock import Clock
from robosc_simulated.battery import Battery
from robosc_simulated.camera import SimulatedCamera
from robosc_simulated.closing import Closing
from robosc_simulated.floor import Track
from robosc_simulated.lidar import LIDARS, Lidar
from robosc_simulated.line import Faults, SimulatedLine
from robosc_simulated.opencr import OpenCr
from robosc_simulated.profile import IDEAL, find_profile
from robosc_simulated.recorder import Recorder
from robosc_simulated.robots import BODIES, Body, find_body
from robosc_simulated.rover import Rover
from robosc_simulated.scene import Scene
from robosc_simulated.servo import Servo
from robosc_simulated.servo_bus import ServoBus
from robosc_simulated.timebase import Timebase
from robosc_simulated.walls import Walls, room
from robosc_simulated.world import World

BASES = ("opencr", "dynamixel", "mavlink-rover")
# The set-up of a TurtleBot3 leaves its motors in this mode.
_VELOCITY_MODE = 1


def wheel_servos(world: World, battery: Battery | None = None) -> tuple[Servo, Servo]:
    """The left and the right servo of a robot, set up as its body says.

    Args:
        world: World that they move in.
        battery: Battery that they live from; None: 12 V.
    """
    body = world.body
    settings = {"baud rate": body.baud_code, "operating mode": _VELOCITY_MODE}
    if body.velocity_limit is not None:
        settings["velocity limit"] = body.velocity_limit
    left, right = (
        Servo(
            body.servo_model,
            world,
            wheel,
            device_id,
            is_mirrored=is_mirrored,
            settings={**settings, "drive mode": int(is_reversed)},
            battery=battery,
        )
        for wheel, device_id, is_mirrored, is_reversed in zip(
            (world.left, world.right), body.ids, body.are_mirrored, body.are_reversed, strict=True
        )
    )
    return left, right


class SimulatedTurtleBot3(Closing):
    """A robot whose devices are served until it is closed.

    Args:
        robot: Key of `BODIES`, a file of a body, or the body itself.
        base: `opencr`, `dynamixel` for two servos behind an adapter, or `mavlink-rover`.
        lidar: Key of `LIDARS`.
        scene: Scene that it is in; None: there are `walls` and a `line` alone.
        walls: Walls around it, in place of a scene; None: a room of 4 m by 3 m.
        clock: Clock of its devices; None: the computer's.
        factor: Factor by which the world is faster than the clock.
        pose: Start pose: x, y in metres, heading in rad; None: where its scene says, or at the origin.
        base_link: Place of the base's port; None: anywhere.
        scanner_link: Place of the LiDAR's port; None: anywhere.
        seed: Seed of all that comes by chance.
        has_motors: True if OpenCR has found its motors when it started.
        calibration_s: Duration of the calibration of OpenCR's gyroscope.
        noise_m: Standard deviation of what the LiDAR measures; None: as its scene and the profile say.
        profile: Name of one of `profile.PROFILES`; None: as its scene says, or `ideal`.
        line: Line on the floor, in place of a scene; with one, there is a camera.
        camera_link: Place of the camera's socket; with a place, there is a camera, also without a line.
        recorder: Recorder that takes all bytes, as of the lines `base` and `scanner`; None: nobody does.
        patience_s: Seconds of the world that pass after the host was heard (`Timebase`); None: it never waits.

    Attributes:
        time: Time that all of it lives by.
        profile: Distance of all of it from ideal.
        battery: Battery that it lives from; None: its voltage is what a test says.
        world: Walls, pose, wheels.
        left: The left servo, also behind OpenCR; of no use where the base is a MAVLink rover.
        right: The right one.
        opencr: The board; None: the servos are reached directly.
        bus: The servos' bus; None: they are not reached directly.
        rover: The autopilot of a MAVLink rover; None: it has another base.
        scanner: The LiDAR.
        base_line: The base's line, with its faults.
        scanner_line: The LiDAR's.
        camera: Camera that looks at the floor; None: there is none.

    Raises:
        ValueError: There is no such robot, base, LiDAR or profile, or there are walls or a line beside a scene.
        FileExistsError: There is something at a link already.
    """

    def __init__(
        self,
        robot: str | Body = "burger",
        base: str = "opencr",
        lidar: str = "lds01",
        *,
        scene: Scene | None = None,
        walls: Walls | None = None,
        clock: Clock | None = None,
        factor: float = 1.0,
        pose: tuple[float, float, float] | None = None,
        base_link: Path | None = None,
        scanner_link: Path | None = None,
        seed: int = 0,
        has_motors: bool = True,
        calibration_s: float = 5.0,
        noise_m: float | None = None,
        line: Track | None = None,
        camera_link: Path | None = None,
        recorder: Recorder | None = None,
        patience_s: float | None = None,
        profile: str | None = None,
    ) -> None:
        body = robot if isinstance(robot, Body) else find_body(robot)
        if body.name not in BODIES and base == "opencr":
            raise ValueError("OpenCR's firmware knows the TurtleBot3s alone: another robot has the base dynamixel")
        for kind, name, known in (("base", base, BASES), ("LiDAR", lidar, LIDARS)):
            if name not in known:
                raise ValueError(f"there is no {kind} {name!r}; there are {', '.join(known)}")
        if scene is None:
            scene = Scene("walls", room(4.0, 3.0) if walls is None else walls, line=line)
        elif walls is not None or line is not None:
            raise ValueError("a scene has its own walls and its own line")
        self.time = Timebase(clock, factor, patience_s)
        self.profile = find_profile(profile or scene.profile or IDEAL.name)
        self.world = World(body, scene, self.time, pose, seed, self.profile)
        self.battery: Battery | None = None
        if self.profile.charge is not None and base != "mavlink-rover":
            self.battery = Battery(self.world, self.profile.charge, self.profile.resistance_ohm)
        self.left, self.right = wheel_servos(self.world, self.battery)
        self.opencr: OpenCr | None = None
        self.bus: ServoBus | None = None
        self.rover: Rover | None = None
        device: OpenCr | ServoBus | Rover
        if base == "opencr":
            device = self.opencr = OpenCr(
                self.world,
                self.left,
                self.right,
                has_motors=has_motors,
                calibration_s=calibration_s,
                pass_s=self.profile.pass_s / self.time.factor,
                refresh_s=self.profile.refresh_s / self.time.factor,
                battery=self.battery,
            )
        elif base == "dynamixel":
            device = self.bus = ServoBus((self.left, self.right))
        else:
            device = self.rover = Rover(self.world)
        noise = self.world.scene.noise.lidar_m if noise_m is None else noise_m
        self.scanner: Lidar = LIDARS[lidar](self.world, seed=seed, noise_m=noise)
        base_tap, scanner_tap = (None if recorder is None else recorder.tap(line) for line in ("base", "scanner"))
        self.base_line = SimulatedLine(device, self.time, base_link, seed, base_tap)
        self._roughen(self.base_line.faults, self.profile.ftdi_s if base == "dynamixel" else self.profile.usb_s)
        self.camera: SimulatedCamera | None = None
        try:
            self.scanner_line = SimulatedLine(self.scanner, self.time, scanner_link, seed + 1, scanner_tap)
            self._roughen(self.scanner_line.faults, self.profile.usb_s)
            try:
                if scene.line is not None or camera_link is not None:
                    self.camera = SimulatedCamera(self.world, camera_link, seed=seed)
            except BaseException:
                self.scanner_line.close()
                raise
        except BaseException:
            self.base_line.close()
            raise

    def _roughen(self, faults: Faults, batch_s: float) -> None:
        """Let a line have the errors of the profile.

        Args:
            faults: Faults of the line.
            batch_s: Time for which its adapter gathers bytes, in seconds.
        """
        there, here = self.profile.to_device, self.profile.to_host
        # Parts of a revolution or of an exchange stay parts where the world passes faster.
        faults.batch_s, faults.has_wire_time = batch_s / self.time.factor, self.profile.has_wire_time
        faults.drop_share, faults.duplicate_share, faults.cut_share, faults.flip_share = (
            here.drop, here.duplicate, here.cut, here.flip,
        )  # fmt: skip
        faults.device_drop_share, faults.device_duplicate_share, faults.device_cut_share, faults.device_flip_share = (
            there.drop, there.duplicate, there.cut, there.flip,
        )  # fmt: skip

    @property
    def base_path(self) -> str:
        """The port of the drive base."""
        return self.base_line.path

    @property
    def scanner_path(self) -> str:
        """The port of the LiDAR."""
        return self.scanner_line.path

    @property
    def base_faults(self) -> Faults:
        """Faults of the base's line."""
        return self.base_line.faults

    @property
    def scanner_faults(self) -> Faults:
        """Faults of the LiDAR's line."""
        return self.scanner_line.faults

    def advance(self, seconds: float) -> None:
        """Let time pass on a `ManualClock`; when it returns, all devices have lived it."""
        self.time.advance(seconds)

    def close(self) -> None:
        """End it; may be called again."""
        if self.camera is not None:
            self.camera.close()
        self.base_line.close()
        self.scanner_line.close()
