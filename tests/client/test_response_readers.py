"""Tests of the data that a client takes from a server, and of its refusals: no server is needed for that."""

import copy
import hashlib
import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import robosc
from robosc.explanation import Explanation, to_text
from robosc_api.v1 import jobs_pb2
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_client import NotThereError, ServiceError, SynthesisStatus, VerificationStatus
from robosc_client.calls import JobPages
from robosc_client.convert import response_readers
from robosc_client.convert.response_fields import server_info_of, targets_of
from robosc_client.convert.response_readers import (
    ExplanationReader,
    ExplorationReader,
    GenerationReader,
    JobResultReader,
    SynthesisReader,
    UnaryReader,
    VerificationReader,
    check_reader,
    format_reader,
)
from support.answers import (
    FILES,
    GRAPH,
    chunks,
    enveloped,
    explanation,
    exploration,
    files_digest,
    generation,
    progress,
    supervisor,
    synthesis,
    verification,
)


def assembled(reader: Any, messages: Any) -> Any:
    for message in messages:
        reader.take(message)
    return reader.result()


def refused(reader: Any, messages: Any, words: str = "malformed") -> None:
    with pytest.raises(ServiceError, match=words):
        assembled(reader, messages)


class TestSynthesis:
    def test_result(self) -> None:
        found = assembled(SynthesisReader(), [progress(), supervisor(b"x", signature=b"signed")])
        assert (found.status, found.supervisor, found.signature) == (SynthesisStatus.SUPERVISOR, b"x", b"signed")

    def test_progress_is_harmless_on_a_terminal(self) -> None:
        report = SynthesisReader().take(progress(stage="\x1b]0;title\x07" + "x" * 2000))
        assert report is not None
        assert report.stage.isprintable()
        assert len(report.stage) < 1100

    @pytest.mark.parametrize(
        ("messages", "words"),
        [
            ([], "without a result"),
            ([progress()], "without a result"),
            ([pb.SynthesizeResponse()], "no field that"),
            ([synthesis(), synthesis()], "more than one"),
            ([synthesis(), progress()], "progress after its result"),
            ([synthesis(status=0)], "unknown status"),
            ([synthesis(status=17)], "unknown status"),
            ([synthesis(status=pb.SYNTHESIS_STATUS_SUPERVISOR)], "contradicts"),
            ([synthesis(supervisor=b"x")], "contradicts"),
            ([supervisor(supervisor_digest=b"")], "digest"),
            ([supervisor(supervisor_digest=bytes(32))], "digest"),
            ([synthesis(supervisor_digest=bytes(32))], "digest"),
            ([synthesis(signature=b"x")], "signature"),
            ([supervisor(signature=bytes(2000))], "signature"),
            ([synthesis(diagnostics=[pb.Diagnostic()])], "severity"),
            ([synthesis(explanation="{")], "malformed"),
            ([synthesis(explanation='{"blamed": []}')], "malformed"),
            ([synthesis(explanation="[" * 100_000)], "malformed"),
            ([supervisor(summary=pb.Summary(states="many"))], "count"),
            ([supervisor(summary=pb.Summary(states="-1"))], "count"),
            ([supervisor(summary=pb.Summary(states="9" * 100_000))], "count"),
        ],
    )
    def test_refused(self, messages: Any, words: str) -> None:
        refused(SynthesisReader(), messages, words)

    def test_endless_progress(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(response_readers, "MAXIMUM_PROGRESS", 1000)
        refused(SynthesisReader(), (progress(number) for number in iter(int, 1)), "too many progress messages")


@pytest.mark.parametrize(
    ("reader", "message", "what"),
    [
        (check_reader(), pb.CheckResponse(diagnostics=[pb.Diagnostic()] * 100_001), "findings"),
        (
            check_reader(),
            pb.CheckResponse(diagnostics=[pb.Diagnostic(related=[pb.RelatedPlace()] * 60_000)] * 2),
            "places",
        ),
        (format_reader(None), pb.FormatResponse(diagnostics=[pb.Diagnostic()] * 100_001), "findings"),
        (SynthesisReader(), supervisor(summary=pb.Summary(added=[pb.AddedCondition()] * 100_001)), "events"),
        (UnaryReader(targets_of), pb.ListTargetsResponse(targets=[pb.Target()] * 1001), "targets"),
        (UnaryReader(server_info_of), pb.GetVersionResponse(engines=[""] * 1001), "engines"),
        (
            JobPages((), None, all_owners=False, page_size=2).operation().reader(),
            jobs_pb2.ListJobsResponse(jobs=[jobs_pb2.Job()] * 3),
            "more than 2 jobs",
        ),
    ],
)
def test_too_many_items(reader: Any, message: Any, what: str) -> None:
    """Are counted before one of them is looked at: each would be refused for itself, too."""
    refused(reader, [message], what)


class TestGeneration:
    @pytest.mark.parametrize("piece", [1000, 65536])
    def test_result(self, piece: int) -> None:
        found = assembled(GenerationReader(), generation(piece=piece))
        assert {path: text.encode() for path, text in found.files.items()} == {
            path: data for path, (data, _) in FILES.items()
        }
        assert found.files.executables == {"a/one.py"}

    def test_an_empty_file_may_have_an_empty_piece(self) -> None:
        head, first, *others = generation()
        empty = pb.GenerateResponse(chunk=pb.FileChunk(file=1))
        assert assembled(GenerationReader(), [head, first, empty, *others]).files is not None
        refused(GenerationReader(), [head, first, empty, empty], "order")

    def test_no_files(self) -> None:
        result = pb.GenerationResult(status=pb.SYNTHESIS_STATUS_UNSUPPORTED_MODEL, reason="odd")
        found = assembled(GenerationReader(), [pb.GenerateResponse(result=result)])
        assert (found.files, found.reason) == (None, "odd")

    def test_pieces_in_any_other_order_are_refused(self) -> None:
        head, *pieces = generation(piece=40_000)
        for place in range(len(pieces) - 1):
            changed = [*pieces[:place], pieces[place + 1], pieces[place], *pieces[place + 2 :]]
            refused(GenerationReader(), [head, *changed], "order")
        for place in range(len(pieces)):
            refused(GenerationReader(), [head, *pieces[:place], *pieces[place + 1 :]], "order|middle")
            refused(GenerationReader(), [head, *pieces[: place + 1], *pieces[place:]], "order|too long|empty")

    @pytest.mark.parametrize(
        ("chunk", "words"),
        [
            (pb.FileChunk(file=3, data=b"x"), "no file"),
            (pb.FileChunk(file=0, offset=1, data=b"x"), "order"),
            (pb.FileChunk(file=0, offset=2**63, data=b"x"), "order"),
            (pb.FileChunk(file=0, data=b""), "empty"),
            (pb.FileChunk(file=0, data=b"x" * 100), "too long"),
            (pb.FileChunk(file=0, data=b"x" * 70_000), "too long"),
        ],
    )
    def test_wrong_pieces(self, chunk: Any, words: str) -> None:
        refused(GenerationReader(), [generation()[0], pb.GenerateResponse(chunk=chunk)], words)

    def test_more_than_was_declared(self) -> None:
        more = pb.GenerateResponse(chunk=pb.FileChunk(file=2, offset=100_000, data=b"x"))
        refused(GenerationReader(), [*generation(), more], "too long")

    def test_pieces_before_the_result(self) -> None:
        refused(GenerationReader(), chunks(FILES), "before")

    @pytest.mark.parametrize("size", [2**26 + 1, 2**63])
    def test_sizes_are_looked_at_first(self, size: int) -> None:
        head = generation()[0]
        head.result.files[0].size = size
        refused(GenerationReader(), [head], "bytes")

    def test_many_files(self) -> None:
        head = pb.GenerateResponse()
        head.result.status = pb.SYNTHESIS_STATUS_SUPERVISOR
        for number in range(10_001):
            head.result.files.add(path=f"{number:06}")
        refused(GenerationReader(), [head], "10000 files")

    def test_digests(self) -> None:
        for change in (
            lambda head: head.files[0].ClearField("digest"),
            lambda head: setattr(head.files[0], "executable", False),
            lambda head: setattr(head.files[0], "path", "a/zone.py"),
            lambda head: head.ClearField("digest"),
        ):
            head, *pieces = copy.deepcopy(generation())
            change(head.result)
            refused(GenerationReader(), [head, *pieces], "digest")
        head, *pieces = generation()
        other = generation({**FILES, "a/one.py": (b"print(2)\n", True)})[1]
        refused(GenerationReader(), [head, other, *pieces[1:]], "digest of 'a/one.py'")

    def test_no_text(self) -> None:
        refused(GenerationReader(), generation({"a": (b"\xff", False)}), "UTF-8")

    def test_status_without_files(self) -> None:
        refused(GenerationReader(), generation({}), "contradicts")

    def test_not_sorted(self) -> None:
        head = generation()[0]
        files = [head.result.files[1], head.result.files[0]]
        result = pb.GenerationResult(status=pb.SYNTHESIS_STATUS_SUPERVISOR, files=files, digest=files_digest(files))
        refused(GenerationReader(), [pb.GenerateResponse(result=result)], "sorted")

    @pytest.mark.parametrize(
        "path",
        [
            "/etc/passwd", "../x", "a/../../x", "", ".", "a//b", "a/./b", "C:\\x", "C:x", "a\\b", "\\\\host\\x", "a\0b",
            ".git/hooks/post-checkout", ".bashrc", "a/.b", "a/.git/c",
            "a\nb", "a\x1b[2J", "a\u202eb", "nul", "x/CON.txt", "com1.py", "LPT\u00b9", "aux ", "a.", "a ", " a",
            "x" * 256, "\u00e9" * 128, "/".join(["x" * 200] * 6), "a*b", "a?b", 'a"b', "a<b", ".robosc-manifest.json",
        ],
    )  # fmt: skip
    def test_odd_paths(self, path: str) -> None:
        refused(GenerationReader(), generation({path: (b"x", False)}))

    @pytest.mark.parametrize(
        "paths",
        [("README", "readme"), ("a", "a/b"), ("A", "a/b"), ("x/A/y", "x/a"), ("\u00e9", "e\u0301"), ("ß", "SS")],
    )
    def test_names_that_meet(self, paths: Any) -> None:
        refused(GenerationReader(), generation(dict.fromkeys(paths, (b"x", False))))

    @given(st.data())
    def test_nothing_is_collected_beyond_what_was_declared(self, data: st.DataObject) -> None:
        """Check for any pieces: no more bytes are held than the sizes allow, and a result is what was meant."""
        files = {"a": (b"12", False), "b": (b"", False), "c": (b"345", False)}
        head = generation(files)[0]
        found = GenerationReader()
        found.take(head)
        piece = st.builds(
            pb.FileChunk,
            file=st.integers(0, 3),
            offset=st.integers(0, 4),
            data=st.sampled_from([b"", b"1", b"12", b"345"]),
        )
        sound = [item.chunk for item in chunks(files)]
        for chunk in data.draw(st.one_of(st.just(sound), st.lists(piece, max_size=6))):
            try:
                found.take(pb.GenerateResponse(chunk=chunk))
            except ServiceError:
                break
            assert all(len(item) <= file.size for item, file in zip(found._contents, head.result.files, strict=True))
        try:
            result = found.result()
        except ServiceError:
            return
        assert result.files is not None
        assert dict(result.files) == {"a": "12", "b": "", "c": "345"}


class TestExploration:
    def test_result(self) -> None:
        found = assembled(ExplorationReader(), exploration())
        assert found.graph is not None
        assert found.graph.states[1].components == {"C": "t"}
        assert found.graph.transitions == ((0, "go", 1), (1, "go", 0))

    @pytest.mark.parametrize(
        ("messages", "words"),
        [
            (exploration()[:-1], "middle"),
            ([*exploration(), pb.ExploreResponse(chunk=b"x")], "too long"),
            ([exploration()[0], pb.ExploreResponse(chunk=b"")], "empty"),
            (exploration(piece=100_000)[1:], "before"),
            (exploration(size=2**27), "more than"),
            (exploration(size=0), "contradicts"),
            (exploration(digest=bytes(32)), "digest"),
            (exploration(states=3), "lacks"),
            (exploration(transitions=1), "lacks"),
            (exploration({**GRAPH, "initial": 2}), "lacks"),
            (exploration({**GRAPH, "initial": -1}), "lacks"),
            (exploration({**GRAPH, "transitions": [[0, "go", 1], [0, "go", 2]]}), "lacks"),
            (exploration({**GRAPH, "states": 5}), "the graph is invalid"),
            (exploration(b"[" * 100_000, 60_000), "the graph is invalid"),
            (exploration(b"\xff"), "the graph is invalid"),
        ],
    )
    def test_refused(self, messages: Any, words: str) -> None:
        refused(ExplorationReader(), messages, words)


class TestExplanation:
    def test_result(self) -> None:
        found = assembled(ExplanationReader(), [explanation(to_text(Explanation(is_of_automata=True)))])
        assert (found.status, found.explanation) == (SynthesisStatus.SUPERVISOR, Explanation(is_of_automata=True))
        found = assembled(ExplanationReader(), [explanation("", pb.EXPLANATION_STATUS_MODEL_ERRORS, "why\n")])
        assert str(found.explanation) == found.reason == "why\\n"
        with pytest.raises(NotThereError, match="no event"):
            assembled(ExplanationReader(), [explanation("", pb.EXPLANATION_STATUS_NOT_THERE, "no event")])

    @pytest.mark.parametrize(
        ("message", "words"),
        [
            (explanation(""), "no explanation"),
            (explanation("[" * 100_000), "no explanation"),
            (explanation('{"events": [{}]}'), "no explanation"),
            (explanation("{}", pb.EXPLANATION_STATUS_EMPTY), "contradicts"),
            (explanation("{}", pb.EXPLANATION_STATUS_MODEL_ERRORS), "contradicts"),
            (explanation("{}", pb.EXPLANATION_STATUS_UNSUPPORTED_MODEL), "contradicts"),
            (explanation("{}", 0), "status"),
            (explanation("{}", 77), "status"),
        ],
    )
    def test_refused(self, message: Any, words: str) -> None:
        refused(ExplanationReader(), [message], words)

    def test_of_another_language(self) -> None:
        robot = robosc.load(text="robot R { }")
        refused(ExplanationReader(robot), [explanation('{"is_of_automata": true}')], "another language")
        automata = robosc.load(text="plant p: location: initial; marked; end", name="p.cif")
        refused(ExplanationReader(automata), [explanation()], "another language")


def goals(**fields: Any) -> pb.GoalExplanation:
    part = pb.ModelPart(kind="goal", text="goal once Base.inside", location=pb.Location(file="r.rscd", line=1))
    nearest = pb.NearestState(
        goal="goal once Base.inside",
        events=["open.request"],
        state=[pb.PartValue(name="Door", text="shut"), pb.PartValue(name="Door.x", number=0.5)],
        missing=["enter.request"],
    )
    return pb.GoalExplanation(**{"goals": [part], "is_hopeless": True, "nearest": nearest, **fields})


class TestGoals:
    def test_result(self) -> None:
        found = assembled(SynthesisReader(), [synthesis(status=pb.SYNTHESIS_STATUS_MODEL_ERRORS, goals=goals())])
        assert isinstance(found.explanation, robosc.GoalExplanation)
        assert found.explanation.nearest is not None
        assert found.explanation.nearest.state == {"Door": "shut", "Door.x": 0.5}
        assert found.explanation.supervisor is None

    def test_hostile_words_are_harmless_on_a_terminal(self) -> None:
        hostile = goals(goals=[pb.ModelPart(text="\x1b]0;title\x07")], helpful=["\x1b[2J"])
        found = assembled(SynthesisReader(), [synthesis(status=pb.SYNTHESIS_STATUS_MODEL_ERRORS, goals=hostile)])
        assert all(line.isprintable() for line in str(found.explanation).splitlines())

    @pytest.mark.parametrize(
        ("message", "words"),
        [
            (goals(goals=[]), "no goals"),
            (goals(nearest=pb.NearestState(goal="goal")), "not allowed"),
            (goals(nearest=pb.NearestState(is_reached=True, state=[pb.PartValue(name="x")])), "no value"),
            (goals(goals=[pb.ModelPart()] * 100_001), "parts of an explanation"),
            (goals(blamed=[pb.ModelPart()] * 100_001), "parts of an explanation"),
            (goals(helpful=[""] * 100_001), "parts of an explanation"),
            (goals(nearest=pb.NearestState(events=[""] * 100_001)), "parts of an explanation"),
            (goals(nearest=pb.NearestState(state=[pb.PartValue()] * 100_001)), "parts of an explanation"),
            (goals(nearest=pb.NearestState(missing=[""] * 100_001)), "parts of an explanation"),
        ],
    )
    def test_refused(self, message: pb.GoalExplanation, words: str) -> None:
        refused(SynthesisReader(), [synthesis(status=pb.SYNTHESIS_STATUS_MODEL_ERRORS, goals=message)], words)
        result = pb.ExplanationResult(status=pb.EXPLANATION_STATUS_MODEL_ERRORS, goals=message)
        refused(ExplanationReader(), [pb.ExplainResponse(result=result)], words)

    def test_of_another_status_or_language(self) -> None:
        refused(SynthesisReader(), [synthesis(goals=goals())], "contradicts")
        both = synthesis(status=pb.SYNTHESIS_STATUS_MODEL_ERRORS, goals=goals(), explanation="{}")
        refused(SynthesisReader(), [both], "contradicts")
        for fields in ({"status": pb.EXPLANATION_STATUS_EMPTY}, {"explanation": "{}"}):
            chosen: dict[str, Any] = {"status": pb.EXPLANATION_STATUS_MODEL_ERRORS, "goals": goals(), **fields}
            refused(ExplanationReader(), [pb.ExplainResponse(result=pb.ExplanationResult(**chosen))], "contradicts")
        automata = robosc.load(text="plant p: location: initial; marked; end", name="p.cif")
        result = pb.ExplanationResult(status=pb.EXPLANATION_STATUS_MODEL_ERRORS, goals=goals())
        refused(ExplanationReader(automata), [pb.ExplainResponse(result=result)], "another language")


class TestOthers:
    def test_verification(self) -> None:
        found = assembled(VerificationReader(), [verification()])
        assert (found.status, found.report) == (VerificationStatus.PASSED, {"status": "holds"})
        for wrong in ("[]", "{", "[" * 100_000, "null"):
            refused(VerificationReader(), [verification(wrong)], "report")
        refused(VerificationReader(), [verification(status=0)], "status")

    def test_check(self) -> None:
        assert assembled(check_reader(), [pb.CheckResponse()]) == ()
        refused(check_reader(), [], "it has no message")
        odd: Any = 9
        refused(check_reader(), [pb.CheckResponse(diagnostics=[pb.Diagnostic(severity=odd)])], "severity")

    def test_format(self) -> None:
        assert assembled(format_reader("a  b"), [pb.FormatResponse(text="a\nb\n")]).text == "a\nb\n"
        for before, after in (
            ("a b", "a c"),
            ("a b", "ab"),
            ("a // x\nb", "a // x b"),
            ("a // x", "a"),
            ("'a'", "' a'"),
        ):
            refused(format_reader(before), [pb.FormatResponse(text=after)], "more than its layout")
        broken = pb.FormatResponse(diagnostics=[pb.Diagnostic(severity=pb.SEVERITY_ERROR)])
        assert assembled(format_reader("a b"), [broken]).text is None

    def test_results_of_jobs(self) -> None:
        found = assembled(JobResultReader(), enveloped("generate", generation()))
        assert set(found.files) == set(FILES)
        assert assembled(JobResultReader(), enveloped("check", [pb.CheckResponse()])) == ()
        assert assembled(JobResultReader(), enveloped("format", [pb.FormatResponse(text="x")])).text == "x"
        refused(JobResultReader(), [], "without a result")
        refused(JobResultReader(), [jobs_pb2.GetJobResultResponse()], "no field that")
        refused(JobResultReader(), enveloped("synthesize", [progress()]), "progress messages")
        two = [*enveloped("synthesize", [synthesis()]), *enveloped("check", [pb.CheckResponse()])]
        refused(JobResultReader(), two, "two task kinds")


def test_the_digest_of_a_graph_is_of_its_bytes() -> None:
    content = json.dumps(GRAPH).encode()
    assert exploration()[0].result.digest == hashlib.sha256(content).digest()
