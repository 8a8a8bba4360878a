"""Methods of a client out of the functions that describe them."""

import inspect
from collections.abc import Callable
from typing import Any, get_args


def described[Method: Callable[..., Any]](
    method: Method, description: Callable[..., Any], of: str, returns: Any = None
) -> Method:
    """Return a method that is called and documented as the function that describes it.

    Args:
        method: The method.
        description: The function that describes it, but for `self`.
        of: Name of the client's class.
        returns: Type that the method returns; None: the result type of the operation that the function returns.
    """
    signature = inspect.signature(description)
    own = inspect.Parameter("self", inspect.Parameter.POSITIONAL_ONLY)
    result = get_args(signature.return_annotation)[0] if returns is None else returns
    documented: Any = method
    documented.__name__ = description.__name__.removesuffix("_")
    documented.__qualname__ = f"{of}.{documented.__name__}"
    documented.__doc__ = description.__doc__
    documented.__signature__ = signature.replace(
        parameters=[own, *signature.parameters.values()], return_annotation=result
    )
    return method
