"""Manifests that Kustomize makes of the folders in deploy/kubernetes."""

import functools
import shutil
import subprocess
from pathlib import Path
from typing import Any

import yaml

KUBERNETES = Path(__file__).parents[2] / "deploy" / "kubernetes"
WITH_ENVOY = "overlays/envoy"
VARIANTS = ("base", "overlays/single", "overlays/dask", "overlays/plaintext", "overlays/signed")

type Manifest = dict[str, Any]


def has_kustomize() -> bool:
    """Return True if there is a kubectl, which knows Kustomize."""
    return shutil.which("kubectl") is not None


@functools.cache
def rendered(variant: str) -> str:
    """The manifests of a folder."""
    done = subprocess.run(["kubectl", "kustomize", str(KUBERNETES / variant)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


def manifests(variant: str) -> list[Manifest]:
    """The same, read."""
    return [item for item in yaml.safe_load_all(rendered(variant)) if item is not None]


def of_kind(variant: str, kind: str) -> list[Manifest]:
    """Those of one kind."""
    return [item for item in manifests(variant) if item["kind"] == kind]


def named(variant: str, kind: str, name: str) -> Manifest:
    """The one of a kind and name; what Kustomize has put behind a name does not count."""
    (found,) = [
        item
        for item in of_kind(variant, kind)
        if item["metadata"]["name"] == name or item["metadata"]["name"].rpartition("-")[0] == name
    ]
    return found


def container_of(variant: str, name: str) -> Manifest:
    """The container of a deployment."""
    (found,) = named(variant, "Deployment", name)["spec"]["template"]["spec"]["containers"]
    return dict(found)
