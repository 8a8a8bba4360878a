"""Options of drivers: as a file can say them, and as the page lists them."""

import inspect
import json
import re
from pathlib import Path
from typing import Any

import pytest

from robosc_bridge.driver_options import DriverOptionError, checked_options, option_types
from robosc_bridge.driver_registry import Driver, Kind, find_driver

PAGE = (Path(__file__).parents[3] / "docs" / "bridge-drivers.md").read_text(encoding="utf-8")
BUILT_IN = [
    (Kind.DRIVE_BASE, "opencr"),
    (Kind.DRIVE_BASE, "dynamixel"),
    (Kind.DRIVE_BASE, "mavlink-rover"),
    (Kind.RANGE_SCANNER, "lds01"),
    (Kind.RANGE_SCANNER, "lds02"),
    (Kind.RANGE_SCANNER, "lds03"),
    (Kind.RANGE_SCANNER, "mavlink-rover"),
]


def _documented(name: str) -> dict[str, Any]:
    """Options and defaults of the page's section."""
    section = next(text for text in re.split(r"^## ", PAGE, flags=re.MULTILINE) if f"`{name}`" in text.split("\n")[0])
    return {
        option: json.loads(default)
        for option, default in re.findall(r"^\| `(\w+)` \| `(.*?)` \|", section, re.MULTILINE)
    }


@pytest.mark.parametrize(("kind", "name"), BUILT_IN)
def test_the_page_lists_every_option_and_its_default(kind: Kind, name: str) -> None:
    driver = find_driver(kind, name)
    types = option_types(driver)
    assert types is not None
    parameters = inspect.signature(driver.make).parameters
    documented = _documented(name)
    if (kind, name) == (Kind.RANGE_SCANNER, "mavlink-rover"):
        documented = {
            option: documented[option] for option in list(documented)[: list(documented).index("motion_limit_s")]
        }
    # Values in JSON: tuples are lists there.
    assert {option: json.loads(json.dumps(parameters[option].default)) for option in types} == documented


def test_options_are_converted_to_what_the_driver_takes() -> None:
    driver = find_driver(Kind.DRIVE_BASE, "dynamixel")
    assert checked_options(driver, {"motors": [3, 4], "watchdog_s": 1}) == {"motors": (3, 4), "watchdog_s": 1.0}


@pytest.mark.parametrize(
    ("name", "options", "problem"),
    [
        ("dynamixel", {"motors": [1, 2, 3]}, "option 'motors': .*length 2"),
        ("dynamixel", {"watchdog_s": "long"}, "option 'watchdog_s': Expected `float`, got `str`"),
        ("opencr", {"calibrates_gyro": "yes"}, "option 'calibrates_gyro': Expected `bool`, got `str`"),
        ("opencr", {"calibrate": True}, "no option 'calibrate'; there is answer_limit_s, calibrates_gyro"),
        ("opencr", {"path": "/dev/null"}, "'path' is not an option: it has a key of its own outside"),
        ("mavlink-rover", {"signing": "key"}, "no option 'signing'; there is .*signing_key"),
    ],
)
def test_what_a_driver_does_not_take_is_reported(name: str, options: dict[str, Any], problem: str) -> None:
    with pytest.raises(DriverOptionError, match=problem):
        checked_options(find_driver(Kind.DRIVE_BASE, name), options)


def test_what_only_a_program_can_give_is_no_option() -> None:
    with pytest.raises(DriverOptionError, match="no option 'clock'"):
        checked_options(find_driver(Kind.RANGE_SCANNER, "lds01"), {"clock": 1})


def test_a_plug_in_that_takes_anything_gets_it() -> None:
    def make(**options: object) -> dict[str, object]:
        return options

    assert checked_options(Driver(Kind.DRIVE_BASE, "cart", "a cart", make), {"wheels": 3}) == {"wheels": 3}


def test_a_plug_in_without_types_is_asked_for_names_alone() -> None:
    def make(path, wheels=4):  # type: ignore[no-untyped-def]
        return path, wheels

    driver = Driver(Kind.DRIVE_BASE, "cart", "a cart", make)
    assert checked_options(driver, {"wheels": "three"}) == {"wheels": "three"}
    with pytest.raises(DriverOptionError, match="no option 'legs'; there is wheels"):
        checked_options(driver, {"legs": 2})


def test_a_rover_signs_with_the_key_of_a_file(tmp_path: Path) -> None:
    make = find_driver(Kind.RANGE_SCANNER, "mavlink-rover").make
    (tmp_path / "key").write_bytes(bytes(range(32)))
    signing = make(path="udpin:127.0.0.1:0", signing_key=str(tmp_path / "key"), signing_link=3)._settings.signing
    assert (signing.key_file, signing.link) == (tmp_path / "key", 3)
    with pytest.raises(Exception, match="the key of signing cannot be read"):
        make(path="udpin:127.0.0.1:0", signing_key=str(tmp_path / "none"))
    with pytest.raises(ValueError, match="signing_link must be from 0 to 255"):
        make(path="udpin:127.0.0.1:0", signing_link=256)
