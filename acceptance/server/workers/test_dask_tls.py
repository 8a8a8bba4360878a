"""A server that reaches its Dask cluster with TLS: a real scheduler and worker, with right and wrong certificates."""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import grpc
import pytest
from google.rpc import error_details_pb2
from grpc_status import rpc_status

from robosc_api.v1 import synthesis_pb2 as pb
from robosc_api.v1 import synthesis_pb2_grpc
from support.certificates import Authority
from support.dask_clusters import Cluster, dask_cluster
from support.service import logged_server_process
from support.waiting import PATIENCE_S, eventually

_PREFIX = "DASK_DISTRIBUTED__COMM__TLS__"
_MODEL = pb.Bundle(main=pb.SourceFile(name="robot.rscd", text="robot Small {}"))


def settings_of(authority: Path, role: str, certificate: tuple[Path, Path]) -> dict[str, str]:
    """Dask's settings of a member of the cluster."""
    file, key = map(str, certificate)
    return {f"{_PREFIX}CA_FILE": str(authority), f"{_PREFIX}{role}__CERT": file, f"{_PREFIX}{role}__KEY": key}


class Site:
    """A cluster, and an authority that knows everybody in it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.authority = Authority(folder)

    def cluster_settings(self) -> dict[str, str]:
        one = self.authority.sign("member")
        roles = [settings_of(self.authority.file, role, one) for role in ("SCHEDULER", "WORKER")]
        return {**roles[0], **roles[1], "DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION": "true"}

    def ours(self) -> dict[str, str]:
        return settings_of(self.authority.file, "CLIENT", self.authority.sign("server"))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Site:
    return Site(tmp_path_factory.mktemp("site"))


@pytest.fixture(scope="module")
def cluster(site: Site) -> Iterator[Cluster]:
    with dask_cluster(site.folder, workers=1, protocol="tls", environment=site.cluster_settings()) as cluster:
        yield cluster


def spec_of(cluster: Cluster, protocol: str = "dask+tls") -> str:
    return f"{protocol}://127.0.0.1:{cluster.port}"


def check(address: str) -> pb.CheckResponse:
    with grpc.insecure_channel(address) as channel:
        stub: Any = synthesis_pb2_grpc.SynthesisServiceStub(channel)  # type: ignore[no-untyped-call]
        response: pb.CheckResponse = stub.Check(pb.CheckRequest(bundle=_MODEL), timeout=PATIENCE_S)
        return response


def config_checked(spec: str, environment: dict[str, str]) -> tuple[str, str]:
    """Return the grade and the message of `check-config` about the workers."""
    command = [sys.executable, "-m", "robosc_server.main", "check-config", "--json", "--port", "0", "--workers", spec]
    variables = {"PYTHONPATH": ":".join(filter(None, sys.path)), "PATH": "/usr/bin:/bin", "HOME": "/nowhere"}
    done = subprocess.run(command, env=variables | environment, check=False, capture_output=True, text=True)
    (found,) = [found for found in json.loads(done.stdout)["findings"] if found["part"] == "workers"]
    return found["grade"], found["message"]


def test_a_call_is_done_by_a_cluster_with_tls(site: Site, cluster: Cluster) -> None:
    spec, ours = spec_of(cluster), site.ours()
    with logged_server_process("--workers", spec, **ours) as (_, address, _):

        def is_answered() -> bool:
            try:
                return bool(check(address).diagnostics is not None)
            except grpc.RpcError as error:
                # Its worker may be on its way.
                assert error.code() is grpc.StatusCode.UNAVAILABLE
                return False

        assert eventually(is_answered)
    assert config_checked(spec, ours) == ("ok", f"127.0.0.1:{cluster.port} answers")


def test_certificates_that_are_wrong_are_reported_in_one_sentence(site: Site, cluster: Cluster, tmp_path: Path) -> None:
    stranger = Authority(tmp_path, "stranger")
    spec = spec_of(cluster)
    refused_as(
        spec,
        settings_of(stranger.file, "CLIENT", site.authority.sign("server")),
        "its certificate is not accepted: ",
    )
    late = settings_of(site.authority.file, "CLIENT", site.authority.sign("late", days=-1))
    refused_as(spec, late, "alert certificate expired")
    strange = settings_of(site.authority.file, "CLIENT", stranger.sign("stranger"))
    for ours, words in ((late, "alert certificate expired"), (strange, "alert unknown ca")):
        grade, message = config_checked(spec, ours)
        assert (grade, message.endswith(words)) == ("error", True), message
        assert message.startswith(f"127.0.0.1:{cluster.port}: TLS fails: ")


def test_a_scheduler_whose_certificate_has_expired_is_not_believed(tmp_path: Path) -> None:
    site = Site(tmp_path)
    late = settings_of(site.authority.file, "SCHEDULER", site.authority.sign("member", days=-1))
    with dask_cluster(tmp_path, workers=0, protocol="tls", environment=late) as cluster:
        refused_as(spec_of(cluster), site.ours(), "its certificate is not accepted: certificate has expired")


def test_a_scheduler_with_tls_is_not_reached_without(site: Site, cluster: Cluster) -> None:
    assert config_checked(spec_of(cluster), {})[0] == "error"
    command = [sys.executable, "-m", "robosc_server.main", "--port", "0", "--workers", spec_of(cluster)]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode != 0
    assert "workers on dask+tls:// need Dask's settings DASK_DISTRIBUTED__COMM__TLS__CA_FILE" in done.stderr
    assert "Traceback" not in done.stderr


def refused_as(spec: str, environment: dict[str, str], words: str) -> None:
    """A server that cannot use its cluster refuses calls, and says why in its log."""
    with logged_server_process("--workers", spec, **environment) as (_, address, log):
        with pytest.raises(grpc.RpcError) as refused:
            check(address)
        assert refused.value.code() is grpc.StatusCode.UNAVAILABLE
        status = rpc_status.from_call(refused.value)
        assert status is not None
        info = error_details_pb2.ErrorInfo()
        assert status.details[0].Unpack(info)
        assert info.reason == "WORKERS_UNAVAILABLE"
        assert eventually(lambda: any(words in line for line in log)), log
        # Once, however often it is tried.
        assert sum(words in line for line in log) == 1
        assert not any("Traceback" in line for line in log)
