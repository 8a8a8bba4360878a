"""Templates of generated packages: their folders, and the values that the templates of every package use."""

import json
from collections.abc import Callable, Mapping

import jinja2

from robosc._version import __version__
from robosc.supervisor import Supervisor
from robosc.targets.registry import PackageMetadata
from robosc.targets.text import printable, requirement_texts


def environment(*packages: str, filters: Mapping[str, Callable[..., object]]) -> jinja2.Environment:
    """The templates of some Python packages; of those that have one name, the first package's."""
    found = jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.PackageLoader(package) for package in packages]),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        # Escapes what goes into XML; every other value is escaped by a filter or is a checked name.
        autoescape=jinja2.select_autoescape(enabled_extensions=("xml.j2", "launch.j2")),
    )
    shared: dict[str, Callable[..., object]] = {
        "json": json.dumps,
        "printable": printable,
        "quality": lambda quality: f"{quality[0].replace('_', ' ')}, depth {quality[1]}",
        "split_lines": str.splitlines,
    }
    found.filters.update(shared, **filters)
    return found


def shared_values(supervisor: Supervisor, package: str, metadata: PackageMetadata) -> dict[str, object]:
    """Return the values about a supervisor that the templates of every package refer to."""
    return {
        "version": __version__,
        "model": supervisor.model.name,
        "package": package,
        "metadata": metadata,
        "package_version": metadata.version or __version__,
        "digest": supervisor.certificate.bundle_sha256,
        "certificate": {
            field: printable(str(getattr(supervisor.certificate, field)))
            for field in ("safe", "controllable", "nonblocking", "maximally_permissive", "method", "states")
        },
        "has_strategy": supervisor.strategy is not None,
        "requirements": [printable(text) for text in requirement_texts(supervisor.model)],
    }
