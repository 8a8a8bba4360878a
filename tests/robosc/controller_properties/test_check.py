"""Finite response, confluence and nonblocking under control: models made for each failure, and how each is reported."""

import pytest

from robosc.automata import ExecutableSystem, to_automata
from robosc.certification import OutcomeStatus, make_supervisor
from robosc.conditions.summary import summary_json, summary_text
from robosc.controller_properties import Properties, check_controller
from robosc.controller_properties.confluence import ConfluenceSearch
from robosc.controller_properties.controller import Controller, Node
from robosc.controller_properties.search import search
from robosc.errors import Severity, SynthesisCancelled
from robosc.model.structure import Deployment
from robosc.supervisor import AddedCondition, DecisionDiagram, DecisionNode, decode, encode
from robosc.synthesis import synthesize
from support.models import EXAMPLE_DEPLOYMENTS, bundle_of, example_bundle, marked_place, model_of

INTERFACE = "interface i use S from p"

EYE = """component Eye {
    outgoing message dusk with type: boolean
    behaviour {
        variable dark: boolean
        on response from dusk do dark := value
        initial marked state s { }
    }
}"""
"""Component that represents what is seen."""

ARM = """component Arm {
    action reach with request: none, response: none, feedback: none links i
    behaviour {
        initial marked state home { on request to reach goto out }
        state out {
            on response from reach goto home
            on error from reach goto home
            on cancel to reach goto home
        }
    }
}"""
"""An action that comes home however it ends."""

SERVICE = "component S { service ask with request: none, response: none links i }"


def robot(*parts: str) -> str:
    return "robot R { " + " ".join(parts) + " }"


def component(name: str, body: str, communications: str = "") -> str:
    return f"component {name} {{ {communications} behaviour {{ {body} }} }}"


def properties(
    text: str, deployment: Deployment = Deployment.CONTROLLER, limit: int = 10_000, states: int = 0
) -> Properties:
    """The properties of a model's supervisor."""
    model = model_of(text)
    result = synthesize(to_automata(model, deployment))
    return check_controller(
        ExecutableSystem(model, deployment), result.added, is_nonblocking=True, limit=limit, states=states
    )


def outcomes(found: Properties) -> tuple[str, str, str]:
    return found.finite_response, found.confluence, found.nonblocking


# Finite response

BLINKING = robot(
    EYE,
    component("B", "initial marked state a { transition if Eye.dark goto b } state b { transition goto a }"),
)


def test_taus_that_feed_each_other_never_end() -> None:
    found = properties(BLINKING)
    assert found.finite_response == "failed"
    assert found.livelock is not None
    assert (found.livelock.trace, found.livelock.cycle) == (("dusk.response",), ("B.tau_1", "B.tau_2"))
    # Every order goes round, so the order does not matter; and the marked state comes again and again.
    assert (found.confluence, found.nonblocking) == ("passed", "passed")


def test_a_livelock_at_the_start_has_an_empty_trace() -> None:
    found = properties(
        robot(component("B", "initial marked state a { transition goto b } state b { transition goto a }"))
    )
    assert found.livelock is not None
    assert (found.livelock.trace, found.livelock.cycle) == ((), ("B.tau_1", "B.tau_2"))


def test_the_steps_before_a_cycle_belong_to_the_trace() -> None:
    text = robot(
        EYE,
        component(
            "B",
            "initial marked state a { transition if Eye.dark goto b } state b { transition goto c }"
            " state c { transition goto d } state d { transition goto c transition if !Eye.dark goto a }",
        ),
    )
    found = properties(text)
    assert found.livelock is not None
    assert found.livelock.trace == ("dusk.response", "B.tau_1", "B.tau_2")
    assert found.livelock.cycle == ("B.tau_3", "B.tau_4")
    assert found.blocking is not None
    assert found.blocking.trace == found.livelock.trace


