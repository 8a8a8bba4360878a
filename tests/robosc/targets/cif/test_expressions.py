"""Expressions that are easily got wrong, each in every state of a small model."""

import pytest

from support.cif_twin import assert_same_problem
from support.execution import supervisor_of
from support.models import model_of


def assert_same(requirement: str = "true", update: str = "n := 1") -> None:
    model = model_of(
        f"""robot R {{
        interface link use Scan from my_msgs
        datatype object Scan {{ flags: array(boolean) }}
        component C {{
            incoming message go with type: none
            outgoing message scan with type: Scan links link
            behaviour {{
                variable n: integer(-2..2)
                variable m: integer(0..2)
                variable flag: boolean
                initial marked state a {{ on response from scan do {update} }}
            }}
        }}
        requirement go needs {requirement}
        requirement go needs C.flag or C.n = C.m
    }}"""
    )
    assert assert_same_problem(supervisor_of(model), reachable=0, others=60) > 10


@pytest.mark.parametrize(
    "requirement",
    [
        *(f"1 - C.n {operator} 0" for operator in ("<", "<=", ">", ">=", "=", "!=")),
        *(f"C.n {operator} -C.m" for operator in ("<", "<=", ">", ">=", "=", "!=")),
        "C.n * 2000000000 > 0",
        "C.n * C.m * 1000000000 < 1",
        "C.n + 2147483640 > C.m - 2000000000",
        "2147483647 - C.n > 5",
        "C.n * 2000000000 - C.n * 2000000000 = 0",
        "C.m * 1073741823 > (if C.flag then 1 else 0) * -1073741823",
        "abs(C.n) = max(C.m, 1) and clamp(C.n, -1, C.m) < 1",
        "(1 / double(C.n) > 0) => (1 / double(C.m) > 0)",
        "!((1 / double(C.n) > 0) => (1 / double(C.m) > 0))",
        "if 1 / double(C.n) > 0 then C.flag else !C.flag",
        "C.flag = (C.n > 0) and C.flag != (1 / double(C.m) > 0.7)",
        "integer(double(C.n) * 1.5) = C.m",
    ],
)
def test_conditions(requirement: str) -> None:
    assert_same(requirement=requirement)


@pytest.mark.parametrize(
    "update",
    [
        "n := if value.flags[3] then 1 else 2, m := if value.flags[0] then 1 else 2",
        "n := if (value.flags[3]) => (value.flags[0]) then 1 else 2, m := if value.flags[3] then 1 else 2",
        "flag := (value.flags[1]) => (value.flags[0])",
        "n := if !((value.flags[1]) => (value.flags[0])) then 1 else -1, m := if value.flags[1] then 1 else 2",
        "n := if value.flags[0] = value.flags[1] then n + 1 else -2, flag := flag and value.flags[1]",
    ],
)
def test_updates(update: str) -> None:
    assert_same(update=update)
