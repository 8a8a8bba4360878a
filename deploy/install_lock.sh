#!/bin/sh
# Installs a lock into an environment: sh deploy/install_lock.sh UV PYTHON LOCK
#
# A lock holds every package with its version and hashes, so that no release of any package changes what is installed:
# requirements of packages are not followed, and what has no wheel is built by the tools of requirements-build.txt. In
# the end the packages are asked whether each has what it needs.
set -eu
uv=$1 python=$2 lock=$3

install() {
    "$uv" pip install --quiet --python "$python" --no-deps --require-hashes "$@"
}

install --no-build -r "$(dirname "$0")/requirements-build.txt"
install --no-build-isolation -r "$lock"
"$uv" pip check --quiet --python "$python"
