"""A supervisor written by hand that has something of everything a supervisor can hold."""

from robosc.expressions import (
    ArrayType,
    Binary,
    BooleanType,
    Constant,
    DoubleType,
    EnumType,
    EnumValue,
    IntegerType,
    NoneType,
    ObjectType,
    Received,
    StateTest,
    StringType,
    Unary,
    VariableRead,
)
from robosc.model.structure import (
    Behaviour,
    Communication,
    CommunicationKind,
    Component,
    Deployment,
    EnumDefinition,
    EnumRule,
    Interface,
    Invariant,
    Model,
    ObjectDefinition,
    ObjectValue,
    Property,
    Provide,
    Requirement,
    RequirementForm,
    State,
    Transition,
    Update,
    Variable,
)
from robosc.supervisor import AddedCondition, Certificate, DecisionDiagram, DecisionNode, Supervisor

CLEARANCE = EnumType("Clearance", ("clear", "obstructed"))
READ_FRONT = VariableRead("Sensor", "front")
IS_CLEAR = Binary("=", READ_FRONT, EnumValue("Clearance", "clear"))

_FRONT_RANGE = Binary(">", Received(("ranges", 0)), Constant(0.5))


def model() -> Model:
    """The model."""
    return Model(
        name="Robot",
        components=(_sensor(), _base(), Component("Silent")),
        communications=_communications(),
        enums=(
            EnumDefinition(
                "Clearance", ObjectType("Scan"), CLEARANCE.values, (EnumRule(_FRONT_RANGE, "clear"),), "obstructed"
            ),
        ),
        objects=(
            ObjectDefinition("Scan", (Property("ranges", ArrayType(DoubleType())), Property("seq", IntegerType()))),
            ObjectDefinition("Vector", (Property("x", DoubleType()), Property("y", DoubleType()))),
            ObjectDefinition("Lib.Twist", (Property("linear", ObjectType("Vector")), Property("fast", BooleanType()))),
            ObjectDefinition("Result", (Property("ok", BooleanType()), Property("text", StringType()))),
        ),
        requirements=(
            Requirement(("move", "navigate"), RequirementForm.NEEDS, Binary("or", IS_CLEAR, StateTest("Base", "idle"))),
            Requirement(
                ("calibrate",), RequirementForm.DISABLES, Binary(">=", VariableRead("Base", "failures"), Constant(2))
            ),
        ),
        provides=(
            Provide(
                "move",
                ObjectValue(
                    (
                        ("linear", ObjectValue((("x", Constant(1.0)), ("y", Unary("-", Constant(2)))))),
                        ("fast", Unary("not", StateTest("Base", "idle"))),
                    )
                ),
                IS_CLEAR,
            ),
            Provide("move", ObjectValue(()), None),
        ),
        invariants=(Invariant(True, Binary(">", VariableRead("Base", "failures"), Constant(3))),),
    )


def _communications() -> tuple[Communication, ...]:
    kind, none, result = CommunicationKind, NoneType(), ObjectType("Result")
    scan = Interface("LaserScan", "sensor_msgs")
    return (
        Communication("scan", "Sensor", kind.OUTGOING_MESSAGE, "/scan", response=CLEARANCE, interface=scan),
        Communication("level", "Sensor", kind.OUTGOING_MESSAGE, "/level", response=IntegerType(-3, 3)),
        Communication(
            "move",
            "Base",
            kind.INCOMING_MESSAGE,
            "/cmd_vel",
            request=ObjectType("Lib.Twist"),
            interface=Interface("Twist", "geometry_msgs"),
        ),
        Communication(
            "calibrate",
            "Base",
            kind.SERVICE,
            "/calibrate",
            request=none,
            response=result,
            interface=Interface("Trigger", "std_srvs"),
        ),
        Communication(
            "navigate",
            "Base",
            kind.ACTION,
            "/navigate",
            request=none,
            response=result,
            feedback=none,
            interface=Interface("Navigate", "nav2_msgs"),
        ),
    )


def _sensor() -> Component:
    variables = (
        Variable("front", CLEARANCE, "obstructed", True),
        Variable("level", IntegerType(-3, 3), 0, False),
        Variable("mean", DoubleType(), 1.0, False),
        Variable("words", StringType(), "none yet", False),
    )
    half = Binary("/", Binary("+", VariableRead("Sensor", "mean"), Received()), Constant(2))
    transitions = (
        Transition(None, "scan.response", None, (Update("front", Received()),), None),
        Transition(None, "level.response", None, (Update("level", Received()), Update("mean", half)), None),
        Transition(None, "calibrate.response", None, (Update("words", Received(("text",))),), None),
    )
    return Component("Sensor", Behaviour(variables, (State("watching", True, True),), transitions))


def _base() -> Component:
    failures = VariableRead("Base", "failures")
    transitions = (
        Transition("idle", "move.request", None, (), "moving"),
        Transition("moving", "move.request", None, (), None),
        Transition("moving", "Base.tau_1", IS_CLEAR, (), "idle"),
        Transition(None, "navigate.request", None, (), None),
        Transition("idle", "navigate.error", None, (Update("failures", Binary("+", failures, Constant(1))),), None),
        Transition(None, "navigate.cancel", None, (), "idle"),
        Transition(None, "calibrate.response", None, (Update("ready", Received(("ok",))),), None),
    )
    variables = (Variable("failures", IntegerType(0, 3), 0, True), Variable("ready", BooleanType(), False, True))
    return Component(
        "Base", Behaviour(variables, (State("idle", True, True), State("moving", False, False)), transitions)
    )


def supervisor() -> Supervisor:
    """The supervisor: it adds a condition to one request."""
    diagram = DecisionDiagram((DecisionNode("Base", "failures", (0, 2), (1, 0)),), 2)
    digest = "0123456789abcdef" * 4
    certificate = Certificate(
        engine_version="0.1.0",
        bundle_sha256=digest,
        deployment=Deployment.CONTROLLER,
        method="by hand",
        safe="passed",
        controllable="passed",
        nonblocking="passed",
        maximally_permissive="not checked",
        states="48",
        transitions=None,
    )
    return Supervisor(model(), Deployment.CONTROLLER, (AddedCondition("navigate.request", diagram),), certificate)
