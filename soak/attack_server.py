"""Attacks a synthesis server of its own on a loopback address, while a well-behaved client calls it.

    python soak/attack_server.py --seconds 10
    python soak/attack_server.py --seconds 10 --envoy .venv-checkers/bin/envoy

Each attack has a server of its own, started by this program, and ends after the given seconds. The attackers are
processes that write raw HTTP/2 (RFC 9113) over sockets, have no token, and call from another loopback address than the
client. The client is a real one, which checks a small model every ten milliseconds. The table has, for each attack, the
calls of the client, how many of them failed, their median, their 99th percentile and the worst one, and the most memory
that the server (and Envoy) took.

With `--envoy`, the server listens on a Unix socket and everything comes through Envoy, with the limits of `deploy/`;
each of the two addresses is a caller. Callers have TLS only under the attacks on TLS.

Exit status: 0 all limits are held, 1 some are not, 2 wrong use.
"""

import argparse
import contextlib
import json
import multiprocessing
import resource
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import yaml

from attacks import ATTACKS, MODEL, OVER_TLS, Deadline

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests")]

from support.certificates import Authority  # noqa: E402

P99_S, MEMORY_BYTES = 0.2, 300 * 2**20
"""Limits that the server is to hold: the client's 99th percentile, and the server's memory."""

CALL_EVERY_S = 0.01
DEADLINE_S = 20.0


@dataclass(frozen=True, slots=True)
class Row:
    """Outcome of one attack.

    Attributes:
        attack: Name of the attack.
        calls: Calls of the well-behaved client.
        failed: Those that failed.
        median_s: Median of their times.
        p99_s: 99th percentile of their times.
        worst_s: The longest call.
        memory_bytes: The most memory of the server.
        door_bytes: The most memory of Envoy; 0: there is none.
        first_failure: Message of the first failure; empty: there is none.
    """

    attack: str
    calls: int
    failed: int
    median_s: float
    p99_s: float
    worst_s: float
    memory_bytes: int
    door_bytes: int
    first_failure: str = ""

    @property
    def is_held(self) -> bool:
        """True if the limits are held."""
        return not self.failed and self.p99_s <= P99_S and self.memory_bytes <= MEMORY_BYTES


def most_memory(process: int) -> int:
    """The most resident memory that a process has had, in bytes."""
    for line in Path(f"/proc/{process}/status").read_text(encoding="utf-8").splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) * 1024
    return 0


@contextlib.contextmanager
def ended(process: "subprocess.Popen[str]") -> Iterator["subprocess.Popen[str]"]:
    """End a process at the end of the context."""
    try:
        yield process
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


@dataclass(frozen=True, slots=True)
class Target:
    """A server that runs.

    Attributes:
        port: Port for callers.
        process: Process of the server.
        door: Process of Envoy; 0: there is none.
        secrets: Certificate authority, and certificate and key of a client; empty: without TLS.
    """

    port: int
    process: int
    door: int
    secrets: tuple[Path, ...]


