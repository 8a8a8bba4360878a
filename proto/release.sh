#!/bin/sh
# Write the descriptor set that later versions of the interfaces are held against: run it when a version is released,
# or when an interface that nobody has seen yet has changed. An argument names another file to write to.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-$here/released/robosc_api_v1.binpb}
cd "$here"
exec "${PYTHON:-python3}" -m grpc_tools.protoc -I. --include_imports "--descriptor_set_out=$out" robosc_api/v1/*.proto
