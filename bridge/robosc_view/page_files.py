"""The files of the page, read once: no other file is served, whatever a path says."""

from dataclasses import dataclass
from pathlib import Path

from robosc_view.sources import ViewError

FOLDER = Path(__file__).parent / "page"
INDEX = "index.html"
MAXIMUM_BYTES = 2 * 1024 * 1024
"""Maximum size of one file, in bytes."""

TOKEN_PLACE = '<meta name="robosc-token" content="">'
"""Place in the page where the token is put, once."""

TYPES = {
    ".html": "text/html",
    ".js": "text/javascript",
    ".css": "text/css",
    ".svg": "image/svg+xml",
}


@dataclass(frozen=True, slots=True)
class PageFiles:
    """Files of the page.

    Attributes:
        index: Text of the page, without a token.
        assets: Type and bytes of the other files, by name.
    """

    index: str
    assets: dict[str, tuple[str, bytes]]

    def with_token(self, token: str) -> str:
        """Return the page for a browser that has sent the token."""
        return self.index.replace(TOKEN_PLACE, f'<meta name="robosc-token" content="{token}">', 1)


def read_page(folder: Path = FOLDER) -> PageFiles:
    """Return the files of a folder.

    Raises:
        ViewError: A file is missing or invalid.
    """
    try:
        found = {item.name: _read(item) for item in sorted(folder.iterdir()) if item.suffix in TYPES}
    except OSError as error:
        raise ViewError(f"the files of the page cannot be read: {error}") from error
    index = found.pop(INDEX, b"").decode("utf-8", "replace")
    if TOKEN_PLACE not in index:
        raise ViewError(f"the files of the page are not whole: {folder / INDEX} has no place for the token")
    return PageFiles(index, {name: (TYPES[Path(name).suffix], data) for name, data in found.items()})


def _read(path: Path) -> bytes:
    with path.open("rb") as stream:
        data = stream.read(MAXIMUM_BYTES + 1)
    if len(data) > MAXIMUM_BYTES:
        raise ViewError(f"{path} is larger than {MAXIMUM_BYTES} bytes")
    return data
