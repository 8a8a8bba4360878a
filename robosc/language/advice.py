"""Advice on how to fix a syntax error: the word that was meant, or how to write a construct of another language here.

Advice that is followed literally removes the error; editors apply it automatically (`robosc.editing.fixes`).
"""

import difflib
import re
from collections.abc import Iterable, Sequence

from robosc.language.words import FOREIGN_TYPES, RESERVED_WORDS, STARTS

_WORDS_OF: dict[str, tuple[str, ...]] = {
    "an operator": ("and", "or"),
    "an expression": ("true", "false", "value", "if"),
    "a type": ("boolean", "integer", "double", "string", "array", "none"),
}
"""The words among what is expected under a common name."""

_MAXIMUM_MEANT = 40
"""Characters of a token that are compared with what it may have been meant to be."""

_NEEDLESS = frozenset(
    "abstract async const def export extern final let private protected public static var virtual".split()
)
"""Words before declarations of other languages."""

_TICKS = frozenset("tick ticked loop spin update execute always entry enter timer step cycle".split())
"""Events of other languages that happen by themselves, as silent transitions do."""

_OF_COMPONENTS = frozenset({"incoming", "outgoing"})

_LEAF_NODES = (
    "action_node actionnode leaf leaf_node leafnode treenode tree_node btnode rosactionnode bt_action_node "
    "btactionnode conditionnode statefulactionnode syncactionnode simpleactionnode coroactionnode asyncactionnode"
)
_SMACH_STATES = "simpleactionstate servicestate monitorstate conditionstate cbstate"

_SAID_ELSEWHERE = {
    "anywhere": "everywhere any anytime all",
    "action": f"task skill {_LEAF_NODES} {_SMACH_STATES}",
    "array": "list vector sequence",
    "assume": "assumes assumption",
    "behaviour": "behavior automaton fsm statemachine state_machine machine",
    "cancel": "cancelled canceled preempted preempt halted",
    "component": f"class node module actor part block device package {_LEAF_NODES} {_SMACH_STATES}",
    "constant": "const define final static let parameter param blackboard setting",
    "datatype": "type typedef data struct enum record",
    "disables": "forbids blocks prevents excludes inhibits",
    "do": "set assign update",
    "enum": "enumeration choice",
    "depth": "queue_size queue history",
    "error": "failure fail failed fault aborted",
    "feedback": "running progress",
    "from": "by of in",
    "goto": "go_to next go target enter",
    "goal": "goals objective aim",
    "identifier": "topic name id path",
    "if": "when guard where",
    "incoming": "input in sub subscriber subscribe subscription receives receive",
    "initial": "init start starting first begin",
    "interface": "import uses include using",
    "leads": "lead causes implies triggers",
    "library": "lib package namespace",
    "limit": "limits bound clamp restrict saturate cap",
    "links": "link linked link_to maps",
    "marked": "final accepting accept end mark terminal",
    "mission": "missions task plan route tour itinerary",
    "message": "topic msg msgs event signal channel",
    "needs": "requires require when only_if only if needed",
    "object": "struct class record message dict map",
    "on": "when upon event at",
    "over": "than before above to",
    "outgoing": "output out pub publisher publish publishes sends emit",
    "prefer": "prefers preference preferred prioritize prioritise priority",
    "provide": "sends send with_data fill",
    "request": "req goal command call send",
    "requirement": "require requires rule constraint spec property assert ensure",
    "response": "resp reply result answer receive received message success succeeded done",
    "robot": "system model program controller main",
    "service": "srv client server rpc service_node servicenode rosservicenode btservicenode servicestate",
    "state": "location mode step phase node",
    "then": "next than after afterwards followed andthen",
    "transition": "trans edge step tau jump",
    "type": "msg_type message_type datatype data payload",
    "use": "using type of",
    "visit": "visits goto go go_to reach reaches at first",
    "variable": "var let val def field int bool float double string boolean integer",
    "while": "when whenever during where if given as",
    "with": "using where has having as",
}
"""Words of other languages and of robotics for those of ours; one may stand for several, of which one is expected."""


def _said_elsewhere(token: str, words: Sequence[str]) -> str | None:
    """The first of some words that a token says in another language, or in another case."""
    folded = token.casefold()
    cased = (word for word in words if word == folded)
    return next(cased, None) or next((word for word in words if folded in _SAID_ELSEWHERE.get(word, "").split()), None)


def is_said_elsewhere(token: str, expected: Iterable[str]) -> bool:
    """Return True if a token is another language's word for one of those expected."""
    return _said_elsewhere(token, [word.strip("'") for word in expected if word[0] == "'"]) is not None


def _near_word(token: str, expected: Iterable[str]) -> str | None:
    """The word that another one was meant to be, if one of those expected is near or means the same elsewhere."""
    words: list[str] = []
    for word in expected:
        words += [word.strip("'")] if word[0] == "'" else _WORDS_OF.get(word, ())
    if said := _said_elsewhere(token, words):
        return said
    near = difflib.get_close_matches(token[:_MAXIMUM_MEANT], words, n=1, cutoff=0.75)
    # Two letters that changed places are half of a short word.
    turned = [word for word in words if len(word) < 5 and sorted(word) == sorted(token)]
    return next(iter([*near, *turned]), None)


