"""Source of the supervisor, and the reason why it is trusted.

The supervisor is synthesized on this machine, or it is foreign: a file, or the answer of a synthesis server. A foreign
supervisor is untrusted input, whatever digest it carries: it is validated, and executed only if a trusted key of this
bridge has signed the file, or else if the independent verifier passes it against the texts of the model. The last
supervisor that a server made for the same texts is kept, so that the robot can start without a network; it is checked
again like any other file. No supervisor is executed if its silent steps never end, unless the user allows that.
"""

import contextlib
import logging
import os
import tempfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from robosc.certification import make_supervisor
from robosc.certification.supervisor_file import verify_supervisor_file
from robosc.controller_properties import check_controller
from robosc.errors import Diagnostic, LanguageError, RoboscError, Severity
from robosc.language import load_bundle
from robosc.model.layers import confusable
from robosc.model.structure import CommunicationKind, Deployment
from robosc.signatures import (
    MAXIMUM_KEY_BYTES,
    MAXIMUM_SIGNATURE_BYTES,
    PublicKey,
    UnknownSignerError,
    read_public_keys,
    signature_file,
    signer,
)
from robosc.source import Bundle
from robosc.supervisor import ControllerProperties, Supervisor, decode
from robosc.supervisor.codec import MAXIMUM_BYTES
from robosc.verification import DEFAULT_STATES, Limits
from robosc_api.security import Credentials
from robosc_bridge.configuration.structure import SupervisorSource
from robosc_bridge.errors import BridgeError

MODEL_SUFFIX, SUPERVISOR_SUFFIX = ".rscd", ".rsup"
_SERVER_LIMIT_S = 120.0

_log = logging.getLogger(__name__)


class NoSupervisorError(BridgeError):
    """No trusted supervisor was found; the message says why."""


@dataclass(frozen=True)
class Source:
    """Source of the supervisor to execute.

    Attributes:
        file: The model (`.rscd`), or a supervisor (`.rsup`) with its signature or the text of its model beside it.
        deployment: Deployment of the supervisor.
        server: HOST:PORT of the synthesis server that makes the supervisor; None: it is made on this machine.
        cache: Folder for the last supervisors of a server; None: none is kept.
        trusted: Keys whose signatures of supervisor files are trusted.
        credentials: Credentials for reaching the server; None: without TLS, certificate and token.
        allow_livelock: True if silent steps may go on forever.
    """

    file: Path
    deployment: Deployment
    server: str | None = None
    cache: Path | None = None
    trusted: tuple[PublicKey, ...] = ()
    credentials: Credentials | None = None
    allow_livelock: bool = False


def trusted_keys(entries: Iterable[str]) -> tuple[PublicKey, ...]:
    """The public keys of a configuration.

    Args:
        entries: Each a key as `robosc key` writes it, or a file with such lines.

    Raises:
        NoSupervisorError: An entry is neither.
    """
    found: list[PublicKey] = []
    for entry in entries:
        try:
            text = entry
            if not entry.startswith("ssh-"):
                text = _bytes(Path(entry), MAXIMUM_KEY_BYTES, "keys").decode("utf-8", "replace")
            found += read_public_keys(text, "supervisor.trusted_keys" if text is entry else entry)
        except RoboscError as error:
            raise NoSupervisorError(str(error)) from error
    return tuple(found)


def credentials_of(chosen: SupervisorSource) -> Credentials:
    """Return the credentials of a configuration for the synthesis server."""
    return Credentials(
        ca=_path(chosen.ca),
        certificate=_path(chosen.certificate),
        key=_path(chosen.key),
        token_file=_path(chosen.token_file),
    )


def cache_folder(argument: Path | None, chosen: SupervisorSource) -> Path | None:
    """Return the folder for the last supervisors of a server.

    The command line gives it, else the configuration, else it is below the home folder.
    """
    folder = argument or _path(chosen.keep) or state_folder()
    if folder is None:
        _log.warning("$HOME is not set; supervisors of a synthesis server are not cached for a start without network")
    return folder


