"""The other side of a ROS 1 node under test. Run by the system's Python, which has rospy; JSON, a line each, both ways.

It takes no orders from the node: what it publishes, answers and ends, the test orders line by line.
"""

import importlib
import json
import sys
import threading
from typing import Any

import genpy
import rospy
from actionlib import ActionServer

publishers: dict[str, Any] = {}
services: dict[str, Any] = {}
actions: dict[str, Any] = {}
goals: dict[str, Any] = {}
lock = threading.Lock()


def report(**entry: Any) -> None:
    with lock:
        sys.stdout.write(json.dumps(entry) + "\n")
        sys.stdout.flush()


def type_of(name: str, folder: str) -> Any:
    package, _, kind = name.partition("/")
    return getattr(importlib.import_module(package + "." + folder), kind)


def plain(value: Any) -> Any:
    if isinstance(value, (genpy.Time, genpy.Duration)):
        return value.to_sec()
    if hasattr(value, "__slots__"):
        return {name: plain(getattr(value, name)) for name in value.__slots__ if not name.startswith("_")}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return value.decode() if isinstance(value, bytes) else value


def filled(message: Any, data: Any) -> Any:
    genpy.message.fill_message_args(message, [data])
    return message


class Service:
    """Answers as ordered, or not at all."""

    def __init__(self, name: str, kind: str) -> None:
        self.answer: Any = None
        self.may_answer = threading.Condition()
        service = type_of(kind, "srv")
        self._response = service._response_class
        self._name = name
        self.server = rospy.Service(name, service, self._take)

    def _take(self, request: Any) -> Any:
        report(kind="called", name=self._name, data=plain(request))
        with self.may_answer:
            self.may_answer.wait_for(lambda: self.answer is not None)
            answer, self.answer = self.answer, None
        if answer == "fail":
            raise rospy.ServiceException("told to fail")
        return filled(self._response(), answer)


class Action:
    """Reports what comes; goals are accepted, rejected and ended as ordered. It may ignore them, or cancels."""

    def __init__(self, name: str, kind: str, unheard: str | None) -> None:
        self._name = name
        self.kind = kind
        self.server = ActionServer(name, type_of(kind + "Action", "msg"), self._take, self._cancel, auto_start=False)
        if unheard == "goal":
            self.server.internal_goal_callback = lambda goal: report(kind="goal", name=name)
        elif unheard == "cancel":
            self.server.internal_cancel_callback = lambda goal: report(kind="cancel", name=name)
        self.server.start()

    def _take(self, goal: Any) -> None:
        goals[self._name] = goal
        report(kind="goal", name=self._name, data=plain(goal.get_goal()))

    def _cancel(self, goal: Any) -> None:
        report(kind="cancel", name=self._name)


def execute(order: dict[str, Any]) -> None:
    what, name = order["do"], order["name"]
    if what == "subscribe":
        # Bound to the topic by a default: the callback is called later.
        def receive(message: Any, topic: Any = name) -> None:
            report(kind="message", name=topic, data=plain(message))

        rospy.Subscriber(name, type_of(order["type"], "msg"), receive, queue_size=1000, tcp_nodelay=True)
    elif what == "publish":
        kind = type_of(order["type"], "msg")
        if name not in publishers:
            publishers[name] = rospy.Publisher(name, kind, queue_size=1000)
        publishers[name].publish(filled(kind(), order["data"]))
    elif what == "service":
        services[name] = Service(name, order["type"])
    elif what == "answer":
        with services[name].may_answer:
            services[name].answer = order["data"]
            services[name].may_answer.notify_all()
    elif what == "end service":
        services.pop(name).server.shutdown("told to")
    elif what == "action":
        actions[name] = Action(name, order["type"], order["data"])
    elif what == "accept":
        goals[name].set_accepted()
    elif what == "reject":
        goals[name].set_rejected()
    elif what == "abort":
        goals[name].set_aborted()
    elif what == "canceled":
        goals[name].set_canceled()
    elif what == "succeed":
        goals[name].set_succeeded(filled(type_of(actions[name].kind + "Result", "msg")(), order["data"]))
    elif what == "feedback":
        goals[name].publish_feedback(filled(type_of(actions[name].kind + "Feedback", "msg")(), order["data"]))
    else:
        report(kind="error", data="no order: " + what)


def main() -> None:
    rospy.init_node(sys.argv[1], disable_signals=True)
    report(kind="ready")
    for line in sys.stdin:
        try:
            execute(json.loads(line))
        except Exception as error:
            report(kind="error", data=f"{line.strip()}: {error}")


main()
