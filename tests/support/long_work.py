"""A model whose synthesis takes minutes."""


def long_work(count: int) -> str:
    """A model whose synthesis takes minutes for some 9 components: counters that are multiplied with each other."""
    components = "".join(
        f"""
        component C{i} {{
            incoming message up{i} with type: none
            outgoing message down{i} with type: none
            behaviour {{
                variable x: integer(0..200)
                initial marked state s {{ on request to up{i} transition if x > 150 goto t }}
                state t {{ on response from down{i} do x := x + 1 goto s }}
            }}
        }}"""
        for i in range(count)
    )
    requirements = "".join(
        f"requirement up{i} needs C{i}.x * C{(i + 1) % count}.x + C{(i + 2) % count}.x < 5000\n" for i in range(count)
    )
    return f"robot Long {{ {components} {requirements} }}"
