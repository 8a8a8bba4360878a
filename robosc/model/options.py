"""Options of communications: quality of service, age, stamp, condition."""

from robosc.language import syntax
from robosc.model.findings import Findings
from robosc.model.structure import MAXIMUM_AGE, MAXIMUM_DEPTH, CommunicationKind

_MESSAGES = (CommunicationKind.INCOMING_MESSAGE, CommunicationKind.OUTGOING_MESSAGE)
_ALLOWED: dict[str, tuple[CommunicationKind, ...]] = {
    "qos": _MESSAGES,
    "depth": _MESSAGES,
    "max_age": (CommunicationKind.OUTGOING_MESSAGE,),
    "stamped": (CommunicationKind.INCOMING_MESSAGE, CommunicationKind.ACTION),
    "when": (CommunicationKind.INCOMING_MESSAGE, CommunicationKind.SERVICE, CommunicationKind.ACTION),
}
_PURPOSE = {
    "qos": "says how a message travels",
    "depth": "says how many messages are kept",
    "max_age": "says when an outgoing message is stale",
    "stamped": "stamps what the controller sends: an incoming message or an action's request",
    "when": "distinguishes requests on one identifier",
}


def build_options(tree: syntax.Communication, kind: CommunicationKind, findings: Findings) -> dict[str, object]:
    """The fields of a communication that its options give, `when` aside, which needs names to be known first."""
    found: dict[str, object] = {}
    for option in tree.options:
        if kind not in _ALLOWED[option.key]:
            findings.error(
                "option-not-allowed",
                f"'{option.key}' {_PURPOSE[option.key]}; '{tree.name.text}' is an {kind}"
                if kind is not CommunicationKind.SERVICE
                else f"'{option.key}' {_PURPOSE[option.key]}; '{tree.name.text}' is a service",
                option.location,
                f"Remove '{option.key}'.",
            )
            continue
        match option.key, option.value:
            case "qos", syntax.Name(text=text):
                found["quality"] = text
            case "depth", syntax.Literal(value=int(depth)) if 1 <= depth <= MAXIMUM_DEPTH:
                found["depth"] = depth
            case "max_age", syntax.Literal(value=int(age) | float(age)) if 0 < age <= MAXIMUM_AGE:
                found["max_age"] = float(age)
            case "stamped", syntax.Text(value=frame):
                _stamp(tree, frame, option, found, findings)
            case (("depth" | "max_age"), _):
                needed = f"a whole number from 1 to {MAXIMUM_DEPTH}"
                if option.key == "max_age":
                    needed = "a number of seconds above 0, at most a year"
                message = f"'{option.key}' takes {needed}"
                findings.error("option-value", message, option.location, "Write such a number.")
    return found


def _stamp(
    tree: syntax.Communication, frame: str, option: syntax.Option, found: dict[str, object], findings: Findings
) -> None:
    if tree.link is None:
        findings.error(
            "links-required",
            "'stamped' needs a middleware type with a header",
            option.location,
            "Define 'interface x use TwistStamped from geometry_msgs' (or another one) and write 'links x'.",
        )
    elif len(frame) > 255:
        findings.error("option-value", "the frame has more than 255 characters", option.location, "Shorten it.")
    else:
        found["frame"] = frame
