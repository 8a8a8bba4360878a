"""Processor time of a cached call, and what each part of the service adds to that of an empty server.

The empty server is given one layer of the service after the other; the rest is the service itself. All servers take
turns of a few hundred calls, and the least of each counts, since other work on the machine only adds to it.
"""

import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from figures import text_table
from robosc_api.security import Credentials, Scope, make_token
from service.echo import LAYERS, echo_server
from service.load import Server, answer_sizes, as_echo, call_kinds, processor_s, run_load
from support.service import server_process

CALLS = 300
TURNS = 24
CLIENTS = 8
WARM_UP = 200

HEADER = ("line follower, cached", "Check us", "more", "Synthesize us", "more")


def table() -> str:
    """Return the table of both methods."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        token, line = make_token("caller", {Scope.SYNTHESIZE})
        tokens, token_file = folder / "tokens", folder / "token"
        for path, text in ((tokens, line), (token_file, token)):
            path.touch(mode=0o600)
            path.write_text(f"{text}\n")
        service = _service(stack)
        sizes = answer_sizes(service.address)
        names = ["empty echo", *(f"and {name}" for name in LAYERS)]
        measured: dict[str, Callable[[str, int], float]] = {}
        for layers, name in enumerate(names):
            process, address = stack.enter_context(echo_server(sizes, layers))
            measured[name] = _measure(Server(process.pid, address), Credentials(), is_echo=True)
        measured["the service: and its checks, quotas and cache"] = _measure(service, Credentials())
        guarded = _service(stack, "--tokens", str(tokens))
        measured["the service with tokens"] = _measure(guarded, Credentials(token_file=token_file))
        found: dict[tuple[str, str], list[float]] = {}
        for turn in range(TURNS + 1):
            for method in ("Check", "Synthesize"):
                for name, measure in measured.items():
                    used_s = measure(f"{method}, cached", CALLS if turn else WARM_UP)
                    if turn:
                        found.setdefault((name, method), []).append(used_s * 1e6)
    rows, before = [], {"Check": 0.0, "Synthesize": 0.0}
    for name in measured:
        row = [name]
        for method in before:
            least = min(found[name, method])
            row += [f"{least:.0f}", f"{least - before[method]:.0f}" if before[method] else ""]
            before[method] = least
        rows.append(row)
    return text_table(f"Processor time of the server for a call, {CLIENTS} clients", HEADER, rows)


def _service(stack: ExitStack, *options: str) -> Server:
    process, address = stack.enter_context(
        server_process("--worker-processes", "1", "--log-level", "warning", *options)
    )
    return Server(process.pid, address)


def _measure(server: Server, credentials: Credentials, *, is_echo: bool = False) -> Callable[[str, int], float]:
    """Return a function of a kind and number of calls, which returns the processor time of one, in seconds."""

    def measured(kind: str, calls: int) -> float:
        load = call_kinds()[kind](CLIENTS)
        before_s = processor_s(server.pid)
        answered = run_load(server.address, as_echo(load) if is_echo else load, credentials, count=calls)
        assert len(answered.times_s) == calls, answered.errors
        return (processor_s(server.pid) - before_s) / calls

    return measured