def test_a_livelock_of_two_components() -> None:
    text = robot(
        EYE,
        component(
            "A",
            "initial marked state x { transition if Eye.dark and B.q goto y } marked state y"
            " { transition if B.p goto x }",
        ),
        component(
            "B",
            "initial marked state p { transition if A.x and Eye.dark goto q } marked state q"
            " { transition if A.y goto p }",
        ),
    )
    found = properties(text)
    assert found.livelock is not None
    assert sorted(found.livelock.cycle) == ["A.tau_1", "A.tau_2", "B.tau_1", "B.tau_2"]


def test_guards_that_exclude_each_other_are_proved_without_a_search() -> None:
    text = BLINKING.replace("transition goto a", "transition if !Eye.dark goto a")
    found = properties(text)
    assert outcomes(found) == ("passed", "passed", "passed")
    assert found.method.startswith("finite response and confluence by the structure of silent steps")


def test_a_cycle_that_is_never_reached_takes_a_search() -> None:
    text = robot(
        component(
            "A",
            "initial marked state a { } marked state b { transition goto c } marked state c { transition goto b }",
        )
    )
    found = properties(text)
    assert outcomes(found) == ("passed", "passed", "passed")
    assert "structure" not in found.method


@pytest.mark.parametrize(
    "parts",
    [
        # Dark and b exclude each other, so synthesis forbids the one or the other step.
        pytest.param(
            (
                EYE,
                component(
                    "B", "initial marked state a { transition if Eye.dark goto b } state b { transition goto a }"
                ),
                "requirement never B.b",
            ),
            id="cycle-that-the-supervisor-cuts",
        ),
        pytest.param(
            (component("A", "transition goto a initial marked state a { }"),),
            id="tau-that-changes-nothing-is-not-taken",
        ),
        # Single steps do not commute, but the ends are the same.
        pytest.param(
            (
                EYE,
                component(
                    "A",
                    "initial marked state a { transition if Eye.dark goto b transition if Eye.dark goto c }"
                    " marked state b { transition goto d } marked state c { transition goto d } marked state d { }",
                ),
            ),
            id="ways-that-part-and-meet-again",
        ),
        pytest.param(
            (
                component(
                    "A",
                    "initial state a { on response from m goto b } marked state b { transition goto a }",
                    "outgoing message m with type: none",
                ),
            ),
            id="marked-state-that-is-only-passed-counts",
        ),
    ],
)
def test_sound_controllers(parts: tuple[str, ...]) -> None:
    assert outcomes(properties(robot(*parts))) == ("passed", "passed", "passed")


# Batches

TWO_ENUMS = """interface i use S from p
datatype object Scan { n: integer m: integer }
datatype enum Near from Scan to { value.n < 1 -> yes default -> no }
datatype enum Far from Scan to { value.m < 1 -> yes default -> no }
component L {
    outgoing message near with identifier: "/scan", type: Near links i
    outgoing message far with identifier: "%s", type: Far links i
    behaviour {
        variable is_near: Near
        variable is_far: Far
        on response from near do is_near := value
        on response from far do is_far := value
        initial marked state s { }
    }
}
component A { behaviour {
    initial marked state home { transition if L.is_far = Far.yes and L.is_near = Near.yes goto away }
    marked state away { transition if L.is_near = Near.yes goto home }
} }"""


@pytest.mark.parametrize("identifier", ["/scan", "/other"])
def test_the_events_of_one_message_come_without_silent_steps_between(identifier: str) -> None:
    found = properties(robot(TWO_ENUMS % identifier))
    assert found.livelock is not None
    assert found.livelock.trace == ("near.response", "far.response")
    assert found.livelock.cycle == ("A.tau_1", "A.tau_2")


def test_what_only_part_of_a_message_could_bring_is_no_way_out() -> None:
    """From `lost`, only `near` without `far` would lead home, and both always come together."""
    text = robot(
        TWO_ENUMS.partition("component L")[0] % (),
        """component L {
            outgoing message near with identifier: "/scan", type: Near links i
            outgoing message far with identifier: "%s", type: Far links i
            behaviour {
                initial marked state home { on response from near goto lost on response from far goto lost }
                state lost { on response from near goto between }
                state between { on response from far goto lost transition goto home }
            }
        }""",
    )
    assert properties(text % "/other").nonblocking == "passed"
    found = properties(text % "/scan")
    assert found.nonblocking == "failed"


