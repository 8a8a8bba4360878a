"""Files of libFAUDES and Supremica: what is read is what was written, and what is wrong is reported at its place."""

from dataclasses import replace
from random import Random

import pytest

from robosc.automata import Role, System
from robosc.automata.structure import DiscreteVariable
from robosc.errors import Diagnostic, UnsupportedModelError
from robosc.expressions import IntegerType, StateTest, Unary
from robosc.plain_automata import WRITERS, check_automata
from robosc.source import Bundle, SourceFile
from support.effort import examples
from support.random_plain import random_plain

MACHINE = """<Generator name="M" ftype="System">
<Alphabet> start +C+ stop </Alphabet>
<States> idle busy </States>
<TransRel> idle start busy  busy stop idle </TransRel>
<InitStates> idle </InitStates>
<MarkedStates> idle </MarkedStates>
</Generator>
"""

MODULE = """<?xml version="1.0" encoding="UTF-8" standalone="yes"?>
<Module Name="door" xmlns="http://waters.sourceforge.net/xsd/module" xmlns:ns2="http://waters.sourceforge.net/xsd/base">
 <EventDeclList>
  <EventDecl Kind="PROPOSITION" Name=":accepting"/>
  <EventDecl Kind="PROPOSITION" Name=":forbidden"/>
  <EventDecl Kind="CONTROLLABLE" Name="open"/>
  <EventDecl Kind="UNCONTROLLABLE" Name="fall"/>
 </EventDeclList>
 <ComponentList>
  <SimpleComponent Kind="PLANT" Name="Door">
   <ns2:Comment>A door.</ns2:Comment>
   <Graph Deterministic="true">
    <NodeList>
     <SimpleNode Initial="true" Name="shut"><PointGeometry><Point X="1" Y="2"/></PointGeometry></SimpleNode>
     <SimpleNode Name="wide"/>
     <SimpleNode Name="broken"><EventList><SimpleIdentifier Name=":forbidden"/></EventList></SimpleNode>
    </NodeList>
    <EdgeList>
     <Edge Source="shut" Target="wide"><LabelBlock><SimpleIdentifier Name="open"/></LabelBlock><SplineGeometry/></Edge>
     <Edge Source="wide" Target="broken">
      <LabelBlock><SimpleIdentifier Name="fall"/><SimpleIdentifier Name="open"/></LabelBlock><GuardActionBlock/></Edge>
    </EdgeList>
   </Graph>
  </SimpleComponent>
 </ComponentList>
</Module>
"""


def read(text: str, ending: str = ".gen") -> tuple[System | None, tuple[Diagnostic, ...]]:
    found = check_automata(Bundle(SourceFile(f"model{ending}", text)))
    return found.system, found.diagnostics


def system_in(text: str, ending: str = ".gen") -> System:
    found, diagnostics = read(text, ending)
    assert found is not None, diagnostics
    return found


@pytest.mark.random
@pytest.mark.parametrize("ending", sorted(WRITERS))
def test_what_is_written_is_read(ending: str) -> None:
    for seed in range(examples(40)):
        made = random_plain(Random(seed))
        found = system_in(WRITERS[ending](made), ending)
        events = sorted(found.events, key=lambda event: event.name)
        assert replace(found, events=tuple(events)) == made


def test_a_generator() -> None:
    found = system_in(MACHINE)
    (machine,) = found.automata
    assert (found.name, machine.name, machine.locations, machine.initial) == ("model", "M", ("idle", "busy"), ("idle",))
    assert [(event.name, event.is_controllable) for event in found.events] == [("start", True), ("stop", False)]


def test_spellings_of_libfaudes() -> None:
    """Its older files and its own writer spell differently: names beside the tag, numbers, comments, empty sections."""
    text = """
% a comment <Generator>
<SystemVector name="Vector">
<Generator>
"My machine"
<Alphabet> "a.b"+C+ c-d +OFa+ </Alphabet>
<States><Consecutive> 1 3 </Consecutive> "up"#4 </States>
<TransRel> 1 a.b 2 % then
2 "c-d" up </TransRel>
<InitStates> 1 </InitStates>
<MarkedStates/>
</Generator>
<Generator><Alphabet> c-d </Alphabet><States> 7 </States><TransRel/><InitStates> 7 </InitStates>
<MarkedStates> 7 </MarkedStates></Generator>
</SystemVector>"""
    found = system_in(text)
    machine, watcher = found.automata
    assert machine.locations == ("1", "2", "3", "up")
    assert (machine.name, machine.role, machine.marked) == ("My machine", Role.PLANT, frozenset())
    assert (watcher.name, watcher.role) == ("automaton", Role.REQUIREMENT)
    assert {(edge.source, edge.event, edge.target) for edge in machine.edges} == {("1", "a.b", "2"), ("2", "c-d", "up")}


def test_copies_of_a_generator_have_names_of_their_own() -> None:
    assert [item.name for item in system_in(MACHINE * 3).automata] == ["M", "M_2", "M_3"]


def test_a_module() -> None:
    found = system_in(MODULE, ".wmod")
    (door,) = found.automata
    assert (found.name, door.initial, door.marked) == ("door", ("shut",), frozenset({"shut", "wide", "broken"}))
    assert found.invariants == (Unary("not", StateTest("Door", "broken")),)
    assert {(edge.event, edge.target) for edge in door.edges} == {
        ("open", "wide"),
        ("fall", "broken"),
        ("open", "broken"),
    }


