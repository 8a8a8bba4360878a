"""The dashboard and the alerts: queries that Prometheus reads, of metrics that there are; alerts that come and go."""

import json
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml

from robosc_server.operations.metrics import Metrics
from support.checkers import checked
from support.containers import TOP
from support.node import PACKAGES, tsc

MONITORING = TOP / "deploy" / "monitoring"
ALERTS = MONITORING / "alerts.yaml"

_TYPES = """\
import type { Dashboard } from "@grafana/schema";
type Json<T> = T extends string ? `${T}` : T extends object ? { [Key in keyof T]: Json<T[Key]> } : T;
"""
"""Types of a dashboard in JSON, where the name of a choice is a text."""

_FUNCTIONS = "sum rate increase min max by le histogram_quantile label_values".split()


@pytest.fixture(scope="module")
def dashboard() -> dict[str, Any]:
    return dict(json.loads((MONITORING / "dashboard.json").read_text()))


def _samples() -> set[str]:
    """Names of all samples that a server exports, also of what has not happened yet."""
    found = set()
    for line in Metrics("").text().decode().splitlines():
        if line.startswith("# TYPE "):
            _, _, name, kind = line.split()
            found |= {f"{name}_{part}" for part in ("bucket", "sum", "count")} if kind == "histogram" else {name}
    return found | {"up"}


def _names(expression: str) -> set[str]:
    """Names of the metrics in a query."""
    without = re.sub(r"\{[^}]*\}|\[[^\]]*\]|\"[^\"]*\"|by \([^)]*\)", "", expression)
    return {name for name in re.findall(r"[a-z][a-z_0-9]+", without) if name not in _FUNCTIONS and name != "e9"}


def _expressions(dashboard: dict[str, Any]) -> list[str]:
    return [target["expr"] for panel in dashboard["panels"] for target in panel["targets"]]


def test_the_names_in_a_query_are_found() -> None:
    query = 'histogram_quantile(0.5, sum by (le, method) (rate(a_bucket{job="x"}[5m]))) / b_total > 1.5e9'
    assert _names(query) == {"a_bucket", "b_total"}


def test_what_is_drawn_is_measured(dashboard: dict[str, Any]) -> None:
    expressions = _expressions(dashboard)
    (instance,) = [item for item in dashboard["templating"]["list"] if item["name"] == "instance"]
    for expression in [*expressions, instance["query"]["query"].replace(", instance", "")]:
        assert _names(expression) and _names(expression) <= _samples(), expression
    # And all of ours that is exported is drawn.
    ours = {name.removesuffix("_bucket") for name in _samples() if name.startswith("robosc_server_")}
    ours -= {name for name in ours if name.endswith(("_sum", "_count", "_created"))}
    drawn = {name.removesuffix("_bucket") for expression in expressions for name in _names(expression)}
    assert ours - drawn == {"robosc_server_info"}


def test_what_is_watched_is_measured() -> None:
    for group in yaml.safe_load(ALERTS.read_text())["groups"]:
        for rule in group["rules"]:
            assert _names(rule["expr"]) and _names(rule["expr"]) <= _samples(), rule["alert"]


def test_prometheus_reads_the_queries_of_the_dashboard(dashboard: dict[str, Any], tmp_path: Path) -> None:
    rules = [
        {"record": f"drawn:{number}", "expr": expression.replace("$__rate_interval", "1m").replace("$instance", ".*")}
        for number, expression in enumerate(_expressions(dashboard))
    ]
    file = tmp_path / "rules.yaml"
    file.write_text(yaml.safe_dump({"groups": [{"name": "dashboard", "rules": rules}]}).replace("drawn:", "drawn:n"))
    assert f"{len(rules)} rules found" in checked("promtool", "check", "rules", file)


def test_prometheus_reads_alerts_and_configuration() -> None:
    checked("promtool", "check", "config", "prometheus.yaml", folder=MONITORING)


def test_alerts_come_and_go(tmp_path: Path) -> None:
    text = (Path(__file__).with_name("alerts_cases.yaml")).read_text().replace("ALERTS", str(ALERTS))
    file = tmp_path / "cases.yaml"
    file.write_text(text)
    checked("promtool", "test", "rules", file)
    cases = yaml.safe_load(text)["tests"]
    tested = {case["alertname"] for item in cases for case in item["alert_rule_test"] if case["exp_alerts"]}
    rules = yaml.safe_load(ALERTS.read_text())["groups"][0]["rules"]
    assert tested == {rule["alert"] for rule in rules}


def test_promtool_likes_the_metrics() -> None:
    checked("promtool", "check", "metrics", text=Metrics("1.0").text().decode())


def test_the_dashboard_is_whole(dashboard: dict[str, Any]) -> None:
    panels = dashboard["panels"]
    assert len({panel["id"] for panel in panels}) == len(panels)
    cells = [
        (column, row)
        for panel in panels
        for column in range(panel["gridPos"]["x"], panel["gridPos"]["x"] + panel["gridPos"]["w"])
        for row in range(panel["gridPos"]["y"], panel["gridPos"]["y"] + panel["gridPos"]["h"])
    ]
    assert len(set(cells)) == len(cells) and max(column for column, _ in cells) == 23
    for panel in panels:
        assert panel["description"] and panel["fieldConfig"]["defaults"]["unit"]
        for source in (panel["datasource"], *(target["datasource"] for target in panel["targets"])):
            assert source == {"type": "prometheus", "uid": "${source}"}
        letters = [target["refId"] for target in panel["targets"]]
        assert letters == sorted(set(letters))


def test_the_dashboard_is_as_grafana_s_own_types_say(tmp_path: Path) -> None:
    """Check it with the compiler of TypeScript, without a Grafana."""
    schema = PACKAGES / "@grafana" / "schema"
    if not schema.exists():
        pytest.skip("the npm packages of tests/node are not installed: npm ci --prefix tests/node")
    (tmp_path / "node_modules").symlink_to(PACKAGES)
    options = ["--noEmit", "--strict", "--skipLibCheck", "--module", "nodenext", "--target", "es2022"]

    def compiled(text: str) -> str:
        (tmp_path / "dashboard.ts").write_text(f"{_TYPES}export const dashboard: Json<Dashboard> = {text};\n")
        words = [str(tsc()), *options, "dashboard.ts"]
        return subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False).stdout

    text = (MONITORING / "dashboard.json").read_text()
    assert compiled(text) == ""
    for right, wrong in (('"hide": 0', '"hide": "no"'), ('"mode": "absolute"', '"mode": "absolut"')):
        assert "error TS" in compiled(text.replace(right, wrong, 1))
