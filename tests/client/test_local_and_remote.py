"""The same nouns here and on a server: what is asked of `robosc` and of a client gives results that are alike."""

import inspect
from collections.abc import Iterator
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import pytest

import robosc
import robosc_client
from robosc.explanation import RequestError
from robosc.source import SourceFile
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_client import AsyncClient, Client, Explain, NotThereError, Synthesize, Verify
from robosc_client.commands.job_results import result_json
from robosc_client.convert.requests import request_of
from support.models import ACCEPTING, EMPTY, EXAMPLES, UNSUPPORTED
from support.service import served

NAVIGATION = EXAMPLES / "navigation" / "navigation.rscd"
WRONG = "robot R { component C { outgoing message m with type: nothing } }"
DENIED = """robot Courier {
    component Door {
        outgoing message opened with type: none
        outgoing message people with type: integer(0..3)
        behaviour {
            variable people: integer(0..3) = 2
            variable is_seen: boolean
            on response from people do people := value, is_seen := true
            initial marked state shut { on response from opened goto ajar }
            marked state ajar { }
        }
    }
    component Base {
        incoming message enter with type: none
        incoming message leave with type: none
        behaviour {
            initial marked state outside { on request to enter goto inside }
            marked state inside { on request to leave goto outside }
        }
    }
    requirement enter needs Door.ajar
    requirement leave needs Door.people < 2 and Door.is_seen
    AIMS
}"""
TEXTS = {
    "navigation": NAVIGATION.read_text(encoding="utf-8"),
    "denied": DENIED.replace("AIMS", "mission delivery { visit Base.inside then Base.outside }"),
    "hopeless": DENIED.replace("AIMS", "requirement always Base.outside goal once Base.inside"),
    "empty": EMPTY,
    "wrong": WRONG,
    "unsupported": UNSUPPORTED,
    "accepting": ACCEPTING,
}
METHODS = ("check", "synthesize", "explore", "verify", "explain", "generate")


@pytest.fixture(scope="module")
def client() -> Iterator[Client]:
    with served() as address, Client(address) as connected:
        yield connected


@pytest.fixture(params=TEXTS, scope="module")
def model(request: pytest.FixtureRequest) -> robosc.LoadedModel:
    return robosc.load(text=TEXTS[request.param], name=f"{request.param}.rscd")


def require_alike(local: Any, remote: Any, *, is_made: bool) -> None:
    """The parts that every result has."""
    assert local.status is remote.status
    assert (local.reason, tuple(local.diagnostics)) == (remote.reason, tuple(remote.diagnostics))
    explanation = None if isinstance(local.explanation, robosc.NoSupervisor) else local.explanation
    assert explanation == remote.explanation
    assert str(explanation) == str(remote.explanation)
    assert is_made == (local.status is robosc.SynthesisStatus.SUPERVISOR)
    for result in (local, remote):
        assert "\n" not in repr(result)
        assert str(result)
        assert result._repr_html_()


def test_check(client: Client, model: robosc.LoadedModel) -> None:
    local, remote = robosc.check(model), client.check(model)
    assert local == remote
    assert local.accepted == remote.accepted
    assert [item.accepted for item in local.accepted] == ["one person presses both"] * ("Lamps" in model.main.text)
    # The texts have their lines, which the server did not send back.
    assert str(local) == str(remote)
    assert isinstance(remote, robosc.Findings)


