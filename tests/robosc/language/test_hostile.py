"""Texts that are no models, or far too much of one: one clear finding each, in time linear in the text."""

from collections.abc import Callable
from pathlib import Path

import pytest

from robosc.cli.main import main
from robosc.errors import LanguageError
from robosc.language import decode_source
from robosc.language.reading import MAXIMUM_BYTES
from robosc.model.check import check
from robosc.source import Bundle, SourceFile


def codes(text: str, **libraries: str) -> list[str]:
    files = tuple(SourceFile(f"{name}.rscd", source) for name, source in libraries.items())
    return [item.code for item in check(Bundle(SourceFile("model.rscd", text), files)).diagnostics]


@pytest.mark.parametrize(
    ("content", "code"),
    [
        (b"robot R { \xff }", "not-utf8"),
        (b"\xff\xfer\x00o\x00b\x00", "not-utf8"),
        (b" " * (MAXIMUM_BYTES + 1), "file-too-large"),
    ],
)
def test_what_is_no_text(content: bytes, code: str) -> None:
    with pytest.raises(LanguageError) as raised:
        decode_source(content, "model.rscd")
    assert [item.code for item in raised.value.diagnostics] == [code]


def both(times: int, before: str, after: str) -> str:
    """A name with so much before and behind it."""
    return before * times + "a" + after * times


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "empty-file"),
        (" \n\t", "empty-file"),
        ("// nothing", "syntax-error"),
        ("robot R { /* open", "unclosed-comment"),
        ("robot R { component C { incoming message m with identifier: 'x", "unclosed-string"),
        ("robot R { \0 }", "invalid-character"),
        ("robot R { requirement r needs " + "(" * 201 + "a" + ")" * 201 + " }", "nesting-too-deep"),
        ("robot R { requirement r needs " + "min(" * 201 + "a" + ")" * 201 + " }", "nesting-too-deep"),
        ("robot R { requirement r needs " + "if a then b else " * 201 + "c }", "nesting-too-deep"),
        ("robot R { requirement r needs " + "a[" * 201 + "0" + "]" * 201 + " }", "nesting-too-deep"),
        ("robot R { requirement r needs " + "any(x in y: " * 201 + "a" + ")" * 201 + " }", "nesting-too-deep"),
        ("robot R { requirement r needs " + "!" * 201 + "a }", "nesting-too-deep"),
        ("robot R { requirement r needs a" + " + a" * 201 + " }", "nesting-too-deep"),
        ("robot R { requirement r needs 1" + "-1" * 200_000 + " }", "nesting-too-deep"),
        ("robot R { requirement r needs " + both(199, "a[" + "!" * 200, "-a" * 199 + "]") + " }", "nesting-too-deep"),
        (
            "robot R { component C { behaviour { on request to r do "
            + both(190, "a[" + "!" * 200, "-a" * 199 + "]")
            + " := 1 } } }",
            "nesting-too-deep",
        ),
        ("robot R { goal once " + "(" * 201 + "a" + ")" * 201 + " }", "nesting-too-deep"),
        ("robot R { goal once -" + "(" * 201 + "a" + ")" * 201 + " }", "nesting-too-deep"),
        ("robot R { goal " + "!" * 201 + "a leads to a }", "nesting-too-deep"),
        ("robot R { assume allow a leads to a" + " + a" * 201 + " }", "nesting-too-deep"),
        ("robot R { mission m { visit " + "(" * 201 + "a" + ")" * 201 + " } }", "nesting-too-deep"),
        ("robot R { mission m { visit a on " + "!" * 201 + "a from anywhere visit a } }", "nesting-too-deep"),
        ("robot R { mission m while a" + " + a" * 201 + " { visit a } }", "nesting-too-deep"),
        ("robot R { provide r with " + "{ a: " * 201 + "1" + " }" * 201 + " }", "nesting-too-deep"),
        ("robot R { datatype object O { x: " + "array(" * 201 + "double" + ")" * 201 + " } }", "nesting-too-deep"),
        ("robot " + "r" * 1_000_000 + " { }", "name-too-long"),
        ("robot R { constant K: integer = " + "9" * 100_000 + " }", "integer-too-large"),
        ("robot R { constant K: double = " + "9" * 100_000 + ".0 }", "number-too-large"),
        ("robot R { constant K: integer = -2147483649 }", "integer-too-large"),
        ("r\u00f6bot R { }", "syntax-error"),
        ("\ufeffrobot R { }", "syntax-error"),
    ],
)
def test_one_finding(text: str, code: str) -> None:
    assert [item for item in codes(text) if item != "empty-model"] == [code]