# Own cancels


def events_after(controller: Controller, *events: str) -> dict[str, Node]:
    """Return the moves from the stable state that some moves lead to, each by its first event."""
    node = controller.run(controller.start).end
    for wanted in events:
        assert node is not None
        run = controller.run(next(after for found, _, after in controller.moves(node) if found == (wanted,)))
        node = run.end
    assert node is not None
    return {found[0]: after for found, _, after in controller.moves(node)}


def controller_of(text: str, *added: AddedCondition) -> Controller:
    return Controller(ExecutableSystem(model_of(text), Deployment.CONTROLLER), added)


def test_a_cancel_happens_when_the_goal_has_ended_not_when_it_is_asked_for() -> None:
    """Check that the goal goes on in the dark: it may end as cancelled, or otherwise, and messages come as ever."""
    controller = controller_of(robot(INTERFACE, EYE, ARM, "requirement reach needs !Eye.dark"))
    assert set(events_after(controller, "reach.request")) == {"dusk.response", "reach.response", "reach.error"}
    asked = events_after(controller, "reach.request", "dusk.response")
    assert set(asked) == {"dusk.response", "reach.response", "reach.error", "reach.cancel"}
    # Light again: a goal that ends as cancelled has failed.
    again = events_after(controller, "reach.request", "dusk.response", "dusk.response")
    assert set(again) == {"dusk.response", "reach.response", "reach.error"}
    assert "reach.cancel" in events_after(controller, "reach.request", *["dusk.response"] * 3)
    assert controller.silent == ("reach.reset",)


def test_an_end_as_cancelled_is_part_of_no_run_of_silent_steps() -> None:
    """A tau that waits for the arm to be out is taken in either order: there is no race with a cancel any more."""
    text = robot(
        INTERFACE,
        EYE,
        ARM,
        component(
            "Log",
            "initial marked state idle { transition if Eye.dark and Arm.out goto late }"
            " marked state late { transition if !Eye.dark goto idle }",
        ),
        "requirement reach needs !Eye.dark",
    )
    assert outcomes(properties(text)) == ("passed", "passed", "passed")


def test_orders_that_ask_for_other_cancels_differ() -> None:
    """Both orders end in one state, but on the way of one of them the requirement does not hold."""
    text = robot(
        INTERFACE,
        EYE,
        ARM,
        component("A", "initial marked state a { transition if Eye.dark goto b } marked state b { }"),
        component("B", "initial marked state a { transition if Eye.dark goto b } marked state b { }"),
        "requirement reach needs A.a or B.b",
    )
    found = properties(text)
    assert found.conflict is not None
    chosen, other = found.conflict.chosen, found.conflict.other
    assert found.conflict.trace == ("reach.request", "dusk.response")
    assert (chosen.events, chosen.asked) == (("A.tau_1", "B.tau_1"), ("reach",))
    assert (other.events, other.asked, other.end) == (("B.tau_1", "A.tau_1"), (), chosen.end)
    (warning,) = (item for item in make_supervisor(bundle_of(text)).diagnostics if item.code == "not-confluent")
    assert "A.tau_1, B.tau_1 asks for the cancel of reach, but the order" in warning.message
    assert "B.tau_1, A.tau_1 asks for no cancel" in warning.message


AGAIN = """component Arm {
    action reach with request: none, response: none, feedback: none links i
    behaviour {
        initial marked state home { on request to reach goto out }
        state out {
            on response from reach goto again
            on error from reach goto again
            on cancel to reach goto home
        }
        state again { on request to reach goto out }
    }
}"""
"""Only a cancel brings it home."""

OWN = robot(INTERFACE, AGAIN, "requirement reach needs Arm.home or Arm.again")


def test_what_the_request_itself_makes_false_never_cancels() -> None:
    """The supervisor would allow the cancel at once, but only a requirement on another's turn cancels."""
    found = properties(OWN)
    assert outcomes(found) == ("passed", "passed", "failed")
    assert found.blocking is not None
    assert found.blocking.trace == ("reach.request",)
    turned = robot(INTERFACE, EYE, AGAIN, "requirement reach needs !Eye.dark")
    assert outcomes(properties(turned)) == ("passed", "passed", "passed")


