import inspect
import json
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

import robosc_bridge.configuration.structure as structure_module
from robosc.execution.runtime.settings import Settings
from robosc_bridge.assembly import EXCHANGE_S
from robosc_bridge.configuration import Configuration, ConfigurationError, load, parse, schema
from robosc_bridge.configuration.channels import (
    CHANNELS,
    ButtonChannel,
    Channel,
    DriveChannel,
    RotateChannel,
    channel_name,
)
from robosc_bridge.configuration.decoding import decode
from robosc_bridge.configuration.document import Document
from robosc_bridge.configuration.structure import Execution
from robosc_bridge.errors import BridgeError
from robosc_bridge.skills import RotateSettings

HEAD = "robot: burger\ndrive: {driver: opencr, port: /dev/ttyACM0}\n"


def configuration(text: str) -> Configuration:
    return parse((HEAD + text).encode(), "c.yaml").configuration


def errors_of(text: str, head: str = HEAD) -> list[str]:
    with pytest.raises(ConfigurationError) as caught:
        parse((head + text).encode(), "c.yaml")
    return str(caught.value).splitlines()


def test_what_is_not_written_has_its_default() -> None:
    found = configuration("")
    assert found.robot == "burger"
    assert found.drive.port == "/dev/ttyACM0"
    assert found.scanner is None
    assert found.execution.period_s == 0.02
    assert found.skills.rotate == RotateSettings()
    assert found.channels == {}


def test_what_is_written_is_there() -> None:
    found = configuration(
        """
scanner: {driver: lds02, port: /dev/ttyUSB0, options: {baud: 115200, tries: [1, 2.5, no]}}
execution:
  period_s: 0.5
  priority: [a, b]
  policy: priority
  max_age_s: {/scan: 1}
  release_identifiers: []
  service_timeout_s: null
safety: {overrun_s: 2, command_timeout_s: 1}
skills: {rotate: {speed_rad_s: 1}, emergency_stop: {stop_keys: [s]}}
remote: {grpc_address: "[::1]:50061"}
channels:
  /cmd_vel: {channel: drive}
  "": {channel: button, name: button_1}
""".replace('"": ', "/b: ")
    )
    assert found.scanner is not None
    assert found.scanner.options == {"baud": 115200, "tries": (1, 2.5, "no")}
    assert found.execution.period_s == 0.5
    assert (found.safety.overrun_s, type(found.safety.overrun_s)) == (2.0, float)
    assert found.execution.priority == ("a", "b")
    assert found.execution.max_age_s == {"/scan": 1.0}
    assert found.execution.release_identifiers == ()
    assert found.execution.service_timeout_s is None
    assert found.skills.rotate.speed_rad_s == 1.0
    assert found.skills.emergency_stop.stop_keys == ("s",)
    assert found.channels == {"/cmd_vel": DriveChannel(), "/b": ButtonChannel(name="button_1", on="press")}


