"""Makes the pictures of the documentation: a live view of a robot in a maze, and a model that is played with.

    make pictures        # needs Chromium

A picture shows what there is: the programs are those that a user starts, and the page is the one that they see.
"""

import sys
import tempfile
import time
from pathlib import Path

from PIL import Image

from robosc.model.structure import Deployment
from robosc_experiments.maze import CHANNELS
from robosc_experiments.processes import Program, interruptible
from robosc_experiments.scenario import ScenarioError
from robosc_experiments.serial import EXAMPLES, Rig, Setting, running, scene_of
from robosc_experiments.tail import latest
from support.browser import CHROMIUM, running_browser, visit

PICTURES = Path(__file__).parents[1] / "docs" / "pictures"
MODEL = EXAMPLES / "maze_solver" / "maze_solver.rscd"
SCENE = "maze-rooms"
PLAYED_EVENTS = {
    "calibrate.request": "",
    "calibrate.response": "true",
    "calibrate.reset": "",
    "Localisation.tau_1": "",
    "person.response": "far",
}
"""Events that have happened when the picture is taken, each with the data that is chosen for it."""

PLAYED = EXAMPLES / "navigation" / "navigation.rscd"

SIZE = (1500, 1000)
COLOURS = 128
"""Colours of a picture: there are few on the page, and a smaller file is seen sooner."""

SPEED = 3.0
WATCHED_S = 60.0
"""Time of the world for which the page has been open when the picture is taken, in seconds: it shows a path by then."""

LIMIT_S = 120.0


def main() -> int:
    """Make every picture; returns the exit status."""
    if CHROMIUM is None:
        print("make_pictures: there is no Chromium on this machine", file=sys.stderr)
        return 1
    PICTURES.mkdir(exist_ok=True)
    try:
        with interruptible(), tempfile.TemporaryDirectory(prefix="robosc-pictures-") as folder:
            print(playground(Path(folder), PICTURES / "playground.png"))
            print(live_view(Path(folder), PICTURES / "live-view.png"))
    except ScenarioError as error:
        print(f"make_pictures: {error}", file=sys.stderr)
        return 1
    return 0


def live_view(folder: Path, picture: Path) -> Path:
    """Make the picture of a live view; returns its file.

    Args:
        folder: Empty folder for the records of the run.
        picture: File of the picture.

    Raises:
        ScenarioError: The robot cannot be started, or stops by itself.
    """
    scene = scene_of(SCENE, 0)
    setting = Setting(folder / "run", MODEL, Deployment.CONTROLLER, scene, SCENE, 0, SPEED, "lds02", CHANNELS, {})
    with running(setting) as rig:
        words = ["-m", "robosc.cli.main", "view", "--bridge", rig.address, "--scene", SCENE, "--address", "127.0.0.1:0"]
        with Program("view", words, folder) as view, running_browser() as browser:
            address = view.wait_for(r"(http://\S+)")[1]
            with visit(browser, address, SIZE, color_scheme="light", reduced_motion="reduce") as seen:
                seen.wait(
                    "() => document.querySelector('#cards svg') && !document.querySelector('#surroundings').hidden"
                )
                _watch(rig)
                # It drives straight on, so that the LiDAR's last turn lies on the walls.
                seen.wait("() => document.querySelector('#requests-count').textContent.startsWith('1 ')")
                seen.page.wait_for_timeout(600)
                height = seen.page.evaluate("document.querySelector('#cards').getBoundingClientRect().bottom + 10")
                seen.page.screenshot(path=picture, clip={"x": 0, "y": 0, "width": SIZE[0], "height": height})
        rig.finish()
    return _small(picture)


def playground(folder: Path, picture: Path) -> Path:
    """Make the picture of a model that is played with; returns its file.

    Args:
        folder: Folder for the records of the program.
        picture: File of the picture.
    """
    words = ["-m", "robosc.cli.main", "view", str(PLAYED), "--address", "127.0.0.1:0"]
    with Program("view", words, folder) as view, running_browser() as browser:
        address = view.wait_for(r"(http://\S+)")[1]
        with visit(browser, address, SIZE, color_scheme="light", reduced_motion="reduce") as seen:
            for event, choice in PLAYED_EVENTS.items():
                if choice:
                    seen.page.locator(f'form[data-event="{event}"] select').select_option(choice)
                seen.page.locator(f'form[data-event="{event}"] button').click()
            seen.wait(f"() => document.querySelector('#play-count').textContent.startsWith('{len(PLAYED_EVENTS)} ')")
            seen.page.evaluate("document.activeElement.blur(), scrollTo(0, 0)")
            seen.page.wait_for_timeout(600)
            seen.page.screenshot(path=picture)
    return _small(picture)


def _small(picture: Path) -> Path:
    """The same picture in a smaller file."""
    Image.open(picture).convert("RGB").quantize(COLOURS).save(picture, optimize=True)
    return picture


def _watch(rig: Rig) -> None:
    """Wait until the robot has gone a way."""
    begin_s, end_s = latest(rig.setting.motion).world_s, time.monotonic() + LIMIT_S
    while latest(rig.setting.motion).world_s < begin_s + WATCHED_S:
        rig.require()
        if time.monotonic() > end_s:
            raise ScenarioError(f"the world was not {WATCHED_S:g} s older after {LIMIT_S:g} s")
        time.sleep(0.05)


if __name__ == "__main__":
    sys.exit(main())