def test_a_cancel_that_was_forbidden_when_it_was_asked_for_comes_later() -> None:
    """Check that it is asked for once; while the supervisor forbids it, a goal that ends as cancelled has failed."""
    gate = component(
        "Gate",
        "initial marked state shut { on response from open goto opened } marked state opened { }",
        "outgoing message open with type: none",
    )
    text = robot(INTERFACE, EYE, gate, AGAIN, "requirement reach needs !Eye.dark")
    if_opened = DecisionDiagram((DecisionNode("Gate", None, (0, 1), (0, 1)),), 2)
    controller = controller_of(text, AddedCondition("reach.cancel", if_opened))
    assert "reach.cancel" not in events_after(controller, "reach.request", "dusk.response")
    assert "reach.cancel" in events_after(controller, "reach.request", "dusk.response", "open.response")
    found = search(controller, limit=100, confluence=None).forbidden
    (item,) = found.values()
    assert (item.action, item.trace, item.fallen) == ("reach", ("reach.request", "dusk.response"), (0,))


ENDED = robot(INTERFACE, EYE, ARM.replace("cancel to reach goto home", "cancel to reach goto out"), "%s")
"""An arm that waits for a reply to a goal that has ended as cancelled."""


def test_a_cancel_that_must_be_possible_is_forbidden() -> None:
    found = properties(ENDED % "requirement reach needs !Eye.dark")
    assert (outcomes(found), found.cancels) == (("passed", "passed", "passed"), "failed")
    (item,) = found.forbidden
    assert (item.event, item.trace) == ("reach.cancel", ("reach.request", "dusk.response"))
    # The request itself makes it false, so nothing asks for the cancel.
    assert properties(ENDED % "requirement reach needs Arm.home").cancels == "passed"
    # An action without requirements is never cancelled; in a layer the caller cancels, and nothing may forbid it.
    assert properties(ENDED % "").cancels is None
    assert properties(robot(INTERFACE, EYE, ARM, "requirement reach needs !Eye.dark"), Deployment.LAYER).cancels is None


def test_a_cancel_that_would_leave_a_range_is_forbidden() -> None:
    counting = ARM.replace("behaviour {", "behaviour { variable n: integer(0..1)").replace(
        "on cancel to reach goto home", "on cancel to reach do n := n + 1 goto home"
    )
    rules = "requirement reach needs !Eye.dark requirement reach needs Arm.n < 2"
    found = properties(robot(INTERFACE, EYE, counting, rules))
    assert found.cancels == "failed"
    assert found.forbidden[0].trace.count("reach.cancel") == 1
    assert found.forbidden[0].fallen == (0,)
    told = counting.replace("n := n + 1", "n := 1")
    assert properties(robot(INTERFACE, EYE, told, rules), limit=1).cancels == "passed"


def test_a_search_that_is_given_up_proves_no_cancel() -> None:
    text = ENDED % "requirement reach needs !Eye.dark"
    assert properties(text, limit=1).cancels == "not checked"
    possible = robot(INTERFACE, EYE, ARM, "requirement reach needs !Eye.dark")
    assert properties(possible, limit=1).cancels == "passed"


def test_as_a_layer_the_caller_may_cancel() -> None:
    assert properties(OWN, Deployment.LAYER).nonblocking == "passed"


# Confluence

RACE = robot(
    EYE,
    component("A", "initial marked state a { transition if Eye.dark and !B.b goto b } marked state b { }"),
    component("B", "initial marked state a { transition if Eye.dark and !A.b goto b } marked state b { }"),
)


def test_two_taus_that_disable_each_other() -> None:
    found = properties(RACE)
    assert outcomes(found) == ("passed", "failed", "passed")
    assert found.conflict is not None
    assert found.conflict.trace == ("dusk.response",)
    assert (found.conflict.chosen.events, found.conflict.other.events) == (("A.tau_1",), ("B.tau_1",))


