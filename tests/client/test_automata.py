"""Automata on a server: the same documents, texts, files and exit statuses as on this machine."""

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import pytest

import robosc
from robosc.cli.main import main as local_main
from robosc.json_documents import json_text
from robosc.pipeline.loading import LoadedAutomata
from robosc.pipeline.systems import decode_system
from robosc.signatures import make_key_pair
from robosc_client import Client, RequestRefusedError, ServiceError, Synthesize, VerificationStatus
from robosc_client import Verification as RemoteVerification
from robosc_client.main import main as remote_main
from robosc_client.outcomes import automata_exploration_of, automata_synthesis_of, require_automata_report
from support.automata_models import BUFFER, DOOR, EMPTY, TANK, TWO_TANKS, WRONG
from support.service import served

SEVERAL = TANK.replace("= 1;", "in any;")
GROUPED = f"group yard: {TANK} end"
MODELS = {
    "tank.cif": TANK,
    "several.cif": SEVERAL,
    "grouped.cif": GROUPED,
    "empty.cif": EMPTY,
    "wrong.cif": WRONG,
    "torn.cif": 'import "nothing.cif"; plant p: location: initial; marked; end',
    "imports.cif": 'import "parts/tank.cif";',
    "line.gen": BUFFER,
    "door.wmod": DOOR,
}
COMMANDS = {
    "check": ["check"],
    "check --strict --synthesize": ["check", "--strict", "--synthesize"],
    "synth": ["synth"],
    "synth --modular": ["synth", "--modular"],
    "explore": ["explore"],
    "explore --dot": ["explore", "--dot"],
    "explore --limit": ["explore", "--limit", "1"],
    "explain-synthesis": ["explain-synthesis"],
    "explain-synthesis --event": ["explain-synthesis", "--event", "tank.c_fill"],
    "explain-synthesis --state": ["explain-synthesis", "--state", "tank.level = 1"],
    "explain-synthesis --after": ["explain-synthesis", "--after", ""],
    "verify": ["verify"],
    "verify --strict": ["verify", "--strict", "--limit", "10"],
    "verify --quiet": ["verify", "--quiet"],
    "verify --controller": ["verify", "--controller"],
    "verify --as-is": ["verify", "--as-is", "--controller"],
}

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the server's keys, and those of another."""
    folder = tmp_path_factory.mktemp("keys")
    for name in ("server", "other"):
        make_key_pair(folder / f"{name}.key", folder / f"{name}.pub")
    return folder


@pytest.fixture(scope="module")
def address(keys: Path) -> Iterator[str]:
    with served(signing_key=keys / "server.key") as address:
        yield address


@pytest.fixture(scope="module")
def client(address: str) -> Iterator[Client]:
    with Client(address) as client:
        yield client


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, text in MODELS.items():
        (tmp_path / "models").mkdir(exist_ok=True)
        (tmp_path / "models" / name).write_text(text)
    (tmp_path / "models" / "parts").mkdir()
    (tmp_path / "models" / "parts" / "tank.cif").write_text('import "../limits.cif";' + TANK.replace("0..3", "0..n"))
    (tmp_path / "models" / "limits.cif").write_text("const int n = 3;")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def both(address: str, capsys: pytest.CaptureFixture[str]) -> Run:
    """Exit status and output of a command, which are the same here and on the server."""

    def run(*arguments: object) -> tuple[int, str, str]:
        texts = [str(item) for item in arguments]
        found = []
        for main, more in ((local_main, []), (remote_main, ["--server", address])):
            status = main([*texts, *more])
            captured = capsys.readouterr()
            found.append((status, captured.out, captured.err.replace("robosc-client: ", "robosc: ")))
        assert found[0] == found[1]
        return found[0]

    return run


@pytest.fixture
def remote(address: str, capsys: pytest.CaptureFixture[str]) -> Run:
    """Exit status and output of `robosc-client`."""

    def run(*arguments: object) -> tuple[int, str, str]:
        capsys.readouterr()
        status = remote_main([*map(str, arguments), "--server", address])
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return run


