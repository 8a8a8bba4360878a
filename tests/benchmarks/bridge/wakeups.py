"""How late this machine wakes a program that sleeps for a millisecond: below that, no program here can react.

Measures until its standard input ends, then prints seconds as a JSON list.
"""

import json
import os
import select
import sys
import time

SLEEP_S = 0.001


def main() -> int:
    """Measure."""
    late_s = []
    poll = select.poll()
    poll.register(sys.stdin.fileno(), select.POLLIN)
    while not (poll.poll(0) and not os.read(sys.stdin.fileno(), 1)):
        begin_s = time.monotonic()
        time.sleep(SLEEP_S)
        late_s.append(round(time.monotonic() - begin_s - SLEEP_S, 6))
    sys.stdout.write(json.dumps(late_s) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