@contextlib.contextmanager
def running(server: Sequence[str], envoy: str | None, *, is_secure: bool = False) -> Iterator[Target]:
    """Run a server, perhaps behind Envoy, and with TLS for callers."""
    with tempfile.TemporaryDirectory(prefix="robosc-attack-") as folder, contextlib.ExitStack() as stack:
        secrets: tuple[Path, ...] = ()
        where = ["--port", "0"] if envoy is None else ["--socket", f"{folder}/server.socket", "--forwarded-identity"]
        if is_secure:
            authority = Authority(Path(folder))
            own = authority.sign("server")
            secrets = authority.file, *authority.sign("client")
            secrets[-1].chmod(0o600)
            if envoy is None:
                where += ["--tls-certificate", str(own[0]), "--tls-key", str(own[1])]
        words = [*server, *where, "--state-dir", folder, "--log-level", "warning", "--drain-seconds", "0"]
        log = stack.enter_context((Path(folder) / "log").open("w", encoding="utf-8"))
        process = stack.enter_context(
            ended(
                subprocess.Popen(
                    # The soft limit on descriptors that most systems have.
                    ["/bin/sh", "-c", 'ulimit -Sn 1024; exec "$@"', "sh", *words],
                    stdout=subprocess.PIPE,
                    stderr=log,
                    text=True,
                )
            )
        )
        assert process.stdout is not None
        line = process.stdout.readline()
        if "listening on" not in line:
            raise SystemExit(f"attack_server.py: the server did not start: {(Path(folder) / 'log').read_text()}")
        address = line.split(";")[0].split()[-1]
        if envoy is None:
            yield Target(int(address.rpartition(":")[2]), process.pid, 0, secrets)
            return
        door_port = free_port()
        file = Path(folder) / "envoy.yaml"
        file.write_text(json.dumps(door_settings(door_port, Path(folder), is_secure=is_secure)), encoding="utf-8")
        words = [envoy, "-c", str(file), "--log-level", "error", "--concurrency", "2", "--base-id", str(process.pid)]
        door = stack.enter_context(ended(subprocess.Popen(words, stdout=log, stderr=log, text=True)))
        wait_for_door(door_port)
        yield Target(door_port, process.pid, door.pid, secrets)


def door_settings(port: int, folder: Path, *, is_secure: bool) -> dict[str, Any]:
    """Settings of Envoy as in `deploy/envoy/mtls.yaml`; without TLS, raw bytes reach it, and hosts are callers."""
    settings: dict[str, Any] = yaml.safe_load((ROOT / "deploy" / "envoy" / "mtls.yaml").read_text(encoding="utf-8"))
    settings["admin"]["address"]["pipe"]["path"] = str(folder / "admin.socket")
    (listener,) = settings["static_resources"]["listeners"]
    listener["address"]["socket_address"] = {"address": "127.0.0.1", "port_value": port}
    (chain,) = listener["filter_chains"]
    if is_secure:
        context = chain["transport_socket"]["typed_config"]["common_tls_context"]
        context["tls_certificates"][0]["certificate_chain"]["filename"] = str(folder / "server.crt")
        context["tls_certificates"][0]["private_key"]["filename"] = str(folder / "server.key")
        context["validation_context"]["trusted_ca"]["filename"] = str(folder / "authority.pem")
    else:
        del chain["transport_socket"]
    (early,) = chain["filters"][-1]["typed_config"]["early_header_mutation_extensions"]
    for mutation in early["typed_config"]["mutations"]:
        header = mutation.get("append", {}).get("header", {})
        if header.get("key") == "x-robosc-caller" and not is_secure:
            header["value"] = "%DOWNSTREAM_REMOTE_ADDRESS_WITHOUT_PORT%"
    (cluster,) = settings["static_resources"]["clusters"]
    (endpoints,) = cluster["load_assignment"]["endpoints"]
    endpoints["lb_endpoints"][0]["endpoint"]["address"]["pipe"]["path"] = str(folder / "server.socket")
    return settings


def free_port() -> int:
    """A port that is free now."""
    with socket.create_server(("127.0.0.1", 0)) as place:
        return int(place.getsockname()[1])


def wait_for_door(port: int) -> None:
    """Wait until something listens on the port."""
    deadline = Deadline(20)
    while deadline:
        with contextlib.suppress(OSError):
            socket.create_connection(("127.0.0.1", port)).close()
            return
        time.sleep(0.05)
    raise SystemExit("attack_server.py: Envoy does not listen")


