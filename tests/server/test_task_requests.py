"""Tests of the requests that the server accepts, byte by byte, and of those that it takes for the same."""

import random
import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import PurePosixPath, PureWindowsPath
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import robosc_server.tasks.requests as requests_module
from robosc.verification import DEFAULT_STATES
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.tasks.requests import NOT_A_MESSAGE, RequestCache, RequestLimits, accept_request
from robosc_server.tasks.task import Reason, RefusedError, Task, TaskKind, own_key
from support.effort import examples
from support.models import EXAMPLES
from support.requests import MESSAGES, bundle_at, small_request, varint

LIMITS = RequestLimits()


def key_of(kind: TaskKind, request: Any, limits: RequestLimits = LIMITS) -> str:
    return accept_request(kind, request.SerializeToString(), limits).key


def refusal(kind: TaskKind, request: Any, limits: RequestLimits = LIMITS) -> RefusedError:
    content = request if isinstance(request, bytes) else request.SerializeToString()
    with pytest.raises(RefusedError) as caught:
        accept_request(kind, content, limits)
    return caught.value


def field(number: int, content: bytes) -> bytes:
    """A field of bytes as it stands in a message."""
    return bytes([number << 3 | 2]) + varint(len(content)) + content


class TestAcceptance:
    @pytest.mark.parametrize("kind", TaskKind)
    def test_the_least_of_each_kind(self, kind: TaskKind) -> None:
        content = small_request(kind, "robot R {}").SerializeToString()
        task = accept_request(kind, content, LIMITS)
        assert (task.kind, task.request, task.main_file) == (kind, content, "robot.rscd")
        assert re.fullmatch("[0-9a-f]{64}", task.key)

    def test_each_kind_has_its_own_key(self) -> None:
        assert len({key_of(kind, small_request(kind)) for kind in TaskKind}) == len(TaskKind)

    @pytest.mark.parametrize("kind", TaskKind)
    def test_nothing_at_all_is_refused(self, kind: TaskKind) -> None:
        assert refusal(kind, b"").reason is Reason.MALFORMED_REQUEST

    @pytest.mark.parametrize(
        ("bundle", "words"),
        [
            (pb.Bundle(), "no main file"),
            (pb.Bundle(libraries=[pb.SourceFile(name="a")]), "no main file"),
            (pb.Bundle(main=pb.SourceFile(text="x")), "no name"),
            (pb.Bundle(main=pb.SourceFile(name="/etc/passwd")), "relative"),
            (pb.Bundle(main=pb.SourceFile(name="C:robot")), "relative"),
            (pb.Bundle(main=pb.SourceFile(name="\\\\host\\share\\robot")), "relative"),
            (pb.Bundle(main=pb.SourceFile(name="a\0b")), "NUL"),
            (pb.Bundle(main=pb.SourceFile(name="a\nb")), "printed"),
            (pb.Bundle(main=pb.SourceFile(name="a\u202eb")), "printed"),
            (pb.Bundle(main=pb.SourceFile(name="a" * 256)), "256 bytes"),
            (pb.Bundle(main=pb.SourceFile(name="é" * 128)), "256 bytes"),
            (pb.Bundle(main=pb.SourceFile(name="a"), libraries=[pb.SourceFile(name="a")]), "two files"),
            (pb.Bundle(main=pb.SourceFile(name="a"), libraries=[pb.SourceFile(name="b")] * 2), "two files"),
            (pb.Bundle(main=pb.SourceFile(name="a"), interfaces=[pb.SourceFile(name="b")] * 2), "two files"),
            (pb.Bundle(main=pb.SourceFile(name="a"), interfaces=[pb.SourceFile(name="/b")]), "relative"),
            (pb.Bundle(main=pb.SourceFile(name="a"), distribution="rolling"), "no ROS distribution 'rolling'"),
        ],
    )
    @pytest.mark.parametrize("kind", [kind for kind in TaskKind if kind is not TaskKind.FORMAT])
    def test_bundles_that_cannot_be(self, kind: TaskKind, bundle: pb.Bundle, words: str) -> None:
        request = small_request(kind)
        request.bundle.CopyFrom(bundle)
        found = refusal(kind, request)
        assert found.reason is Reason.MALFORMED_REQUEST
        assert words in found.message
        assert found.message.isprintable()

    @pytest.mark.parametrize(
        ("kind", "change", "words"),
        [
            (TaskKind.SYNTHESIZE, {"options": pb.SynthesisOptions(deployment=9)}, "deployment"),  # type: ignore[arg-type]
            (TaskKind.SYNTHESIZE, {"options": pb.SynthesisOptions(engine="\x1b[2J")}, "printed"),
            (TaskKind.SYNTHESIZE, {"options": pb.SynthesisOptions(engine="x" * 256)}, "256 bytes"),
            (TaskKind.SYNTHESIZE, {"options": pb.SynthesisOptions(verified_states=10**9 + 1)}, "verified_states"),
            (TaskKind.GENERATE, {"target": ""}, "no target"),
            (TaskKind.GENERATE, {"target": "x" * 256}, "256 bytes"),
            (TaskKind.GENERATE, {"generation": pb.GenerateOptions(package="\n")}, "printed"),
            (
                TaskKind.GENERATE,
                {"generation": pb.GenerateOptions(supervised=pb.SupervisedController(package="\n"))},
                "printed",
            ),
            (TaskKind.VERIFY, {"properties": []}, "neither"),
            (TaskKind.VERIFY, {"strict": True}, "has none"),
            (TaskKind.VERIFY, {"maximum_states": 5}, "has none"),
            (TaskKind.VERIFY, {"supervisor": b"x", "maximum_states": 10**9 + 1}, "maximum_states"),
            (TaskKind.VERIFY, {"property_files": [pb.SourceFile(name="/a")]}, "relative"),
            (TaskKind.FORMAT, {"file": pb.SourceFile(name="..\0")}, "printed"),
        ],
    )
    def test_requests_that_cannot_be(self, kind: TaskKind, change: dict[str, Any], words: str) -> None:
        request = small_request(kind)
        for name in change:
            request.ClearField(name)
        request.MergeFrom(MESSAGES[kind](**change))
        found = refusal(kind, request)
        assert found.reason is Reason.MALFORMED_REQUEST
        assert words in found.message

    @given(st.text(st.sampled_from("a1.:/\\ é\0\n"), max_size=6))
    @example("a:/b")
    @example("../shared/a.rscd")
    def test_names_are_relative_to_every_system(self, name: str) -> None:
        posix, windows = PurePosixPath(name), PureWindowsPath(name)
        is_right = bool(name) and name.isprintable() and not (posix.is_absolute() or windows.drive or windows.root)
        try:
            accept_request(TaskKind.CHECK, small_request(TaskKind.CHECK, name=name).SerializeToString(), LIMITS)
            was_accepted = True
        except RefusedError:
            was_accepted = False
        assert was_accepted == is_right