def _path(text: str | None) -> Path | None:
    return None if text is None else Path(text)


def obtain(source: Source, report: Callable[[str], None] = lambda text: None) -> Supervisor:
    """Return the supervisor, verified or signed.

    Args:
        source: Source of the supervisor.
        report: Function that takes messages about where the work is and what is worth knowing, one line each.

    Raises:
        NoSupervisorError: There is none that can be trusted, or its silent steps never end.
    """
    if source.file.suffix == SUPERVISOR_SUFFIX:
        return _read(source, report)
    if source.file.suffix != MODEL_SUFFIX:
        raise NoSupervisorError(
            f"{source.file}: neither a model ({MODEL_SUFFIX}) nor a supervisor ({SUPERVISOR_SUFFIX})"
        )
    bundle = _bundle(source.file)
    if source.server is None:
        return _made(bundle, source, report)
    return _served(bundle, source.server, source, report)


def deployment_of(file: Path) -> Deployment:
    """Return the deployment that the supervisor in a file was made for.

    A model may have any deployment, and is taken for a controller.

    Raises:
        NoSupervisorError: A supervisor's file cannot be read.
    """
    if file.suffix != SUPERVISOR_SUFFIX:
        return Deployment.CONTROLLER
    try:
        return decode(_bytes(file)).deployment
    except RoboscError as error:
        raise NoSupervisorError(f"{file}: {error}") from error


def _read(source: Source, report: Callable[[str], None]) -> Supervisor:
    """The supervisor of a file, by its signature or by its model."""
    file, data = source.file, _bytes(source.file)
    model = file.with_suffix(MODEL_SUFFIX)
    bundle = _bundle(model) if model.is_file() else None
    key = _signer(file, data, source.trusted, report)
    if key is not None:
        report(f"{file}: signed by {key}")
        return _signed(file, data, bundle, source, report)
    if bundle is None:
        reason = "is not signed by a trusted key, and the" if source.trusted else "the"
        raise NoSupervisorError(f"{file}: {reason} model that it is checked against is missing: no {model}")
    return _checked(data, str(file), bundle, source, report)


def _signer(file: Path, data: bytes, trusted: tuple[PublicKey, ...], report: Callable[[str], None]) -> PublicKey | None:
    """The trusted key that has signed a file; None: none has, so that the verifier decides.

    Raises:
        NoSupervisorError: The signature does not fit the file: one of them was changed.
    """
    place = signature_file(file)
    if not trusted or not place.exists():
        return None
    try:
        return signer(data, _bytes(place, MAXIMUM_SIGNATURE_BYTES, "a signature"), trusted)
    except UnknownSignerError as error:
        report(f"{file}: {error}: it is verified instead")
        return None
    except RoboscError as error:
        raise NoSupervisorError(f"{place}: {error}") from error


def _signed(
    file: Path, data: bytes, bundle: Bundle | None, source: Source, report: Callable[[str], None]
) -> Supervisor:
    """A supervisor that its signer vouches for: its purpose, and the findings about it, stand in it."""
    try:
        supervisor = decode(data)
    except RoboscError as error:
        raise NoSupervisorError(f"{file}: {error}") from error
    _require_deployment(supervisor, source.deployment, str(file))
    if bundle is not None and supervisor.certificate.bundle_sha256 != bundle.digest:
        raise NoSupervisorError(f"{file}: it is signed, but was made of other texts than {bundle.main.name} beside it")
    claimed = supervisor.certificate.controller
    if claimed is None or _may_hide_cancels(supervisor, claimed):
        claimed = _controller_properties(supervisor, str(file))
    _require_controller(claimed, str(file), source, report)
    return supervisor