def test_every_mistake_is_told_at_once_with_its_place() -> None:
    found = errors_of(
        """execution:
  period_s: 0
  perod_s: 1
  every: evnt
  priority: [1]
  seed: 1.5
  max_age_s: {x: -1}
  service_timeout_s: fast
safety: 3
channels:
  /a: {channel: drve}
  /b:
  /c: {channel: button}
  /d: drive
  /e: {channel: key, key: s, keys: 1}
  /f: {channel: 7}
zz: 1
""",
        head="robot: burgr\ndrive: {driver: opencr, prt: 3, options: {a: {}, B: 1}}\n",
    )
    channels = "battery, bumper, button, drive, emergency_stop, fault, grpc, imu, key, line, line_lost, log, none, "
    channels += "odometry, rotate, rotated, scanner, stop"
    safety = ", ".join(structure_module.Safety.__struct_fields__)
    assert found == [
        'c.yaml:1: robot: is "burgr"; it must be one of burger, waffle, waffle_pi or a mapping with '
        "wheel_separation_m, linear_m_s, angular_rad_s",
        "c.yaml:2: drive.prt: there is no such key; did you mean 'port'?",
        "c.yaml:2: drive: 'port' is missing: a text of 1 to 4096 characters",
        "c.yaml:2: drive.options.a: is a mapping; it must be true or false or a whole number or a number or a text or "
        "a list: true or false or a whole number or a number or a text each",
        'c.yaml:2: drive.options.B: is "B"; it must be a text like baud or watchdog_s',
        "c.yaml:4: execution.period_s: is 0; it must be a number from 0.001 to 0.5",
        "c.yaml:5: execution.perod_s: there is no such key; did you mean 'period_s'?",
        'c.yaml:6: execution.every: is "evnt"; it must be one of period, event',
        "c.yaml:7: execution.priority[0]: is 1; it must be a text of 1 to 255 characters",
        "c.yaml:8: execution.seed: is 1.5; it must be a whole number from 0 to 2147483647",
        "c.yaml:9: execution.max_age_s.x: is -1; it must be a number above 0, at most 86400",
        'c.yaml:10: execution.service_timeout_s: is "fast"; it must be a number above 0, at most 86400',
        f"c.yaml:11: safety: is 3; it must be a mapping with {safety}",
        'c.yaml:13: channels["/a"].channel: there is no channel "drve"; did you mean \'drive\'?',
        f'c.yaml:14: channels["/b"]: is not filled in; it must be {{channel: NAME}} with one of {channels}',
        "c.yaml:15: channels[\"/c\"]: 'name' is missing: a text of 1 to 40 characters",
        f'c.yaml:16: channels["/d"]: is "drive"; it must be {{channel: NAME}} with one of {channels}',
        "c.yaml:17: channels[\"/e\"].keys: there is no such key; did you mean 'key'?",
        f'c.yaml:18: channels["/f"].channel: there is no channel 7; there is {channels}',
        "c.yaml:19: zz: there is no such key; there is channels, drive, execution, log, remote, robot, safety, "
        "scanner, skills, supervisor, view",
    ]


@pytest.mark.parametrize("text", ["", "# nothing\n", "{}"])
def test_an_empty_file_lacks_what_is_required(text: str) -> None:
    assert [line.rpartition(": ")[0].partition("'")[2] for line in errors_of(text, head="")] == [
        "robot' is missing",
        "drive' is missing",
    ]


@pytest.mark.parametrize(("text", "what"), [("[1]", "a list"), ("words", '"words"'), ("3", "3")])
def test_a_file_that_is_no_mapping_is_told(text: str, what: str) -> None:
    (line,) = errors_of(text, head="")
    assert line.startswith(f"c.yaml:1: the file is {what}; it must be a mapping with robot, drive, scanner")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("period_s: true", "is true; it must be a number from 0.001 to 0.5"),
        ('period_s: "1"', 'is "1"; it must be a number'),
        ("period_s: .nan", 'is ".nan"; it must be a number'),
        ("period_s:", "is nothing; it must be a number"),
        ("period_s: 0.501", "is 0.501"),
        ("seed: true", "is true; it must be a whole number"),
        ("seed: -1", "is -1"),
        ("priority: a", 'is "a"; it must be a list: a text of 1 to 255 characters each'),
        ("priority: ['']", 'execution.priority[0]: is ""; it must be a text of 1 to 255 characters'),
        ("max_age_s: []", "is a list; it must be a mapping"),
        ("policy: [fair]", "is a list; it must be one of fair, priority, random"),
        ("every: " + "x" * 100, 'is "' + "x" * 56 + "...;"),
    ],
)
def test_values_of_a_wrong_kind_are_told(text: str, expected: str) -> None:
    (line,) = errors_of(f"execution:\n  {text}\n")
    assert line.startswith("c.yaml:4: execution.")
    assert expected in line


@pytest.mark.parametrize("address", ["localhost", "host:", "host:123456", "ho st:1", ":1", "host:1\n", "[zz]:1"])
def test_addresses_are_host_and_port(address: str) -> None:
    (line,) = errors_of(f"view: {{address: {json.dumps(address)}}}\n")
    assert "it must be a text like HOST:PORT" in line


