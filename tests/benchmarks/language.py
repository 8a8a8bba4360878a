"""Time and memory of reading, checking and formatting models of 100 to 100,000 lines.

The model is the navigation robot again and again, every copy with names of its own. Each size is measured in a process
of its own, so that one cannot use what another has left.
"""

import json
import re
import resource
import subprocess
import sys
import time
from pathlib import Path

from figures import text_table

ROOT = Path(__file__).parents[2]
SIZES = (100, 1_000, 10_000, 100_000)
AIM = 20_000
_NAMES = re.compile(r"(?:component|message|service|action|interface|object|enum)\s+([A-Za-z_]\w*)")


def model_of(lines: int) -> str:
    """A model of about so many lines."""
    text = (ROOT / "examples" / "navigation" / "navigation.rscd").read_text(encoding="utf-8")
    body = text[text.index("{") + 1 : text.rindex("}")]
    name = re.compile(rf"\b({'|'.join(sorted(set(_NAMES.findall(body))))})\b(?!:)")
    copies = max(1, round(lines / body.count("\n")))
    return "robot R {" + "\n".join(name.sub(rf"\1_{number}", body) for number in range(copies)) + "}\n"


def measured(lines: int) -> dict[str, float]:
    """Lines, seconds of each step and the memory that they take on top, in this process."""
    from robosc.formatting import format_text
    from robosc.language import parse
    from robosc.model.check import check
    from robosc.source import Bundle, SourceFile

    bundle = Bundle(SourceFile("model.rscd", model_of(lines)))
    check(Bundle(SourceFile("warm.rscd", model_of(100))))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    seconds = {}
    for name, step in (
        ("parse", lambda: parse(bundle.main)),
        ("check", lambda: check(bundle)),
        ("format", lambda: format_text(bundle.main.text)),
    ):
        begin = time.perf_counter()
        step()
        seconds[name] = time.perf_counter() - begin
        if name == "check":
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    return {"lines": bundle.main.text.count("\n"), "memory_kib": memory, **seconds}


def table() -> str:
    """Lines a second of each step (checking includes reading), and memory of reading and checking."""
    rows = []
    for size in SIZES:
        done = subprocess.run(
            [sys.executable, __file__, str(size)], capture_output=True, text=True, check=True, cwd=Path(__file__).parent
        )
        found = json.loads(done.stdout)
        rates = [f"{found['lines'] / found[name]:,.0f}" for name in ("parse", "check", "format")]
        rows.append((f"{found['lines']:,.0f}", *rates, f"{found['check']:.3f}", f"{found['memory_kib'] / 1024:.0f}"))
    return text_table(
        f"language: lines a second (aim for read + check: {AIM:,})",
        ("lines", "read", "read + check", "format", "read + check, s", "memory, MB"),
        rows,
    )


if __name__ == "__main__":
    print(json.dumps(measured(int(sys.argv[1]))))
