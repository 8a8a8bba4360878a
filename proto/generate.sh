#!/bin/sh
# Generate the bindings next to the .proto files; an argument names another folder to write to.
# The proto path is the import path, so the output says `from robosc_api.v1 import ...` and needs no patch.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-$here}
exec "${PYTHON:-python3}" -m grpc_tools.protoc "-I$here" "--python_out=$out" "--pyi_out=$out" "--grpc_python_out=$out" \
    robosc_api/v1/bridge.proto robosc_api/v1/jobs.proto robosc_api/v1/synthesis.proto
