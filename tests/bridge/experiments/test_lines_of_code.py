"""Lines of code, counted by hand beside."""

from robosc.source import Bundle, SourceFile
from robosc_experiments.lines_of_code import CodeSize, count_lines, model_size, target_sizes
from support.generated import example_supervisor

PYTHON = '''#!/usr/bin/env python3
"""A docstring
over two lines."""

import sys  # a comment behind code


# a comment
def hello(who):
    """Another one."""
    text = """a string
    that is none

    of those"""
    return text, who, "# no comment"
'''
# import, def, text = and its two lines that are not blank, return.
PYTHON_LINES = 6

C = """/* A comment
   over lines */
#include <stdio.h>

// one more
int main(void) /* behind */
{
    puts("/* no comment */ // none either \\" */"); // but this
    return '"'; /* and
    this */ }
"""
# include, main, {, puts, return, }.
C_LINES = 6

MODEL = """// A robot.
robot R {
    /* nothing
       here */
    component A {
        outgoing message m with identifier: "//m", type: none  // a topic
    }

}
"""
MODEL_LINES = 5


def test_blank_lines_and_comments_do_not_count() -> None:
    assert count_lines("hello.py", PYTHON) == PYTHON_LINES
    assert count_lines("scripts/hello", PYTHON) == PYTHON_LINES
    for name in ("a.c", "a.h", "a.cpp", "a.hpp", "a.cif", "a.pml"):
        assert count_lines(name, C) == C_LINES
    assert count_lines("r.rscd", MODEL) == MODEL_LINES
    assert count_lines("a.c", "") == 0
    assert count_lines("a.c", "/* not closed\nint x;") == 0
    assert count_lines("a.c", "char c = 'x\nint y;") == 2


def test_what_is_no_source_file_does_not_count() -> None:
    for name in ("README.md", "package.xml", "CMakeLists.txt", "config/parameters.yaml", "marker"):
        assert count_lines(name, "something\n") is None


def test_a_model_counts_with_its_libraries() -> None:
    bundle = Bundle(SourceFile("r.rscd", MODEL), (SourceFile("lib.rscd", MODEL),))
    assert model_size(bundle) == CodeSize("model", 2 * MODEL_LINES, 2)


def test_every_target_is_counted_or_says_why_not() -> None:
    sizes = {size.name: size for size in target_sizes(example_supervisor("maze_solver/maze_solver"))}
    assert list(sizes) == ["c99", "cif", "promela", "python", "ros1", "ros1-cpp", "ros2", "ros2-cpp"]
    assert all(size.lines for size in sizes.values())
    assert (sizes["cif"].files, sizes["python"].files) == (1, 1)
    # A node holds what the target without ROS holds.
    assert (sizes["ros2"].lines or 0) > (sizes["python"].lines or 0) > (sizes["cif"].lines or 0)