def automata(text: str = TANK, name: str = "tank.cif") -> LoadedAutomata:
    found = robosc.load(text=text, name=name)
    assert isinstance(found, LoadedAutomata)
    return found


class TestCommands:
    @pytest.mark.parametrize("command", COMMANDS)
    @pytest.mark.parametrize("name", MODELS)
    def test_they_print_the_same(self, command: str, name: str, folder: Path, both: Run) -> None:
        # The folder of a model says something of this machine, and does not reach the server.
        for place in (Path("models", name), folder / "models" / name):
            status, out, err = both(*COMMANDS[command], place)
            result = both(*COMMANDS[command], place, "--json")
            assert (status, json.loads(result[1]) != {}) == (result[0], True)
            assert out or err or command == "verify --quiet"

    def test_a_model_of_a_machine(self, both: Run) -> None:
        """Groups, enums, inputs and components as a factory's model has them; its states are too many to list."""
        model = Path(__file__).parents[1] / "models" / "wafer_handling.cif"
        assert json.loads(both("synth", model, "--json")[1])["states"] == 468979718
        assert both("explore", model, "--limit", "1000")[0] == 1

    @pytest.mark.parametrize("target", ["cif", "c99", "python"])
    @pytest.mark.parametrize("name", ["tank.cif", "grouped.cif", "imports.cif", "empty.cif", "several.cif", "line.gen"])
    def test_they_generate_the_same(self, target: str, name: str, folder: Path, both: Run) -> None:
        status, out, _ = both("generate", f"models/{name}", "--target", target, "-o", "out", "--force")
        assert (status == 0) == bool(out)
        both("generate", f"models/{name}", "--target", target, "-o", "out", "--force", "--json")

    def test_generated_files_are_the_same(self, folder: Path, address: str) -> None:
        arguments = ["generate", "models/several.cif", "--target", "python", "--package", "basin", "--initial"]
        for initial in ("tank.level = 1", "tank.level = 2"):
            assert local_main([*arguments, initial, "-o", "here", "--force"]) == 0
            assert remote_main([*arguments, initial, "-o", "there", "--force", "--server", address]) == 0
            assert (folder / "here" / "basin.py").read_bytes() == (folder / "there" / "basin.py").read_bytes()

    @pytest.mark.parametrize("ending", [".cif", ".gen", ".wmod"])
    def test_the_controlled_system_is_written(self, ending: str, folder: Path, both: Run) -> None:
        output = folder / f"controlled{ending}"
        contents = []
        for _ in range(2):
            assert both("synth", "models/tank.cif", "-o", output)[0] == 0
            contents.append(output.read_bytes())
        assert contents[0] == contents[1] != b""
        assert both("synth", "models/tank.cif", "-o", "models/tank.cif")[0] == 2

    @pytest.mark.parametrize(
        "arguments",
        [
            ["synth", "-o", "x.txt"],
            ["synth", "--allow-livelock"],
            ["synth", "--verify-limit", "7"],
            ["synth", "--deployment", "layer"],
            ["check", "--engine", "cudd"],
            ["check", "-L", "."],
            ["check", "-I", "."],
            ["explore", "--deployment", "layer"],
            ["explain-synthesis", "--deployment", "layer"],
            ["explain-synthesis", "--event", "nothing"],
            ["verify", "--property", "invariant true"],
            ["verify", "--signed-by", "x.pub"],
            ["generate", "--target", "all", "-o", "out"],
            ["generate", "--target", "ros2", "-o", "out"],
            ["generate", "--target", "cif", "--package", "tank", "-o", "out"],
            ["generate", "--target", "python", "--allow-livelock", "-o", "out"],
            ["generate", "--target", "python", "--initial", "tank.levl = 1", "-o", "out"],
            ["generate", "--target", "python", "--maintainer", "me", "-o", "out"],
            ["synth", "--engine", "none"],
            ["synth", "--max-nodes", "1"],
        ],
    )
    def test_what_cannot_be_is_reported(self, arguments: list[str], folder: Path, remote: Run) -> None:
        """Messages are those of this machine; what a server finds out ends with the status of a refusal."""
        status, out, err = remote(*arguments, "models/tank.cif")
        assert (out, err.count("\n")) == ("", 1)
        assert status == (3 if arguments[1] in ("--engine", "--max-nodes") and arguments[0] == "synth" else status)
        assert status in (1, 2, 3)
        document = json.loads(remote(*arguments, "models/tank.cif", "--json")[1])
        assert document["error"]["status"] == status

    def test_what_is_of_automata_is_refused_for_robots(self, folder: Path, both: Run) -> None:
        Path("robot.rscd").write_text("robot R { component C { incoming message m with type: none } }")
        assert both("synth", "robot.rscd", "--modular")[0] == 0
        assert both("explain-synthesis", "robot.rscd", "--modular", "--event", "m")[0] == 0
        assert "leave it out with --state" in both("explain-synthesis", "robot.rscd", "--modular", "--after", "m")[2]
        assert "as a whole" in both("explain-synthesis", "models/tank.cif", "--modular")[2]
        generate = ("generate", "robot.rscd", "--target", "python", "-o", "out", "--initial", "C = a")
        assert "a robot begins in one state" in both(*generate)[2]
        for option in ("--controller", "--as-is"):
            assert f"{option} is for automata" in both("verify", "robot.rscd", option, "--property", "AG true")[2]

    def test_a_file_that_is_not_there(self, folder: Path, both: Run) -> None:
        assert both("synth", "none.cif") == (2, "", "robosc: there is no file none.cif\n")

    def test_the_server_reads_no_file(self, folder: Path, remote: Run) -> None:
        """An import by a place on this machine cannot be sent, and is not looked up there."""
        place = folder / "models" / "limits.cif"
        Path("absolute.cif").write_text(f'import "{place}";{TANK}')
        status, _, err = remote("check", "absolute.cif")
        assert (status, "must be relative" in err) == (3, True)

    def test_signatures(self, folder: Path, remote: Run, keys: Path) -> None:
        assert remote("synth", "models/tank.cif", "--signed-by", keys / "server.pub", "-o", "signed.cif")[0] == 0
        status, _, err = remote("synth", "models/tank.cif", "--signed-by", keys / "other.pub", "-o", "refused.cif")
        assert (status, "the server's supervisor" in err) == (3, True)
        assert not Path("refused.cif").exists()

    def test_a_supervisor_s_file_is_signed(self, folder: Path, remote: Run, keys: Path) -> None:
        """Its bytes are those of this machine, and it has the signature that `get` writes."""
        made = folder / "made.rsup"
        beside = folder / "made.rsup.sig"
        assert local_main(["synth", "models/tank.cif", "-o", "local.rsup"]) == 0
        assert remote("synth", "models/tank.cif", "--signed-by", keys / "server.pub", "-o", made)[0] == 0
        assert made.read_bytes() == Path("local.rsup").read_bytes()
        assert local_main(["verify", str(made), "models/tank.cif", "--signed-by", str(keys / "server.pub")]) == 0
        job = remote("submit", "synth", "models/tank.cif", "--watch")[1].splitlines()[0]
        assert remote("get", job, "-o", "got.rsup")[0] == 0
        assert Path("got.rsup").read_bytes() == made.read_bytes()
        assert Path("got.rsup.sig").read_bytes() == beside.read_bytes()
        # The signature of an earlier supervisor is replaced; what is refused leaves both as they are.
        before = beside.read_bytes()
        assert remote("synth", "models/several.cif", "--signed-by", keys / "other.pub", "-o", made)[0] == 3
        assert beside.read_bytes() == before
        assert remote("synth", "models/several.cif", "-o", made)[0] == 0
        assert beside.read_bytes() != before
        assert local_main(["verify", str(made), "models/several.cif", "--signed-by", str(keys / "server.pub")]) == 0

    def test_a_server_without_a_key_signs_nothing(self, folder: Path) -> None:
        Path("made.rsup.sig").write_bytes(b"of another supervisor")
        with served() as address:
            assert remote_main(["synth", "models/tank.cif", "-o", "made.rsup", "--server", address]) == 0
        assert not Path("made.rsup.sig").exists()


