"""Interrupts at moments that a signal hardly ever meets."""

import threading
from typing import NoReturn


def interrupt_without_its_lock() -> NoReturn:
    """Interrupt as a signal that meets `threading.Condition.wait` just after it has given up its lock.

    Raises:
        RuntimeError: The lock is given up once more as the interrupt passes.
    """
    condition = threading.Condition()
    with condition:
        condition.release()
        raise KeyboardInterrupt
