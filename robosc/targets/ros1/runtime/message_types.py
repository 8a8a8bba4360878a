"""
The types of services and actions of ROS 1, taken apart into the messages that they are made of.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

import importlib
from typing import Any, NamedTuple

from robosc.targets.ros.runtime.messages import Server, SetupError


class ServerType(NamedTuple):
    """
    A service's or action's type.

    :ivar specification: The class that stands for all of it.
    :ivar request: Class of what is sent.
    :ivar response: Class of the reply or the result.
    :ivar feedback: Class of an action's feedback, else None.
    """

    specification: Any
    request: Any
    response: Any
    feedback: Any


def load_service(server: Server) -> ServerType:
    """
    Return the type of a service.

    :raises SetupError: It is not installed.
    """
    try:
        found = getattr(importlib.import_module(f'{server.package}.srv'), server.type_name)
        return ServerType(found, found._request_class, found._response_class, None)
    except (ImportError, AttributeError) as error:
        raise _missing(server, f'{server.package}/srv/{server.type_name}') from error


def load_action(server: Server) -> ServerType:
    """
    Return the type of an action.

    `MoveBase` and `MoveBaseAction` both mean `move_base_msgs/MoveBaseAction`.

    :raises SetupError: It is not installed.
    """
    name = server.type_name if server.type_name.endswith('Action') else server.type_name + 'Action'
    try:
        found = getattr(importlib.import_module(f'{server.package}.msg'), name)
        whole = found()
        return ServerType(
            found,
            type(whole.action_goal.goal),
            type(whole.action_result.result),
            type(whole.action_feedback.feedback),
        )
    except (ImportError, AttributeError) as error:
        raise _missing(server, f'{server.package}/msg/{name}') from error


def _missing(server: Server, name: str) -> SetupError:
    kind = 'action' if server.is_action else 'service'
    return SetupError(
        f'the {kind} type {name} is not installed; build {server.package} and source its workspace'
    )
