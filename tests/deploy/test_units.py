"""Units of systemd and rules of udev."""

import re
from pathlib import Path

import pytest

from robosc_server.operations.settings import Settings
from robosc_server.operations.shutdown import END_S
from support.containers import TOP
from support.units import read_unit

UNITS = sorted((TOP / "deploy" / "systemd").glob("*.service"))

RULES = TOP / "deploy" / "udev" / "60-robosc.rules"

# udev(7): what a rule may ask, and what it may set.
_ASKED = "ACTION KERNEL SUBSYSTEM SUBSYSTEMS DRIVER ATTR{} ATTRS{} ENV{}".split()

_SET = "SYMLINK GROUP MODE ENV{} ATTR{} GOTO LABEL".split()


@pytest.mark.parametrize("file", UNITS, ids=lambda file: file.stem)
def test_a_unit_promises_nothing_that_its_program_does_not_keep(file: Path) -> None:
    unit = read_unit(file)
    if file.stem == "robosc-server":
        # It does not say that it is ready, or that it is still there.
        assert unit.one("Type") == "exec" and not unit.all("WatchdogSec") and not unit.all("NotifyAccess")
    else:
        assert unit.one("Type") == "notify" and unit.one("NotifyAccess") == "main"
        # A loop that hangs has stopped the wheels long before.
        assert 5 <= float(unit.one("WatchdogSec")) <= 30
    assert unit.one("Restart") == "on-failure" and unit.one("KillMode") == "mixed"
    assert unit.one("DynamicUser") == "yes" and unit.one("WorkingDirectory").endswith(unit.one("StateDirectory"))


def test_the_servers_unit_gives_it_time_to_drain_and_settings_that_there_are() -> None:
    unit = read_unit(TOP / "deploy" / "systemd" / "robosc-server.service")
    assert float(unit.one("TimeoutStopSec")) > Settings().drain_seconds + END_S
    # Dask and what counts the memory of processes read /proc/meminfo and its like.
    assert not unit.all("ProcSubset")
    for text in unit.all("Environment"):
        assert text.partition("=")[0].removeprefix("ROBOSC_SERVER_").lower() in {"config", *Settings.model_fields}
    handed = {text.partition(":")[0] for text in unit.all("LoadCredential")}
    assert handed == {match for text in unit.all("Environment") for match in re.findall(r"%d/(\w+)", text)}


def test_the_bridges_unit_loads_the_drivers_that_its_devices_are_named_by() -> None:
    unit = read_unit(TOP / "deploy" / "systemd" / "robosc-bridge@.service")
    (wanted,) = unit.all("Wants", "Unit")
    assert wanted in unit.all("After", "Unit")
    # By what registers them; those that stand on no USB are part of the kernel.
    drivers = {"ttyACM": {"cdc_acm"}, "ttyUSB": {"ftdi_sio", "cp210x"}, "video4linux": {"uvcvideo"}}
    named = {text.removeprefix("char-").removesuffix(" rw") for text in unit.all("DeviceAllow")}
    assert named == {*drivers, "ttyAMA", "ttyS"}
    assert set(wanted.split()) == {f"modprobe@{name}.service" for names in drivers.values() for name in names}


def test_the_rules_of_udev_can_be_read() -> None:
    """Every line as udev(7) has it: comparisons, then assignments, to keys that there are."""
    labels, jumps = [], []
    for line in RULES.read_text().splitlines():
        if not line or line.startswith("#"):
            continue
        is_setting = False
        for part in line.split(", "):
            match = re.fullmatch(r'([A-Z]+)(\{[A-Za-z_]+\})?(==|!=|=|\+=)"([^"]*)"', part)
            assert match, part
            key = match[1] + ("{}" if match[2] else "")
            if match[3] in ("==", "!="):
                assert key in _ASKED and not is_setting, part
            else:
                assert key in _SET, part
                is_setting = True
            labels += [match[4]] if key == "LABEL" else []
            jumps += [match[4]] if key == "GOTO" else []
    assert len(labels) == len(set(labels)) and set(jumps) == set(labels)


def test_udev_knows_the_devices_that_the_bridge_drives() -> None:
    text = RULES.read_text()
    found = re.findall(r'idVendor}=="(\w{4})", ATTRS{idProduct}=="(\w{4})", SYMLINK\+="robosc-(\w+)"', text)
    assert {name for _, _, name in found} == {"opencr", "u2d2", "lds"}
    documented = (TOP / "docs" / "deployment.md").read_text()
    for vendor, product, name in found:
        assert f"`{vendor}:{product}`" in documented and f"`/dev/robosc-{name}`" in documented
