#!/bin/sh
# Makes what is installed elsewhere: sh deploy/make_dist.sh DIRECTORY. PYTHON is that of the project's environment, EXTRAS
# says for which extras there are to be wheels, MACHINE for which processor, as `uname -m` calls it there. DIRECTORY then has
#   robosc-VERSION-py3-none-any.whl    RoboSC: one distribution, for every system; extras say what of it can be used
#   robosc-VERSION-cp312-abi3-*.whl    the same for this processor alone, with the kernel of synthesis in C
#   constraints.txt                    the versions of other packages that it is tested with
#   wheels/                            all of it for a machine without network, of this Python and that processor
#   udev/, systemd/                    rules for serial lines, units
#   SHA256SUMS                         checksums of all files: sha256sum -c SHA256SUMS
set -eu
directory=$(realpath -m "$1")
cd "$(dirname "$0")/.."
: "${PYTHON:?}" "${EXTRAS:?}" "${MACHINE:=$(uname -m)}"
quiet="--quiet --disable-pip-version-check"

rm -rf "$directory"
mkdir -p "$directory/wheels"
lock=$(mktemp)
trap 'rm -f "$lock"' EXIT
# shellcheck disable=SC2086  # several words, as $quiet
"$PYTHON" deploy/lock_images.py $EXTRAS >"$lock"

ROBOSC_KERNEL=0 "$PYTHON" -m pip wheel $quiet --no-deps --no-build-isolation --no-index --wheel-dir "$directory" .
# Packages without a wheel are built by the locked tools of the environment.
if [ "$MACHINE" = "$(uname -m)" ]; then
    "$PYTHON" -m pip wheel $quiet --no-deps --no-build-isolation --no-index --wheel-dir "$directory" .
    "$PYTHON" -m pip wheel $quiet --no-deps --no-build-isolation --require-hashes --wheel-dir "$directory/wheels" -r "$lock"
else
    # For systems with glibc 2.35 (Ubuntu 22.04) and later.
    platforms=$(seq -f "--platform manylinux_2_%.0f_$MACHINE" 35 -1 17)
    # shellcheck disable=SC2086  # several words
    "$PYTHON" -m pip download $quiet --no-deps --no-build-isolation --require-hashes \
        $platforms --platform "manylinux2014_$MACHINE" --dest "$directory/wheels" -r "$lock"
    find "$directory/wheels" -name '*.tar.gz' | while read -r source; do
        # Only what is the same on every processor can be built here.
        "$PYTHON" -m pip wheel $quiet --no-deps --no-build-isolation --no-index \
            --wheel-dir "$directory/wheels" "$source"
        rm "$source"
    done
    foreign=$(find "$directory/wheels" -name '*.whl' ! -name '*-any.whl' ! -name "*_$MACHINE.whl")
    if [ -n "$foreign" ]; then
        echo "make: these have to be built on a $MACHINE: $foreign" >&2
        exit 1
    fi
fi
cp "$directory"/robosc-*.whl "$directory/wheels"
grep -o '^[a-z0-9][^ \\]*' "$lock" | sed 's/\[[^]]*\]//' >"$directory/constraints.txt"
cp -r deploy/udev deploy/systemd "$directory"
(cd "$directory" && find . -type f ! -name SHA256SUMS -printf '%P\n' | LC_ALL=C sort | xargs sha256sum >SHA256SUMS)
"$PYTHON" -c 'import sys; print("for Python {}.{} on {}".format(*sys.version_info[:2], sys.argv[1]))' "$MACHINE"
