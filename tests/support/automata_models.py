"""Small models of automata, with and without a supervisor: of CIF, libFAUDES and Supremica."""

TANK = """plant tank:
  controllable c_fill; uncontrollable u_drain;
  disc int[0..3] level = 1;
  location:
    initial; marked;
    edge c_fill do level := level + 1;
    edge u_drain when level > 1 do level := level - 1;
end
requirement tank.u_drain needs tank.level != 3;
"""
TWO_TANKS = TANK + TANK.replace("tank", "tub")
EMPTY = TANK.replace("when level > 1", "")
WRONG = TANK.replace("= 1;", "= n;")

TANK_AND_BELT = """\
input bool sensor;
plant tank:
  controllable c_fill;
  uncontrollable u_drain;
  disc int[0..4] level in any;
  location:
    initial; marked;
    edge c_fill do level := level + 1;
    edge u_drain when level > 1 do level := level - 1;
end
group line:
  plant belt:
    uncontrollable u_go;
    controllable c_turn;
    location run: initial; marked; edge u_go goto jam; edge u_go goto run;
    location jam: edge c_turn goto run;
  end
end
requirement order:
  location a: initial; marked; edge tank.c_fill goto b;
  location b: marked; edge tank.c_fill when sensor goto a;
end
requirement tank.u_drain needs tank.level != 4;
"""
"""A tank with an input variable and several beginnings, and a belt whose event has two outcomes."""

BUFFER = """<Generator name="Machine" ftype="System">
<Alphabet> start +C+ stop </Alphabet>
<States> idle busy </States>
<TransRel> idle start busy  busy stop idle </TransRel>
<InitStates> idle </InitStates>
<MarkedStates> idle </MarkedStates>
</Generator>
<Generator name="Buffer">
<Alphabet> stop take +C+ </Alphabet>
<States> empty full </States>
<TransRel> empty stop full  full take empty </TransRel>
<InitStates> empty </InitStates>
<MarkedStates> empty </MarkedStates>
</Generator>
"""
"""A machine and a buffer for libFAUDES."""

DOOR = """<?xml version="1.0" encoding="UTF-8" standalone="yes"?>
<Module Name="door" xmlns="http://waters.sourceforge.net/xsd/module" xmlns:ns2="http://waters.sourceforge.net/xsd/base">
 <EventDeclList>
  <EventDecl Kind="PROPOSITION" Name=":accepting"/>
  <EventDecl Kind="CONTROLLABLE" Name="open"/>
  <EventDecl Kind="UNCONTROLLABLE" Name="fall"/>
 </EventDeclList>
 <ComponentList>
  <SimpleComponent Kind="PLANT" Name="Door">
   <Graph Deterministic="true">
    <NodeList><SimpleNode Initial="true" Name="shut"/><SimpleNode Name="wide"/></NodeList>
    <EdgeList>
     <Edge Source="shut" Target="wide"><LabelBlock><SimpleIdentifier Name="open"/></LabelBlock></Edge>
     <Edge Source="wide" Target="shut"><LabelBlock><SimpleIdentifier Name="fall"/></LabelBlock></Edge>
    </EdgeList>
   </Graph>
  </SimpleComponent>
 </ComponentList>
</Module>
"""
"""A door for Supremica."""
