"""Example file of all settings, with descriptions and defaults as comments."""

import json
import textwrap
from typing import Any

from pydantic_core import PydanticUndefined

from robosc_server.operations.settings import (
    Settings,
    default_text,
    description_of,
    format_value,
    group_of,
)

_WIDTH = 100

_EXAMPLES = {
    "tls_certificate": "/etc/robosc/server.crt",
    "tls_key": "/etc/robosc/server.key",
    "socket": "/run/robosc/server.socket",
    "client_ca": "/etc/robosc/callers.pem",
    "tokens": "/etc/robosc/tokens",
    "signing_key": "/etc/robosc/signing.key",
    "worker_processes": 4,
    "state_dir": "/var/lib/robosc-server",
    "database_url": "postgresql://robosc:PASSWORD@localhost:5432/robosc",
    "metrics_address": "127.0.0.1:9464",
    "tracing_endpoint": "http://127.0.0.1:4317",
}


def example_file() -> str:
    """Return the example file, in TOML."""
    lines = [
        "# Settings of robosc-server. Flags (--state-dir) and environment variables (ROBOSC_SERVER_STATE_DIR)",
        "# override this file, which is selected with --config or ROBOSC_SERVER_CONFIG. Relative paths start",
        "# at the working directory of the server.",
    ]
    group = ""
    for name in Settings.model_fields:
        if group_of(name) != group:
            group = group_of(name)
            lines += ["", f"## {group}"]
        words = f"{description_of(name)} (default: {default_text(name)})"
        lines += ["", *textwrap.wrap(words, _WIDTH, initial_indent="# ", subsequent_indent="# ")]
        lines.append(f"#{name} = {_literal(name)}")
    return "\n".join(lines) + "\n"


def _literal(name: str) -> str:
    default = Settings.model_fields[name].default
    value: Any = _EXAMPLES.get(name) if default is None or default is PydanticUndefined else default
    text = format_value(name, value)
    is_number = (isinstance(value, bool | int | float) and text.lower() in ("true", "false")) or _is_number(text)
    return text if is_number else json.dumps(text)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
