"""Manifests as Kustomize makes them, held against the schemas of Kubernetes and against rules of our own."""

import re
import subprocess
from pathlib import Path

import pytest

from robosc.signatures import make_key_pair
from robosc_server.operations.settings import Settings
from robosc_server.operations.settings_sources import settings_from
from robosc_server.operations.shutdown import END_S
from robosc_server.signing import SigningError, read_signing_key
from support.checkers import checked
from support.containers import IMAGES
from support.dockerfiles import parse_dockerfile
from support.manifests import (
    VARIANTS,
    WITH_ENVOY,
    Manifest,
    container_of,
    has_kustomize,
    manifests,
    named,
    of_kind,
    rendered,
)

pytestmark = pytest.mark.skipif(not has_kustomize(), reason="there is no kubectl, which knows Kustomize")

# The oldest version in use, and the newest.
VERSIONS = ("1.29.0", "1.34.0")

EVERY = (*VARIANTS, WITH_ENVOY)
"""Also the one whose servers are not reached themselves."""


@pytest.mark.parametrize("version", VERSIONS)
def test_manifests_fit_the_schemas(version: str, tmp_path: Path) -> None:
    files = [tmp_path / f"{number}.yaml" for number in range(len(EVERY))]
    for file, variant in zip(files, EVERY, strict=True):
        file.write_text(rendered(variant))
    checked("kubernetes-validate", "--strict", "--quiet", "-k", version, *files)


def test_a_wrong_manifest_would_be_found(tmp_path: Path) -> None:
    file = tmp_path / "manifests.yaml"
    file.write_text(rendered("base").replace("readOnlyRootFilesystem", "readOnlyRootFileSystem"))
    with pytest.raises(AssertionError, match="readOnlyRootFileSystem"):
        checked("kubernetes-validate", "--strict", "--quiet", file)


@pytest.mark.parametrize("variant", EVERY)
def test_pods_keep_to_the_strictest_standard(variant: str) -> None:
    """Check that pods meet the Pod Security Standard `restricted`, and more."""
    for pod in _pods(variant):
        spec, security = pod["spec"], pod["spec"]["securityContext"]
        assert security["runAsNonRoot"] is True and security["runAsUser"] > 10000
        assert security["seccompProfile"] == {"type": "RuntimeDefault"}
        assert spec["automountServiceAccountToken"] is False and spec["serviceAccountName"] == "robosc"
        assert not {"hostNetwork", "hostPID", "hostIPC"} & set(spec)
        kinds = {key for volume in spec["volumes"] for key in volume if key != "name"}
        assert kinds <= {"configMap", "secret", "emptyDir", "persistentVolumeClaim"}
        containers = [*spec["containers"], *spec.get("initContainers", ())]
        for container in containers:
            own = container["securityContext"]
            assert own == {
                "allowPrivilegeEscalation": False,
                "readOnlyRootFilesystem": True,
                "capabilities": {"drop": ["ALL"]},
            }
            assert re.fullmatch(r"(robosc-server:|docker\.io/envoyproxy/envoy:v)\d+\.\d+\.\d+", container["image"])
            assert {"cpu", "memory"} == set(container["resources"]["limits"]) == set(container["resources"]["requests"])
        assert all({"startupProbe", "readinessProbe", "livenessProbe"} <= set(one) for one in spec["containers"])
        mounted = {mount["name"] for container in containers for mount in container["volumeMounts"]}
        assert mounted == {volume["name"] for volume in spec["volumes"]}
        # A disk of the node would fill without a limit.
        assert all("sizeLimit" in volume.get("emptyDir", {"sizeLimit": ""}) for volume in spec["volumes"])
    (namespace,) = of_kind(variant, "Namespace")
    assert namespace["metadata"]["labels"]["pod-security.kubernetes.io/enforce"] == "restricted"


@pytest.mark.parametrize("variant", EVERY)
def test_whatever_chooses_pods_finds_some(variant: str) -> None:
    pods = _pods(variant)
    for item in manifests(variant):
        assert item["kind"] == "Namespace" or item["metadata"]["namespace"] == "robosc", item["metadata"]["name"]
        spec = item.get("spec", {})
        for key in ("selector", "podSelector"):
            selector = spec.get(key, {})
            labels = selector.get("matchLabels", selector) if item["kind"] != "PersistentVolumeClaim" else {}
            assert any(labels.items() <= pod["metadata"]["labels"].items() for pod in pods), item["metadata"]["name"]
    deployments = {item["metadata"]["name"] for item in of_kind(variant, "Deployment")}
    for scaler in of_kind(variant, "HorizontalPodAutoscaler"):
        assert scaler["spec"]["scaleTargetRef"]["name"] in deployments
    ports = {port["name"]: port["containerPort"] for pod in pods for port in _ports_of(pod)}
    for service in of_kind(variant, "Service"):
        assert all(ports[port["targetPort"]] or port for port in service["spec"]["ports"])