def test_an_order_that_never_ends_beside_one_that_does() -> None:
    """B goes first and stops A; were A first, it would go round for ever, or until B comes."""
    text = robot(
        EYE,
        component("B", "initial marked state go { transition if Eye.dark goto stop } marked state stop { }"),
        component(
            "A",
            "initial marked state x { transition if Eye.dark and B.go goto y } marked state y { transition goto x }",
        ),
    )
    found = properties(text)
    assert outcomes(found) == ("passed", "failed", "passed")
    assert found.conflict is not None
    assert found.conflict.chosen.events == ("B.tau_1",)
    assert found.conflict.other.end is None
    assert found.conflict.other.cycle == ("A.tau_1", "A.tau_2")


def test_independent_steps_are_confluent_without_a_search() -> None:
    parts = [
        component(f"A{n}", "initial marked state a { transition if Eye.dark goto b } marked state b { }")
        for n in range(12)
    ]
    found = properties(robot(EYE, *parts))
    assert outcomes(found) == ("passed", "passed", "passed")
    assert found.method.startswith("finite response and confluence by the structure")


# Nonblocking


def test_silent_steps_that_run_past_the_only_way_back() -> None:
    text = robot(
        component(
            "A",
            "initial marked state a { on request to go goto b }"
            " state b { on request to back goto a transition goto c } state c { on request to go goto b }",
            "incoming message go with type: none incoming message back with type: none",
        )
    )
    found = properties(text)
    assert outcomes(found) == ("passed", "passed", "failed")
    assert found.blocking is not None
    assert found.blocking.trace == ("go.request", "A.tau_1")


def test_the_executors_choice_between_two_transitions_decides() -> None:
    """Synthesis counts both; the executor takes the state's own."""
    body = "on response from m goto a initial marked state a {{ on response from n goto b }} state b {{ {} }} "
    communications = "outgoing message m with type: none outgoing message n with type: none"
    text = robot(component("A", body.format("on response from m goto b"), communications))
    found = properties(text)
    assert found.nonblocking == "failed"
    assert properties(robot(component("A", body.format(""), communications))).nonblocking == "passed"


def test_services_alone_stay_nonblocking_without_a_search() -> None:
    found = properties(robot(INTERFACE, SERVICE))
    assert (outcomes(found), found.method) == (("passed",) * 3, "by the structure of silent steps")


# Limits

SEEN = " and ".join(f"E{n}.dark" for n in range(20))
WIDE = robot(
    f"component G {{ incoming message go with type: none }} requirement go needs {SEEN}",
    *(EYE.replace("Eye", f"E{n}").replace("dusk", f"dusk{n}") for n in range(20)),
    component("A", "initial marked state a { transition if E0.dark goto b } state b { transition goto a }"),
)


def test_beyond_the_limit_only_what_is_known_is_reported() -> None:
    found = properties(WIDE, limit=4)
    assert (found.finite_response, found.nonblocking) == ("failed", "not checked")
    sound = WIDE.replace("transition goto a", "transition if !E0.dark goto a")
    found = properties(sound, limit=4)
    assert outcomes(found) == ("passed", "passed", "not checked")
    assert "given up" in found.method
    assert "not searched" in properties(sound, limit=4, states=5000).method


def test_a_large_robot_is_proved_to_end_by_its_parts() -> None:
    parts = [
        f"""component C{n} {{
            incoming message go{n} with type: none
            outgoing message seen{n} with type: boolean
            behaviour {{
                variable v: boolean
                on response from seen{n} do v := value
                initial marked state a {{ on request to go{n} goto b }}
                marked state b {{ transition if C{n}.v goto c }}
                marked state c {{ transition if !C{n}.v goto a }}
            }}
        }}"""
        for n in range(60)
    ]
    found = check_controller(
        ExecutableSystem(model_of(robot(*parts)), Deployment.CONTROLLER), (), is_nonblocking=True, states=10**30
    )
    assert outcomes(found) == ("passed", "passed", "not checked")