class TestJobs:
    def submitted(self, remote: Run, *arguments: object) -> str:
        status, out, err = remote("submit", *arguments, "--watch")
        assert status == 0, err
        return out.splitlines()[0]

    def test_a_controlled_system(self, folder: Path, remote: Run) -> None:
        job = self.submitted(remote, "synth", "models/tank.cif", "--modular")
        assert remote("get", job, "-o", "job.cif")[0] == 0
        assert local_main(["synth", "models/tank.cif", "--modular", "-o", "local.cif"]) == 0
        assert Path("job.cif").read_bytes() == Path("local.cif").read_bytes()
        assert remote("get", job, "-o", "job.rsup")[0] == 0
        assert local_main(["verify", "job.rsup", "models/tank.cif"]) == 0
        status, _, err = remote("get", job, "-o", "job.txt")
        assert (status, "ends in .cif" in err) == (2, True)
        status, _, err = remote("get", job, "--result", "--deployment", "controller")
        assert (status, "automata are not a node" in err) == (2, True)
        assert json.loads(remote("get", job, "--result")[1])["summary"].startswith("tank: a supervisor exists")

    def test_the_other_tasks(self, folder: Path, remote: Run) -> None:
        explored = self.submitted(remote, "explore", "models/several.cif")
        assert remote("get", explored, "-o", "graph.json")[0] == 0
        assert json.loads(Path("graph.json").read_text())["initial_states"] == [0, 1, 2]
        verified = self.submitted(remote, "verify", "models/tank.cif", "--strict")
        assert json.loads(remote("get", verified, "--result")[1])["status"] == "passed"
        properties = self.submitted(remote, "verify", "models/tank.cif", "--controller", "--as-is")
        assert set(json.loads(remote("get", properties, "--result")[1])["controller"]["checks"]) == {
            "bounded_response",
            "finite_response",
            "confluence",
            "nonblocking_under_control",
        }
        generated = self.submitted(
            remote, "generate", "models/several.cif", "--target", "python", "--initial", "tank.level = 1"
        )
        assert remote("get", generated, "-o", "code")[0] == 0
        assert Path("code/several_supervisor.py").exists()
        explained = self.submitted(remote, "explain-synthesis", "models/tank.cif", "--event", "tank.c_fill")
        assert remote("get", explained, "-o", "explanation.json")[0] == 0
        document = json.loads(Path("explanation.json").read_text())
        assert local_main(["explain-synthesis", "models/tank.cif", "--event", "tank.c_fill", "--json"]) == 0
        assert document["explanation"]["events"][0]["event"] == "tank.c_fill"
        nowhere = self.submitted(remote, "explain-synthesis", "models/tank.cif", "--event", "nothing")
        status, _, err = remote("get", nowhere, "--result")
        assert (status, "unknown event 'nothing'" in err) == (2, True)
        assert remote("list", "--kind", "explain-synthesis")[1].count("explain") == 2
        checked = self.submitted(remote, "check", "models/wrong.cif")
        assert remote("get", checked, "--result")[0] == 1

    def test_wrong_options_are_refused_at_once(self, folder: Path, remote: Run) -> None:
        for arguments in (
            ["synth", "--allow-livelock"],
            ["generate", "--target", "all"],
            ["verify", "--property", "invariant true"],
            ["explore", "--deployment", "layer"],
        ):
            status, _, err = remote("submit", *arguments, "models/tank.cif")
            assert (status, "automata" in err) == (2, True)


