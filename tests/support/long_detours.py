"""A robot that goes round rooms on a mission with many visits, and on detours that are as long."""

_ROOMS = range(7)


def robot_with_detours(detours: int, visits: int, own: int = 3) -> str:
    """Return the text of a robot whose detours begin whenever somebody calls.

    Args:
        detours: Number of detours.
        visits: Number of visits of each of them.
        own: Number of visits of the mission itself.
    """
    messages, states = [], []
    for room in _ROOMS:
        messages.append(f'incoming message go_{room} with identifier: "/go_{room}", type: none')
        ways = " ".join(
            f"on request to go_{other} goto r{other}" for other in ((room + 1) % len(_ROOMS), (room - 1) % len(_ROOMS))
        )
        states.append(f"{'initial ' if room == 0 else ''}marked state r{room} {{ {ways} }}")
    calls = [
        f'outgoing message call_{number} with identifier: "/call_{number}", type: boolean' for number in range(detours)
    ]
    variables = [f"variable calling_{number}: boolean" for number in range(detours)]
    answers = [f"on response from call_{number} do calling_{number} := value" for number in range(detours)]
    parts = [f"on Operator.calling_{number} from anywhere visit {_visits(visits, number)}" for number in range(detours)]
    lines = [
        *("robot Tour {", "component Base {", *messages, "behaviour {", *states, "}", "}"),
        *("component Operator {", *calls, "behaviour {", *variables, *answers),
        *("initial marked state present { }", "}", "}"),
        *("mission rounds {", f"visit {_visits(own, 0)}", *parts, "}", "}"),
    ]
    return "\n".join(lines) + "\n"


def _visits(count: int, first: int) -> str:
    return " then ".join(f"Base.r{(5 * number + first) % len(_ROOMS)}" for number in range(1, count + 1))
