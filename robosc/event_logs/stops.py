"""Reasons that keep a robot at rest, by the texts of its log (semantics 3.9)."""


def is_ended(stop: str, resumed: str) -> bool:
    """Return True if an entry `resume` ends a stop.

    `scan is back` ends `scan on /scan is stale`, and no other.

    Args:
        stop: Text of the entry `stop`.
        resumed: Text of the entry `resume`.
    """
    # Whoever stops by hand may give a reason that begins with a sensor's name.
    return stop.startswith(f"{resumed.removesuffix(' is back')} on ") and stop.endswith(" is stale")