@pytest.mark.parametrize(
    ("old", "new", "code", "line"),
    [
        ("<Generator", "<Genrator", "automata-syntax", 1),
        ("</Generator>\n", "", "automata-syntax", 7),
        ("idle busy </States>", "idle <b> </States>", "automata-syntax", 3),
        ("idle busy", "<Consecutive> 1 x </Consecutive>", "automata-syntax", 3),
        ("idle busy", "<Consecutive> 1 99999999 </Consecutive>", "automata-unsupported", 3),
        ("idle busy", f"<Consecutive> 1 {'9' * 5000} </Consecutive>", "automata-syntax", 3),
        ("idle busy", 'idle busy ""', "automata-name", 3),
        ("+C+", "+X+", "automata-syntax", 2),
        ("+C+", '"', "automata-syntax", 2),
        ("stop idle", "stop", "automata-syntax", 4),
        ("idle busy", "idle idle busy", "automata-name", 3),
        ("start busy", "starts busy", "automata-name", 4),
        ("<InitStates> idle", "<InitStates> idel", "automata-name", 5),
        ("<MarkedStates> idle", "<MarkedStates> idel", "automata-name", 6),
        ("<TransRel>", "<Clocks/> <TransRel>", "automata-syntax", 4),
        ('ftype="System"', 'ftype="Generator"', None, 0),
        ("start +C+ stop </Alphabet>", "start stop </Alphabet>", None, 0),
    ],
)
def test_wrong_generators(old: str, new: str, code: str | None, line: int) -> None:
    assert old in MACHINE
    _, diagnostics = read(MACHINE.replace(old, new, 1))
    assert [(item.code, item.location and item.location.line) for item in diagnostics] == (
        [(code, line)] if code else []
    )


def test_generators_that_do_not_agree() -> None:
    assert read("")[1][0].message == "there is no generator in it"
    for said in ("+c+", ""):
        _, (finding,) = read(MACHINE + MACHINE.replace("+C+", said))
        assert "controllable in one alphabet and not in another" in finding.message
    # A requirement need not say it.
    requirement = MACHINE.replace(' ftype="System"', "").replace("+C+", "")
    assert [event.is_controllable for event in system_in(requirement + MACHINE).events] == [True, False]
    _, (finding,) = read(requirement)
    assert finding.message == "no generator is a plant"


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("<Module", '<!DOCTYPE a [<!ENTITY b "c">]><Module', "automata-syntax"),
        ("</Module>", "", "automata-syntax"),
        ("Module", "Modul", "automata-syntax"),
        ('Kind="CONTROLLABLE"', 'Kind="MAYBE"', "automata-syntax"),
        ('Kind="CONTROLLABLE"', 'Observable="false" Kind="CONTROLLABLE"', "automata-unsupported"),
        (
            'Name="fall"/>\n </EventDeclList>',
            'Name="fall"><RangeList/></EventDecl>\n </EventDeclList>',
            "automata-unsupported",
        ),
        ('Name="fall"/>\n </EventDeclList>', 'Name="open"/>\n </EventDeclList>', "automata-name"),
        ("SimpleComponent", "VariableComponent", "automata-unsupported"),
        ('Kind="PLANT"', 'Kind="THING"', "automata-syntax"),
        ("<GuardActionBlock/>", "<GuardActionBlock><Guards/></GuardActionBlock>", "automata-unsupported"),
        ('<SimpleNode Name="wide"/>', '<GroupNode Name="wide"/>', "automata-unsupported"),
        ('<SimpleNode Name="wide"/>', "", "automata-name"),
        ('<SimpleIdentifier Name="fall"/>', "<IndexedIdentifier/>", "automata-unsupported"),
        ('<SimpleIdentifier Name="fall"/>', '<SimpleIdentifier Name="falls"/>', "automata-name"),
        ("<ComponentList>", "<InstanceList><Instance/></InstanceList><ComponentList>", "automata-unsupported"),
    ],
)
def test_wrong_modules(old: str, new: str, code: str) -> None:
    assert old in MODULE
    found, diagnostics = read(MODULE.replace(old, new), ".wmod")
    assert found is None
    assert diagnostics[0].code == code, diagnostics


def test_a_module_in_another_encoding() -> None:
    """The file is read as UTF-8, whatever its first line says."""
    text = MODULE.replace('"UTF-8"', '"ISO-8859-1"').replace('Name="open"', 'Name="öffnen"')
    assert "öffnen" in {event.name for event in system_in(text, ".wmod").events}


def test_a_state_that_nobody_can_mark() -> None:
    """With `:accepting` in its alphabet, and in no state, an automaton is never marked."""
    block = '<LabelBlock><SimpleIdentifier Name=":accepting"/></LabelBlock><NodeList>'
    assert system_in(MODULE.replace("<NodeList>", block), ".wmod").automata[0].marked == frozenset()


def test_what_plain_automata_do_not_have_is_not_written() -> None:
    made = random_plain(Random(1))
    (first, *rest) = made.automata
    wide = replace(first, variables=(DiscreteVariable("n", IntegerType(0, 1), (0,)),))
    for write in WRITERS.values():
        with pytest.raises(UnsupportedModelError, match="is not a plain automaton"):
            write(replace(made, automata=(wide, *rest)))
        with pytest.raises(UnsupportedModelError, match="has conditions beside its automata"):
            write(replace(made, invariants=(StateTest(first.name, first.locations[0]),)))
    with pytest.raises(UnsupportedModelError, match="is not a symbol of libFAUDES"):
        WRITERS[".gen"](replace(made, automata=(replace(first, name='A"\n<x>'), *rest)))
    hostile = replace(made, automata=(replace(first, name='A"><x y="&amp;'), *rest))
    assert system_in(WRITERS[".wmod"](hostile), ".wmod").automata[0].name == 'A"><x y="&amp;'
