"""Names that ROS accepts for a topic, service or action.

Rules of ROS 2: "Topic and Service name mapping to DDS", design.ros2.org, 2018, section "ROS 2 Name Space Tokens" and
"ROS Topic and Service Name Constraints"; the rules of ROS 1 are not stricter in any point that matters here.
"""

import re

_TOKEN = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")


def identifier_fault(identifier: str) -> str | None:
    """Return the reason why ROS refuses a name, in words; None for one that it takes."""
    if not identifier:
        return "it is empty"
    if not identifier.isascii() or re.search(r"[^A-Za-z0-9_/~]", identifier):
        return "it may hold letters, digits, '_', '/' and '~' only"
    name = identifier.removeprefix("~/") if identifier.startswith("~") else identifier.removeprefix("/")
    if identifier.startswith("~") and name == identifier:
        return "'~' is followed by '/'"
    for token in name.split("/"):
        if not token:
            return "there is nothing between or behind two '/'" if "//" in identifier else "it ends with '/'"
        if "~" in token:
            return "'~' can stand at the beginning only"
        if not _TOKEN.match(token):
            return f"'{token}' begins with a digit"
        if "__" in token:
            return "'_' stands twice in a row"
    return None
