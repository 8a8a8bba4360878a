"""A robot on serial lines: synthesis server, client, bridge and simulated TurtleBot3 as processes of their own.

The bridge obtains its supervisor from the server over gRPC and drives the robot through bytes on pseudo-terminals, as
it would a real one. Nothing in it knows that the world passes faster; only numbers of its configuration go by that
(`configuration`).
"""

import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from robosc.model.structure import Deployment
from robosc_experiments.processes import Program, finish
from robosc_experiments.records import Recorded
from robosc_experiments.scenario import ScenarioError
from robosc_simulated.scene import Scene, SceneError, load_scene, scene_names

EXAMPLES = Path(__file__).parents[2] / "examples"
"""The models of the scenarios; they are part of the source tree."""

PATIENCE_S = 0.5
"""Time of the world for which it does not wait for the bridge, in seconds: a robot at 0.1 m/s goes 5 cm meanwhile."""

FASTEST, SLOWEST = 25.0, 0.5
"""Fastest and slowest speed of the world, as a multiple of the clock's."""

SLOWEST_RAD_S = 0.055
"""Slowest rotation, in rad/s: a Burger's wheels stand still below 0.05 rad/s on the worst day of the profiles."""

_BRIDGE_LIMIT_S = 60.0
_SYNTHESIS_LIMIT_S = 120.0


@dataclass(frozen=True)
class Setting(Recorded):
    """Setting of a run.

    Attributes:
        source: Name or file of the scene.
        seed: Seed of what the scene leaves to chance.
        speed: Speed of the world, as a multiple of the clock's.
        lidar: LiDAR of the robot. LDS-01 measures up to 3.5 m, LDS-02 up to 8 m.
        channels: Channels that the communications of the model are mapped to, as lines of the configuration.
        skills: Further lines of its section `skills`, by skill.
    """

    source: str | Path
    seed: int
    speed: float
    lidar: Literal["lds01", "lds02"]
    channels: Mapping[str, str]
    skills: Mapping[str, str]


@dataclass(frozen=True)
class Rig:
    """The processes of a run, and the places where they write.

    Attributes:
        setting: Setting of the run.
        simulator: The robot and its world.
        bridge: Bridge that executes the supervisor.
        address: Address of the bridge's gRPC service.
        used_s: Time that processors had worked for bridge and simulator until then, in seconds.
    """

    setting: Setting
    simulator: Program
    bridge: Program
    address: str
    used_s: tuple[float, float]

    def require(self) -> None:
        """Raise ScenarioError if a process has ended by itself."""
        self.bridge.require()
        self.simulator.require()

    def finish(self) -> dict[str, float]:
        """Bring the robot to rest and end bridge and simulator; what processors worked for them since, as figures.

        Raises:
            ScenarioError: One of them did not end in order.
        """
        used = {
            "bridge_cpu_s": self.bridge.cpu_s - self.used_s[0],
            "simulator_cpu_s": self.simulator.cpu_s - self.used_s[1],
        }
        finish(self.bridge)
        finish(self.simulator)
        return used


def scene_of(source: str | Path, seed: int) -> Scene:
    """A scene; raises ScenarioError if it cannot be used."""
    try:
        return load_scene(source, seed)
    except SceneError as error:
        raise ScenarioError(str(error)) from error


def require_speed(speed: float) -> None:
    """Raise ScenarioError if a world cannot be asked to pass so fast."""
    if not SLOWEST <= speed <= FASTEST:
        raise ScenarioError(f"the speed must be from {SLOWEST:g} to {FASTEST:g}, and is {speed:g}")


def configuration(setting: Setting, base: str, scanner: str, camera: str | None) -> str:
    """Return the bridge's file (YAML).

    Reactions that must be soon in the world are N times as soon by the clock where the world passes N times as fast:
    the wheels stop without the LiDAR or the loop after some second of the world at most, the acceleration that the
    safety layer allows is N times as large by the clock, and a rotation slows down earlier, since an exchange with the
    drive base every 20 ms is one of 20 N ms in the world. Waits without any motion stay as patient as a busy machine
    needs.

    Args:
        setting: Setting of the run.
        base: Port of the drive base.
        scanner: Port of the LiDAR.
        camera: Socket of the camera; None: there is none.
    """
    speed = setting.speed
    # The least that the bridge takes: twice the period, and more than a revolution of the LiDAR.
    loop_limit_s, scan_limit_s = min(max(1.2 / speed, 0.04), 0.3), min(max(1.0 / speed, 0.22), 0.6)
    # One exchange, and one to be felt; gain times delay stays below 1/e (`robosc_bridge.skills.rotate`).
    delay_s = min(2 * 0.02 * speed, 2 * PATIENCE_S) + 0.04
    skills = {
        "rotate": f"speed_rad_s: 0.6, slowest_rad_s: {SLOWEST_RAD_S:g}, "
        f"tolerance_rad: {max(0.02, 0.6 * SLOWEST_RAD_S * delay_s):.4f}, patience_s: 30, "
        f"gain_per_s: {min(2.0, 0.36 / delay_s):.3f}, settle_s: {max(0.4 / speed, 0.06):.3f}",
        **setting.skills,
    }
    if camera is not None:
        skills["line"] = ", ".join(filter(None, (f'camera: "simulated:{camera}"', setting.skills.get("line"))))
    lines = [
        "robot: burger",
        f'drive: {{driver: opencr, port: "{base}", options: {{answer_limit_s: 0.5}}}}',
        f'scanner: {{driver: {setting.lidar}, port: "{scanner}"}}',
        "execution: {period_s: 0.02, every: event}"
        if setting.deployment is Deployment.CONTROLLER
        else f"execution: {{period_s: 0.02, command_timeout_s: {max(1.0 / speed, 0.2):.3f}}}",
        "safety:",
        f"  overrun_s: {loop_limit_s:.3f}",
        f"  scan_timeout_s: {scan_limit_s:.3f}",
        f"  linear_acceleration_m_s2: {min(1.0 * speed, 50.0):g}",
        f"  angular_acceleration_rad_s2: {min(6.0 * speed, 200.0):g}",
        "  motor_timeout_s: 1.0",
        "  command_timeout_s: 1.0",
        # The mouth of a maze leads to the open, where an LDS-01 measures nothing.
        "  stops_when_blind: false",
        "skills:",
        *(f"  {name}: {{{text}}}" for name, text in skills.items()),
        "remote: {grpc_address: 127.0.0.1:0}",
        f'log: {{folder: "{setting.events}"}}',
        "channels:",
        *(f'  "{identifier}": {text}' for identifier, text in setting.channels.items()),
    ]
    return "\n".join(lines) + "\n"


