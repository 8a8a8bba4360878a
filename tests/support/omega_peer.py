"""The solver of omega as an opponent: the games of other people, with a semantics and an algorithm of their own."""

from collections.abc import Sequence
from typing import Any

from omega.games import gr1
from omega.symbolic.temporal import Automaton, default_streett_automaton

from support.reactive import ReactiveProblem


def automaton_of(problem: ReactiveProblem, manager: Any = None) -> Automaton:
    """Return a problem as omega has it.

    Args:
        problem: The problem.
        manager: Manager that has its variables; omega takes one of its own otherwise.
    """
    made = default_streett_automaton()
    if manager is not None:
        made.bdd = manager
    made.declare_variables(**dict.fromkeys(problem.order, "bool"))
    made.varlist = {"env": list(problem.inputs), "sys": list(problem.outputs)}
    made.init.update(env=_conjunction(made, problem.start_inputs), sys=_conjunction(made, problem.start))
    made.action.update(env=_conjunction(made, problem.input_moves), sys=_conjunction(made, problem.moves))
    # omega names what lasts for ever where an assumption fails: without one, that nothing does.
    made.win["<>[]"] = [~made.add_expr(item) for item in problem.assumptions] or [made.false]
    made.win["[]<>"] = [made.add_expr(item) for item in problem.goals]
    # For all inputs there are outputs, at the beginning and in each step; the system need not keep its moves once the
    # surroundings have broken theirs.
    made.qinit, made.moore, made.plus_one = r"\A \E", False, False
    return made


def _conjunction(made: Automaton, formulas: Sequence[str]) -> Any:
    found = made.true
    for formula in formulas:
        found = found & made.add_expr(formula)
    return found


def winning_positions(made: Automaton) -> Any:
    """Return the winning positions of a problem."""
    return gr1.solve_streett_game(made)[0]


def is_realizable(made: Automaton, winning: Any) -> bool:
    """Return True if the system can begin in a winning position, whatever inputs it begins with."""
    return bool(gr1.is_realizable(winning, made))
