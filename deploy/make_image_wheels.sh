#!/bin/sh
# Fetches what the images are made of, as locked: sh deploy/make_image_wheels.sh DIRECTORY. PYTHON is that of the
# project's environment. A build without a network, as of the tests, takes it from there.
set -eu
directory=$1
cd "$(dirname "$0")/.."
for image in server bridge; do
    for lock in build "$image"; do
        "${PYTHON:?}" -m pip download --quiet --disable-pip-version-check --no-deps --no-build-isolation --require-hashes \
            --dest "$directory/$image" -r "deploy/requirements-$lock.txt"
    done
done
