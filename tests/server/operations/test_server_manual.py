"""The manual of the server against what it describes."""

import re
from pathlib import Path

from prometheus_client.parser import text_string_to_metric_families

from robosc_server.operations.metrics import Metrics
from robosc_server.operations.settings import Settings, default_text, description_of, group_of
from robosc_server.operations.settings_sources import flag_of, variable_of

PAGE = (Path(__file__).parents[3] / "docs" / "server.md").read_text("utf-8")


def settings_table() -> str:
    """Return the settings for the manual: a table in Markdown for each group."""
    parts = []
    for group in dict.fromkeys(map(group_of, Settings.model_fields)):
        rows = ["| flag | file | environment | what it is | default |", "|---|---|---|---|---|"]
        for name in Settings.model_fields:
            if group_of(name) == group:
                cells = [f"`{flag_of(name)}`", f"`{name}`", f"`{variable_of(name)}`", description_of(name)]
                cells.append(default_text(name))
                assert "|" not in "".join(cells)
                rows.append(f"| {' | '.join(cells)} |")
        parts.append(f"### {group[0].upper()}{group[1:]}\n\n" + "\n".join(rows) + "\n")
    return "\n".join(parts)


def test_every_setting_stands_in_the_manual_as_it_is_defined() -> None:
    _, _, rest = PAGE.partition("<!-- settings: from the definition -->\n\n")
    table, _, _ = rest.partition("\n<!-- end of settings -->")
    assert table == settings_table()


def test_every_metric_stands_in_the_manual() -> None:
    listed = set(re.findall(r"^\| `(robosc_server_[a-z_]+)` \|", PAGE, re.MULTILINE))
    metrics = Metrics("1")
    metrics.set_sources(jobs=lambda: {"queued": 1}, conditions=lambda: {"store": True})
    families = text_string_to_metric_families(metrics.text().decode())
    counted = {
        f"{family.name}_total" if family.type == "counter" else family.name
        for family in families
        if family.name.startswith("robosc_") and not family.name.endswith("_created")
    }
    assert listed == {name.removesuffix("_info") + "_info" if "info" in name else name for name in counted}