class TestSizes:
    def test_names_and_texts_up_to_the_last_byte(self) -> None:
        limits = RequestLimits(bundle_bytes=100)
        accept_request(TaskKind.CHECK, small_request(TaskKind.CHECK, "x" * 90).SerializeToString(), limits)
        found = refusal(TaskKind.CHECK, small_request(TaskKind.CHECK, "x" * 91), limits)
        assert found.reason is Reason.REQUEST_TOO_LARGE
        assert found.message == "the names and texts have 101 bytes; this server accepts at most 100"

    @pytest.mark.parametrize(
        ("kind", "change"),
        [
            (TaskKind.CHECK, {"bundle": {"searched": ["x" * 100]}}),
            (TaskKind.CHECK, {"bundle": {"interfaces": [{"name": "b", "text": "é" * 50}]}}),
            (TaskKind.VERIFY, {"supervisor": b"x" * 100}),
            (TaskKind.VERIFY, {"properties": ["x" * 100]}),
            (TaskKind.VERIFY, {"property_files": [{"name": "b", "text": "x" * 100}]}),
            (TaskKind.GENERATE, {"generation": {"package": "x" * 100}}),
            (TaskKind.SYNTHESIZE, {"options": {"engine": "x" * 100}}),
        ],
    )
    def test_everything_counts(self, kind: TaskKind, change: dict[str, Any]) -> None:
        request = small_request(kind)
        request.MergeFrom(MESSAGES[kind](**change))
        assert refusal(kind, request, RequestLimits(bundle_bytes=100)).reason is Reason.REQUEST_TOO_LARGE
        accept_request(kind, request.SerializeToString(), RequestLimits(bundle_bytes=200))

    def test_files_up_to_the_last(self) -> None:
        limits = RequestLimits(bundle_files=4)
        request = small_request(TaskKind.CHECK)
        request.bundle.libraries.extend(pb.SourceFile(name=f"l{number}") for number in range(2))
        request.bundle.interfaces.extend(pb.SourceFile(name=f"i{number}") for number in range(1))
        accept_request(TaskKind.CHECK, request.SerializeToString(), limits)
        request.bundle.interfaces.add(name="i2")
        found = refusal(TaskKind.CHECK, request, limits)
        assert (found.reason, "5 files" in found.message) == (Reason.REQUEST_TOO_LARGE, True)

    def test_a_long_message_is_not_even_parsed(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(requests_module, "_KINDS", {})
        limits = RequestLimits(bundle_bytes=100)
        content = b"\xff" * (limits.request_bytes + 1)
        assert refusal(TaskKind.CHECK, content, limits).reason is Reason.REQUEST_TOO_LARGE

    def test_a_thousand_files_of_the_longest_names_fit(self) -> None:
        request = small_request(TaskKind.CHECK)
        request.bundle.libraries.extend(pb.SourceFile(name=f"{number:0255}", text="x" * 700) for number in range(999))
        accept_request(TaskKind.CHECK, request.SerializeToString(), LIMITS)

    @pytest.mark.parametrize(
        "content",
        [
            field(1, field(2, b"") * 300_000),
            field(1, field(3, b"") * 300_000),
            field(1, field(4, b"") * 300_000),
        ],
        ids=["libraries", "searched", "interfaces"],
    )
    def test_hundreds_of_thousands_of_empty_parts(self, content: bytes) -> None:
        assert refusal(TaskKind.SYNTHESIZE, content).reason is Reason.REQUEST_TOO_LARGE

    def test_hundreds_of_thousands_of_properties(self) -> None:
        bundle = small_request(TaskKind.VERIFY).SerializeToString()
        for number in (4, 5):
            assert refusal(TaskKind.VERIFY, bundle + field(number, b"") * 300_000).reason is Reason.REQUEST_TOO_LARGE


class TestHostileBytes:
    @pytest.mark.parametrize(
        "content",
        [
            b"\xff",
            b"\xff" * 1000,
            b"\x0a\xff\xff\xff\xff\x0f",
            b"\x0b" * 1_000_000,
            b"\x7b" * 1_000_000,
            field(1, b"\x7b" * 500_000 + b"\x7c" * 500_000),
            field(1, field(1, field(1, b"\xff\xfe"))),
            field(1, field(1, field(1, b"\xed\xa0\x80"))),
            field(1, field(1, field(2, b"\xc0\x80"))),
            field(1, field(3, b"\x80")),
        ],
        ids=[
            "no tag", "no tags", "length beyond the end", "groups for a message", "groups", "nested groups",
            "invalid UTF-8", "surrogate", "overlong NUL", "cut UTF-8",
        ],
    )  # fmt: skip
    @pytest.mark.parametrize("kind", [TaskKind.SYNTHESIZE, TaskKind.CHECK])
    def test_what_is_no_message_is_refused_in_our_own_words(self, kind: TaskKind, content: bytes) -> None:
        found = refusal(kind, content)
        assert (found.reason, found.message) == (Reason.MALFORMED_REQUEST, NOT_A_MESSAGE)
        assert found.__cause__ is None

    def test_unknown_fields_change_nothing(self) -> None:
        known = small_request(TaskKind.SYNTHESIZE, "robot R {}").SerializeToString()
        unknown = field(15, b"x" * 1000) + b"\x78\x01" + b"\x7b\x7c"
        task = accept_request(TaskKind.SYNTHESIZE, known + unknown, LIMITS)
        assert task.key == accept_request(TaskKind.SYNTHESIZE, known, LIMITS).key

    def test_of_fields_that_come_twice_the_last_counts(self) -> None:
        first, second = (small_request(TaskKind.CHECK, text).SerializeToString() for text in ("first", "second"))
        assert (
            accept_request(TaskKind.CHECK, first + second, LIMITS).key
            == accept_request(TaskKind.CHECK, second, LIMITS).key
        )
        # Parts that may be many are put together, and two files of one name are none.
        library = pb.CheckRequest(bundle=pb.Bundle(libraries=[pb.SourceFile(name="a")])).SerializeToString()
        assert "two files" in refusal(TaskKind.CHECK, first + library + library).message

    @settings(max_examples=examples(60))
    @given(st.sampled_from(list(TaskKind)), st.binary(max_size=200), st.integers(0, 2**32))
    def test_any_bytes_are_accepted_or_refused(self, kind: TaskKind, noise: bytes, seed: int) -> None:
        broken = bytearray(small_request(kind, "robot R {}").SerializeToString())
        chance = random.Random(seed)
        for _ in range(chance.randrange(4)):
            broken[chance.randrange(len(broken))] = chance.randrange(256)
        place = chance.randrange(len(broken))
        for content in (noise, bytes(broken), bytes(broken[:place]) + noise + bytes(broken[place:])):
            try:
                task = accept_request(kind, content, LIMITS)
            except RefusedError as error:
                assert error.reason in (Reason.MALFORMED_REQUEST, Reason.REQUEST_TOO_LARGE)
                assert error.message.isprintable()
            else:
                assert task.request == content
                assert task.main_file.isprintable()


# Requests as plain values: what they mean is said a second time, slowly and by other means.

NAMES = st.sampled_from(["a.rscd", "b.rscd", "../c.rscd", "d é", "('x', 'y')", "'"])
TEXTS = st.sampled_from(["", "robot R {}", "a", "b", "', '", "é"])
FILES = st.dictionaries(NAMES, TEXTS, max_size=3)
OPTIONS = st.fixed_dictionaries(
    {},
    optional={
        "deployment": st.sampled_from([0, 1, 2]),
        "engine": st.sampled_from(["", "auto", "cudd", "autoref"]),
        "allow_livelock": st.booleans(),
        "allow_reordering": st.booleans(),
        "maximum_nodes": st.sampled_from([0, 5, 20_000_000, 30_000_000]),
        "verified_states": st.sampled_from([0, 5, 200_000]),
    },
)
SUPERVISED = st.fixed_dictionaries({"package": st.sampled_from(["p", "q"]), "executable": st.sampled_from(["", "x"])})
GENERATION = st.fixed_dictionaries(
    {},
    optional={
        "package": st.sampled_from(["", "p"]),
        "publish_state": st.booleans(),
        "log_events": st.booleans(),
        "supervised": SUPERVISED,
        "state_message": st.sampled_from(["", "typed"]),
        "metadata": st.fixed_dictionaries(
            {}, optional={"license": st.sampled_from(["", "MIT"]), "version": st.just("1.0.0")}
        ),
    },
)
BUNDLES = st.tuples(FILES, FILES, st.lists(TEXTS, max_size=2)).filter(
    lambda parts: parts[0] and not set(parts[0]) & set(parts[1])
)
REQUESTS = st.fixed_dictionaries(
    {
        "bundle": BUNDLES,
        "options": OPTIONS,
        "target": st.sampled_from(["python", "c99"]),
        "generation": GENERATION,
        "maximum_states": st.sampled_from([0, 7, 100_000, 1_000_000]),
        "supervisor": st.sampled_from([b"", b"\0", b"x"]),
        "properties": st.lists(TEXTS, max_size=2),
        "property_files": st.lists(st.tuples(NAMES, TEXTS), max_size=2),
        "strict": st.booleans(),
        "asked": st.fixed_dictionaries(
            {}, optional=dict.fromkeys(("event", "state", "after"), st.sampled_from(["", "a", "a, b"]))
        ),
    }
)


def message_of(kind: TaskKind, given_: dict[str, Any], seed: int) -> Any:
    """A request in any of the forms that it may have on its way."""
    chance = random.Random(seed)
    files, interfaces, searched = given_["bundle"]
    (name, text), *libraries = files.items()
    libraries, others = list(libraries), list(interfaces.items())
    chance.shuffle(libraries)
    chance.shuffle(others)

    def file(item: tuple[str, str]) -> pb.SourceFile:
        return pb.SourceFile(name=item[0], text=item[1])

    if kind is TaskKind.FORMAT:
        return pb.FormatRequest(file=file((name, text)))
    bundle = pb.Bundle(
        main=file((name, text)),
        libraries=map(file, libraries),
        interfaces=map(file, others),
        searched=searched,
    )
    if kind is TaskKind.CHECK:
        return pb.CheckRequest(bundle=bundle)
    options = pb.SynthesisOptions(**given_["options"])
    if kind is TaskKind.SYNTHESIZE:
        return pb.SynthesizeRequest(bundle=bundle, options=options)
    if kind is TaskKind.EXPLAIN:
        return pb.ExplainRequest(bundle=bundle, options=options, **given_["asked"])
    if kind is TaskKind.EXPLORE:
        return pb.ExploreRequest(bundle=bundle, options=options, maximum_states=given_["maximum_states"])
    if kind is TaskKind.GENERATE:
        generation = pb.GenerateOptions(**given_["generation"])
        return pb.GenerateRequest(bundle=bundle, options=options, target=given_["target"], generation=generation)
    is_given = bool(given_["supervisor"])
    return pb.VerifyRequest(
        bundle=bundle,
        options=options,
        supervisor=given_["supervisor"],
        properties=given_["properties"],
        property_files=map(file, given_["property_files"]),
        maximum_states=given_["maximum_states"] if is_given else 0,
        strict=given_["strict"] and is_given,
    )


def meaning_of(kind: TaskKind, given_: dict[str, Any]) -> Any:
    """Return the meaning of a request, as values that are equal exactly where it is the same."""
    files, interfaces, searched = given_["bundle"]
    main = next(iter(files.items()))
    if kind is TaskKind.FORMAT:
        return kind, main
    bundle = main, files, interfaces, searched
    if kind is TaskKind.CHECK:
        return kind, bundle
    options = given_["options"]
    is_given = kind is TaskKind.VERIFY and given_["supervisor"]
    how = [
        options.get("deployment", 0) or (0 if is_given else 1),
        options.get("engine", "") or "auto",
        options.get("allow_reordering", False),
        min(options.get("maximum_nodes", 0) or LIMITS.nodes, LIMITS.nodes),
    ]
    if kind is TaskKind.EXPLAIN:
        return kind, bundle, how, given_["asked"]
    if not is_given:
        how.append(options.get("verified_states", DEFAULT_STATES))
    if kind in (TaskKind.SYNTHESIZE, TaskKind.GENERATE):
        how.append(options.get("allow_livelock", False))
    if kind is TaskKind.SYNTHESIZE:
        return kind, bundle, how
    if kind is TaskKind.EXPLORE:
        return kind, bundle, how, given_["maximum_states"] or 100_000
    if kind is TaskKind.GENERATE:
        choices = given_["generation"]
        flags = [choices.get(name, False) for name in ("publish_state", "log_events")]
        flags.append(choices.get("state_message", ""))
        said = {name: text for name, text in choices.get("metadata", {}).items() if text}
        return kind, bundle, how, given_["target"], choices.get("package", ""), flags, choices.get("supervised"), said
    claims = given_["properties"], given_["property_files"]
    states = given_["maximum_states"] or 1_000_000
    return kind, bundle, how, claims, is_given and (given_["supervisor"], states, given_["strict"])


@st.composite
def pairs(draw: Any) -> tuple[Any, Any]:
    """Two requests that differ in little or nothing."""
    first = draw(REQUESTS)
    changed = draw(st.sets(st.sampled_from(sorted(first)), max_size=2))
    second = draw(REQUESTS)
    return first, {name: second[name] if name in changed else first[name] for name in first}


class TestKeys:
    @settings(max_examples=examples(60))
    @given(st.sampled_from(list(TaskKind)), pairs(), st.integers(0, 1000))
    def test_equal_exactly_where_requests_mean_the_same(
        self, kind: TaskKind, both: tuple[dict[str, Any], dict[str, Any]], seed: int
    ) -> None:
        keys = []
        for number, request in enumerate(both):
            try:
                keys.append(key_of(kind, message_of(kind, request, seed + number)))
            except RefusedError as error:
                assert "neither" in error.message
                return
        assert (keys[0] == keys[1]) == (meaning_of(kind, both[0]) == meaning_of(kind, both[1]))

    def test_one_change_is_enough_for_another_key(self) -> None:
        library = pb.Bundle(libraries=[pb.SourceFile(name="a", text="x")])
        bundles = [
            pb.Bundle(),
            pb.Bundle(main=pb.SourceFile(text="y")),
            pb.Bundle(main=pb.SourceFile(name="other.rscd")),
            pb.Bundle(searched=["x"]),
            pb.Bundle(searched=["y"]),
            pb.Bundle(searched=["x", "y"]),
            pb.Bundle(searched=["y", "x"]),
            pb.Bundle(interfaces=library.libraries),
            pb.Bundle(distribution="jazzy"),
            pb.Bundle(distribution="lyrical"),
            library,
            pb.Bundle(libraries=[pb.SourceFile(name="a", text="y")]),
            pb.Bundle(libraries=[pb.SourceFile(name="b", text="x")]),
        ]
        options = [
            pb.SynthesisOptions(deployment=pb.DEPLOYMENT_LAYER),
            pb.SynthesisOptions(engine="autoref"),
            pb.SynthesisOptions(allow_livelock=True),
            pb.SynthesisOptions(allow_reordering=True),
            pb.SynthesisOptions(maximum_nodes=5),
            pb.SynthesisOptions(verified_states=5),
            pb.SynthesisOptions(verified_states=0),
        ]
        claims: list[dict[str, Any]] = [
            {"supervisor": b"x"},
            {"supervisor": b"y"},
            {"supervisor": b"x", "options": pb.SynthesisOptions(deployment=pb.DEPLOYMENT_CONTROLLER)},
            {"supervisor": b"x", "strict": True},
            {"supervisor": b"x", "maximum_states": 5},
            {"properties": ["x"]},
            {"properties": ["y"]},
            {"property_files": [pb.SourceFile(name="a", text="x")]},
            {"property_files": [pb.SourceFile(name="a", text="y")]},
            {"property_files": [pb.SourceFile(name="b", text="x")]},
        ]
        heard: list[dict[str, Any]] = [{"options": item} for item in options if not item.allow_livelock]
        changes: dict[TaskKind, list[dict[str, Any]]] = {
            TaskKind.CHECK: [],
            TaskKind.SYNTHESIZE: [{"options": item} for item in options],
            TaskKind.GENERATE: [
                *({"options": item} for item in options),
                {"target": "c99"},
                {"generation": pb.GenerateOptions(package="x")},
                {"generation": pb.GenerateOptions(publish_state=True)},
                {"generation": pb.GenerateOptions(state_message="typed")},
                {"generation": pb.GenerateOptions(metadata=pb.PackageMetadata(license="x"))},
                {"generation": pb.GenerateOptions(metadata=pb.PackageMetadata(version="x"))},
                {"generation": pb.GenerateOptions(metadata=pb.PackageMetadata(copyright="x"))},
                {"generation": pb.GenerateOptions(log_events=True)},
                {"generation": pb.GenerateOptions(supervised=pb.SupervisedController())},
                {"generation": pb.GenerateOptions(supervised=pb.SupervisedController(executable="x"))},
                {"generation": pb.GenerateOptions(supervised=pb.SupervisedController(launch_file="x"))},
            ],
            TaskKind.EXPLORE: [{"maximum_states": 5}, *heard],
            TaskKind.VERIFY: [*claims, *heard],
        }
        for kind, fields in changes.items():
            keys = []
            for change in [*({"bundle": bundle} for bundle in bundles), *fields]:
                request = small_request(kind)
                request.MergeFrom(MESSAGES[kind](**change))
                keys.append(key_of(kind, request))
            assert len(set(keys)) == len(bundles) + len(fields), kind

    def test_another_version_gives_another_key(self, monkeypatch: pytest.MonkeyPatch) -> None:
        request = small_request(TaskKind.CHECK)
        before = key_of(TaskKind.CHECK, request)
        monkeypatch.setattr(requests_module, "_producer_versions", lambda: ("another", "plug-in 1.0"))
        assert key_of(TaskKind.CHECK, request) != before

    def test_what_the_server_allows_decides_where_nothing_is_asked_for(self) -> None:
        request = small_request(TaskKind.SYNTHESIZE)
        few = RequestLimits(nodes=1000)
        assert key_of(TaskKind.SYNTHESIZE, request) != key_of(TaskKind.SYNTHESIZE, request, few)
        request.options.maximum_nodes = 1000
        assert key_of(TaskKind.SYNTHESIZE, request) == key_of(TaskKind.SYNTHESIZE, request, few)

    def test_a_library_that_takes_the_place_of_the_main_file(self) -> None:
        files = [pb.SourceFile(name="a", text="x"), pb.SourceFile(name="b", text="x")]
        requests = [
            pb.CheckRequest(bundle=pb.Bundle(main=main, libraries=[library]))
            for main, library in (files, reversed(files))
        ]
        assert key_of(TaskKind.CHECK, requests[0]) != key_of(TaskKind.CHECK, requests[1])

    def test_of_the_line_follower(self) -> None:
        bundle = bundle_at(EXAMPLES / "line_follower" / "line_follower.rscd")
        task = accept_request(TaskKind.SYNTHESIZE, pb.SynthesizeRequest(bundle=bundle).SerializeToString(), LIMITS)
        assert task.main_file == "line_follower.rscd"


class TestRecentRequests:
    def test_says_the_same_as_a_look_at_each(self) -> None:
        cache = RequestCache(LIMITS)
        contents = [small_request(kind).SerializeToString() for kind in MESSAGES] + [b"", b"\xff", b"no message"]
        for _ in range(2):
            for kind in MESSAGES:
                for content in contents:
                    assert outcome(partial(accept_as, cache, "me"), kind, content) == outcome(
                        partial(accepted_by, "me"), kind, content
                    )

    def test_a_caller_never_gets_the_task_of_another_one(self) -> None:
        cache = RequestCache(LIMITS)
        content = small_request(TaskKind.CHECK).SerializeToString()
        tasks = {name: cache.accept(TaskKind.CHECK, name, content) for name in ("me", "you")}
        key = accept_request(TaskKind.CHECK, content, LIMITS).key
        for _ in range(2):
            for name, task in tasks.items():
                assert cache.accept(TaskKind.CHECK, name, content) is task
                assert task.key == own_key(key, name)

    def test_callers_share_where_results_are_shared(self) -> None:
        cache = RequestCache(LIMITS, lambda key, caller: key)
        content = small_request(TaskKind.CHECK).SerializeToString()
        assert cache.accept(TaskKind.CHECK, "me", content).key == cache.accept(TaskKind.CHECK, "you", content).key

    def test_one_that_came_before_is_not_looked_at_again(self, monkeypatch: pytest.MonkeyPatch) -> None:
        cache = RequestCache(LIMITS)
        content = small_request(TaskKind.CHECK).SerializeToString()
        task = cache.accept(TaskKind.CHECK, "me", content)
        monkeypatch.setattr(requests_module, "accept_request", None)
        assert cache.accept(TaskKind.CHECK, "me", bytes(bytearray(content))) is task

    def test_is_bounded_and_forgets_what_was_asked_for_longest_ago(self) -> None:
        cache = RequestCache(LIMITS)
        requests = [
            pb.CheckRequest(bundle=pb.Bundle(main=pb.SourceFile(name="m", text=f"{number:060000}"))).SerializeToString()
            for number in range(100)
        ]
        first, *others = requests
        tasks = [cache.accept(TaskKind.CHECK, "me", first)]
        for request in others:
            tasks.append(cache.accept(TaskKind.CHECK, "me", request))
            assert cache.accept(TaskKind.CHECK, "me", first) is tasks[0]
        assert sum(map(len, cached_contents(cache))) <= 4 * 2**20
        assert cache.accept(TaskKind.CHECK, "me", requests[1]) is not tasks[1]
        assert cache.accept(TaskKind.CHECK, "me", requests[-1]) is tasks[-1]

    def test_many_small_ones_are_bounded_too(self) -> None:
        cache = RequestCache(LIMITS)
        for number in range(10_000):
            file = pb.SourceFile(name="m", text=str(number))
            cache.accept(TaskKind.CHECK, "me", pb.CheckRequest(bundle=pb.Bundle(main=file)).SerializeToString())
        # Each takes some four hundred bytes beside its own.
        assert len(cached_contents(cache)) < 8500

    def test_a_long_one_is_looked_at_each_time(self) -> None:
        cache = RequestCache(LIMITS)
        bundle = pb.Bundle(main=pb.SourceFile(name="m", text="x" * 70_000))
        content = pb.CheckRequest(bundle=bundle).SerializeToString()
        assert cache.accept(TaskKind.CHECK, "me", content) is not cache.accept(TaskKind.CHECK, "me", content)
        assert not cached_contents(cache)


def outcome(accept: Callable[[TaskKind, bytes], Task], kind: TaskKind, content: bytes) -> object:
    """Return the outcome of a request: a task, or the refusal's reason and words."""
    try:
        return accept(kind, content)
    except RefusedError as error:
        return error.reason, error.message


def accept_as(cache: RequestCache, caller: str, kind: TaskKind, content: bytes) -> Task:
    """Return the task of a caller, from a cache."""
    return cache.accept(kind, caller, content)


def accepted_by(caller: str, kind: TaskKind, content: bytes) -> Task:
    """Return the same without a cache."""
    task = accept_request(kind, content, LIMITS)
    return replace(task, key=own_key(task.key, caller))


def cached_contents(recent: RequestCache) -> list[bytes]:
    """The requests that are remembered."""
    return [content for _, _, content in recent._tasks]
