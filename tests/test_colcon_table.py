"""The table of acceptance/end_to_end/test_colcon_workspace.py, from outputs as colcon writes them."""

from pathlib import Path

import pytest

from support.colcon_table import Counts, build_durations, result_counts, rows, table

BUILT = """\
Starting >>> messages
Finished <<< messages [13.4s]
Starting >>> node
Finished <<< node [1min 3s]
Finished <<< engine [1h 0min 2s]

Summary: 3 packages finished [2min 10s]
"""
TESTED = """\
build/messages/test_results/messages/xmllint.xunit.xml: 2 tests, 0 errors, 2 failures, 0 skipped
build/node/pytest.xml: 4 tests, 0 errors, 1 failure, 1 skipped

Summary: 6 tests, 0 errors, 3 failures, 1 skipped
"""
XMLLINT = """<testsuite><testcase name="package.xml"><failure message="is not valid"/></testcase>
<testcase name="other.xml"><failure message="not well formed">line 1</failure></testcase></testsuite>"""
PYTEST = """<testsuites><testsuite>
<testcase classname="test.test_supervisor" name="test_starts"/>
<testcase classname="test.test_supervisor" name="test_no_data"><skipped/></testcase>
<testcase classname="test.test_flake8" name="test_flake8"><failure message="AssertionError: Found 12 code style errors">
</failure></testcase><testcase classname="test.test_pep257" name="test_pep257"/></testsuite></testsuites>"""
KINDS = {"messages": "interfaces", "node": "Python", "engine": "C++"}


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    for path, text in (("messages/test_results/messages/xmllint.xunit.xml", XMLLINT), ("node/pytest.xml", PYTEST)):
        file = tmp_path / "build" / path
        file.parent.mkdir(parents=True)
        file.write_text(text, encoding="utf-8")
    return tmp_path


def test_durations_of_every_length() -> None:
    assert build_durations(BUILT) == {"messages": 13.4, "node": 63.0, "engine": 3602.0}


def test_each_package_has_its_counts(workspace: Path) -> None:
    messages, node, engine = rows(workspace, KINDS, BUILT, TESTED)
    assert (messages.counts, messages.lint_tests, messages.lint_findings) == (Counts(2, 0, 2, 0), 2, 2)
    assert (node.counts, node.lint_tests, node.lint_findings) == (Counts(4, 0, 1, 1), 2, 12)
    assert (engine.counts, engine.lint_tests, engine.lint_findings) == (Counts(), 0, 0)


def test_the_table_ends_with_the_sums(workspace: Path) -> None:
    lines = table(rows(workspace, KINDS, BUILT, TESTED)).splitlines()
    assert lines[0].startswith("| package | kind | build s | tests |")
    assert lines[3] == "| node | Python | 63.0 | 4 | 0 | 1 | 1 | 2 | 12 |"
    assert lines[-1] == "| all |  | 3678.4 | 6 | 0 | 3 | 1 | 4 | 14 |"


def test_a_package_that_was_not_built_is_told(workspace: Path) -> None:
    with pytest.raises(AssertionError, match="colcon built no twin"):
        rows(workspace, {**KINDS, "twin": "Python"}, BUILT, TESTED)


def test_results_of_other_packages_are_told(workspace: Path) -> None:
    with pytest.raises(AssertionError, match="results of other packages"):
        rows(workspace, {"node": "Python"}, BUILT, TESTED)


def test_an_output_without_a_summary_is_shown() -> None:
    with pytest.raises(AssertionError, match="no such folder"):
        result_counts("no such folder")
