"""Access control of RoboSC's services: TLS, client certificates, bearer tokens with scopes.

A service that other machines can reach needs TLS, unless insecure connections are allowed. Tokens have 256 random
bits; a token file has their SHA-256 digests, so that it reveals no token. Without tokens and client certificates,
methods that change something are only for callers on the same machine.
"""

from robosc_api.security.addresses import is_loopback_host, is_loopback_peer, joined
from robosc_api.security.arguments import (
    add_client_arguments,
    add_token_arguments,
    credentials_of,
    issue_token,
)
from robosc_api.security.callers import caller_of, is_admin, network_of, token_name, token_or_host_of
from robosc_api.security.client import Credentials, check_credentials, close_channel, open_async_channel, open_channel
from robosc_api.security.errors import SecurityError
from robosc_api.security.guard import Guard, Rule
from robosc_api.security.listening import ServerSecurity, add_port, check_files, check_listening
from robosc_api.security.token_commands import add_tokens_arguments, run_tokens
from robosc_api.security.tokens import Entry, Quota, Scope, TokenFile, make_token, missing_scope

__all__ = [
    "Credentials",
    "Entry",
    "Guard",
    "Quota",
    "Rule",
    "Scope",
    "SecurityError",
    "ServerSecurity",
    "TokenFile",
    "add_client_arguments",
    "add_port",
    "add_token_arguments",
    "add_tokens_arguments",
    "caller_of",
    "check_credentials",
    "check_files",
    "check_listening",
    "close_channel",
    "credentials_of",
    "is_admin",
    "is_loopback_host",
    "is_loopback_peer",
    "issue_token",
    "joined",
    "make_token",
    "missing_scope",
    "network_of",
    "open_async_channel",
    "open_channel",
    "run_tokens",
    "token_name",
    "token_or_host_of",
]