@contextmanager
def running(setting: Setting) -> Iterator[Rig]:
    """Start all programs until the bridge executes its supervisor; all have ended after the block.

    Raises:
        ScenarioError: A step fails; says which.
    """
    require_speed(setting.speed)
    if not setting.model.is_file():
        raise ScenarioError(f"there is no model {setting.model}; scenarios are run in the source tree")
    folder = setting.folder
    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.iterdir()):
        raise ScenarioError(f"{folder} is not empty")
    with ExitStack() as stack:
        server_words = ["-m", "robosc_server.main", "--port", "0", "--state-dir", str(folder / "server")]
        server = stack.enter_context(Program("server", server_words, folder))
        simulator, ports = _simulator(stack, setting)
        synthesis_server = server.wait_for(r"listening on (\S+:\d+)$")[1]
        client = stack.enter_context(_client(setting, synthesis_server))
        file = folder / "bridge.yaml"
        file.write_text(configuration(setting, ports["base"], ports["scanner"], ports.get("camera")), encoding="utf-8")
        bridge = stack.enter_context(
            Program(
                "bridge",
                _words(
                    "-m robosc_bridge.main run",
                    model=setting.model,
                    deployment=setting.deployment,
                    config=file,
                    server=synthesis_server,
                    keep=folder / "kept",
                ),
                folder,
                is_preferred=True,
            )
        )
        address = bridge.wait_for(r"the remote endpoint listens on (\S+:\d+)$", _SYNTHESIS_LIMIT_S)[1]
        bridge.wait_for(r" running$", _BRIDGE_LIMIT_S)
        rig = Rig(setting, simulator, bridge, address, (bridge.cpu_s, simulator.cpu_s))
        _wait_for_supervisor(client)
        (kept,) = (folder / "kept").glob("*.rsup")
        if kept.read_bytes() != setting.supervisor.read_bytes():
            raise ScenarioError("client and bridge were sent different supervisors of the same model")
        yield rig


def _simulator(stack: ExitStack, setting: Setting) -> tuple[Program, dict[str, str]]:
    folder = setting.folder
    # It has another working folder.
    scene = setting.source if setting.source in scene_names() else str(Path(setting.source).resolve())
    program = Program(
        "simulator",
        _words(
            "-m robosc_simulated --base opencr",
            lidar=setting.lidar,
            scene=scene,
            seed=setting.seed,
            speed=setting.speed,
            wait=PATIENCE_S,
            motion=setting.motion,
        ),
        folder,
        is_preferred=True,
        is_asked=True,
    )
    stack.enter_context(program)
    ports: dict[str, str] = {}
    for expected in ("base", "scanner", *(["camera"] if setting.scene.line is not None else [])):
        name, _, path = program.answer(_BRIDGE_LIMIT_S).partition(" ")
        if name != expected:
            raise ScenarioError(f"the simulator printed {name!r} where {expected!r} was expected")
        ports[name] = path
    return program, ports


def _client(setting: Setting, server: str) -> Program:
    """The client, which sends the model and keeps the supervisor that it receives."""
    return Program(
        "client",
        _words(
            "-m robosc_client.command synth",
            setting.model,
            server=server,
            deployment=setting.deployment,
            output=setting.supervisor,
        ),
        setting.folder,
    )


def _wait_for_supervisor(client: Program) -> None:
    end_s = time.monotonic() + _SYNTHESIS_LIMIT_S
    while client.status is None:
        if time.monotonic() > end_s:
            raise ScenarioError(f"the server had no supervisor after {_SYNTHESIS_LIMIT_S:g} s")
        time.sleep(0.02)
    if client.status != 0:
        raise ScenarioError(f"the client ended with status {client.status}:\n{client.output()}")


def _words(begin: str, *places: Path, **options: object) -> list[str]:
    """A command's words: its beginning, files, and options with their names."""
    return [*begin.split(), *map(str, places), *(f"--{name}={value}" for name, value in options.items())]
