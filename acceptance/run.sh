#!/bin/sh
# The tests with real parts: first those that wait for nothing but the computer, several at a time, then, alone, those
# that live by its clock (the marker `real_time`).
#
#   PYTHON=.venv/bin/python WORKERS=3 sh acceptance/run.sh [WORDS FOR PYTEST ...]
#
# Both parts run whatever the first one finds. Exit status: that of the first part that failed, else 0; 5 if no test was
# chosen.
set -u
[ "$#" -gt 0 ] || set -- acceptance

"$PYTHON" -m pytest -n "$WORKERS" --dist loadfile -m "not real_time" --durations 20 -r fEsR "$@"
first=$?
# Interrupted.
[ "$first" -ne 2 ] || exit 2
"$PYTHON" -m pytest -m real_time --durations 20 -r fEsR "$@"
second=$?

case $first,$second in
  0,5) exit 0 ;;
  0,* | 5,*) exit "$second" ;;
esac
echo "The first part, of tests that do not live by the clock, has failed: see above." >&2
exit "$first"
