"""Properties that nothing reads or fills and no field stands for: each communication goes without its own."""

from robosc.expressions import EnumType, ObjectType
from robosc.model.structure import Communication, Model
from robosc.targets.ros.topics import shapes_of
from support.models import checked

# The pose of one message is filled, that of the other does not exist, as in the scenarios of the language's authors.
NAVIGATION = """robot R {
    interface located use PoseWithCovarianceStamped from geometry_msgs
    interface target use PoseStamped from geometry_msgs
    datatype object Point { x: double }
    datatype object Pose { position: Point }
    datatype object Target { pose: Pose }
    component Base {
        outgoing message seen with type: Pose links located
        incoming message move with type: Target links target, stamped: "map"
        behaviour {
            variable x: double
            initial marked state lost { on response from seen §READ§ goto known }
            marked state known { }
        }
    }
    requirement move needs Base.known
    provide move with { pose: { position: { x: Base.x } } }
}""".replace(' links target, stamped: "map"', ', stamped: "map" links target')


def model_of(text: str) -> tuple[Model, list[str]]:
    found = checked(text)
    assert found.model is not None, found.diagnostics
    return found.model, [item.code for item in found.diagnostics]


def properties(model: Model, communication: Communication, part: str) -> list[str]:
    type_ = getattr(communication, part)
    assert isinstance(type_, ObjectType)
    return [item.name for item in model.object(type_.name).properties]


def by_name(model: Model) -> dict[str, Communication]:
    return {item.name: item for item in model.communications}


def test_only_the_communication_that_does_not_need_it_goes_without() -> None:
    model, codes = model_of(NAVIGATION.replace("§READ§ ", ""))
    assert codes == ["needless-property"]
    communications = by_name(model)
    assert properties(model, communications["seen"], "response") == []
    assert properties(model, communications["move"], "request") == ["pose"]
    assert [item.name for item in model.objects] == ["Point", "Pose", "Pose_seen", "Target"]


def test_what_is_read_is_as_unknown_as_ever() -> None:
    model, codes = model_of(NAVIGATION.replace("§READ§", "do x := value.position.x"))
    assert "unknown-field" in codes
    assert properties(model, by_name(model)["seen"], "response") == ["position"]


def test_packages_are_made_as_if_it_were_not_there() -> None:
    model, _ = model_of(NAVIGATION.replace("§READ§ ", ""))
    communications = by_name(model)
    assert shapes_of(model, communications["seen"]) == {"seen.response": {}}
    assert shapes_of(model, communications["move"]) == {"move.request": {"pose": {"position": {"x": "double"}}}}


def test_where_no_communication_needs_it_the_type_keeps_its_name() -> None:
    text = """robot R {
        interface battery use BatteryState from sensor_msgs
        datatype object Battery { percentag: double voltage: double }
        component C { outgoing message m with type: Battery links battery
            behaviour { variable v: double initial marked state s { on response from m do v := value.voltage } } }
    }"""
    model, codes = model_of(text)
    assert codes == ["needless-property"]
    assert [(item.name, [inner.name for inner in item.properties]) for item in model.objects] == [
        ("Battery", ["voltage"])
    ]


def test_what_the_rules_of_an_enum_read_is_needed() -> None:
    text = """robot R {
        interface battery use BatteryState from sensor_msgs
        datatype object Battery { percentag: double voltage: double }
        datatype enum Level from Battery to { value.§ > 1.0 -> high default -> low }
        component C { outgoing message m with type: Level links battery }
    }"""
    model, codes = model_of(text.replace("§", "voltage"))
    assert codes == ["needless-property"]
    type_ = by_name(model)["m"].response
    assert isinstance(type_, EnumType)
    source = model.enum(type_.name).source
    assert isinstance(source, ObjectType)
    assert [item.name for item in model.object(source.name).properties] == ["voltage"]
    model, codes = model_of(text.replace("§", "percentag"))
    assert codes == ["unknown-field"]


def test_a_property_of_elements_is_read_in_quantifiers() -> None:
    text = """robot R {
        interface points use PointCloud from sensor_msgs
        datatype object Point { height: double }
        datatype object Cloud { points: array(Point) }
        datatype enum Seen from Cloud to { any(p in value.points: p.height > 1.0) -> something default -> nothing }
        component C { outgoing message m with type: Seen links points }
    }"""
    _, codes = model_of(text)
    assert codes == ["unknown-field"]


def test_what_the_other_ros_has_stays() -> None:
    text = """robot R {
        interface odometry use Odometry from nav_msgs
        datatype object Header { seq: integer }
        datatype object Odometry { header: Header }
        component C { outgoing message m with type: Odometry links odometry }
    }"""
    model, codes = model_of(text)
    assert codes == ["ros1-only"]
    assert len(model.object("Header").properties) == 1
