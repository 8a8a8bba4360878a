"""Check that what the live view needs is installed."""

import importlib.util

from robosc_view.sources import ViewError


def require_view() -> None:
    """Raise where the extra `view` is missing.

    Raises:
        ViewError: It is, with what to do about it.
    """
    missing = [name for name in ("aiohttp", "igraph") if importlib.util.find_spec(name) is None]
    if missing:
        raise ViewError(f"the live view needs {' and '.join(missing)}: install robosc[view]")
