"""Cycles of a controller in every form that this machine can run."""

from robosc.supervisor import Supervisor
from robosc_experiments.cycles.driving import measured_driving
from robosc_experiments.cycles.isolated import measured_c, measured_python
from robosc_experiments.cycles.times import CYCLES, RUNS, CycleTimes, cycle_times

_WITH_MIDDLEWARE = (
    ("generated C, roscpp", "roscpp"),
    ("generated C, rclcpp", "rclcpp"),
    ("generated Python, rclpy", "rclpy"),
    ("generated Python, rospy", "rospy"),
)


def measure(experiment: str, supervisor: Supervisor, runs: int = RUNS, cycles: int = CYCLES) -> tuple[CycleTimes, ...]:
    """Measure a controller in every form that this machine can run.

    Args:
        experiment: `maze` or `line`; its model has a message on `/scan`, and one beside it.
        supervisor: Supervisor of a controller, not of a layer: a layer decides nothing by itself.
        runs: Number of runs.
        cycles: Number of cycles in each run.
    """
    alone = (("generated C, gcc -O2", measured_c), ("generated Python", measured_python))
    return (
        *(
            cycle_times(experiment, what, found if isinstance(found, str) else {"cycle": found}, has_middleware=False)
            for what, measured in alone
            for found in (measured(experiment, supervisor, runs, cycles),)
        ),
        *(
            cycle_times(
                experiment,
                what,
                measured_driving(middleware, experiment, supervisor, runs, cycles),
                has_middleware=True,
            )
            for what, middleware in _WITH_MIDDLEWARE
        ),
    )
