"""The other side of a ROS 1 node under test: run by Debian's Python, it does what lines of JSON order and reports.

Commands, by `do` (replies and reports are lines of JSON, too; `time` is seconds on the steady clock of the machine):

    subscribe topic, type         from then on {"topic", "message", "time"} for each message
    publish   topic, type, message, latch
    ends      topic               {"ends": topic, "publishers", "subscribers"}: names of the nodes connected here
    service   name, type          from then on {"service", "request"} for each call, which waits
    answer    name, message       the oldest waiting call is answered
    refuse    name                the oldest waiting call is refused
    action    name, type, accepts, cancels, ends_on_cancel, gives_results
                                  from then on {"action", "goal"} and {"action", "cancel"}
    accepts   name, accepts       the same option from now on
    accept    name                the oldest goal that waits for it (accepts: "later") is accepted
    feedback  name, message
    end       name, how, message  the oldest accepted goal ends: succeeded, aborted, canceled, rejected
    cancel    name                all goals of a server, whoever sent them, are cancelled
    call      id, name, type, message
                                  {"call": id, "reply"} or {"call": id, "failed"}, later
    send      id, name, type, message
                                  from then on {"sent": id, "state", "status", "result"} and {"sent": id, "feedback"}
    withdraw  id                  a goal that was sent is cancelled by its sender
    names                         {"names": {"publishers": {topic: [node]}, ...}} as the master knows them
    clear                         all waiting calls are refused, all accepted goals aborted
    die                           the process ends at once
"""

import json
import os
import sys
import threading
import time
from typing import Any

import genpy
import rosgraph
import rospy
from actionlib import ActionClient, ActionServer, CommState
from actionlib_msgs.msg import GoalID
from genpy.message import fill_message_args
from roslib.message import get_message_class, get_service_class

_writing = threading.Lock()
_publishers: dict[str, Any] = {}
_subscribers: dict[str, Any] = {}
_waiting_calls: dict[str, Any] = {}
_servers: dict[str, Any] = {}
_clients: dict[str, Any] = {}
_sent: dict[int, Any] = {}

WAIT_S = 10.0


def report(**what: Any) -> None:
    with _writing:
        sys.stdout.write(json.dumps(what) + "\n")
        sys.stdout.flush()


