"""The files of the target `promela`: the model, and how to check it."""

from robosc.supervisor import Supervisor
from robosc.targets.code.naming import package_name
from robosc.targets.files import GeneratedFiles
from robosc.targets.promela.model import promela_model
from robosc.targets.registry import GenerateOptions
from robosc.targets.text import requirements_chapter

_README = """\
# {name} in Promela

`{file}` is the controlled system of {name}: the robot's parts under their supervisor, in which everything that is
allowed may happen. The model checker [spin](https://spinroot.com) can go through it (`apt install spin gcc`):

```
spin -a -o2 {file}
gcc -O2 -o pan pan.c
./pan -m1000000
```

This counts the states of the controlled system (`states, stored`) and would find a run that takes a variable out of its
range (`errors: 1`). `-o2` keeps variables that are only written. For a property, add a line like one of these to the
end of `{file}` and run `./pan -a -m1000000` instead:

```
ltl never_both {{ [] !({example}) }}
ltl comes_back {{ [] <> ({example}) }}
```

| in the model | here |
|---|---|
| component `C` is in state `s` | `in_C_s` |
| service or action `c` is in location `l` | `in_c_l` |
| variable `v` of component `C` | `v_C_v` |
| value `x` of enum `E` | `value_E_x` |

Where two of these names would be the same, the later one in the file ends in `_2`. A run that ends, since nothing can
happen any more, counts as one that stays in its last state for ever. A step of the model may be several steps of
spin, in which nothing that has a name above changes: properties must not speak of the next step (`X`).

{requirements}"""


def generate(supervisor: Supervisor, options: GenerateOptions) -> GeneratedFiles:
    """The files for a supervisor.

    Raises:
        UnsupportedModelError: The model is outside what the target handles.
    """
    system = supervisor.executable.automata
    name = supervisor.model.name if options.package is None else package_name(supervisor, options, "")
    file = f"{name}.pml"
    head = (
        f"/* The controlled system of {supervisor.model.name} ({supervisor.deployment}): "
        "everything that its supervisor allows may happen. */"
    )
    text = promela_model(system, supervisor.added)
    example = next((line.split()[1] for line in text.splitlines() if line.startswith("#define in_")), "true")
    requirements = requirements_chapter(supervisor.model)
    readme = _README.format(name=supervisor.model.name, file=file, example=example, requirements=requirements)
    return GeneratedFiles({file: f"{head}\n\n{text}", "README.md": f"{readme.rstrip()}\n"})