@pytest.mark.parametrize("variant", EVERY)
def test_nothing_reaches_pods_but_what_a_policy_says(variant: str) -> None:
    policies = of_kind(variant, "NetworkPolicy")
    (nothing,) = [item for item in policies if item["spec"]["podSelector"] == {}]
    assert nothing["spec"] == {"podSelector": {}, "policyTypes": ["Ingress", "Egress"]}
    for pod in _pods(variant):
        component = pod["metadata"]["labels"]["app.kubernetes.io/component"]
        policy = named(variant, "NetworkPolicy", f"robosc-{component}")["spec"]
        opened = {port["port"] for rule in policy["ingress"] for port in rule["ports"]}
        # Probes come from the node, which no policy keeps away.
        listening = {port["containerPort"] for port in _ports_of(pod) if port["name"] != "http"}
        assert opened == listening, component
        assert all(rule["from"] for rule in policy["ingress"]) and all(rule["to"] for rule in policy["egress"])


def test_whoever_connects_is_let_out_and_in() -> None:
    """Servers and workers reach the scheduler; the scheduler and workers reach workers."""
    for source, target, port in (
        ("server", "scheduler", 8786),
        ("worker", "scheduler", 8786),
        ("scheduler", "worker", 8788),
        ("worker", "worker", 8788),
    ):
        out = named("overlays/dask", "NetworkPolicy", f"robosc-{source}")["spec"]["egress"]
        labels = {"app.kubernetes.io/name": "robosc", "app.kubernetes.io/component": target}
        assert {"to": [{"podSelector": {"matchLabels": labels}}], "ports": [{"port": port}]} in out
        (into,) = named("overlays/dask", "NetworkPolicy", f"robosc-{target}")["spec"]["ingress"]
        (chosen,) = into["from"]
        (values,) = [
            item["values"]
            for item in chosen["podSelector"]["matchExpressions"]
            if item["key"] == "app.kubernetes.io/component"
        ]
        assert source in values


@pytest.mark.parametrize("variant", VARIANTS)
def test_the_settings_can_be_used_and_fit_the_pod(variant: str, tmp_path: Path) -> None:
    settings = settings_of(variant, tmp_path)
    pod = named(variant, "Deployment", "robosc-server")["spec"]["template"]["spec"]
    (container,) = pod["containers"]
    assert settings.drain_seconds + 5 + END_S < pod["terminationGracePeriodSeconds"]
    ports = {port["name"]: port["containerPort"] for port in container["ports"]}
    assert settings.port == ports["grpc"]
    assert str(settings.metrics_address).endswith(f":{ports['metrics']}")
    folders = {mount["mountPath"] for mount in container["volumeMounts"]}
    for file in (settings.tls_certificate, settings.tls_key, settings.tokens):
        assert file is None or str(file.parent) in folders, file
    # Clients send no token without TLS: where there is none, a token could be asked of nobody.
    is_clear = settings.insecure_beyond_loopback
    assert (settings.tls_certificate is None) == (settings.tokens is None) == is_clear
    files = {"robosc-tls", "robosc-tokens"}
    assert files & _secrets_of(pod) == (set() if is_clear else files)
    worker = container_of(variant, "robosc-worker") if settings.workers != "local" else container
    threads = settings.worker_processes if settings.workers == "local" else 2
    limit = int(worker["resources"]["limits"]["memory"].removesuffix("Gi")) * 2**30
    assert threads * settings.task_memory_bytes < limit
    for item in container["env"]:
        assert item["name"].removeprefix("ROBOSC_SERVER_").lower() in {"config", *Settings.model_fields}


def test_several_servers_share_a_database_and_one_alone_does_not() -> None:
    for variant in VARIANTS:
        deployment = named(variant, "Deployment", "robosc-server")["spec"]
        variables = {item["name"] for item in deployment["template"]["spec"]["containers"][0]["env"]}
        is_alone = variant == "overlays/single"
        assert (deployment["replicas"] == 1) == is_alone
        assert ("ROBOSC_SERVER_DATABASE_URL" not in variables) == is_alone
        assert (deployment["strategy"].get("type") == "Recreate") == is_alone
        assert (not of_kind(variant, "HorizontalPodAutoscaler")) == is_alone


