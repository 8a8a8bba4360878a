"""Simulated devices on pseudo-terminals or on virtual time, and the planar world that they move in and see.

`SimulatedTurtleBot3` is a whole robot; its parts can be put together otherwise: a `World` with `Walls`, `Servo`s on a
`ServoBus`, an `OpenCr`, one of the `LIDARS`, each on a `SimulatedLine`, a `SimulatedCamera` over a `Track`.
`python -m robosc_simulated` serves one in a process of its own. Nothing here knows the drivers' encoders and
decoders: both sides stand on the manuals alone.
"""

from robosc_simulated.battery import Battery
from robosc_simulated.camera import SimulatedCamera
from robosc_simulated.datagram_line import DatagramFaults, DatagramLine
from robosc_simulated.floor import Track, oval, parse_track, spline
from robosc_simulated.lidar import LIDARS, Lds01, Lds02, Lds03, Lidar
from robosc_simulated.line import Faults, SimulatedLine
from robosc_simulated.motion import Motion, MotionError, MotionRecorder, read_motion
from robosc_simulated.opencr import OpenCr
from robosc_simulated.pinhole_camera import Mount, PinholeCamera
from robosc_simulated.profile import BAD_DAY, IDEAL, PROFILES, TYPICAL, Profile
from robosc_simulated.recorder import Record, Recorder, Tap, read_records
from robosc_simulated.robots import BODIES, Body
from robosc_simulated.rover import Rover
from robosc_simulated.scene import Goal, Look, Noise, Obstacle, Scene, SceneError, load_scene, maze_scene, scene_names
from robosc_simulated.servo import HardwareError, Servo
from robosc_simulated.servo_bus import ServoBus
from robosc_simulated.textures import Texture
from robosc_simulated.timebase import Timebase
from robosc_simulated.turtlebot3 import BASES, SimulatedTurtleBot3, wheel_servos
from robosc_simulated.virtual_host import VirtualHost, VirtualTimeError
from robosc_simulated.walls import Walls, maze, open_maze, parse_walls, room
from robosc_simulated.world import Wheel, World

__all__ = [
    "BAD_DAY",
    "BASES",
    "BODIES",
    "IDEAL",
    "LIDARS",
    "PROFILES",
    "TYPICAL",
    "Battery",
    "Body",
    "DatagramFaults",
    "DatagramLine",
    "Faults",
    "Goal",
    "HardwareError",
    "Lds01",
    "Lds02",
    "Lds03",
    "Lidar",
    "Look",
    "Motion",
    "MotionError",
    "MotionRecorder",
    "Mount",
    "Noise",
    "Obstacle",
    "OpenCr",
    "PinholeCamera",
    "Profile",
    "Record",
    "Recorder",
    "Rover",
    "Scene",
    "SceneError",
    "Servo",
    "ServoBus",
    "SimulatedCamera",
    "SimulatedLine",
    "SimulatedTurtleBot3",
    "Tap",
    "Texture",
    "Timebase",
    "Track",
    "VirtualHost",
    "VirtualTimeError",
    "Walls",
    "Wheel",
    "World",
    "load_scene",
    "maze",
    "maze_scene",
    "open_maze",
    "oval",
    "parse_track",
    "parse_walls",
    "read_motion",
    "read_records",
    "room",
    "scene_names",
    "spline",
    "wheel_servos",
]