def _require_deployment(supervisor: Supervisor, deployment: Deployment, place: str) -> None:
    """Check that a supervisor fits the deployment.

    Without actions both deployments have the same supervisors, except that a layer must be able to tell messages apart.
    """
    if supervisor.deployment is deployment:
        return
    model = supervisor.model
    if any(item.kind is CommunicationKind.ACTION for item in model.communications):
        raise NoSupervisorError(
            f"{place}: made for the deployment {supervisor.deployment}, not {deployment}, and its model has actions"
        )
    if deployment is Deployment.LAYER:
        for item, other in confusable(model):
            raise NoSupervisorError(
                f"{place}: made for the deployment controller; as a layer it could not determine whether a request on "
                f"'{item.identifier}' is '{item.name}' or '{other.name}'"
            )


def _may_hide_cancels(supervisor: Supervisor, claimed: ControllerProperties) -> bool:
    """Return True if nothing is claimed about cancels, as in older files, and an executor may ask for some."""
    model = supervisor.model
    return (
        claimed.cancels is None
        and supervisor.deployment is Deployment.CONTROLLER
        and any(
            item.kind is CommunicationKind.ACTION and model.requirements_on(item.name) for item in model.communications
        )
    )


def _controller_properties(supervisor: Supervisor, place: str) -> ControllerProperties:
    """Check here whether silent steps end and cancels are possible, and return the results."""
    certificate = supervisor.certificate
    try:
        found = check_controller(
            supervisor.executable,
            supervisor.added,
            is_nonblocking=certificate.nonblocking == "passed",
            states=int(certificate.states),
        )
    except RoboscError as error:
        raise NoSupervisorError(f"{place}: {error}") from error
    return found.certified()


def _require_controller(found: ControllerProperties, place: str, source: Source, report: Callable[[str], None]) -> None:
    """Refuse a supervisor that forbids a cancel which must be possible, or whose silent steps never end.

    Such steps stop the executor with a fault in the middle of its work.
    """
    if found.cancels == "failed":
        raise NoSupervisorError(
            f"{place}: not executed, because it forbids a cancel that must be possible; 'robosc check --synthesize' of "
            "its model says which"
        )
    if found.finite_response == "failed":
        if not source.allow_livelock:
            raise NoSupervisorError(
                f"{place}: not executed, because its silent steps never end (--allow-livelock overrides this)"
            )
        report(f"{place}: its silent steps may go on for ever; it stops with a fault then")


def _bundle(model: Path) -> Bundle:
    try:
        return load_bundle(model)
    except LanguageError as error:
        raise NoSupervisorError(str(error.diagnostics[0])) from error
    except (OSError, UnicodeError) as error:
        raise NoSupervisorError(f"{model}: {error}") from error


def _bytes(file: Path, most: int = MAXIMUM_BYTES, what: str = "a supervisor") -> bytes:
    try:
        with file.open("rb") as stream:
            data = stream.read(most + 1)
    except OSError as error:
        raise NoSupervisorError(f"{file}: {error.strerror or error}") from error
    if len(data) > most:
        raise NoSupervisorError(f"{file}: more bytes than {what} may have ({most})")
    return data


def _made(bundle: Bundle, source: Source, report: Callable[[str], None]) -> Supervisor:
    report(f"{bundle.main.name}: synthesis")
    try:
        made = make_supervisor(bundle, deployment=source.deployment, allow_livelock=source.allow_livelock)
    except RoboscError as error:
        raise NoSupervisorError(f"{bundle.main.name}: {error}") from error
    if made.supervisor is None:
        raise NoSupervisorError(_why_none(made.reason, made.diagnostics))
    found = made.supervisor.certificate.controller
    if found is not None:
        _require_controller(found, bundle.main.name, source, report)
    return made.supervisor


def _why_none(reason: str, diagnostics: Iterable[Diagnostic]) -> str:
    """Return why there is no supervisor, with the first error in the text of the model."""
    error = next((str(item) for item in diagnostics if item.severity is Severity.ERROR), "")
    return ": ".join(part for part in (reason, error) if part)