def is_foreign_operator(token: str) -> bool:
    """Return True if a token is an operator of another language, or nearly one of ours."""
    return token in ("&", "|", "=", "is") or _near_word(token, ("an operator",)) is not None


def type_elsewhere(parts: Sequence[str]) -> str:
    """The type that a qualified name of another language or of ROS means: a basic one, or its last part."""
    return FOREIGN_TYPES.get(parts[-1], parts[-1])


def fix_syntax(before: str, token: str, expected: Sequence[str], following: Sequence[str] = ("", "", "")) -> str:
    """Return advice on how to fix a syntax error.

    Args:
        before: The token before the one that does not fit.
        token: Token that does not fit; empty at the end of the text.
        expected: Words for what would have fitted.
        following: The three tokens behind it.
    """
    return (
        _of_signs(before, token, expected, following[0])
        or _of_words(token, expected, following)
        or _of_operators(before, token, expected)
        or _of_missing_words(before, token, expected, following[0])
        or _of_brackets(token, expected)
        or _of_what_is_missing(token, expected)
    )


def _of_signs(before: str, token: str, expected: Sequence[str], following: str) -> str:
    """Advice about a sign that the language does not have, or not there."""
    match token:
        case "&":
            return "Write 'and' for '&&'."
        case "|":
            return "Write 'or' for '||'."
        case ";":
            return "Remove the ';': nothing ends with one."
        case "#":
            return "Write '//' instead of '#'."
        case "=" if before == "=":
            return "Write '=' once: it compares."
        case "=" if before == "!=":
            return "Remove the '='."
        case ">" if before == "<":
            return "Write '!=' instead of '<>'."
        case "<" if before == "=":
            return "Write '<=' instead of '=<'."
        case "," | "-" | ":" if {*expected} == {"'..'"}:
            return f"Write '..' instead of '{token}'."
        case ":=" if "'='" in expected:
            return "Write '=' instead of ':='."
        case "[" if "'('" in expected:
            return "Write '(' instead of '['."
        case "]" if "')'" in expected:
            return "Write ')' instead of ']'."
        case "," if "'goto'" in expected:
            return "Remove the ','."
        case "=" if "':'" in expected:
            return "Write ':' instead of '='."
        case ":" if following == ":" and "an operator" in expected:
            return "Write '.' instead of '::'."
        case ":" if "'{'" in expected:
            return "Write '{' instead of ':'."
        case ":" if missing := next((key for key in _KEYS if f"'{key}'" in expected), None):
            return f"Write '{missing}' before it."
        case ":":
            return "Remove the ':'."
        case "->" if "'goto'" in expected:
            return "Write 'goto' instead of '->'."
        case "->" if "an operator" in expected:
            return "Write '.' instead of '->'."
        case "," if "a name" in expected and "'}'" in expected:
            return "Remove the ',': nothing parts these."
        case "(" if "'with'" in expected:
            return "Write 'with' instead of '('."
        case ")":
            return "Remove it, or open it with '('."
        case _ if "a name" in expected and re.fullmatch(r"(['\"])[A-Za-z_]\w*\1", token):
            return f"Write '{token[1:-1]}' instead of '{token}'."
        case _ if not token.isascii():
            return "Names are made of the letters A to Z, digits and '_' only."
    return ""


def _of_words(token: str, expected: Sequence[str], following: Sequence[str]) -> str:
    """Advice about a word that is misspelt, or that another language has."""
    if token == "then" and "'goto'" in expected:
        return "Remove 'then': 'goto' follows the condition."
    if token == "is" and "an operator" in expected:
        return "Write '=' instead of 'is'."
    is_final = token == "final" and following[0] == "state"
    if token in _NEEDLESS and not is_final and f"'{following[0]}'" in expected:
        return f"Remove '{token}'."
    if token == "from" and "'interface'" in expected and following[1] == "import":
        package, _, name = following
        written = f"from {package} import {name}"
        return f"Write 'interface {name.lower()}_type use {name} from {package}' instead of '{written}'."
    if token in ("enum", "object") and "'datatype'" in expected:
        return "Write 'datatype' before it."
    if token in ("struct", "record", "dataclass") and "'datatype'" in expected:
        return "Did you mean 'datatype object'?"
    if token in ("message", "topic", "msg") and "'incoming'" in expected:
        return "Write 'incoming message' or 'outgoing message'."
    if token.casefold() in _TICKS and "'request'" in expected and following[0] in ("goto", "if", "}"):
        return f"Write 'transition' instead of 'on {token}'."
    near = _near_word(token, expected)
    if near is not None and near != token:
        is_message = near in _OF_COMPONENTS and following[0] not in ("message", "topic", "msg")
        return f"Did you mean '{near}{' message' if is_message else ''}'?"
    if token == "visit" and "'mission'" in expected:
        return "Put it in a mission, as in 'mission rounds { visit ... }'."
    if "'variable'" in expected and following[0] == ":" and token.isidentifier():
        return "Write 'variable' before it."
    return ""