@pytest.mark.parametrize("is_modular", [False, True])
def test_synthesize(client: Client, model: robosc.LoadedModel, is_modular: bool) -> None:
    local = robosc.synthesize(model, is_modular=is_modular)
    remote = client.synthesize(model, is_modular=is_modular)
    is_made = local.supervisor is not None
    if local.status is robosc.SynthesisStatus.UNSUPPORTED_MODEL:
        # The server stops before it has anything to say of the text.
        assert (local.status, local.reason) == (remote.status, remote.reason)
        return
    require_alike(local, remote, is_made=is_made)
    assert isinstance(local.diagnostics, robosc.Findings) and isinstance(remote.diagnostics, robosc.Findings)
    assert local.diagnostics.accepted == remote.diagnostics.accepted
    assert [item.code for item in local.diagnostics.accepted] == (
        ["shared-topic", "competing-requests"] if "Lamps" in model.main.text else []
    )
    assert bool(remote.supervisor) == is_made
    assert local.summary == remote.summary
    if local.supervisor is not None and local.statistics is not None and remote.statistics is not None:
        assert remote.supervisor == local.supervisor.encode()
        assert robosc.simulate(remote.supervisor).enabled == robosc.simulate(local.supervisor).enabled
        here, there = asdict(local.statistics), asdict(remote.statistics)
        assert {item.name: here[item.name] for item in fields(remote.statistics)} == there


def test_explore(client: Client, model: robosc.LoadedModel) -> None:
    local, remote = robosc.explore(model), client.explore(model)
    if local.status is robosc.SynthesisStatus.UNSUPPORTED_MODEL:
        assert (local.status, local.reason) == (remote.status, remote.reason)
        return
    require_alike(local, remote, is_made=local.graph is not None)
    if local.graph is None or remote.graph is None:
        assert (local.graph, remote.graph) == (None, None)
        return
    assert (local.graph.initial, local.graph.transitions) == (remote.graph.initial, remote.graph.transitions)
    for ours, theirs in zip(local.graph.states, remote.graph.states, strict=True):
        for name in ("components", "variables", "communications", "enabled"):
            assert getattr(ours, name) == getattr(theirs, name)


def test_verify(client: Client, model: robosc.LoadedModel, tmp_path: Path) -> None:
    listing = tmp_path / "properties.txt"
    listing.write_text("reachable true\n")
    supervisor = robosc.synthesize(NAVIGATION).supervisor
    assert supervisor is not None
    questions: list[dict[str, Any]] = [
        {"properties": "invariant true"},
        {"properties": ["AG EF true", "invariant false"], "property_files": [listing]},
        {"properties": "nonsense"},
        {"supervisor": supervisor},
        {"supervisor": supervisor.encode(), "properties": ["invariant true"], "is_strict": True},
        {"supervisor": supervisor.write(tmp_path / "navigation.rsup"), "maximum_states": 1},
        {"supervisor": b"none"},
        {"supervisor": supervisor, "options": robosc.SynthesisOptions(deployment=robosc.Deployment.LAYER)},
    ]
    for question in questions:
        local, remote = robosc.verify(model, **question), client.verify(model, **question)
        assert (local.status, local.reason, local.holds) == (remote.status, remote.reason, remote.holds)
        assert tuple(local.diagnostics) == tuple(remote.diagnostics)
        # A report of the server is what `robosc verify --json` prints of it there.
        assert local.passed == remote.passed
        assert repr(local) == repr(remote)
        assert local.report == remote.report
        assert str(remote)


def test_explain(client: Client, model: robosc.LoadedModel) -> None:
    questions: list[dict[str, Any]] = [{}, {"after": ""}, {"event": "nothing"}, {"state": ""}]
    for question in questions:
        try:
            local = robosc.explain(model, **question)
        except RequestError as error:
            with pytest.raises(NotThereError) as refused:
                client.explain(model, **question)
            assert str(refused.value) == str(error)
            continue
        assert client.explain(model, **question) == local
        assert str(client.explain(model, **question)) == str(local)