def _checked(data: bytes, place: str, bundle: Bundle, source: Source, report: Callable[[str], None]) -> Supervisor:
    """A foreign supervisor, if it is right."""
    report(f"{place}: verification against {bundle.main.name}")
    try:
        supervisor = decode(data)
        _require_deployment(supervisor, source.deployment, place)
        found = verify_supervisor_file(supervisor, bundle, Limits.of(DEFAULT_STATES), deployment=source.deployment)
    except RoboscError as error:
        raise NoSupervisorError(f"{place}: {error}") from error
    if found.diagnostics:
        raise NoSupervisorError(str(found.diagnostics[0]))
    if not found.has_passed:
        why = found.faults[0].message if found.faults else f"not checked: {', '.join(found.unchecked())}"
        raise NoSupervisorError(f"{place}: not a supervisor of {bundle.main.name} that can be trusted: {why}")
    claimed = supervisor.certificate.controller
    if (
        claimed is None
        or "not checked" in (claimed.finite_response, claimed.cancels)
        or _may_hide_cancels(supervisor, claimed)
    ):
        # The verifier has judged the claim of a file; a file without a claim must not pass unchecked.
        claimed = _controller_properties(supervisor, place)
    _require_controller(claimed, place, source, report)
    return supervisor


def _served(bundle: Bundle, server: str, source: Source, report: Callable[[str], None]) -> Supervisor:
    """Return the supervisor that the server makes, or else the one that it made last."""
    from robosc_client import Client, ClientError, ServerUnavailableError, SynthesisOptions, SynthesisStatus

    cache = source.cache / f"{bundle.digest}-{source.deployment}{SUPERVISOR_SUFFIX}" if source.cache else None
    report(f"{bundle.main.name}: synthesis at {server}")
    try:
        with Client(server, source.credentials) as client:
            options = SynthesisOptions(deployment=source.deployment, allow_livelock=source.allow_livelock)
            answer = client.synthesize(bundle, options, deadline_s=_SERVER_LIMIT_S)
    except (ServerUnavailableError, TimeoutError) as error:
        if cache is None or not is_cached(cache):
            raise NoSupervisorError(f"{error}, and none is kept of an earlier start") from error
        report(f"{error}: what it made last is taken")
        return _checked(_bytes(cache), str(cache), bundle, source, report)
    except ClientError as error:
        raise NoSupervisorError(str(error)) from error
    if answer.status is not SynthesisStatus.SUPERVISOR:
        raise NoSupervisorError(f"{server}: {_why_none(answer.reason, answer.diagnostics)}")
    supervisor = _checked(answer.supervisor, server, bundle, source, report)
    if cache is not None:
        store(cache, answer.supervisor)
    return supervisor


_log = logging.getLogger(__name__)

_FOLDER = "robosc-bridge"


def state_folder(environment: Mapping[str, str] = os.environ) -> Path | None:
    """Return the user's folder for files that are kept from one run to the next; None: there is no home folder.

    Source: XDG Base Directory Specification 0.8, which also says that a path that is not absolute is ignored.
    """
    chosen = Path(environment.get("XDG_STATE_HOME", ""))
    if chosen.is_absolute():
        return chosen / _FOLDER
    try:
        return Path.home() / ".local" / "state" / _FOLDER
    except RuntimeError:
        return None


def is_cached(file: Path) -> bool:
    """Return True if there is such a file that this user can see."""
    try:
        return file.is_file()
    except OSError:
        return False


def store(file: Path, data: bytes) -> None:
    """Replace a file in one step, or log a warning that it cannot be replaced: the start does not depend on it.

    Whoever reads it finds the old or the new one, also after a power cut.
    """
    try:
        _replace(file, data)
    except OSError as error:
        _log.warning("%s: cannot be kept for a start without network: %s", file, error.strerror or error)


def _replace(file: Path, data: bytes) -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    number, name = tempfile.mkstemp(dir=file.parent, prefix=".", suffix=file.suffix)
    try:
        with os.fdopen(number, "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        Path(name).replace(file)
        folder = os.open(file.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
    except BaseException:
        with contextlib.suppress(OSError):
            Path(name).unlink()
        raise