class TestPython:
    @pytest.mark.parametrize(("text", "name"), [(TWO_TANKS, "tank.cif"), (BUFFER, "line.gen"), (DOOR, "door.wmod")])
    def test_results_are_alike(self, text: str, name: str, client: Client) -> None:
        model = automata(text, name)
        assert client.check(model) == robosc.check(model)
        local, remote = robosc.synthesize(model, is_modular=True), client.synthesize(model, is_modular=True)
        assert local.supervisor is not None
        assert decode_system(remote.supervisor) == local.supervisor
        assert local.supervisor.modules == decode_system(remote.supervisor).modules
        assert client.verify(model, is_strict=True).report == robosc.verify(model, is_strict=True).report
        for controller, as_is in ((True, False), (False, True), (True, True)):
            remotely = client.verify(model, controller=controller, as_is=as_is)
            assert remotely.report == robosc.verify(model, controller=controller, as_is=as_is).report
        assert client.generate(model, "c99") == robosc.generate(model, "c99")
        assert client.explain(model) == robosc.explain(model)
        graph, explored = robosc.explore(model).graph, client.explore(model).graph
        assert graph is not None
        assert explored is not None
        assert json_text(graph.to_json()) == json_text(msgspec.to_builtins(explored))

    def test_paths_are_models(self, client: Client, folder: Path) -> None:
        assert client.check("models/imports.cif") == robosc.check("models/imports.cif") == ()
        assert client.check("models/wrong.cif").has_errors

    def test_a_job(self, client: Client) -> None:
        job = client.submit(Synthesize(automata(TWO_TANKS), is_modular=True)).job
        client.wait(job.id)
        found: Any = client.job_result(job.id)
        assert len(decode_system(found.supervisor).modules) == 2

    def test_options_of_robots_are_refused(self, client: Client) -> None:
        with pytest.raises(RequestRefusedError, match="allow_livelock applies to RoboSC models"):
            client.synthesize(automata(), robosc.SynthesisOptions(allow_livelock=True))
        with pytest.raises(RequestRefusedError, match="properties applies to RoboSC models"):
            client.verify(automata(), "invariant true")
        with pytest.raises(RequestRefusedError, match="log_events applies to RoboSC models"):
            client.generate(automata(), "python", robosc.GenerateOptions(log_events=True))


