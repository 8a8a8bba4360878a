import json
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robosc_bridge.configuration import ConfigurationError
from robosc_bridge.configuration.document import (
    MAXIMUM_BYTES,
    MAXIMUM_DEPTH,
    MAXIMUM_ENTRIES,
    MAXIMUM_SCALAR,
    parse_document,
    read_file,
)


def value_of(text: str) -> object:
    return parse_document(text.encode(), "c.yaml").value


def error_of(text: str | bytes) -> str:
    data = text.encode() if isinstance(text, str) else text
    with pytest.raises(ConfigurationError) as caught:
        parse_document(data, "c.yaml")
    return str(caught.value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("~", None),
        ("null", None),
        ("a:", {"a": None}),
        ("true", True),
        ("False", False),
        ("7", 7),
        ("-0012", -12),
        ("1.5", 1.5),
        (".5", 0.5),
        ("1e-3", 0.001),
        ("-2.E+2", -200.0),
        # Words that YAML 1.1 takes for something else.
        ("on", "on"),
        ("No", "No"),
        ("1:30", "1:30"),
        ("0x1F", "0x1F"),
        ("1_000", "1_000"),
        ("2026-01-01", "2026-01-01"),
        (".inf", ".inf"),
        (".nan", ".nan"),
        ("<<", "<<"),
        ("'7'", "7"),
        ('"null"', "null"),
        ("|\n  true", "true"),
        ("/cmd_vel", "/cmd_vel"),
        ("{}", {}),
        ("[a, [1], {b: c}]", ["a", [1], {"b": "c"}]),
        ("", None),
        ("# only a comment", None),
    ],
)
def test_scalars_are_those_of_the_core_schema(text: str, expected: object) -> None:
    found = value_of(text)
    assert (found, type(found)) == (expected, type(expected))


def test_every_key_has_its_line() -> None:
    document = parse_document(b"# head\na:\n  b: 1\n  c:\n    - x\n    - {d: 2}\n", "c.yaml")
    assert document.lines[("a",)] == 2
    assert document.line(("a", "b")) == 3
    assert document.line(("a", "c", 1)) == 6
    assert document.line(("a", "c", 1, "d")) == 6
    assert document.line(("a", "zz", "yy")) == 2
    assert parse_document(b"", "c.yaml").line(("a",)) is None


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a: 1\nb: 2\na: 3\n", "c.yaml:3: a: is repeated here; it is already in line 1"),
        ("a: &x 1\nb: *x\n", "c.yaml:1: a: aliases and anchors are not allowed; write the value out"),
        ("a: &x 1\nb: *x\n", "c.yaml:2: b: aliases and anchors are not allowed; write the value out"),
        ("&x a: 1\n", "c.yaml:1: a key must not have an anchor or a tag"),
        ("a: !!python/object:os.system 1\n", "c.yaml:1: a: tags are not allowed"),
        ("a: ! 1\n", "c.yaml:1: a: tags are not allowed"),
        ("a: !!str 1\n", "c.yaml:1: a: tags are not allowed"),
        ("a: 1\n---\nb: 1\n", "c.yaml:2: a second document begins here"),
        ("? [a]\n: 1\n", "c.yaml:1: a key must be a word"),
        ("a: [1, 2\n", "c.yaml:2: is not YAML: did not find expected"),
        ("a: 'x\n", "is not YAML"),
        ("a: 1e999\n", 'c.yaml:1: a: "1e999" is too large a number'),
        ("a: \x00\n", "is not YAML"),
        (b"a: 1\nb: \xff\n", "c.yaml:2: is not UTF-8"),
        ("a: [" * (MAXIMUM_DEPTH + 1), f"is nested deeper than {MAXIMUM_DEPTH} levels"),
        ("[" * (MAXIMUM_DEPTH + 1) + "]" * (MAXIMUM_DEPTH + 1), f"is nested deeper than {MAXIMUM_DEPTH} levels"),
        ("[" * 200_000, f"is nested deeper than {MAXIMUM_DEPTH} levels"),
        ("a: [" + "1," * (MAXIMUM_ENTRIES + 1) + "]", f"c.yaml:1: a: has more than {MAXIMUM_ENTRIES} entries"),
        ("".join(f"k{i}: 1\n" for i in range(MAXIMUM_ENTRIES + 1)), f"has more than {MAXIMUM_ENTRIES} entries"),
        ("a: " + "x" * (MAXIMUM_SCALAR + 1), f"c.yaml:1: a: is longer than {MAXIMUM_SCALAR} characters"),
        ("? " + "x" * (MAXIMUM_SCALAR + 1) + "\n: 1", "a key is longer than"),
        (b" " * (MAXIMUM_BYTES + 1), f"c.yaml: is larger than {MAXIMUM_BYTES} bytes"),
    ],
)
def test_what_is_not_allowed_is_reported_with_its_line(text: str | bytes, expected: str) -> None:
    assert expected in error_of(text)


def test_what_is_just_allowed() -> None:
    assert value_of("[" * MAXIMUM_DEPTH + "]" * MAXIMUM_DEPTH) is not None
    many = value_of("[" + ",".join(["1"] * MAXIMUM_ENTRIES) + "]")
    assert isinstance(many, list)
    assert len(many) == MAXIMUM_ENTRIES
    assert value_of("x" * MAXIMUM_SCALAR) == "x" * MAXIMUM_SCALAR
    assert parse_document(b" " * MAXIMUM_BYTES, "c.yaml").value is None


def test_all_problems_are_reported_at_once_and_by_line() -> None:
    lines = error_of("a: !x 1\nb: &y 2\na: 3\n").splitlines()
    assert [line.split(":")[1] for line in lines] == ["1", "2", "3"]


@given(st.binary(max_size=200) | st.text(alphabet="ab:-[]{}&*!|>'\"#%@,? \n\t0.", max_size=60).map(str.encode))
def test_whatever_is_read_gives_a_value_or_one_error(data: bytes) -> None:
    try:
        parse_document(data, "c.yaml")
    except ConfigurationError as error:
        assert error.problems


_TEXTS = st.text(st.characters(categories=("L", "N", "P", "S")) | st.sampled_from(' \n\t"\\'), max_size=8)
_LEAVES = st.none() | st.booleans() | st.integers(-(10**18), 10**18) | _TEXTS
_TREES = st.recursive(
    _LEAVES | st.floats(allow_nan=False, allow_infinity=False),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(_TEXTS, inner, max_size=3),
    max_leaves=10,
)


@given(_TREES.filter(lambda value: _depth(value) < MAXIMUM_DEPTH))
def test_json_is_read_as_json(value: object) -> None:
    assert value_of(json.dumps(value, ensure_ascii=False)) == value


def _depth(value: object) -> int:
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return 1 + max(map(_depth, inner), default=0)


def test_only_regular_files_are_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path, words in (
        (tmp_path, "is not a regular file"),
        (tmp_path / "pipe", "is not a regular file"),
        (Path("/dev/zero"), "is not a regular file"),
        (tmp_path / "missing", "cannot be read: No such file or directory"),
    ):
        with pytest.raises(ConfigurationError, match=words):
            read_file(path)
    file = tmp_path / "c.yaml"
    file.write_bytes(b"x" * (MAXIMUM_BYTES + 5))
    (tmp_path / "link").symlink_to(file)
    assert len(read_file(tmp_path / "link")) == MAXIMUM_BYTES + 1
