import pytest

from robosc.errors import UnsupportedModelError
from robosc.targets.code.nesting import shallow


@pytest.mark.parametrize("text", ["(" * 300 + "1" + ")" * 300, "a and (" * 300 + "1" + ")" * 300, "-" * 5000 + "1"])
def test_an_expression_that_python_cannot_parse_is_nested_too_deeply(text: str) -> None:
    with pytest.raises(UnsupportedModelError, match="m has an expression that is nested"), shallow("m", "Python"):
        compile(text, "supervisor.py", "eval")


def test_a_lack_of_memory_is_not_the_models_fault() -> None:
    with pytest.raises(MemoryError), shallow("m", "Python"):
        bytearray(2**62)
