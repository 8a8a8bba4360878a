#!/bin/sh
# Makes a virtual environment from the lock: sh deploy/make_environment.sh DIRECTORY
# PYTHON chooses the interpreter; otherwise the first Python 3.12 or newer that answers is taken.
set -eu
venv=$1
cd "$(dirname "$0")/.."

usable() {
    "$@" -c 'import sys; sys.exit(not (3, 12) <= sys.version_info[:2] < (3, 14))' >/dev/null 2>&1
}

find_python() {
    if [ -n "${PYTHON:-}" ]; then
        usable "$PYTHON" || { echo "make: PYTHON=$PYTHON is not Python 3.12 or 3.13" >&2; exit 1; }
        command -v "$PYTHON"
        return
    fi
    for candidate in python3.12 python3 python python3.13; do
        if usable "$candidate"; then
            command -v "$candidate"
            return
        fi
    done
    # pyenv keeps versions that are installed but not chosen beside each other.
    for candidate in "${PYENV_ROOT:-$HOME/.pyenv}"/versions/3.12*/bin/python; do
        if usable "$candidate"; then
            echo "$candidate"
            return
        fi
    done
    echo "make: no Python 3.12 found; install one, or say make PYTHON=/path/to/python3.12" >&2
    exit 1
}

python=$(find_python)
if [ ! -x "$venv/bin/python" ] || ! usable "$venv/bin/python"; then
    rm -rf "$venv"
    "$python" -m venv "$venv"
fi
echo "make: installing the locked packages into $venv (about a minute the first time)"
# The pip of the interpreter installs uv and a pip of the locked version, and nothing more.
"$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-deps --require-hashes --only-binary :all: \
    -r deploy/requirements-build.txt
sh deploy/install_lock.sh "$venv/bin/uv" "$venv/bin/python" requirements.lock
"$venv/bin/uv" pip install --quiet --python "$venv/bin/python" --no-deps --no-build-isolation --editable .
