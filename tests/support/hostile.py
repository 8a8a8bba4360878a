"""Robots whose names and texts are chosen to break generated code, or to get code of theirs run in it."""

from pathlib import Path
from random import Random

from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from support.models import model_of
from support.random_supervisors import CERTIFICATE

# Words of Python, C, C++ and their libraries, of generated code and of templates.
WORDS = """
    None True False def class lambda self import pass yield async await global nonlocal raise del with as assert print
    exec eval type object str int len super property __init__ __class__ __dict__ __name__ __file__ os sys subprocess
    double float struct union enum errno NULL EOF main printf malloc free system memcpy strcmp signed unsigned register
    auto restrict volatile extern static inline _Bool bool true false sizeof goto switch case default typedef const
    template namespace operator new delete this virtual private public protected using typename and_eq xor bitand compl
    not_eq constexpr co_await nullptr wchar_t decltype alignas thread_local friend mutable explicit export noexcept std
    state enabled read step provide restart signature description values skipped reading data path event message request
    response value_0 r r_ settings callbacks init start tick stop status fault node rclpy rospy ros time Clock Node
    Supervisor Executor Middleware Controller String Empty Float32 Int16 loop block super_ raw endraw endfor if_ elif
    idle waiting ready failed executing plant supervisor location input end func cont alg tau invariant controllable
    uncontrollable proctype active init_ bit byte chan mtype inline_ never trace printf_ unless atomic d_step skip
    INT_MAX INT32_MIN UINT8_MAX DBL_MAX isnan NAN INFINITY signal SIGTERM stdin stdout assert_ linux unix i386 _ __ _0
""".split()

COLLIDING = "x_y x__y _x_y x_y_ xY x_Y_2 x_y_2 x_y_1 a_x_y at_a v_a_x a__state a__x x_y__state enabled_x_y".split()
"""Names that become one where words are joined by underscores, or where capitals become small."""


def payloads(canary: Path) -> list[str]:
    """Texts that make a file appear if anything executes them, or break what they are written into."""
    touch = f"touch {canary}"
    python = f"__import__('os').system('{touch}')"
    return [
        f'"; import os; os.system("{touch}"); "',
        f"'; {python}; '",
        f'"""\n{python}\n"""',
        f"'''\n{python}\n'''\\",
        f"\\\n{python}\n#",
        f'\\"; {python} #',
        f"{{{{ cycler.__init__.__globals__.os.system('{touch}') }}}}{{% raw %}}{{# #}}",
        f'*/ #include <stdlib.h>\nint x = system("{touch}"); /*',
        f'"); system("{touch}"); ("',
        f'\n#error "{canary}"\n??/\n??=error\n//\\\n',
        f"$({touch}) `{touch}` ${{HOME}} $ENV{{PATH}} ; {touch}",
        f"]==] ]] ) execute_process(COMMAND {touch}) [[ [==[",
        f"</robot></name><script>{touch}</script> & &amp; <!-- --> ]]> <![CDATA[",
        f"%s %n %d %1$s %(x)s {{}} {{0}} {{0.__class__}} f'{{{python}}}'",
        f"!!python/object/apply:os.system ['{touch}']\n- : # & * | >",
        f"| ` | </code> [x](javascript:{touch}) \u202e\u2028\u2029 \x85 \x0c é 漢 😀",
        "\r\n\t\x01\x1b[31m\x7f",
        "",
        "ÿ" * 300,
    ]


