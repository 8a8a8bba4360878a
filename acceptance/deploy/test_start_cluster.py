"""The Dask clusters of compose and Kubernetes: the words that stand in their files, started on this machine alone.

Only addresses, ports and the folder for temporary files are others. A server with the settings of compose has a model
checked by that of compose.
"""

import json
import os
import socket
import subprocess
import sys
import tomllib
import urllib.request
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import yaml

from robosc.source import Bundle, SourceFile
from robosc_api.security import Credentials, Scope, make_token
from robosc_client import Client
from support.certificates import Authority
from support.containers import TOP
from support.dask_clusters import end
from support.manifests import container_of, has_kustomize
from support.service import server_process
from support.waiting import eventually

distributed = pytest.importorskip("distributed")

COMPOSE = TOP / "deploy" / "compose"
SCHEDULER_PORT, DASHBOARD_PORT, WORKER_PORT = "8786", "8787", "8788"

MODEL = "robot Empty { component C { behaviour { } } "


@dataclass(frozen=True)
class Part:
    """A scheduler or worker.

    Attributes:
        words: It is started with.
        health_check: Its health check's words, or the path that is asked for.
    """

    words: list[str]
    health_check: list[str] | str


def parts_of_compose() -> tuple[Part, Part, dict[str, Any]]:
    """Scheduler, worker, and the settings of the server."""
    services = yaml.safe_load((COMPOSE / "compose.yaml").read_text())["services"]
    scheduler, worker = (
        Part([*service["entrypoint"], *service["command"]], service["healthcheck"]["test"][1:])
        for service in (services["scheduler"], services["worker"])
    )
    return scheduler, worker, tomllib.loads((COMPOSE / "server.toml").read_text())


def parts_of_kubernetes() -> tuple[Part, Part]:
    """Scheduler and worker."""
    scheduler, worker = (
        Part([*container["command"], *container["args"]], container["startupProbe"]["httpGet"]["path"])
        for container in (container_of("overlays/dask", f"robosc-{name}") for name in ("scheduler", "worker"))
    )
    return scheduler, worker


def free_port() -> str:
    """A port without a listener."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return str(probe.getsockname()[1])


@contextmanager
def started(part: Part, scheduler: str, folder: Path) -> Iterator[None]:
    """Run a healthy scheduler or worker on loopback addresses.

    Args:
        part: Part to start.
        scheduler: The port of the scheduler.
        folder: Folder for its log and temporary files.
    """
    folder.mkdir()
    dashboard, own = free_port(), free_port()
    words = []
    for word in part.words:
        host, colon, port = word.rpartition(":")
        if colon and port == SCHEDULER_PORT:
            words.append(f"tcp://127.0.0.1:{scheduler}")
        elif colon and port == DASHBOARD_PORT:
            assert host in ("", "127.0.0.1"), word
            words.append(f"127.0.0.1:{dashboard}")
        else:
            others = {SCHEDULER_PORT: scheduler, WORKER_PORT: own, "0.0.0.0": "127.0.0.1", "/tmp": str(folder)}
            words.append(others.get(word, word))
    program = Path(sys.executable).with_name(words[0])
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    with ExitStack() as stack:
        log = stack.enter_context((folder / "log").open("wb"))
        process = subprocess.Popen(
            [program, *words[1:]], stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=environment, cwd=folder
        )
        stack.callback(end, process)
        assert eventually(lambda: process.poll() is not None or _is_well(part, dashboard))
        assert process.poll() is None, (folder / "log").read_text()
        yield
    assert process.returncode == 0, (folder / "log").read_text()


def _is_well(part: Part, dashboard: str) -> bool:
    if isinstance(part.health_check, str):
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{dashboard}{part.health_check}", timeout=4) as answer:
                return bool(answer.status == 200)
        except OSError:
            return False
    python, *words = part.health_check
    assert python == "python"
    words = [word.replace(f":{DASHBOARD_PORT}/", f":{dashboard}/") for word in words]
    return subprocess.run([sys.executable, *words], capture_output=True).returncode == 0


def here(settings: dict[str, Any], scheduler: str, folder: Path) -> tuple[Path, Credentials]:
    """A file with the settings of a server that is reached on this machine alone, and what a caller needs."""
    authority = Authority(folder)
    certificate, key = authority.sign("server")
    token, line = make_token("caller", (Scope.SYNTHESIZE,))
    tokens, token_file, file = folder / "tokens", folder / "token", folder / "server.toml"
    for path, text in ((tokens, line), (token_file, token)):
        path.write_text(text + "\n")
        path.chmod(0o600)
    assert settings["workers"].startswith("dask://") and settings["workers"].endswith(f":{SCHEDULER_PORT}")
    # The database is SQLite's.
    there = {name: value for name, value in settings.items() if name not in ("database_url", "metrics_address")} | {
        "host": "127.0.0.1",
        "tls_certificate": str(certificate),
        "tls_key": str(key),
        "tokens": str(tokens),
        "workers": f"dask://127.0.0.1:{scheduler}",
    }
    file.write_text("".join(f"{name} = {json.dumps(value)}\n" for name, value in there.items()))
    return file, Credentials(ca=authority.file, token_file=token_file)


def test_a_server_has_a_model_checked_by_the_cluster_of_compose(tmp_path: Path) -> None:
    scheduler, worker, settings = parts_of_compose()
    port = free_port()
    file, credentials = here(settings, port, tmp_path)
    with (
        started(scheduler, port, tmp_path / "scheduler"),
        started(worker, port, tmp_path / "worker"),
        server_process(ROBOSC_SERVER_CONFIG=str(file)) as (_, address),
        Client(address, credentials) as client,
    ):
        findings = client.check(Bundle(SourceFile("robot.rscd", MODEL), ()))
    assert findings and "robot.rscd" in str(findings[0]), findings


@pytest.mark.skipif(not has_kustomize(), reason="there is no kubectl, which knows Kustomize")
def test_the_worker_of_kubernetes_reaches_its_scheduler(tmp_path: Path) -> None:
    scheduler, worker = parts_of_kubernetes()
    port = free_port()
    with (
        started(scheduler, port, tmp_path / "scheduler"),
        started(worker, port, tmp_path / "worker"),
        distributed.Client(f"tcp://127.0.0.1:{port}", set_as_default=False) as client,
    ):
        client.wait_for_workers(1, timeout=60)
        threads = list(client.nthreads().values())
    assert threads == [2]
