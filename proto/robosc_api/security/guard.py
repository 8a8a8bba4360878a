"""Whether a caller may do what it asks for, before the service sees it."""

import logging
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Any

import grpc
import grpc.aio

from robosc_api.failures import failure_metadata
from robosc_api.security.addresses import is_loopback_peer
from robosc_api.security.callers import CALLER, ENTRY
from robosc_api.security.tokens import Entry, Scope, TokenFile
from robosc_api.streams import write_responses

_log = logging.getLogger(__name__)

_HEALTH = "/grpc.health.v1.Health/"
_NO_TOKEN = grpc.StatusCode.UNAUTHENTICATED, "a valid token is needed"
_SCHEME = "bearer "


@dataclass(frozen=True, slots=True)
class Rule:
    """Who may call a method.

    Attributes:
        scopes: A token with one of them may; empty: any token.
        is_open: Whether callers from other machines may, too, where neither tokens nor client certificates are asked
            for.
    """

    scopes: frozenset[Scope] = frozenset()
    is_open: bool = True


class Guard(grpc.aio.ServerInterceptor):
    """Looks at the token of each call, or at where it comes from. Health checks need none.

    Args:
        rules: By full name of a method (`/package.Service/Method`); what is not named may be called with any token.
        tokens: None: callers need none.
        has_client_certificates: Whether callers have shown certificates that were asked for.
    """

    def __init__(
        self, rules: Mapping[str, Rule], tokens: TokenFile | None, *, has_client_certificates: bool = False
    ) -> None:
        self._rules = rules
        self._tokens = tokens
        self._has_client_certificates = has_client_certificates
        # By method: the handler that was there, and the one behind a look at the caller, made once, not for each call.
        self._made: dict[str, tuple[Any, Any]] = {}

    async def intercept_service(self, continuation: Callable[[Any], Awaitable[Any]], handler_call_details: Any) -> Any:
        """The method's handler, behind a look at the caller."""
        handler = await continuation(handler_call_details)
        method: str = handler_call_details.method
        if handler is None or method.startswith(_HEALTH):
            return handler
        if self._tokens is not None and self._entry(self._tokens, handler_call_details.invocation_metadata) is None:
            # Whoever shows none is told so at once: a handler of single requests would wait for one that never comes,
            # and hold one of the calls that a server can have.
            return grpc.stream_stream_rpc_method_handler(self._refuse(method))
        made = self._made.get(method)
        if made is None or made[0] is not handler:
            made = self._made[method] = handler, self._behind(handler, method)
        return made[1]

    def _refuse(self, method: str) -> Any:
        async def refuse(requests: Any, context: Any) -> None:
            refusal = self._refusal(Rule(), method, context.invocation_metadata(), context.peer())
            # One that has become valid in between is shown again.
            code, message = refusal or _NO_TOKEN
            await context.abort(code, message, failure_metadata(code, message, code.name, context=context))

        return refuse

    def _behind(self, handler: Any, method: str) -> Any:
        """A handler that does nothing before the caller is admitted."""
        rule = self._rules.get(method, Rule())
        if self._tokens is None and (rule.is_open or self._has_client_certificates):
            return handler

        async def admit(context: Any) -> None:
            refusal = self._refusal(rule, method, context.invocation_metadata(), context.peer())
            if refusal is not None:
                code, message = refusal
                await context.abort(code, message, failure_metadata(code, message, code.name, context=context))

        wrap = {
            (False, False): (grpc.unary_unary_rpc_method_handler, _answer),
            (False, True): (grpc.unary_stream_rpc_method_handler, _stream),
            (True, False): (grpc.stream_unary_rpc_method_handler, _answer),
            (True, True): (grpc.stream_stream_rpc_method_handler, _stream),
        }
        make, guarded = wrap[handler.request_streaming, handler.response_streaming]
        inner = handler.unary_unary or handler.unary_stream or handler.stream_unary or handler.stream_stream
        return make(guarded(inner, admit), handler.request_deserializer, handler.response_serializer)

    def _refusal(self, rule: Rule, method: str, metadata: Any, peer: str) -> tuple[grpc.StatusCode, str] | None:
        """Why a call is not admitted; None: it is."""
        if self._tokens is None:
            if rule.is_open or self._has_client_certificates or is_loopback_peer(peer):
                return None
            return (
                grpc.StatusCode.PERMISSION_DENIED,
                "without tokens this is for callers on the same machine alone",
            )
        entry = self._entry(self._tokens, metadata)
        if entry is None:
            _log.warning("%s: no valid token for %s", peer, method)
            return _NO_TOKEN
        if rule.scopes and not rule.scopes & entry.scopes:
            _log.warning("%s: the token '%s' is not for %s", peer, entry.name, method)
            wanted = " or ".join(f"'{scope}'" for scope in sorted(rule.scopes))
            return grpc.StatusCode.PERMISSION_DENIED, f"the token's scope does not include {wanted}"
        CALLER.set(entry.name)
        ENTRY.set(entry)
        return None

    @staticmethod
    def _entry(tokens: TokenFile, metadata: Any) -> Entry | None:
        given = [value for key, value in metadata or () if key.lower() == "authorization"]
        # Two tokens are none: nobody can tell which one somebody between has added.
        if len(given) != 1 or not isinstance(given[0], str) or not given[0].lower().startswith(_SCHEME):
            return None
        return tokens.find(given[0][len(_SCHEME) :].strip())


def _answer(inner: Any, admit: Callable[[Any], Awaitable[None]]) -> Any:
    async def guarded(request: Any, context: Any) -> Any:
        await admit(context)
        return await inner(request, context)

    return guarded


def _stream(inner: Any, admit: Callable[[Any], Awaitable[None]]) -> Any:
    async def guarded(request: Any, context: Any) -> None:
        await admit(context)
        await write_responses(inner(request, context), context)

    return guarded