def test_it_can_be_stopped() -> None:
    model = model_of(RACE)
    with pytest.raises(SynthesisCancelled):
        check_controller(
            ExecutableSystem(model, Deployment.CONTROLLER), (), is_nonblocking=True, should_stop=lambda: True
        )
    controller = Controller(ExecutableSystem(model, Deployment.CONTROLLER), ())
    with pytest.raises(SynthesisCancelled):
        search(controller, limit=9, confluence=None, should_stop=lambda: True)


def test_too_many_orders_are_not_called_confluent() -> None:
    parts = [
        component(f"A{n}", "initial marked state a { transition if Eye.dark goto b } marked state b { }")
        for n in range(12)
    ]
    controller = Controller(ExecutableSystem(model_of(robot(EYE, *parts)), Deployment.CONTROLLER), ())
    few, all_ = ConfluenceSearch(controller, 100), ConfluenceSearch(controller, 10_000)
    assert search(controller, limit=100, confluence=few).conflict is None
    assert few.is_exhausted
    assert search(controller, limit=100, confluence=all_).conflict is None
    assert not all_.is_exhausted


# Reports for people


def test_a_livelock_is_an_error_unless_it_is_allowed() -> None:
    text, line, column = marked_place(
        BLINKING.replace("transition if Eye.dark goto b", "§transition if Eye.dark goto b")
    )
    made = make_supervisor(bundle_of(text))
    assert (made.status, made.supervisor) == (OutcomeStatus.MODEL_ERRORS, None)
    assert "--allow-livelock" in made.reason
    (found,) = [item for item in made.diagnostics if item.code == "livelock"]
    assert found.severity is Severity.ERROR
    assert found.location is not None and (found.location.line, found.location.column) == (line, column)
    assert "after dusk.response, B.tau_1, B.tau_2 repeat themselves" in found.message
    assert [place.location.line for place in found.related] == [line]
    made = make_supervisor(bundle_of(text), allow_livelock=True)
    assert [item.severity for item in made.diagnostics if item.code == "livelock"] == [Severity.WARNING]
    assert made.supervisor is not None and made.supervisor.certificate.controller is not None
    assert made.supervisor.certificate.controller.finite_response == "failed"
    assert decode(encode(made.supervisor)) == made.supervisor
    assert summary_json(made.supervisor)["controller"] == {
        "finite_response": "failed",
        "confluence": "passed",
        "nonblocking": "passed",
        "method": "search of every stable state (1)",
    }
    assert "finite response       failed" in summary_text(made.supervisor)


def test_the_message_of_every_other_failure() -> None:
    made = make_supervisor(bundle_of(RACE))
    assert made.supervisor is not None
    (found,) = [item for item in made.diagnostics if item.code == "not-confluent"]
    assert found.severity is Severity.WARNING
    assert found.message == (
        "the order of silent steps matters: after dusk.response, the executor's order A.tau_1 ends with A = b, B = a, "
        "but the order B.tau_1 ends with A = a, B = b"
    )
    text, line, column = marked_place(OWN.replace("component Arm", "component §Arm"))
    made = make_supervisor(bundle_of(text))
    (found,) = [item for item in made.diagnostics if item.code == "blocking-under-control"]
    assert found.message == (
        "after reach.request, no marked state can be reached: as silent steps come first, 'Arm' is never marked again"
    )
    assert found.location is not None and (found.location.line, found.location.column) == (line, column)


@pytest.mark.parametrize(("name", "deployment"), EXAMPLE_DEPLOYMENTS)
def test_the_examples_have_every_property(name: str, deployment: Deployment) -> None:
    made = make_supervisor(example_bundle(name), deployment=deployment)
    assert made.supervisor is not None and made.supervisor.certificate.controller is not None
    found = made.supervisor.certificate.controller
    assert (found.finite_response, found.confluence, found.nonblocking) == ("passed",) * 3


def test_a_file_without_these_properties_is_still_read() -> None:
    made = make_supervisor(example_bundle("line_follower/line_follower"))
    assert made.supervisor is not None
    content = encode(made.supervisor)
    start = content.index(b'"controller":{"confluence"')
    old = content[:start] + content[content.index(b"}", start) + 2 :]
    assert decode(old).certificate.controller is None
    assert encode(decode(old)) == old
