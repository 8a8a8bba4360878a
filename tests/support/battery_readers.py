"""Two components that read one message of the battery, each in words of its own."""

BATTERY_READERS = """\
    component Battery {
        outgoing message level with identifier: "/battery", type: Level links battery
        behaviour {
            variable level: Level = good
            on response from level do level := value
            initial marked state ready { }
        }
    }
    component Planner {
        outgoing message reserve with identifier: "/battery", type: Reserve links battery
        behaviour {
            variable reserve: Reserve = large
            on response from reserve do reserve := value
            initial marked state ready { }
        }
    }
"""