@pytest.mark.parametrize(
    "address", ["host:", "host:123456", "ho st:1", ":1", "host:1\n", "host\n", "[zz]:1", "50051", ""]
)
def test_the_server_is_a_host_with_or_without_a_port(address: str) -> None:
    (line,) = errors_of(f"supervisor: {{server: {json.dumps(address)}}}\n")
    assert "it must be a text like HOST or HOST:PORT" in line
    for right in ("localhost", "lab.example:1", "[::1]"):
        assert (
            parse(f"{HEAD}supervisor: {{server: '{right}'}}\n".encode(), "c.yaml").configuration.supervisor.server
            == right
        )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "skills: {rotate: {slowest_rad_s: 0.5, speed_rad_s: 0.4}}",
            "skills.rotate.slowest_rad_s: is 0.5; it must be at most 'speed_rad_s', which is 0.4",
        ),
        ("skills: {line: {top: 0.5, bottom: 0.5}}", "skills.line.top: is 0.5; it must be below 'bottom', which is 0.5"),
        (
            "skills: {line: {smallest: 0.7}}",
            "skills.line.smallest: is 0.7; it must be below 'largest', which is 0.6",
        ),
        (
            "safety: {battery_stop_v: 12, battery_warning_v: 11.5}",
            "safety.battery_stop_v: is 12; it must be at most 'battery_warning_v', which is 11.5",
        ),
        (
            "skills: {emergency_stop: {stop_keys: [a, b], resume_keys: [b]}}",
            "skills.emergency_stop.resume_keys: 'b' stops the robot already",
        ),
        (
            "skills: {emergency_stop: {stop_buttons: [a], resume_buttons: [a]}}",
            "skills.emergency_stop.resume_buttons: 'a' stops the robot already",
        ),
        ("execution: {priority: [a]}", "execution.priority: has no effect unless 'policy' is priority"),
        (
            "execution: {period_s: 0.1}",
            "execution.period_s: is 0.1; it must be at most half of 'safety.overrun_s', which is 0.1",
        ),
        (
            "safety: {overrun_s: 0.03}",
            "safety.overrun_s: is 0.03; it must be at least twice 'execution.period_s', which is 0.02",
        ),
        (
            "safety: {command_timeout_s: 0.03}",
            "safety.command_timeout_s: is 0.03; it must be at least twice 'execution.period_s', which is 0.02",
        ),
        ("remote: {mavlink_key: k}", "remote.mavlink_key: has no effect without 'mavlink_url'"),
        (
            "remote: {mavlink_unsigned_commands: true}",
            "remote.mavlink_unsigned_commands: has no effect without 'mavlink_url'",
        ),
        ("remote: {tokens: t}", "remote.tokens: has no effect without 'grpc_address'"),
    ],
)
def test_contradictions_are_told(text: str, expected: str) -> None:
    assert errors_of(text) == [f"c.yaml:3: {expected}"]


@pytest.mark.parametrize("key", ["escape", "ctrl-c", "ab", "", " ", "\r", "\x03", "\x1a", "a\n"])
def test_a_key_that_can_never_come_is_refused(key: str) -> None:
    given = json.dumps(key)
    for text, place in (
        (f"skills: {{emergency_stop: {{stop_keys: [{given}]}}}}", "skills.emergency_stop.stop_keys[0]"),
        (f"skills: {{emergency_stop: {{resume_keys: [{given}]}}}}", "skills.emergency_stop.resume_keys[0]"),
        (f"channels: {{/k: {{channel: key, key: {given}}}}}", 'channels["/k"].key'),
    ):
        (line,) = errors_of(text)
        assert line.startswith(f"c.yaml:3: {place}: is ")
        assert "it must be a text like space or a single character" in line


@pytest.mark.parametrize("key", ["space", "s", "é", "\t", "\n", "\x1b", "€", "-"])
def test_a_key_that_a_terminal_gives_is_taken(key: str) -> None:
    found = configuration(f"skills: {{emergency_stop: {{stop_keys: [{json.dumps(key)}]}}}}")
    assert found.skills.emergency_stop.stop_keys == (key,)


