"""A robot with a goal: it calls a lift, once, and enters."""

LIFT = """robot Lifted {
    component Lift {
        incoming message call with identifier: "/lift/call", type: none
        outgoing message arrived with identifier: "/lift/arrived", type: none
        behaviour {
            initial marked state away { on request to call goto called }
            state called { on response from arrived goto here }
            marked state here { on request to enter goto away }
        }
    }
    component Base {
        incoming message enter with identifier: "/enter", type: none
        incoming message leave with identifier: "/leave", type: none
        behaviour {
            initial marked state outside { on request to enter goto inside }
            marked state inside { on request to leave goto outside }
        }
    }
    requirement call needs Base.outside
    assume Lift.called leads to Lift.here
    goal once Base.inside
}
"""