def _of_operators(before: str, token: str, expected: Sequence[str]) -> str:
    """Advice about two operators in a row, or one with nothing behind it."""
    if before not in ("and", "or", "not") or "an expression" not in expected:
        return ""
    if token in ("and", "or"):
        return f"Remove it: '{before}' stands before it."
    if token in RESERVED_WORDS or token == "}":
        return f"Remove '{before}' before it, or write what is missing there."
    return ""


def _of_missing_words(before: str, token: str, expected: Sequence[str], following: str) -> str:
    """Advice about a word or sign that is missing before what would go on behind it."""
    is_name = token.removeprefix("^").isidentifier() and (token[0] == "^" or token not in RESERVED_WORDS)
    begins_operand = is_name or token in _BEGIN_OPERANDS or token[:1].isdigit()
    begins_item = "an operator" not in expected
    is_operand_behind = following.isidentifier() or following in _BEGIN_OPERANDS
    missing = next(
        (
            word
            for word, is_missing in (
                ("component", begins_item and is_name and following in ("{", "from")),
                ("goal", begins_item and (token, following) == ("always", "eventually")),
                ("goal", begins_item and (token == "eventually" or (token == "once" and is_operand_behind))),
                ("requirement", begins_item and (begins_operand or token in ("{", "always", "never"))),
                ("if", begins_operand and not (is_name and following in _BEHIND_TARGETS)),
                ("do", is_name and following in (":=", "=")),
                (_PREPOSITIONS.get(before, "from"), is_name and "'to'" in expected and "'from'" in expected),
                ("goto", is_name),
                ("state", is_name),
                (",", following == ":"),
                ("links", is_name),
                ("on", token in _PREPOSITIONS),
                ("transition", token in ("if", "goto")),
                ("needs", begins_operand),
                ("visit", begins_operand),
                ("then", begins_operand),
                ("over", is_name),
                ("to", token == "{"),
                ("(", token[:1].isdigit()),
            )
            if is_missing and f"'{word}'" in expected
        ),
        None,
    )
    if missing is not None:
        return f"Write '{missing}' before it."
    if begins_operand and "an operator" in expected:
        return "Write 'and' before it, or the operator that is meant."
    return ""


_PREPOSITIONS = {"request": "to", "response": "from", "feedback": "from", "error": "from", "cancel": "to"}
_KEYS = ("type", "request", "response", "feedback")
_BEHIND_TARGETS = frozenset({"", "}", "on", "transition", "state", "initial", "marked", "variable", "goto"})
"""Tokens behind the state that a transition leads to."""

_BEGIN_OPERANDS = frozenset({"!", "(", "true", "false", "value"})


def _of_brackets(token: str, expected: Sequence[str]) -> str:
    """Advice about a bracket that is missing, or one too many."""
    if "'}'" in expected and (not token or {*expected} in _ENDS_OF_LISTS):
        return "Write '}' before it."
    if "'}'" in expected and token in _HOMES:
        return misplaced(token)
    if "'{'" in expected and (token == "}" or token in STARTS):
        return "Write '{' before it."
    if token == "}" and "the end of the file" in expected:
        return "Remove it: there is one '}' too many, here or before."
    return ""


_HOMES = {
    **dict.fromkeys(("component", "datatype", "interface", "requirement", "provide", "limit"), "the robot or library"),
    **dict.fromkeys(("goal", "assume", "mission", "prefer"), "the robot"),
    "visit": "a mission",
    **dict.fromkeys(("incoming", "outgoing", "service", "action", "behaviour"), "a component"),
    **dict.fromkeys(("variable", "initial", "marked", "state"), "a behaviour"),
    **dict.fromkeys(("on", "transition"), "a state or behaviour"),
}
"""The lists that items stand in, by their first words."""


def misplaced(word: str) -> str:
    """Advice about an item that stands in a list of others."""
    return f"Move it: '{word}' stands in {_HOMES.get(word, 'another list')}, not in what is open here."


_ENDS_OF_LISTS = ({"','", "'}'"}, {"an operator", "','", "'}'"})


def _of_what_is_missing(token: str, expected: Sequence[str]) -> str:
    """Advice if only the expected tokens are known."""
    if token in RESERVED_WORDS and any(word in expected for word in ("a name", "an expression", "a type")):
        return f"If '{token}' is meant as a name, write '^{token}'."
    if len(set(expected)) == 1 and expected[0][0] == "'":
        return f"Write {expected[0]} before it, or look for a bracket or comma missing before."
    return "Write one of the expected words here, or look for a bracket or comma missing before."


__all__ = ["fix_syntax", "is_foreign_operator", "is_said_elsewhere", "misplaced", "type_elsewhere"]