def test_a_byte_order_mark_and_lone_carriage_returns_are_no_matter(tmp_path: Path) -> None:
    path = tmp_path / "model.rscd"
    path.write_bytes(b"\xef\xbb\xbfrobot R {\rcomponent C { incoming message m with type: none } // a\r\n}\r")
    assert main(["check", str(path)]) == 0


SIZES = 10_000
LARGE: dict[str, Callable[[int], str]] = {
    "states": lambda n: (
        "robot R { component C { incoming message m with type: none behaviour { initial marked state s { } "
        + "".join(f"state s{i} {{ on request to m goto s }}\n" for i in range(n))
        + "} } }"
    ),
    "components": lambda n: "robot R {" + "".join(f"component C{i} {{ }}\n" for i in range(n)) + "}",
    "enum values": lambda n: (
        "robot R { datatype enum E from integer to {"
        + "".join(f"value = {i} -> v{i}\n" for i in range(n))
        + "default -> no } component C { outgoing message m with type: E behaviour { variable e: E "
        "on response from m do e := value initial marked state s { } } } }"
    ),
    "properties": lambda n: (
        "robot R { interface i use T from p datatype object O {"
        + "".join(f"p{i}: double\n" for i in range(n))
        + "} component C { incoming message m with type: O links i } provide m with {"
        + ",\n".join(f"p{i}: {i}.5" for i in range(n))
        + "} }"
    ),
    "operators": lambda n: (
        "robot R { component C { incoming message m with type: none behaviour { initial marked state s { } } } "
        "requirement m needs C.s" + " and C.s" * n + " }"
    ),
    "goals": lambda n: (
        "robot R { component C { incoming message m with type: none behaviour { initial marked state s { } } }\n"
        + "goal once C.s\ngoal C.s leads to C.s\nassume allow always eventually C.s\n" * n
        + "}"
    ),
    "missions": lambda n: (
        "robot R { component C { incoming message a with type: none incoming message b with type: none behaviour { "
        + "initial marked state s { } } }\n"
        + "".join(f"mission m{i} while C.s {{ visit C.s then C.s on C.s from anywhere visit C.s }}\n" for i in range(n))
        + "prefer a over b\n" * n
        + "}"
    ),
    "visits": lambda n: (
        "robot R { component C { behaviour { initial marked state s { } } }\n"
        + "".join(
            f"mission m{i} {{ visit C.s{' then C.s' * 40}{' on C.s from anywhere visit C.s' * 40} }}\n"
            for i in range(n // 40)
        )
        + "}"
    ),
    "actions": lambda n: (
        "robot R { interface i use T from p\n"
        + "".join(
            f"component C{i} {{ action a{i} with request: none, response: none, feedback: none links i behaviour {{ "
            f"initial marked state s {{ on request to a{i} }} }} }}\nrequirement a{i} needs C{i}.s\n"
            for i in range(n)
        )
        + "}"
    ),
    "constants": lambda n: (
        "robot R { component C { incoming message m with type: none } constant K0: integer = 1\n"
        + "".join(f"constant K{i + 1}: integer = K{i}\n" for i in range(n))
        + "}"
    ),
}


@pytest.mark.timeout(30)
@pytest.mark.parametrize("name", LARGE)
def test_large_models_are_models(name: str) -> None:
    assert codes(LARGE[name](SIZES)) in ([], ["empty-model"])


@pytest.mark.timeout(30)
def test_constants_that_need_each_other_backwards() -> None:
    text = "robot R {" + "".join(f"constant K{i}: integer = K{i + 1}\n" for i in range(SIZES)) + "}"
    found = codes(text)
    assert sorted(found) == ["nesting-too-deep", "unknown-name"]


@pytest.mark.timeout(30)
def test_a_long_chain_of_imports() -> None:
    libraries = {f"l{i}": f"library L{i} {{ component C from L{i + 1} import C }}" for i in range(500)}
    libraries["l500"] = "library L500 { component C { incoming message m with type: none } }"
    assert codes("robot R { component C from L0 import C }", **libraries) == []


@pytest.mark.timeout(30)
@pytest.mark.parametrize(
    "condition",
    [both(190, "if ", " then C.s else C.s"), both(190, "if C.s then ", " else C.s"), "!" * 190 + "C.s"],
    ids=["conditions", "branches", "signs"],
)
def test_what_is_just_not_too_deep_goes_all_the_way(tmp_path: Path, condition: str) -> None:
    condition = condition.replace(" a ", " C.s ")
    path = tmp_path / "model.rscd"
    path.write_text(
        "robot R { component C { incoming message m with type: none behaviour { initial marked state s { } } }"
        f" requirement m needs {condition} }}"
    )
    for command in (
        ["check", "--synthesize"],
        ["synth", "-o", str(tmp_path / "r.rsup")],
        ["doc"],
        ["format"],
        ["generate", "--target", "python", "-o", str(tmp_path / "out")],
    ):
        assert main([command[0], str(path), *command[1:]]) == 0


FOUND: dict[str, Callable[[int], str]] = {
    "nondeterministic-event": lambda n: (
        "robot R { component C { outgoing message m with type: none behaviour {"
        + "on response from m\n" * n
        + "initial marked state s { }"
        + "".join(f"state s{i} {{ on response from m goto s }}\n" for i in range(n))
        + "} } }"
    ),
    "partial-update": lambda n: (
        "robot R { component C {"
        + "".join(f"outgoing message m{i} with type: double\n" for i in range(n))
        + "behaviour { variable v: double initial marked state s {"
        + "".join(f"on response from m{i} do v := value\n" for i in range(n))
        + "}"
        + "".join(f"state s{i} {{ transition goto s }}\n" for i in range(n))
        + "} } }"
    ),
}


@pytest.mark.timeout(30)
@pytest.mark.parametrize("code", FOUND)
def test_many_findings_are_found_and_shown(code: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "model.rscd"
    path.write_text(FOUND[code](SIZES))
    assert main(["check", str(path)]) == 0
    assert capsys.readouterr().err.count(f"[{code}]") >= SIZES


@pytest.mark.timeout(30)
def test_many_imports_from_one_library_and_from_many() -> None:
    count = 10_000
    components = "".join(f"component C{i} {{ incoming message m{i} with type: none }}\n" for i in range(count))
    imports = "".join(f"component C{i} from L import C{i}\n" for i in range(count))
    assert codes(f"robot R {{ {imports} }}", lib=f"library L {{ {components} }}") == []
    libraries = {
        f"l{i}": f"library L{i} {{ component C{i} {{ incoming message m{i} with type: none }} }}" for i in range(2000)
    }
    imports = "".join(f"component C{i} from L{i} import C{i}\n" for i in range(2000))
    assert codes(f"robot R {{ {imports} }}", **libraries) == []


@pytest.mark.timeout(30)
@pytest.mark.parametrize("piece", ["component {", "requirement ", "provide m with {", "state s {", "on ", "constant :"])
def test_many_errors_are_reported_up_to_a_limit(piece: str) -> None:
    found = codes("robot R {" + piece * 50_000 + "}")
    assert 1 <= len(found) <= 100
    assert set(found) <= {"syntax-error", "nesting-too-deep"}
