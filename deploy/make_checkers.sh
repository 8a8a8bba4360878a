#!/bin/sh
# Makes the environment of what looks at the files of this folder: sh deploy/make_checkers.sh DIRECTORY. BIN has the
# python and the uv of the project's environment.
#
# An environment of its own, from a lock of its own; promtool and Prometheus come from Debian, unpacked and not installed,
# since installed they would start a service. What cannot be had is left out, and its tests are skipped.
set -eu
venv=$1
cd "$(dirname "$0")/.."
bin=${BIN:-.venv/bin}
"$bin/uv" venv --quiet --clear --python "$bin/python" "$venv"
sh deploy/install_lock.sh "$bin/uv" "$venv/bin/python" deploy/requirements-checkers.txt
rm -rf "$venv/prometheus"
if command -v apt-get >/dev/null && command -v dpkg-deb >/dev/null; then
    folder=$(mktemp -d)
    trap 'rm -rf "$folder"' EXIT
    chmod 755 "$folder"
    if (cd "$folder" && apt-get download prometheus >/dev/null 2>&1) && dpkg-deb -x "$folder"/prometheus_*.deb "$folder/unpacked"; then
        mkdir -p "$venv/prometheus"
        cp "$folder/unpacked/usr/bin/prometheus" "$folder/unpacked/usr/bin/promtool" "$venv/prometheus"
    else
        echo "no Prometheus can be had here: its tests will be skipped" >&2
    fi
fi
