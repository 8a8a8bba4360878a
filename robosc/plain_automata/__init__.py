"""Plain automata, without variables, in the files of other tools: libFAUDES (`.gen`) and Supremica (`.wmod`).

A reader converts a file to a system, like the front ends for RoboSC and CIF; a writer converts a system of plain
automata to a file.
"""

from robosc.plain_automata.check import check_automata
from robosc.plain_automata.gen import write_gen
from robosc.plain_automata.wmod import write_wmod

WRITERS = {".gen": write_gen, ".wmod": write_wmod}
"""The writer for each ending of a file."""

__all__ = ["WRITERS", "check_automata", "write_gen", "write_wmod"]