def quoted(text: str) -> str:
    """A text as a literal of the language."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'


class _Names:
    """Hands out names that are new in a name space, whose names differ in more than case."""

    def __init__(self, dice: Random, words: list[str]) -> None:
        self._dice = dice
        self._words = words

    def take(self, count: int) -> list[str]:
        """Names for one name space."""
        found: dict[str, str] = {}
        while len(found) < count:
            word = self._dice.choice(self._words)
            if self._dice.random() < 0.1:
                word = self._dice.choice((word * 60, word + "_" * 40, "_" + word, word + "_2"))[:255]
            found.setdefault(word.lower(), word)
        return [f"^{word}" for word in found.values()]


def hostile_text(seed: int, canary: Path, *, is_on_ros: bool = False) -> str:
    """Return the text of a robot with every kind of name and text, that does something.

    Args:
        seed: Seed that decides everything else.
        canary: The file that must not appear.
        is_on_ros: True if its properties are those of messages of ROS.
    """
    dice = Random(seed)
    names = _Names(dice, dice.choice((WORDS, COLLIDING, WORDS + COLLIDING)))
    texts = [quoted(text) for text in dice.sample(payloads(canary), 5)]
    comments = [text.replace("\n", " ").replace("\r", " ").replace("*/", "* /") for text in payloads(canary)]
    comment = dice.choice(comments).replace("\x85", " ").replace("\u2028", " ").replace("\u2029", " ")
    comment = "".join(char for char in comment if char.isprintable())
    arm, base, kind, thing, limit, words = names.take(6)
    (trigger,) = names.take(1)
    heard, number, button, say, count, ask = names.take(6)
    low, middle, high = names.take(3)
    level, text, steps, size, flag, first, second = names.take(7)
    other, left, right = names.take(3)
    good, message = ("^success", "^message") if is_on_ros else names.take(2)
    (robot,) = names.take(1)
    topics = ["/heard", "/number", "/say"]
    return f"""
// {comment}
robot {robot} {{ /* {comment} */
    constant {limit}: double = 0.5
    constant {words}: string = {texts[0]}
    interface {trigger} use Trigger from std_srvs
    datatype object {thing} {{ {good}: boolean {message}: string }}
    datatype enum {kind} from string to {{
        value = {texts[1]} -> {low}
        value = {words} -> {middle}
        default -> {high}
    }}
    component {arm} {{
        outgoing message {heard} with identifier: "{topics[0]}", type: {kind}
        outgoing message {number} with identifier: "{topics[1]}", type: double
        outgoing message {button} with identifier: "/button", type: none
        incoming message {say} with identifier: "{topics[2]}", type: string
        incoming message {count} with identifier: "/count", type: integer
        service {ask} with identifier: "/ask", request: none, response: {thing} links {trigger}
        behaviour {{
            variable {level}: {kind} = {high}
            variable {text}: string = {texts[2]}
            variable {steps}: integer(0..3)
            variable {size}: double
            variable {flag}: boolean
            on response from {heard} do {level} := value
            on response from {number} do
                {size} := value * {limit}, {steps} := if {arm}.{steps} < 3 then {arm}.{steps} + 1 else 0
            on response from {ask} do {flag} := value.{good}
            initial marked state {first} {{
                on request to {say}
                on request to {count}
                on request to {ask}
                transition if {arm}.{level} = {kind}.{low} goto {second}
            }}
            marked state {second} {{
                on request to {count}
                on response from {button} goto {first}
                transition if {arm}.{level} = {kind}.{middle} goto {first}
            }}
        }}
    }}
    component {base} {{
        behaviour {{
            variable {other}: string = {texts[3]}
            initial marked state {left} {{ on response from {button} goto {right} }}
            marked state {right} {{ on response from {button} goto {left} }}
        }}
    }}
    requirement {say} needs {base}.{left} and {arm}.{steps} < 3 or {arm}.{flag}
    requirement {ask} needs {base}.{right} and !{arm}.{flag}
    provide {say} with {texts[4]} if {base}.{left}
    provide {say} with {words}
    provide {count} with {arm}.{steps}
}}
"""


def hostile_supervisor(seed: int, canary: Path, *, is_on_ros: bool = True) -> Supervisor:
    """The supervisor, without a condition, of a hostile robot."""
    text = hostile_text(seed, canary, is_on_ros=is_on_ros)
    return Supervisor(model_of(text), Deployment.CONTROLLER, (), CERTIFICATE)
