"""Authorization of calls before the service handles them."""

import logging
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Any

import grpc

from robosc_api.calls import call_under_way, peer_of
from robosc_api.failures import failure_metadata
from robosc_api.layers import Layer, behaviour_of, with_behaviour, writing
from robosc_api.security.addresses import is_loopback_peer
from robosc_api.security.forwarded import forwarded_entry
from robosc_api.security.host_sample import HostSample
from robosc_api.security.tokens import Entry, Scope, TokenFile, time_text

_log = logging.getLogger(__name__)

_HEALTH = "/grpc.health.v1.Health/"
_SCHEME = "bearer "


@dataclass(frozen=True, slots=True)
class _Refusal:
    """Refusal of a call; without a reason, that is the name of the code."""

    code: grpc.StatusCode
    message: str
    reason: str = ""


_NO_TOKEN = _Refusal(grpc.StatusCode.UNAUTHENTICATED, "a valid token is needed")
_ANOTHER_MACHINE = _Refusal(
    grpc.StatusCode.PERMISSION_DENIED, "without tokens, only callers on the same machine may call this method"
)


@dataclass(frozen=True, slots=True)
class Rule:
    """Rule for who may call a method.

    Attributes:
        scopes: Scopes of which a token needs one; empty: any token.
        is_open: True to admit callers from other machines if neither tokens nor client certificates are required.
        admits_expired: True to admit tokens that have expired.
    """

    scopes: frozenset[Scope] = frozenset()
    is_open: bool = True
    admits_expired: bool = False


_ANY_TOKEN = Rule()


class Guard(Layer):
    """Layer that authorizes each call by its token or its origin. Health checks need no token.

    Args:
        rules: Rules by full name of a method (`/package.Service/Method`); other methods need any token.
        tokens: Token file; None: no tokens are required.
        has_client_certificates: True if the service requires client certificates.
        is_forwarded: True if a trusted proxy sends the name and scopes of callers.
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
        self._tokens = tokens
        self._is_forwarded = is_forwarded
        self._needs_caller = is_forwarded or tokens is not None
        self._sample = HostSample()

    def handler(self, inner: Any, details: Any) -> Any:
        """Return the handler of a call, after authorization."""
        method: str = details.method
        if inner is None or method.startswith(_HEALTH):
            return inner
        if self._needs_caller:
            rule = self._rules.get(method, _ANY_TOKEN)
            entry = self._entry(rule, details.invocation_metadata)
            if entry is None or (rule.scopes and not rule.scopes & entry.scopes):
                # Refuse at once: a handler of unary requests would wait for a request that may never arrive, and count
                # as an open call.
                return grpc.stream_stream_rpc_method_handler(self._refuse(rule, method, entry))
            call = call_under_way()
            call.caller, call.entry = entry.name, entry
        return super().handler(inner, details)

    def _refuse(self, rule: Rule, method: str, entry: Entry | None) -> Any:
        async def refuse(requests: Any, context: Any) -> None:
            await _abort(context, self._refusal(rule, method, entry, context))

        return refuse

    def wrap(self, inner: Any, method: str) -> Any:
        """Wrap a handler in the authorization of its caller."""
        if self._needs_caller or self._has_client_certificates or self._rules.get(method, _ANY_TOKEN).is_open:
            return inner
        answer = behaviour_of(inner)
        return with_behaviour(inner, _for_this_machine(writing(answer) if inner.response_streaming else answer))

    def _refusal(self, rule: Rule, method: str, entry: Entry | None, context: Any) -> _Refusal:
        """Return the reason why a call is not admitted.

        Args:
            rule: Rule of the method.
            method: The method.
            entry: Entry of the caller, who is not one of the rule's; None: there is none.
            context: Context of the call.
        """
        peer = peer_of(context)
        if entry is not None:
            self._log_refusal(peer, f"the token '{entry.name}' is not for {method}")
            wanted = " or ".join(f"'{scope}'" for scope in sorted(rule.scopes))
            return _Refusal(grpc.StatusCode.PERMISSION_DENIED, f"the token's scope does not include {wanted}")
        expired = self._expired(context.invocation_metadata())
        if expired is not None and expired.expires_s is not None:
            message = f"the token has expired at {time_text(expired.expires_s)}: a new one is needed"
            return _Refusal(grpc.StatusCode.UNAUTHENTICATED, message, "TOKEN_EXPIRED")
        self._log_refusal(peer, f"no valid token for {method}")
        return _NO_TOKEN

    def _entry(self, rule: Rule, metadata: Any) -> Entry | None:
        """Return the entry of a call's caller; None: there is none whom the rule may admit."""
        if self._is_forwarded:
            return forwarded_entry(metadata)
        given = _token_of(metadata)
        if self._tokens is None or given is None:
            return None
        found = self._tokens.find(given)
        return self._tokens.find_expired(given) if found is None and rule.admits_expired else found

    def _expired(self, metadata: Any) -> Entry | None:
        given = None if self._is_forwarded else _token_of(metadata)
        return None if self._tokens is None or given is None else self._tokens.find_expired(given)

    def _log_refusal(self, peer: str, message: str) -> None:
        """Log a refusal, unless one of the same host was logged just now."""
        skipped = self._sample.take(peer)
        if skipped is not None:
            more = f" (and {skipped} more refusals of this host before)" if skipped else ""
            _log.warning("%s: %s%s", peer, message, more)


def _token_of(metadata: Any) -> str | None:
    """Return the token that a call came with; None: it came with none."""
    given = [value for key, value in metadata or () if key.lower() == "authorization"]
    # Several tokens are refused: a proxy may have added one of them.
    if len(given) != 1 or not isinstance(given[0], str) or not given[0].lower().startswith(_SCHEME):
        return None
    return given[0][len(_SCHEME) :].strip()


async def _abort(context: Any, refusal: _Refusal) -> None:
    code, message, reason = refusal.code, refusal.message, refusal.reason or refusal.code.name
    await context.abort(code, message, failure_metadata(code, message, reason))


def _for_this_machine(answer: Callable[[Any, Any], Awaitable[Any]]) -> Callable[[Any, Any], Awaitable[Any]]:
    async def guarded(request: Any, context: Any) -> Any:
        if not is_loopback_peer(peer_of(context)):
            await _abort(context, _ANOTHER_MACHINE)
        return await answer(request, context)

    return guarded
