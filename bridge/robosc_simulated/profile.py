"""Profiles: how far devices, lines and the floor are from ideal, as one word.

`ideal` is what most tests need: exact, and the same each time. `typical` is a robot as it left the factory, on a floor
in a room. `bad-day` has everything at once that is still within the manuals or seen often: an adapter that holds bytes
back for 16 ms, a worn battery, stiff wheels, a scanner that stalls, bits that flip on a long cable. All of it comes by
the seed of the run.

Sources: ROBOTIS e-Manual, pages XL430-W250, XM430-W210, LDS-01 (accuracy: 15 mm below 0.5 m, 5 % beyond; precision:
10 mm, 3.5 %), U2D2 (latency timer) and "TurtleBot3: Features" (19.98 Wh last for two hours and a half); FTDI,
"AN232B-04 Data Throughput, Latency and Handshaking" (62 bytes a packet, 16 ms).
"""

from dataclasses import dataclass

from robosc_simulated.scene import IDEAL as NO_NOISE
from robosc_simulated.scene import Noise, Scene


@dataclass(frozen=True)
class WireErrors:
    """Shares of the packets of one direction that do not come as they were sent.

    Attributes:
        drop: Share that is lost.
        duplicate: Share that comes twice.
        cut: Share that ends too early.
        flip: Share in which one bit is wrong.
    """

    drop: float = 0.0
    duplicate: float = 0.0
    cut: float = 0.0
    flip: float = 0.0


@dataclass(frozen=True)
class Profile:
    """Distance from ideal.

    Attributes:
        name: Name as on the command line.
        noise: Least noise of motion and sensors; a scene may have more.
        pass_s: Time of a pass of OpenCR's loop, in seconds.
        refresh_s: Time of a pass in which it refreshes its registers, in seconds.
        has_wire_time: True if the bytes of the LiDARs take their time on the line.
        ftdi_s: Latency timer of a servo adapter, in seconds; 0: it keeps nothing back.
        usb_s: Time between two USB frames of OpenCR and the LiDARs' adapters, in seconds; 0: none.
        to_host: Errors on the way to the host.
        to_device: Errors on the way from it.
        lag_s: Time constant with which a wheel follows its goal, in seconds.
        dead_band_rad_s: Goals of a wheel below this do not set it in motion.
        warming_c: Temperature of a motor above its surroundings after a long time at full speed.
        charge: Share of the battery's charge at the start; None: its voltage stays 12 V.
        resistance_ohm: Inner resistance of the battery and its cables.
        lidar_share: Standard deviation of a distance, as a share of it, beside that in metres.
        dropout_share: Share of a LiDAR's beams that return nothing.
        spin_up_s: Time until a LiDAR's motor has its speed, in seconds.
        stall_every_s: Mean time between two stalls of that motor, in seconds; 0: it never stalls.
        stall_s: Time of such a stall, in seconds.
        sees_glass: Share of the beams on glass that return.
        dark_reach: Share of its range in which a LiDAR sees dark things.
    """

    name: str
    noise: Noise = NO_NOISE
    pass_s: float = 0.0
    refresh_s: float = 0.0
    has_wire_time: bool = False
    ftdi_s: float = 0.0
    usb_s: float = 0.0
    to_host: WireErrors = WireErrors()
    to_device: WireErrors = WireErrors()
    lag_s: float = 0.0
    dead_band_rad_s: float = 0.0
    warming_c: float = 0.0
    charge: float | None = None
    resistance_ohm: float = 0.0
    lidar_share: float = 0.0
    dropout_share: float = 0.0
    spin_up_s: float = 0.0
    stall_every_s: float = 0.0
    stall_s: float = 0.0
    sees_glass: float = 1.0
    dark_reach: float = 1.0

    def noise_in(self, scene: Scene) -> Noise:
        """Return the noise in a scene: of each kind the stronger one."""
        mine, its = self.noise, scene.noise
        return Noise(
            max(mine.slip_share, its.slip_share),
            max(mine.slip_deviation, its.slip_deviation),
            max(mine.encoder_deviation, its.encoder_deviation),
            max(mine.lidar_m, its.lidar_m),
            max(mine.camera_shades, its.camera_shades),
        )


IDEAL = Profile("ideal")
TYPICAL = Profile(
    "typical",
    noise=Noise(slip_share=0.004, slip_deviation=0.004, encoder_deviation=0.0005, lidar_m=0.004, camera_shades=2.0),
    pass_s=0.0015,
    refresh_s=0.008,
    has_wire_time=True,
    ftdi_s=0.001,
    usb_s=0.001,
    lag_s=0.03,
    dead_band_rad_s=0.03,
    warming_c=8.0,
    charge=0.95,
    resistance_ohm=0.08,
    lidar_share=0.005,
    dropout_share=0.004,
    spin_up_s=1.0,
    sees_glass=0.25,
    dark_reach=0.6,
)
BAD_DAY = Profile(
    "bad-day",
    noise=Noise(slip_share=0.02, slip_deviation=0.02, encoder_deviation=0.003, lidar_m=0.008, camera_shades=5.0),
    pass_s=0.002,
    refresh_s=0.010,
    has_wire_time=True,
    ftdi_s=0.016,
    usb_s=0.001,
    to_host=WireErrors(0.003, 0.002, 0.002, 0.003),
    to_device=WireErrors(0.003, 0.002, 0.002, 0.003),
    lag_s=0.08,
    dead_band_rad_s=0.12,
    warming_c=25.0,
    charge=0.75,
    resistance_ohm=0.15,
    lidar_share=0.02,
    dropout_share=0.03,
    spin_up_s=2.5,
    stall_every_s=60.0,
    stall_s=0.8,
    sees_glass=0.1,
    dark_reach=0.4,
)
PROFILES = {profile.name: profile for profile in (IDEAL, TYPICAL, BAD_DAY)}


def find_profile(name: str) -> Profile:
    """Return the profile of a name.

    Raises:
        ValueError: There is none; says which there are.
    """
    if name not in PROFILES:
        raise ValueError(f"there is no profile {name!r}; there are {', '.join(PROFILES)}")
    return PROFILES[name]