def test_servers_behind_envoy_are_reached_through_it_alone() -> None:
    pod = named(WITH_ENVOY, "Deployment", "robosc-server")["spec"]["template"]["spec"]
    containers = {container["name"]: container for container in pod["containers"]}
    server, envoy = containers["server"], containers["envoy"]
    assert [port["name"] for port in server["ports"]] == ["metrics"]
    assert [port["name"] for port in envoy["ports"]] == ["grpc"]
    variables = {item["name"]: item.get("value") for item in server["env"]}
    mounts = {
        name: {mount["mountPath"]: mount["name"] for mount in container["volumeMounts"]}
        for name, container in containers.items()
    }
    # Both have the socket at the place where each looks for it, and each its configuration.
    socket = Path(str(variables["ROBOSC_SERVER_SOCKET"]))
    assert mounts["server"][str(socket.parent)] == mounts["envoy"][str(socket.parent)] == "socket"
    (config,) = [item for item in of_kind(WITH_ENVOY, "ConfigMap") if "envoy.yaml" in item["data"]]
    assert f"path: {socket}" in config["data"]["envoy.yaml"]
    assert mounts["server"][str(Path(str(variables["ROBOSC_SERVER_CONFIG"])).parent)] == "envoy"
    assert "server.toml" in config["data"]
    assert envoy["command"][2] == "/etc/envoy/envoy.yaml" and mounts["envoy"]["/etc/envoy"] == "envoy"
    # The server needs no certificate and no tokens, and the pod starts without them.
    assert _secrets_of(pod) == {"robosc-tls", "robosc-callers"}
    assert "/etc/robosc/tls" in mounts["envoy"] and not {"tls", "tokens"} & set(mounts["server"].values())


def test_a_key_that_signs_is_handed_over_for_its_reader_alone(tmp_path: Path) -> None:
    """Check that the file that Kubernetes makes of a secret, which is also for a group, is refused."""
    pod = named("overlays/signed", "Deployment", "robosc-server")["spec"]["template"]["spec"]
    (first,) = pod["initContainers"]
    folders = {mount["mountPath"]: tmp_path / mount["name"] for mount in first["volumeMounts"]}
    words = list(first["command"])
    for place, folder in folders.items():
        folder.mkdir()
        words = [word.replace(place, str(folder)) for word in words]
    given, copied = (Path(word) for word in words[-2:])
    make_key_pair(given, tmp_path / "public")
    given.chmod(0o440)
    with pytest.raises(SigningError, match="others may read"):
        read_signing_key(given)
    # Also where a copy is there already.
    for _ in range(2):
        subprocess.run(words, check=True)
    read_signing_key(copied)
    (container,) = pod["containers"]
    variables = {item["name"]: item.get("value") for item in container["env"]}
    place = Path(variables["ROBOSC_SERVER_SIGNING_KEY"])
    assert folders[str(place.parent)] / place.name == copied
    # The server itself sees the copy alone.
    assert not [mount for mount in container["volumeMounts"] if mount["name"] == "signing-secret"]


def test_the_image_of_kubernetes_is_that_of_the_dockerfile() -> None:
    stage = parse_dockerfile((IMAGES / "server.Dockerfile").read_text())[-1]
    pod = named("base", "Deployment", "robosc-server")["spec"]["template"]["spec"]
    security = pod["securityContext"]
    assert stage.last("USER").text == f"{security['runAsUser']}:{security['runAsGroup']}"  # type: ignore[union-attr]
    exposed = {int(port) for port in stage.last("EXPOSE").text.split()}  # type: ignore[union-attr]
    assert {port["containerPort"] for port in pod["containers"][0]["ports"]} == exposed
    (volume,) = stage.last("VOLUME").words  # type: ignore[union-attr]
    assert volume in {mount["mountPath"] for mount in pod["containers"][0]["volumeMounts"]}


def settings_of(variant: str, folder: Path) -> Settings:
    (config,) = of_kind(variant, "ConfigMap")
    file = folder / "server.toml"
    file.write_text(config["data"]["server.toml"])
    return settings_from({}, file)


def _secrets_of(pod: Manifest) -> set[str]:
    return {volume["secret"]["secretName"] for volume in pod["volumes"] if "secret" in volume}


def _ports_of(pod: Manifest) -> list[Manifest]:
    return [port for container in pod["spec"]["containers"] for port in container["ports"]]


def _pods(variant: str) -> list[Manifest]:
    return [item["spec"]["template"] for item in of_kind(variant, "Deployment")]
