"""Parts that tests of the generated ROS packages of supervision layers share."""

import ast
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc.targets import generate, write_files
from support.execution import unsupervised
from support.own_tests import own_tests

HOSTILE_LAYER = r"""
robot None {
    datatype object class { x: double }
    interface i use Vector3 from geometry_msgs
    interface j use Trigger from std_srvs
    component def {
        incoming message lambda with identifier: "/a", type: string, when: value = "{{ 1 }} --> `|` \" ' \\ </name>"
        incoming message try with identifier: "/a", type: string
        incoming message raise with identifier: "/b", type: class, stamped: "\"; import os; '" links i
        outgoing message yield with identifier: "/import/class", type: string
        service while with identifier: "/exec", request: none, response: none links j
        behaviour {
            variable x: string = "\" ' \\ ${x} {{ x }} {% raw %} </name> <!-- --> \u0022 é"
            initial marked state s { on request to lambda on request to raise on request to try on request to while }
        }
    }
}
"""
"""A model whose names and texts are meant to break generated packages."""


def layer_of(text: str) -> Supervisor:
    """A layer to which synthesis adds nothing."""
    return unsupervised(text, Deployment.LAYER)


def hostile_package(target: str, folder: Path) -> None:
    """Write the hostile model's package, whose files are well formed and whose own tests pass."""
    files = generate(layer_of(HOSTILE_LAYER), target)
    for path, text in files.items():
        if path.endswith(".py"):
            ast.parse(text, filename=path, feature_version=(3, 8))
    ElementTree.fromstring(files["package.xml"])
    pytest.importorskip("yaml").safe_load(files["config/parameters.yaml"])
    write_files(files, folder)
    assert own_tests(folder).returncode == 0
