"""Family of robots that go to whoever calls: the more rooms, the more positions there are under a strategy."""

_ROOM = """
    component Caller{0} {{
        outgoing message call{0} with identifier: "/call{0}", type: none
        behaviour {{
            initial marked state quiet {{ on response from call{0} goto waiting }}
            marked state waiting {{ on request to enter{0} goto quiet }}
        }}
    }}
    component Door{0} {{
        outgoing message opened{0} with identifier: "/door{0}/opened", type: none
        outgoing message closed{0} with identifier: "/door{0}/closed", type: none
        behaviour {{
            initial marked state shut {{ on response from opened{0} goto ajar }}
            marked state ajar {{ on response from closed{0} goto shut }}
        }}
    }}
    requirement enter{0} needs Door{0}.ajar
    assume always eventually Door{0}.ajar
    goal Caller{0}.waiting leads to Base.in{0}"""


def rooms(count: int) -> str:
    """Return the text of a robot in a corridor with rooms, each with a caller and a door that people open and close."""
    numbers = range(1, count + 1)
    messages = [f'incoming message enter{item} with identifier: "/enter{item}", type: none' for item in numbers]
    enters = [f"on request to enter{item} goto in{item}" for item in numbers]
    states = [f"marked state in{item} {{ on request to leave goto corridor }}" for item in numbers]
    return "\n        ".join(
        [
            "robot Rooms {",
            *(_ROOM.format(item) for item in numbers),
            "component Base {",
            'incoming message leave with identifier: "/leave", type: none',
            *messages,
            "behaviour {",
            f"initial marked state corridor {{ {' '.join(enters)} }}",
            *states,
            "} } }",
        ]
    )
