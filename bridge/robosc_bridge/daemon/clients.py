"""The connected programs, and delivery of items to them."""

import logging

from robosc_bridge.daemon.programs import Program, Refused, ToProgram

_log = logging.getLogger(__name__)


class Clients:
    """Connected programs, in the order in which they came; used by the loop's thread."""

    def __init__(self) -> None:
        self._programs: dict[Program, None] = {}

    def __contains__(self, program: Program) -> bool:
        return program in self._programs

    def add(self, program: Program) -> None:
        """Add a program."""
        self._programs[program] = None

    def remove(self, program: Program) -> None:
        """Remove a program: it gets no messages any more."""
        self._programs.pop(program, None)

    def tell(self, program: Program, item: ToProgram) -> None:
        """Tell a program something, if it is still there; never raises."""
        if program not in self._programs:
            return
        try:
            program.tell(item)
        except Exception:  # What a program's side does wrong must not stop the robot's loop.
            _log.exception("%s could not be told something", program.name)

    def tell_all(self, item: ToProgram) -> None:
        """Tell every program something."""
        for program in self._programs:
            self.tell(program, item)

    def refuse(self, program: Program, why: str) -> None:
        """Tell a program that what it sent makes no sense."""
        _log.debug("%s: %s", program.name, why)
        self.tell(program, Refused(why))
