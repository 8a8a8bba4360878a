"""A client in TypeScript: stubs generated from the .proto files, compiled, and run by Node."""

import shutil
import subprocess
from pathlib import Path

import google.rpc
from grpc_tools import protoc  # type: ignore[import-untyped]

from support.interfaces import PROTO, WELL_KNOWN
from support.node import NODE_FOLDER, PACKAGES, node_tool, tsc

_STATUSES = Path(next(iter(google.rpc.__path__))).parents[1]
_OPTIONS = (
    "outputServices=grpc-js,esModuleInterop=true,importSuffix=.js,forceLong=bigint,oneof=unions-value,stringEnums=true,"
    "outputJsonMethods=false,outputPartialMethods=false"
)
_FILES = (
    "robosc_api/v1/synthesis.proto",
    "robosc_api/v1/jobs.proto",
    "google/rpc/status.proto",
    "google/rpc/error_details.proto",
)


def compiled_client(folder: Path) -> Path:
    """Compile `tests/node/client.ts` with stubs made for it in a folder; returns what Node runs."""
    plugin, compiler = node_tool("protoc-gen-ts_proto"), tsc()
    for name in ("client.ts", "tsconfig.json", "package.json"):
        shutil.copy(NODE_FOLDER / name, folder)
    (folder / "node_modules").symlink_to(PACKAGES)
    status = protoc.main(
        [
            "protoc",
            f"-I{PROTO}",
            f"-I{_STATUSES}",
            f"-I{WELL_KNOWN}",
            f"--plugin=protoc-gen-ts_proto={plugin}",
            f"--ts_proto_out={folder}",
            f"--ts_proto_opt={_OPTIONS}",
            *_FILES,
        ]
    )
    assert status == 0, "protoc has said why on standard error"
    ran = subprocess.run([compiler], cwd=folder, capture_output=True, text=True, timeout=240)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return folder / "built" / "client.js"