def plain(value: Any) -> Any:
    """A message as JSON has it."""
    if isinstance(value, (genpy.Time, genpy.Duration)):
        return {"secs": value.secs, "nsecs": value.nsecs}
    if isinstance(value, genpy.Message):
        return {name: plain(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, (list, tuple, bytes)):
        return [plain(item) for item in value]
    return value


def filled(message: Any, fields: Any) -> Any:
    if fields:
        fill_message_args(message, [fields])
    return message


def publisher(topic: str, type_name: str, latch: bool = False) -> Any:
    if topic not in _publishers:
        _publishers[topic] = rospy.Publisher(topic, get_message_class(type_name), queue_size=1000, latch=latch)
    return _publishers[topic]


class Call:
    """A service call that waits for the test."""

    def __init__(self) -> None:
        self.is_over = threading.Event()
        self.message: Any = None

    def end(self, message: Any) -> None:
        self.message = message
        self.is_over.set()


def serve(name: str, type_name: str) -> None:
    service_class = get_service_class(type_name)
    waiting: list[Call] = []
    _waiting_calls[name] = waiting

    def handle(request: Any) -> Any:
        call = Call()
        waiting.append(call)
        report(service=name, request=plain(request))
        call.is_over.wait()
        if call.message is None:
            raise rospy.ServiceException("refused")
        return filled(service_class._response_class(), call.message)

    rospy.Service(name, service_class, handle)


class Server(ActionServer):  # type: ignore[misc]
    """An action whose goals end when the test says so, or when they are cancelled."""

    def __init__(
        self,
        name: str,
        type_name: str,
        accepts: Any = True,
        cancels: bool = True,
        ends_on_cancel: bool = True,
        gives_results: bool = True,
    ) -> None:
        self.name = name
        self.gives_results = gives_results
        self.accepts = accepts
        self.cancels = cancels
        self.ends_on_cancel = ends_on_cancel
        self.pending: list[Any] = []
        self.running: list[Any] = []
        action_class = get_message_class(type_name + "Action")
        whole = action_class()
        self.result_class = type(whole.action_result.result)
        self.feedback_class = type(whole.action_feedback.feedback)
        super().__init__(name, action_class, self.goal_came, self.cancel_came, auto_start=False)
        self.start()

    def goal_came(self, handle: Any) -> None:
        if self.accepts == "later":
            self.pending.append(handle)
        elif self.accepts:
            handle.set_accepted()
            self.running.append(handle)
        else:
            handle.set_rejected()
        # Last: its reader may let the goal go on.
        report(action=self.name, goal=plain(handle.get_goal()))

    def cancel_came(self, handle: Any) -> None:
        if self.ends_on_cancel:
            (self.running if handle in self.running else self.pending).remove(handle)
            handle.set_canceled()

    def publish_result(self, status: Any, result: Any) -> None:
        if self.gives_results:
            super().publish_result(status, result)
        else:
            self.publish_status()

    def internal_cancel_callback(self, goal_id: Any) -> None:
        # One that comes before its goal ends that later, and `cancel_came` is not asked.
        report(action=self.name, cancel=True)
        if self.cancels:
            super().internal_cancel_callback(goal_id)

    def end(self, how: str, fields: Any) -> None:
        handle = self.pending.pop(0) if how == "rejected" else self.running.pop(0)
        getattr(handle, "set_" + how)(filled(self.result_class(), fields))

    def feedback(self, fields: Any) -> None:
        self.running[0].publish_feedback(filled(self.feedback_class(), fields))

    def accept(self) -> None:
        handle = self.pending.pop(0)
        handle.set_accepted()
        self.running.append(handle)


def call(number: int, name: str, type_name: str, message: Any) -> None:
    service_class = get_service_class(type_name)
    try:
        rospy.wait_for_service(name, WAIT_S)
        reply = rospy.ServiceProxy(name, service_class)(filled(service_class._request_class(), message))
    except (rospy.ServiceException, rospy.ROSException) as error:
        report(call=number, failed=str(error))
    else:
        report(call=number, reply=plain(reply))


def send(number: int, name: str, type_name: str, message: Any) -> None:
    action_class = get_message_class(type_name + "Action")
    if name not in _clients:
        _clients[name] = ActionClient(name, action_class)
    _clients[name].wait_for_server(rospy.Duration(WAIT_S))

    def changed(handle: Any) -> None:
        state = handle.get_comm_state()
        result = plain(handle.get_result()) if state == CommState.DONE else None
        report(sent=number, state=state, status=handle.get_goal_status(), result=result)

    goal = filled(type(action_class().action_goal.goal)(), message)
    _sent[number] = _clients[name].send_goal(
        goal, changed, lambda handle, feedback: report(sent=number, feedback=plain(feedback))
    )


def ends(topic: str) -> None:
    out = _publishers[topic].impl.connections if topic in _publishers else []
    into = _subscribers[topic].impl.connections if topic in _subscribers else []
    report(ends=topic, subscribers=[item.endpoint_id for item in out], publishers=[item.callerid_pub for item in into])


def names() -> None:
    publishers, subscribers, services = rosgraph.Master("/test_peer").getSystemState()
    report(names={"publishers": dict(publishers), "subscribers": dict(subscribers), "services": dict(services)})


def clear() -> None:
    for waiting in _waiting_calls.values():
        while waiting:
            waiting.pop(0).end(None)
    for server in _servers.values():
        while server.running:
            server.end("aborted", None)


def do(command: Any) -> None:
    what, name = command["do"], command.get("name")
    if what == "subscribe":
        topic = command["topic"]
        _subscribers[topic] = rospy.Subscriber(
            topic,
            get_message_class(command["type"]),
            lambda message: report(topic=topic, message=plain(message), time=time.monotonic()),
        )
    elif what == "publish":
        topic = publisher(command["topic"], command["type"], command.get("latch", False))
        if command["message"] is not None:
            topic.publish(filled(topic.data_class(), command["message"]))
    elif what == "ends":
        ends(command["topic"])
    elif what == "names":
        names()
    elif what == "service":
        serve(name, command["type"])
    elif what in ("answer", "refuse"):
        _waiting_calls[name].pop(0).end(command.get("message"))
    elif what == "action":
        _servers[name] = Server(name, command["type"], **command["options"])
    elif what == "accepts":
        _servers[name].accepts = command["accepts"]
    elif what == "accept":
        _servers[name].accept()
    elif what == "feedback":
        _servers[name].feedback(command["message"])
    elif what == "end":
        _servers[name].end(command["how"], command.get("message"))
    elif what == "cancel":
        publisher(name + "/cancel", "actionlib_msgs/GoalID").publish(GoalID())
    elif what == "call":
        arguments = (command["id"], name, command["type"], command["message"])
        threading.Thread(target=call, args=arguments, daemon=True).start()
    elif what == "send":
        send(command["id"], name, command["type"], command["message"])
    elif what == "withdraw":
        _sent[command["id"]].cancel()
    elif what == "clear":
        clear()
    elif what == "die":
        os._exit(9)
    else:
        raise ValueError(what)


def main() -> None:
    rospy.init_node(sys.argv[1], argv=sys.argv[:1], disable_signals=True)
    report(ready=True)
    for line in sys.stdin:
        do(json.loads(line))
    # A call that waits would keep it.
    os._exit(0)


if __name__ == "__main__":
    main()
