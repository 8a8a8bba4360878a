"""State of a robot as the page of the live view shows it, and as it is to show it."""

import json
from typing import Any

from support.browser import Visit

# State and variables of each component in the browser, places of services and actions, and the enabled requests.
SHOWN = """() => {
  const text = (element) => element.textContent.trim();
  const pair = (line) => [text(line.querySelector("dt")), text(line.querySelector("dd"))];
  const components = {};
  const places = {};
  for (const card of document.querySelectorAll(".card")) {
    const lines = [...card.querySelectorAll(".variables > div")];
    const active = [...card.querySelectorAll(".state.is-active")].map((state) => state.dataset.state);
    if (active.length > 0) {
      components[card.dataset.component] = {
        state: active.join(),
        variables: Object.fromEntries(lines.map(pair)),
      };
    }
    for (const place of card.querySelectorAll(".place")) {
      places[text(place.parentElement.querySelector("bdi"))] = text(place);
    }
  }
  const enabled = [...document.querySelectorAll('.request[data-enabled="true"]')].map((item) => item.dataset.request);
  return { components, places, enabled };
}"""
EQUALS = f"(wanted) => JSON.stringify(({SHOWN})()) === wanted"


def _in_words(value: Any) -> str:
    if isinstance(value, float):
        # Browsers take 0.0 and 0 for one number.
        return f"{value:g}"
    return value if isinstance(value, str) else json.dumps(value)


def wanted(components: Any, places: Any, enabled: list[str]) -> str:
    """Return the value that `SHOWN` is to have, as the browser writes it."""
    shown = {
        name: {
            "state": part["state"],
            "variables": {variable: _in_words(value) for variable, value in part["variables"].items()},
        }
        for name, part in components.items()
    }
    return json.dumps({"components": shown, "places": places, "enabled": enabled}, separators=(",", ":"))


def shows(seen: Visit, state: str) -> None:
    seen.wait("(count) => document.querySelectorAll('.card').length >= count", 1)
    try:
        seen.wait(EQUALS, state)
    except Exception:
        assert json.dumps(seen.page.evaluate(SHOWN), separators=(",", ":")) == state
        raise


def entries_shown(seen: Visit) -> list[Any]:
    with seen.page.expect_download() as download:
        seen.page.get_by_role("button", name="Save").click()
    return [json.loads(line) for line in download.value.path().read_text(encoding="utf-8").splitlines()]
