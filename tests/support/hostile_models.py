"""Correct models of a few lines that would take all the time or memory that there is."""


def products(bits: int = 16) -> str:
    """A requirement on a product: its diagram grows exponentially with the bits of the factors.

    Source: R. E. Bryant, "On the complexity of VLSI implementations and graph representations of Boolean functions with
    application to integer multiplication", IEEE Transactions on Computers 40(2), 1991, pp. 205-213.
    """
    high = 2**bits - 1
    return f"""
robot Products {{
    component Sensor {{
        outgoing message a with identifier: "/a", type: none
        outgoing message b with identifier: "/b", type: none
        behaviour {{
            variable x: integer(0..{high})
            variable y: integer(0..{high})
            variable z: integer(0..{high})
            on response from a do x := x + 1
            on response from b do y := y + 1
            initial marked state here {{ }}
        }}
    }}
    component Wheels {{ incoming message drive with identifier: "/drive", type: none }}
    requirement Sensor.x * Sensor.y = Sensor.z disables drive
}}
"""


def bounded_products(bits: int) -> str:
    """The same with sums that stay in their range, and so with a supervisor; seconds for 9 or 10 bits."""
    text = products(bits)
    for name in "xy":
        text = text.replace(f"{name} := {name} + 1", f"{name} := min({name} + 1, {2**bits - 1})")
    return text


def all_different(count: int = 8, bits: int = 12) -> str:
    """A change that asks whether some numbers are all different, which takes memory quicker than `products` does.

    Whichever numbers a diagram asks for first, it has to remember their values: it grows exponentially with their bits.
    """
    high = 2**bits - 1
    messages = "".join(f'outgoing message a{i} with identifier: "/a{i}", type: none\n' for i in range(1, count))
    variables = "".join(f"variable x{i}: integer(0..{high})\n" for i in range(count))
    # Variables that never change would be replaced by their values.
    changes = "".join(f"on response from a{i} do x{i} := min(x{i} + 1, {high})\n" for i in range(1, count))
    different = " and ".join(f"x{i} != x{j}" for i in range(count) for j in range(i))
    return f"""
robot AllDifferent {{
    component Sensor {{
        outgoing message a with identifier: "/a", type: none
        {messages}
        behaviour {{
            {variables}
            on response from a do x0 := if {different} then x0 else min(x0 + 1, {high})
            {changes}
            initial marked state here {{ }}
        }}
    }}
    component Wheels {{ incoming message drive with identifier: "/drive", type: none }}
    requirement Sensor.x0 = 1 disables drive
}}
"""


def buttons(count: int = 24) -> str:
    """Buttons that know nothing of each other: quickly synthesized, and 2 ** count states."""
    button = """
    component Button{0} {{
        outgoing message pressed{0} with identifier: "/pressed/{0}", type: boolean
        behaviour {{
            variable is_down: boolean
            on response from pressed{0} do is_down := value
            initial marked state here {{ }}
        }}
    }}
    component Lamp{0} {{ incoming message shine{0} with identifier: "/shine/{0}", type: none }}
    requirement Button{0}.is_down disables shine{0}
"""
    return "robot Buttons {" + "".join(button.format(number) for number in range(count)) + "}\n"