def call_until(stop: float, target: Target) -> tuple[list[float], list[str]]:
    """Times of the calls of a well-behaved client until a time, and the messages of those that failed."""
    from robosc import load
    from robosc_api.security import Credentials
    from robosc_client import Client, ClientError

    times: list[float] = []
    failures: list[str] = []
    model = load(text=MODEL)
    ca, certificate, key = target.secrets or (None, None, None)
    credentials = Credentials(ca=ca, certificate=certificate, key=key)
    with Client(f"127.0.0.1:{target.port}", credentials) as client:
        while (begun := time.monotonic()) < stop:
            try:
                client.check(model, deadline_s=DEADLINE_S)
            except ClientError as error:
                failures.append(f"{type(error).__name__}: {error}")
            times.append(time.monotonic() - begun)
            time.sleep(max(0.0, CALL_EVERY_S - times[-1]))
    return times, failures


def attacked(name: str, seconds: float, server: Sequence[str], envoy: str | None) -> Row:
    """Run one attack."""
    with running(server, envoy, is_secure=name in OVER_TLS) as target:
        call_until(time.monotonic() + 0.5, target)
        attacker = multiprocessing.get_context("fork").Process(
            target=ATTACKS[name], args=(target.port, Deadline(seconds)), daemon=True
        )
        attacker.start()
        times, failures = call_until(time.monotonic() + seconds, target)
        attacker.join(5)
        attacker.kill()
        memory, door_memory = most_memory(target.process), most_memory(target.door) if target.door else 0
    times.sort()
    return Row(
        name,
        len(times),
        len(failures),
        times[len(times) // 2],
        times[min(len(times) - 1, len(times) * 99 // 100)],
        times[-1],
        memory,
        door_memory,
        failures[0] if failures else "",
    )


def shown(row: Row) -> str:
    """A line of the table."""
    milliseconds = " | ".join(f"{seconds * 1000:8.1f}" for seconds in (row.median_s, row.p99_s, row.worst_s))
    memory = f"{row.memory_bytes / 2**20:6.0f} | {row.door_bytes / 2**20:5.0f}"
    held = "yes" if row.is_held else "NO"
    return f"| {row.attack:<19} | {row.calls:5} | {row.failed:6} | {milliseconds} | {memory} | {held:<4} |"


HEADING = (
    "| attack              | calls | failed | median ms |   p99 ms | worst ms | server MB | Envoy MB | held |",
    "| ------------------- | ----- | ------ | --------- | -------- | -------- | --------- | -------- | ---- |",
)


def main(argv: Sequence[str] | None = None) -> int:
    """Run as the arguments say."""
    parser = argparse.ArgumentParser(
        prog="attack_server.py",
        description=__doc__.partition("\n\n")[0],
        epilog="attacks: "
        + "; ".join(f"{name}: {(attack.__doc__ or '').rstrip('.')}" for name, attack in ATTACKS.items()),
    )
    parser.add_argument("--seconds", type=float, default=10.0, help="duration of each attack, at most 60 (default: 10)")
    parser.add_argument(
        "--attack", action="append", choices=tuple(ATTACKS), help="an attack; repeatable (default: all)"
    )
    parser.add_argument("--envoy", metavar="FILE", help="put this Envoy in front of the server")
    parser.add_argument(
        "--python", metavar="FILE", default=sys.executable, help="Python whose robosc_server is attacked"
    )
    parser.add_argument("--json", action="store_true", help="print the rows as JSON")
    arguments = parser.parse_args(argv)
    if not 0 < arguments.seconds <= 60:
        parser.error("--seconds takes a number above 0, up to 60")
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(16384, resource.getrlimit(resource.RLIMIT_NOFILE)[1]),) * 2)
    server = [arguments.python, "-m", "robosc_server.main"]
    rows = []
    if not arguments.json:
        print(*HEADING, sep="\n", flush=True)
    for name in arguments.attack or ATTACKS:
        rows.append(attacked(name, arguments.seconds, server, arguments.envoy))
        if not arguments.json:
            print(shown(rows[-1]), flush=True)
            if rows[-1].first_failure:
                print(f"  first failure: {rows[-1].first_failure}")
    if arguments.json:
        print(json.dumps([asdict(row) | {"held": row.is_held} for row in rows], indent=2))
    return 0 if all(row.is_held for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
