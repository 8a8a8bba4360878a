"""Profiles of servers in the file `client.toml` of the user's configuration folder.

The user may edit the file; comments are preserved. Tokens are stored in separate private files.

    default = "lab"

    [profiles.lab]
    server = "lab.example:50051"
    ca = "/home/me/lab-ca.pem"
    token_file = "/home/me/.config/robosc/tokens/lab"
"""

import contextlib
import os
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robosc.cli.output import UsageError
from robosc_api.security.addresses import SYNTHESIS_PORT, with_port

if TYPE_CHECKING:
    from tomlkit import TOMLDocument

MAXIMUM_BYTES = 64 * 1024
"""Maximum size of the file, in bytes."""

MAXIMUM_TOKEN_BYTES = 4096

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}\Z")
_PATHS = ("ca", "certificate", "key", "token_file")


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """Address and credentials of a server.

    Attributes:
        server: HOST:PORT.
        tls: True to use TLS with the usual certificate authorities; a CA or certificate implies TLS.
        ca: Authorities (PEM) that are trusted instead.
        certificate: Own certificate chain (PEM).
        key: Private key of the certificate.
        token_file: File with a token.
    """

    server: str
    tls: bool = False
    ca: Path | None = None
    certificate: Path | None = None
    key: Path | None = None
    token_file: Path | None = None

    def document(self) -> dict[str, Any]:
        """Return the values for the file, without unset ones."""
        paths = {name: str(getattr(self, name)) for name in _PATHS if getattr(self, name) is not None}
        return {"server": self.server, **({"tls": True} if self.tls else {}), **paths}


@dataclass(frozen=True, slots=True)
class Profiles:
    """All profiles of a user.

    Attributes:
        default: Name of the default profile; None: there is none.
        by_name: The profiles, in the order of the file.
    """

    default: str | None
    by_name: dict[str, Profile]


def _settings_folder() -> Path:
    """Return the configuration folder (XDG Base Directory Specification 0.8: relative paths are ignored)."""
    chosen = Path(os.environ.get("XDG_CONFIG_HOME", ""))
    try:
        return (chosen if chosen.is_absolute() else Path.home() / ".config") / "robosc"
    except RuntimeError as error:
        raise UsageError("the user has no home folder for profiles: use --server") from error


def profiles_file() -> Path:
    """Return the path of the file with the profiles."""
    return _settings_folder() / "client.toml"


def read_profiles() -> Profiles:
    """Return the user's profiles; none if there is no file.

    Raises:
        UsageError: The file cannot be read, or has an invalid profile.
    """
    file = profiles_file()
    text = _text(file)
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        # ValueError also covers numbers that are too long.
        raise UsageError(f"{file}: {error}") from error
    found = document.pop("profiles", {})
    default = document.pop("default", None)
    if document or not isinstance(found, dict) or not (default is None or isinstance(default, str)):
        raise UsageError(f"{file}: the file may contain only 'default' (a name) and tables [profiles.NAME]")
    by_name = {name: _profile(file, name, entry) for name, entry in found.items()}
    if default is not None and default not in by_name:
        raise UsageError(f"{file}: the default {default!r} is not one of its profiles ({_names(by_name)})")
    return Profiles(default, by_name)


def add_profile(name: str, profile: Profile, *, token: str | None = None, is_default: bool, replaces: bool) -> None:
    """Write a profile.

    Args:
        name: Name of the profile.
        profile: Content of the profile.
        token: Token to store in a separate file; None: none.
        is_default: True to make it the default profile; the first one always is.
        replaces: True to replace an existing profile of that name.

    Raises:
        UsageError: The name is invalid or exists already; or a file cannot be written.
    """
    if not _NAME.match(name):
        raise UsageError(f"invalid profile name {name!r}: use at most 64 letters, digits, '.', '-' and '_'")
    known = read_profiles()
    if name in known.by_name and not replaces:
        raise UsageError(f"the profile {name!r} exists already: use --force to replace it")
    entry = profile.document()
    for key in _PATHS:
        if not _is_unicode(str(entry.get(key, ""))):
            raise UsageError(f"the path for {key!r} cannot be stored in {profiles_file()}: it is not UTF-8")
    if token is not None:
        entry["token_file"] = str(_token_file(name))
        _write(_token_file(name), f"{token}\n")
    document = _document()
    document.setdefault("profiles", {})[name] = entry
    if is_default or known.default is None:
        document["default"] = name
    _write(profiles_file(), document.as_string())


