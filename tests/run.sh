#!/bin/sh
# All tests in two phases: first those that wait for nothing but the computer, several at a time; then, in one process
# and with nothing beside them, those that live by its clock (the marker `real_time`; `_IN_REAL_TIME` of conftest.py).
#
#   PYTHON=.venv/bin/python WORKERS=3 sh tests/run.sh [WORDS FOR PYTEST ...]
#
# Both phases run whatever the first one finds. Exit status: that of the first phase that failed, else 0; 5 if no test
# was chosen.
set -u

PYTHON=${PYTHON:-python}
WORKERS=${WORKERS:-auto}
NOTHING_CHOSEN=5
INTERRUPTED=2

many() {
  "$PYTHON" -m pytest -n "$WORKERS" --dist loadscope --durations 20 -r fEs "$@"
}

# Who chooses by markers has said which ones: pytest knows one choice alone.
for word; do
  case $word in
    -m | -m?*)
      many "$@"
      exit
      ;;
  esac
done

many -m 'not real_time' "$@"
first=$?
[ "$first" -ne "$INTERRUPTED" ] || exit "$INTERRUPTED"
"$PYTHON" -m pytest -m real_time --durations 20 -r fEs "$@"
second=$?

# Its failures stand far above.
case $first in
  0 | "$NOTHING_CHOSEN") ;;
  *) echo "The first phase, of tests that do not live by the clock, has failed: see above." >&2 ;;
esac
# Either may have had nothing to do.
if [ "$first" -eq "$NOTHING_CHOSEN" ]; then
  exit "$second"
fi
if [ "$first" -eq 0 ] && [ "$second" -ne "$NOTHING_CHOSEN" ]; then
  exit "$second"
fi
exit "$first"
