#!/bin/sh
# Makes a virtual environment with colcon and the generators of ROS 2 interfaces: sh deploy/make_colcon_environment.sh DIR
# For machines without an installed ROS 2: DIR/colcon builds packages there, with a C++ compiler and CMake.
# BIN has the python and the uv of the project's environment; otherwise those of .venv are taken.
set -eu
case $1 in /*) venv=$1 ;; *) venv=$PWD/$1 ;; esac
cd "$(dirname "$0")/.."
bin=${BIN:-.venv/bin}
command -v "$bin/uv" >/dev/null || {
    echo "there is no $bin/uv: say \`make environment\`" >&2
    exit 1
}

# A Python with ROS 2 hands these down, and other programs must not load its libraries.
unset LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE PYTHONPATH

"$bin/uv" venv --quiet --clear --python "$bin/python" "$venv"
echo "installing colcon and the ROS 2 generators into $venv (about a minute)"
sh deploy/install_lock.sh "$bin/uv" "$venv/bin/python" deploy/requirements-colcon.txt

# The wheels' CMake files name folders of the machine that the wheels were built on; here they are elsewhere.
include=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("include"))')
packages=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
built='/opt/python/cp3[0-9]+-cp3[0-9]+'
grep -rIlE "$built" "$venv/share" "$venv/lib/cmake" --include='*.cmake' | while read -r file; do
    sed -i -E "s#$built/include/python3\.[0-9]+#$include#g; s#$built/lib/python3\.[0-9]+/site-packages#$packages#g" "$file"
done

# The script sets the variables that colcon needs. It is not in bin, whose own colcon it calls.
cat >"$venv/colcon" <<END
#!/bin/sh
# colcon with this environment's ROS 2 as the underlay; no other workspace may be sourced.
unset LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE PYTHONPATH
export AMENT_PREFIX_PATH='$venv' CMAKE_PREFIX_PATH='$venv' PATH='$venv/bin:/usr/local/bin:/usr/bin:/bin'
verb=\$1
shift
if [ "\$verb" = build ]; then
    exec colcon build "\$@" --cmake-args -DPython3_EXECUTABLE='$venv/bin/python'
fi
exec colcon "\$verb" "\$@"
END
chmod +x "$venv/colcon"
touch "$venv/.ready"