class TestAnswers:
    """Claims of a server, which are held against the automata that were sent."""

    def test_a_supervisor_of_others(self, client: Client) -> None:
        found = client.synthesize(automata())
        assert automata_synthesis_of(found, automata()).supervisor is not None
        with pytest.raises(ServiceError, match="it was made of other automata"):
            automata_synthesis_of(found, automata(TWO_TANKS))
        with pytest.raises(ServiceError, match="the server's supervisor is refused"):
            automata_synthesis_of(replace(found, supervisor=b"{}"), automata())

    def test_a_graph_of_others(self, client: Client) -> None:
        found = client.explore(automata())
        graph = found.graph
        assert graph is not None
        first = graph.states[0]
        wrong = [
            msgspec.structs.replace(first, components={"tub": "*"}),
            msgspec.structs.replace(first, components={"tank": "x"}),
            msgspec.structs.replace(first, variables={"tank.level": 7}),
            msgspec.structs.replace(first, communications={"m": "idle"}),
            msgspec.structs.replace(first, enabled=("tub.c_fill",)),
        ]
        graphs = [msgspec.structs.replace(graph, states=(state, *graph.states[1:])) for state in wrong]
        graphs.append(msgspec.structs.replace(graph, transitions=((0, "tub.c_fill", 1),)))
        for other in graphs:
            with pytest.raises(ServiceError, match="the graph belongs to other automata"):
                automata_exploration_of(replace(found, graph=other), automata())
        with pytest.raises(ServiceError, match="a model that has errors"):
            automata_exploration_of(found, automata(WRONG))

    def test_a_report_of_others(self, client: Client) -> None:
        found = client.verify(automata())
        report = dict(found.report)
        for status, changed in (
            (VerificationStatus.FAILED, report),
            (VerificationStatus.PROPERTY_ERRORS, report),
            (VerificationStatus.PASSED, {**report, "faults": [{"check": "safe"}]}),
            (VerificationStatus.PASSED, {}),
            (VerificationStatus.NO_SUPERVISOR, report),
            (VerificationStatus.NO_SUPERVISOR, {"status": "empty", "explanation": {"trouble": 3}}),
        ):
            answer = RemoteVerification(status, (), "", changed)
            with pytest.raises(ServiceError, match=re.compile("invalid|malformed|contradicts")):
                require_automata_report(answer)
        assert require_automata_report(found).passed