def test_goals_that_cannot_be_reached(client: Client) -> None:
    hopeless = client.synthesize(robosc.load(text=TEXTS["hopeless"], name="hopeless.rscd")).explanation
    assert isinstance(hopeless, robosc.GoalExplanation) and hopeless.nearest is not None
    # Values of each kind come as they were.
    assert {name: type(value) for name, value in hopeless.nearest.state.items()} == {
        **dict.fromkeys(("Door", "Base"), str),
        "Door.people": int,
        "Door.is_seen": bool,
    }
    local = robosc.synthesize(robosc.load(text=TEXTS["denied"], name="denied.rscd")).explanation
    remote = client.explain(robosc.load(text=TEXTS["denied"], name="denied.rscd")).explanation
    assert isinstance(local, robosc.GoalExplanation) and isinstance(remote, robosc.GoalExplanation)
    assert local == remote and local.document() == remote.document()
    # The results of jobs are printed with the same keys.
    denied = robosc.load(text=TEXTS["denied"], name="denied.rscd")
    for task in (Explain(model=denied), Synthesize(denied)):
        job = client.submit(task).job
        for _ in client.watch(job.id):
            pass
        printed = result_json(client.job_result(job.id))
        assert (printed["status"], printed["explanation"]) == ("model errors", None)
        assert printed["goals"] == local.document()
    assert remote.has_counter_strategy
    assert [item.text for item in remote.blamed] == ["requirement enter needs Door.ajar"]
    with pytest.raises(robosc.NoCounterStrategyError, match="on this machine"):
        robosc.CounterRun(remote)


def test_generate(client: Client, model: robosc.LoadedModel, tmp_path: Path) -> None:
    local, remote = robosc.generate(model, "all"), client.generate(model, "all")
    assert (local.status, local.reason, local.files) == (remote.status, remote.reason, remote.files)
    if local.files is None:
        for generation in (local, remote):
            with pytest.raises(robosc.NothingGeneratedError):
                generation.write(tmp_path)
        return
    assert local == remote
    ours, theirs = local.write(tmp_path / "local"), remote.write(tmp_path / "remote")
    assert ours.left_out == theirs.left_out
    assert [path.name for path in ours.files] == [path.name for path in theirs.files]


def test_paths_are_models(client: Client) -> None:
    for path in (NAVIGATION, str(NAVIGATION)):
        assert client.check(path) == robosc.check(path)
    with pytest.raises(robosc.FileAccessError, match="there is no file nowhere"):
        client.check("nowhere")
    with pytest.raises(robosc.FileAccessError, match="cannot read nowhere"):
        client.verify(NAVIGATION, supervisor="nowhere")


def test_a_task_says_by_itself_what_is_to_be_verified(client: Client) -> None:
    task = Verify(model=robosc.load(NAVIGATION), properties=("AG EF Navigator.ready",))
    assert client.verify(task) == client.verify(NAVIGATION, "AG EF Navigator.ready")
    with pytest.raises(TypeError, match="give either a task, or a model with options"):
        client.verify(task, "invariant true")


def test_values_that_mean_the_same_are_the_same() -> None:
    for name in (
        *(
            "Explained",
            "Generation",
            "GoalSummary",
            "Summary",
            "SynthesisOptions",
            "SynthesisStatus",
            "Verification",
            "VerificationStatus",
        ),
    ):
        assert getattr(robosc, name) is getattr(robosc_client, name)


@pytest.mark.parametrize("name", METHODS)
def test_parameters_have_the_same_names(name: str) -> None:
    local = list(inspect.signature(getattr(robosc, name)).parameters)
    remote = list(inspect.signature(getattr(Client, name)).parameters)[1:]
    # Work here is stopped by a function, and there by a deadline; pages of findings are here alone.
    assert [item for item in local if item not in ("should_stop", "on_progress", "code")] == [
        item for item in remote if item not in ("deadline_s", "on_progress")
    ]


@pytest.mark.parametrize("kind", [Client, AsyncClient])
def test_what_a_server_has_made_is_simulated_here(kind: type[Client | AsyncClient]) -> None:
    supervisor = robosc.synthesize(NAVIGATION).supervisor
    assert supervisor is not None
    assert kind.simulate is robosc.simulate
    assert kind.simulate(supervisor.encode()).enabled == robosc.simulate(supervisor).enabled


def test_a_file_of_properties_is_sent_under_a_name_that_a_server_takes() -> None:
    names = ("/home/somebody/properties.txt", "folder/properties.txt")
    files = tuple(SourceFile(name, "reachable true") for name in names)
    request = request_of(Verify(model=robosc.load(NAVIGATION), property_files=files))
    assert isinstance(request, pb.VerifyRequest)
    assert [file.name for file in request.property_files] == ["properties.txt", "folder/properties.txt"]
