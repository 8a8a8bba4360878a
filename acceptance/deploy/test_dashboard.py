"""The dashboard on a real Prometheus that scrapes a real server: every one of its queries has an answer."""

import json
import subprocess
import time
import urllib.parse
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import yaml

from robosc.language import load_bundle
from robosc_api.security import Credentials, Scope, make_token
from robosc_client import Check, Client, JobError, Synthesize
from support.checkers import TOP, found
from support.models import EXAMPLES
from support.ports import lasting_port, port_of
from support.service import server_process
from support.waiting import eventually, wait_until

MONITORING = TOP / "deploy" / "monitoring"
MODEL = EXAMPLES / "line_follower" / "line_follower.rscd"

_RANGE = "2m"
_INTERVAL = "1s"
# The alert about tokens that expire soon is raised within 14 days.
_VALID_S = 90 * 86_400


class Prometheus:
    """A Prometheus that runs.

    Args:
        address: Its address.
    """

    def __init__(self, address: str) -> None:
        self._address = address

    def get(self, path: str, **arguments: str) -> Any:
        """The data of an answer of its HTTP interface; None: it has none."""
        query = urllib.parse.urlencode(arguments)
        try:
            with urllib.request.urlopen(f"http://{self._address}/api/v1/{path}?{query}", timeout=10) as answer:
                return json.load(answer)["data"]
        except OSError:
            return None

    def values(self, expression: str) -> list[float]:
        """The numbers that a query gives now; without those that are not known."""
        data = self.get("query", query=expression)
        found = [] if data is None else [float(series["value"][1]) for series in data["result"]]
        return [value for value in found if value == value]


@pytest.fixture(scope="module")
def prometheus(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Prometheus]:
    """A Prometheus with our configuration, but for the place of the server and for its patience."""
    folder = tmp_path_factory.mktemp("prometheus")
    token, line = make_token("caller", Scope, expires_s=int(time.time()) + _VALID_S)
    token_file, tokens = folder / "token", folder / "tokens"
    token_file.write_text(token)
    tokens.write_text(f"{line}\n")
    with (
        _kept_port() as metrics,
        server_process("--metrics-address", f"127.0.0.1:{metrics}", "--tokens", str(tokens)) as (_, address),
        _running(folder, metrics) as made,
    ):
        # An increase before the first look is not seen by it.
        assert eventually(lambda: made.values('up{job="robosc-server"}') == [1.0])
        _work(address, Credentials(token_file=token_file))
        yield made


@contextmanager
def _kept_port() -> Iterator[int]:
    with lasting_port() as keeper:
        yield port_of(keeper)


@contextmanager
def _running(folder: Path, metrics: int) -> Iterator[Prometheus]:
    configuration = yaml.safe_load((MONITORING / "prometheus.yaml").read_text())
    configuration["global"] = {"scrape_interval": _INTERVAL, "evaluation_interval": _INTERVAL}
    configuration["rule_files"] = [str(MONITORING / "alerts.yaml")]
    configuration["scrape_configs"][0]["static_configs"][0]["targets"] = [f"127.0.0.1:{metrics}"]
    (folder / "prometheus.yaml").write_text(yaml.safe_dump(configuration))
    with _kept_port() as port, (folder / "log").open("wb") as log:
        address = f"127.0.0.1:{port}"
        command = [found("prometheus"), f"--config.file={folder}/prometheus.yaml", f"--storage.tsdb.path={folder}/data"]
        process = subprocess.Popen([*command, f"--web.listen-address={address}"], stdout=log, stderr=log, cwd=folder)
        try:
            yield Prometheus(address)
        finally:
            process.terminate()
            process.wait()


def _work(address: str, credentials: Credentials) -> None:
    """Have a server do some of everything."""
    model = load_bundle(MODEL)
    with Client(address, credentials) as client:
        client.check(model)
        client.synthesize(model)
        client.wait(client.submit(Synthesize(model)).job.id)
        client.wait(client.submit(Check(model)).job.id)
        with pytest.raises(JobError):
            client.get_job("none")


def _dashboard() -> dict[str, Any]:
    return dict(json.loads((MONITORING / "dashboard.json").read_text()))


def _queries() -> list[tuple[str, str]]:
    return [
        (panel["title"], target["expr"].replace("$__rate_interval", _RANGE).replace("$instance", ".*"))
        for panel in _dashboard()["panels"]
        for target in panel["targets"]
    ]


def test_every_panel_shows_something(prometheus: Prometheus) -> None:
    for title, query in _queries():
        wait_until(lambda query=query: prometheus.values(query), f"{title}: {query}")  # type: ignore[misc]


def test_what_was_done_is_seen(prometheus: Prometheus) -> None:
    queries = dict(_queries())
    for title in ("Calls", "Calls that failed, by reason", "Duration of tasks", "Tasks by outcome"):
        wait_until(lambda title=title: max(prometheus.values(queries[title]), default=0.0) > 0, title)  # type: ignore[misc]
    assert prometheus.values(queries["Servers"]) == [1.0]


def test_the_server_can_be_chosen(prometheus: Prometheus) -> None:
    (chosen,) = [item for item in _dashboard()["templating"]["list"] if item["name"] == "instance"]
    series, label = chosen["query"]["query"].removeprefix("label_values(").removesuffix(")").rsplit(", ", 1)
    (found_labels,) = prometheus.get("series", **{"match[]": series})
    assert found_labels[label].startswith("127.0.0.1:")


def test_alerts_are_evaluated_and_none_is_raised(prometheus: Prometheus) -> None:
    def evaluated() -> Any:
        rules = [rule for group in prometheus.get("rules")["groups"] for rule in group["rules"]]
        return rules if all(rule["health"] == "ok" for rule in rules) else None

    rules = wait_until(evaluated, "the evaluation of all rules")
    names = {
        rule["alert"]
        for group in yaml.safe_load((MONITORING / "alerts.yaml").read_text())["groups"]
        for rule in group["rules"]
    }
    assert {rule["name"] for rule in rules} == names
    assert [rule["name"] for rule in rules if rule["state"] == "firing"] == []