def test_a_drive_is_not_silent_before_three_exchanges() -> None:
    (line,) = errors_of("safety: {motor_timeout_s: 0.05}")
    assert "is 0.05; it must be a number from 0.06 to 1" in line
    assert configuration("safety: {motor_timeout_s: 0.06}").safety.motor_timeout_s == pytest.approx(3 * EXCHANGE_S)


def test_limits_may_be_equal_where_that_has_a_meaning() -> None:
    text = "skills: {rotate: {slowest_rad_s: 0.5, speed_rad_s: 0.5}}\nsafety: {battery_stop_v: 11.5}"
    assert configuration(text).safety.battery_stop_v == 11.5


def test_a_file_is_loaded_by_its_path(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(HEAD)
    assert load(path).configuration.robot == "burger"
    path.write_text("robot: x")
    with pytest.raises(BridgeError, match=f"{path}:1: robot: "):
        load(path)


def test_the_executor_knows_every_setting_and_most_defaults() -> None:
    mine, theirs = msgspec.structs.asdict(Execution()), Settings()._asdict()
    assert mine.keys() == theirs.keys()
    assert {name for name in mine if mine[name] != theirs[name]} == {"period_s", "every"}


def test_the_shipped_schema_is_that_of_the_structures() -> None:
    path = Path(inspect.getfile(structure_module)).with_name("schema.json")
    text = json.dumps(schema(), indent=2, sort_keys=True, ensure_ascii=False) + "\n"
    assert path.read_text(encoding="utf-8") == text


def test_every_key_is_described_in_the_schema() -> None:
    for name, definition in schema()["$defs"].items():
        assert definition["additionalProperties"] is False, name
        assert definition["description"], name
        for key, value in definition["properties"].items():
            assert key == "channel" or value.get("description"), f"{name}.{key}"


def test_every_channel_is_in_the_table() -> None:
    assert set(CHANNELS) == set(Channel.__args__)
    assert len({channel_name(kind) for kind in CHANNELS}) == len(CHANNELS)


_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-5, 10**6) | st.floats(-5, 1e6) | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=2)
        | st.dictionaries(
            st.sampled_from(["channel", "driver", "port", "rotate", "line", "period_s", "/a", "options", "name"]), inner
        )
    ),
    max_leaves=6,
)


@given(st.dictionaries(st.sampled_from(list(Configuration.__struct_fields__)), _VALUES), st.booleans())
def test_the_decoder_takes_what_msgspec_takes(given_values: dict[str, object], is_complete: bool) -> None:
    values = dict(given_values)
    if is_complete:
        values |= {"robot": "waffle", "drive": {"driver": "opencr", "port": "/dev/x"}}
    try:
        expected: Configuration | None = msgspec.convert(values, Configuration)
    except msgspec.ValidationError:
        expected = None
    try:
        found: Configuration | None = decode(Document("c.yaml", values, {}), Configuration)
    except ConfigurationError:
        found = None
    assert found == expected


def test_a_channel_keeps_its_options() -> None:
    found = configuration("channels: {/r: {channel: rotate, unit: radians, direction: right}}")
    assert found.channels == {"/r": RotateChannel(unit="radians", direction="right")}


def test_a_body_of_ones_own_is_checked_part_by_part() -> None:
    head = "robot: {wheel_separation_m: 0, linear_m_s: fast, wheels: 4}\ndrive: {driver: x, port: y}\n"
    with pytest.raises(ConfigurationError) as raised:
        parse(head.encode(), "c.yaml")
    assert str(raised.value).splitlines() == [
        "c.yaml:1: robot.wheels: there is no such key; there is angular_rad_s, linear_m_s, wheel_separation_m",
        "c.yaml:1: robot.wheel_separation_m: is 0; it must be a number above 0, at most 5",
        'c.yaml:1: robot.linear_m_s: is "fast"; it must be a number above 0, at most 5',
        "c.yaml:1: robot: 'angular_rad_s' is missing: a number above 0, at most 20",
    ]
    found = parse(head.replace("0,", "0.3,").replace("fast, wheels: 4", "1, angular_rad_s: 2").encode(), "c.yaml")
    assert found.configuration.robot == structure_module.Body(wheel_separation_m=0.3, linear_m_s=1.0, angular_rad_s=2.0)