def remove_profile(name: str) -> None:
    """Remove a profile, and the token that was stored for it.

    Raises:
        UsageError: There is no profile of that name, or a file cannot be written.
    """
    known = read_profiles()
    require_profile(known, name)
    document = _document()
    document["profiles"].remove(name)
    if known.default == name:
        document.remove("default")
    _write(profiles_file(), document.as_string())
    try:
        _token_file(name).unlink(missing_ok=True)
    except OSError as error:
        raise UsageError(f"cannot remove {_token_file(name)}: {error.strerror}") from error


def require_profile(known: Profiles, name: str) -> Profile:
    """Return the profile of a name.

    Raises:
        UsageError: There is no such profile.
    """
    if name not in known.by_name:
        raise UsageError(f"there is no profile {name!r} ({_names(known.by_name)}): see robosc-client profile --help")
    return known.by_name[name]


def _names(by_name: Mapping[str, Profile]) -> str:
    return f"there are {', '.join(by_name) or 'none'}"


def _profile(file: Path, name: str, entry: Any) -> Profile:
    def refused(why: str) -> UsageError:
        return UsageError(f"{file}: profile {name!r}: {why}")

    if not _NAME.match(name):
        raise refused("its name must have at most 64 letters, digits, '.', '-' and '_'")
    if not isinstance(entry, dict) or not isinstance(entry.get("server"), str):
        raise refused("'server' must be HOST or HOST:PORT")
    try:
        server = with_port(entry["server"], SYNTHESIS_PORT)
    except ValueError as error:
        raise refused("'server' must be HOST or HOST:PORT") from error
    if not isinstance(entry.get("tls", False), bool):
        raise refused("'tls' must be true or false")
    for key, value in entry.items():
        if key not in ("server", "tls", *_PATHS):
            raise refused(f"unknown key {key!r}")
        if key in _PATHS and (not isinstance(value, str) or not value or "\0" in value):
            raise refused(f"{key!r} must be a file path")
    # Paths are relative to the file, not to the working directory.
    try:
        paths = {key: file.parent / Path(entry[key]).expanduser() for key in _PATHS if key in entry}
    except RuntimeError as error:
        raise refused("a path begins with '~' and the name of an unknown user") from error
    return Profile(server=server, tls=entry.get("tls", False), **paths)


def _is_unicode(text: str) -> bool:
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


def _token_file(name: str) -> Path:
    return _settings_folder() / "tokens" / name


def _document() -> "TOMLDocument":
    """Return the file as it stands, for changing it; it was read before."""
    import tomlkit

    return tomlkit.parse(_text(profiles_file()))


def _text(file: Path) -> str:
    try:
        with file.open("rb") as stream:
            content = stream.read(MAXIMUM_BYTES + 1)
    except FileNotFoundError:
        return ""
    except OSError as error:
        raise UsageError(f"cannot read {file}: {error.strerror or error}") from error
    if len(content) > MAXIMUM_BYTES:
        raise UsageError(f"{file}: the file is larger than {MAXIMUM_BYTES} bytes")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise UsageError(f"{file}: the file is not UTF-8") from error


def _write(file: Path, text: str) -> None:
    """Write a private file atomically."""
    temporary = file.with_name(f".{file.name}.{os.getpid()}")
    try:
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with os.fdopen(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as out:
            out.write(text)
        temporary.replace(file)
    except BaseException as error:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        if not isinstance(error, OSError):
            raise
        raise UsageError(f"cannot write {file}: {error.strerror or error}") from error
