"""Authorization of calls before the service handles them."""

import logging
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import grpc

from robosc_api.failures import failure_metadata
from robosc_api.layers import Layer, behaviour_of, with_behaviour, writing
from robosc_api.security.addresses import is_loopback_peer
from robosc_api.security.callers import CALLER, ENTRY
from robosc_api.security.forwarded import forwarded_entry
from robosc_api.security.host_sample import HostSample
from robosc_api.security.tokens import Entry, Scope, TokenFile

_log = logging.getLogger(__name__)

_HEALTH = "/grpc.health.v1.Health/"
_NO_TOKEN = grpc.StatusCode.UNAUTHENTICATED, "a valid token is needed"
_SCHEME = "bearer "


@dataclass(frozen=True, slots=True)
class Rule:
    """Rule for who may call a method.

    Attributes:
        scopes: Scopes of which a token needs one; empty: any token.
        is_open: True to admit callers from other machines if neither tokens nor client certificates are required.
    """

    scopes: frozenset[Scope] = frozenset()
    is_open: bool = True


class Guard(Layer):
    """Layer that authorizes each call by its token or its origin. Health checks need no token.

    Args:
        rules: Rules by full name of a method (`/package.Service/Method`); other methods need any token.
        tokens: Token file; None: no tokens are required.
        has_client_certificates: True if the service requires client certificates.
        is_forwarded: True if a trusted proxy tells the name and scopes of callers.
    """

    def __init__(
        self,
        rules: Mapping[str, Rule],
        tokens: TokenFile | None,
        *,
        has_client_certificates: bool = False,
        is_forwarded: bool = False,
    ) -> None:
        super().__init__()
        self._rules = rules
        self._has_client_certificates = has_client_certificates
        # None: callers need not be known.
        self._find: Callable[[Any], Entry | None] | None = None
        if is_forwarded:
            self._find = forwarded_entry
        elif tokens is not None:
            self._find = partial(_entry_of_token, tokens)
        self._sample = HostSample()

    def handler(self, inner: Any, details: Any) -> Any:
        """Return the handler of a call, after authorization."""
        method: str = details.method
        if inner is None or method.startswith(_HEALTH):
            return inner
        if self._find is not None and self._find(details.invocation_metadata) is None:
            # Refuse at once: a handler of unary requests would wait for a request that may never arrive, and count as
            # an open call.
            return grpc.stream_stream_rpc_method_handler(self._refuse(method))
        return super().handler(inner, details)

    def _refuse(self, method: str) -> Any:
        async def refuse(requests: Any, context: Any) -> None:
            refusal = self._refusal(Rule(), method, context.invocation_metadata(), context.peer())
            # A token that has become valid meanwhile is refused once.
            code, message = refusal or _NO_TOKEN
            await context.abort(code, message, failure_metadata(code, message, code.name, context=context))

        return refuse

    def wrap(self, inner: Any, method: str) -> Any:
        """Wrap a handler in the authorization of its caller."""
        rule = self._rules.get(method, Rule())
        if self._find is None and (rule.is_open or self._has_client_certificates):
            return inner

        async def admit(context: Any) -> None:
            refusal = self._refusal(rule, method, context.invocation_metadata(), context.peer())
            if refusal is not None:
                code, message = refusal
                await context.abort(code, message, failure_metadata(code, message, code.name, context=context))

        answer = behaviour_of(inner)
        return with_behaviour(inner, _guarded(writing(answer) if inner.response_streaming else answer, admit))

    def _refusal(self, rule: Rule, method: str, metadata: Any, peer: str) -> tuple[grpc.StatusCode, str] | None:
        """Return the reason why a call is not admitted; None: it is."""
        if self._find is None:
            if rule.is_open or self._has_client_certificates or is_loopback_peer(peer):
                return None
            return (
                grpc.StatusCode.PERMISSION_DENIED,
                "without tokens, only callers on the same machine may call this method",
            )
        entry = self._find(metadata)
        if entry is None:
            self._log_refusal(peer, f"no valid token for {method}")
            return _NO_TOKEN
        if rule.scopes and not rule.scopes & entry.scopes:
            self._log_refusal(peer, f"the token '{entry.name}' is not for {method}")
            wanted = " or ".join(f"'{scope}'" for scope in sorted(rule.scopes))
            return grpc.StatusCode.PERMISSION_DENIED, f"the token's scope does not include {wanted}"
        CALLER.set(entry.name)
        ENTRY.set(entry)
        return None

    def _log_refusal(self, peer: str, message: str) -> None:
        """Log a refusal, unless one of the same host was logged just now."""
        skipped = self._sample.take(peer)
        if skipped is not None:
            more = f" (and {skipped} more refusals of this host before)" if skipped else ""
            _log.warning("%s: %s%s", peer, message, more)


def _entry_of_token(tokens: TokenFile, metadata: Any) -> Entry | None:
    """Return the entry of the token of a call; None: there is none that is valid."""
    given = [value for key, value in metadata or () if key.lower() == "authorization"]
    # Several tokens are refused: a proxy may have added one of them.
    if len(given) != 1 or not isinstance(given[0], str) or not given[0].lower().startswith(_SCHEME):
        return None
    return tokens.find(given[0][len(_SCHEME) :].strip())


def _guarded(answer: Any, admit: Callable[[Any], Awaitable[None]]) -> Any:
    async def guarded(request: Any, context: Any) -> Any:
        await admit(context)
        return await answer(request, context)

    return guarded
