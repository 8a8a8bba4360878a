"""Models as texts in tests."""

from pathlib import Path

from robosc.language import load_bundle
from robosc.model.check import Checked, check
from robosc.model.structure import Deployment, Model
from robosc.source import Bundle, SourceFile

EXAMPLES = Path(__file__).parents[2] / "examples"
EXAMPLE_NAMES = (
    "line_follower/line_follower",
    "line_follower/line_follower_layer",
    "maze_solver/maze_solver",
    "navigation/navigation",
)

EXAMPLE_DEPLOYMENTS = tuple(
    (name, deployment)
    for name in EXAMPLE_NAMES
    for deployment in Deployment
    # A layer could not tell its two messages on one topic apart: that is the purpose of the other model.
    if (name, deployment) != ("line_follower/line_follower", Deployment.LAYER)
)

# A robot that accepts a finding of the check, and one of the synthesis.
ACCEPTING = """robot Lamps {
    component Switch { outgoing message pressed with identifier: "/pressed", type: none }
    component Button {
        // robosc: accept shared-topic: one person presses both
        outgoing message pushed with identifier: "/pressed", type: none
        incoming message light with identifier: "/light", type: none
        // robosc: accept competing-requests: one of them will do
        incoming message dim with identifier: "/light", type: none
    }
}
"""

# A robot whose synthesis is given up: the condition of its requirement has too many values.
UNSUPPORTED = """robot R {
    component C {
        incoming message m with type: none
        outgoing message n with type: integer(0..2000)
        behaviour {
            variable x: integer(0..2000)
            variable y: integer(0..2000)
            on response from n do x := value, y := x
            initial marked state s { }
        }
    }
    requirement m needs C.x / C.y > 0.5
}"""

# A robot for which there is no supervisor: nothing controllable leads back from where a message leads to.
EMPTY = """robot R {
    component C {
        outgoing message broken with type: none
        behaviour {
            initial marked state fine { on response from broken goto lost }
            state lost { transition if value_seen goto fine }
            variable value_seen: boolean
        }
    }
}"""

STOPPING = """robot Stopping {
    interface i use Fibonacci from p
    component Stop {
        outgoing message stop with type: boolean
        behaviour { variable pressed: boolean on response from stop do pressed := value initial marked state known { } }
    }
    component Drive {
        action travel with request: none, response: none, feedback: none links i
        behaviour {
            initial marked state idle { on request to travel goto driving }
            state driving {
                on response from travel goto idle
                on error from travel goto idle
                on cancel to travel goto braking
            }
            state braking { on response from travel goto idle on error from travel goto idle }
        }
    }
    requirement travel needs !Stop.pressed
}
"""
"""A driver that waits for a reply after a cancel, as if a cancel were only asked for."""

DOOR = """component Door {
    incoming message open with type: none
    incoming message shut with type: none
    behaviour {
        initial marked state closed { on request to open goto opened }
        marked state opened { on request to shut goto closed }
    }
}"""
"""A component that opens and shuts."""


def bundle_of(text: str, **libraries: str) -> Bundle:
    """A bundle of a model's text and libraries by file name (without the ending), of which no file was looked for."""
    files = tuple(SourceFile(f"{name}.rscd", source) for name, source in sorted(libraries.items()))
    return Bundle(SourceFile("model.rscd", text), files)


def checked(text: str, **libraries: str) -> Checked:
    """The check of a model's text."""
    return check(bundle_of(text, **libraries))


def model_of(text: str, **libraries: str) -> Model:
    """The model of a text without errors."""
    return checked(text, **libraries).model_or_raise()


def example_bundle(name: str) -> Bundle:
    """The bundle of an example robot, such as `maze_solver/maze_solver`."""
    return load_bundle(EXAMPLES / f"{name}.rscd")


def example_model(name: str) -> Model:
    """The model of an example robot."""
    return check(example_bundle(name)).model_or_raise()


def marked_place(text: str) -> tuple[str, int, int]:
    """A text without its one `§`, and the line and column where that stood."""
    before, mark, after = text.partition("§")
    assert mark and "§" not in after
    return before + after, before.count("\n") + 1, len(before) - before.rfind("\n")
