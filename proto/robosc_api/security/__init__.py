"""Access to a service of RoboSC, the same for each: TLS, client certificates, bearer tokens with scopes.

A service listens beyond this machine with TLS only, unless it is told otherwise. Tokens are random texts of 256 bits;
a
file holds their SHA-256 digests, so that who reads it learns none. Without tokens and client certificates, whatever
changes something is for callers on this machine alone.
"""

from robosc_api.security.addresses import is_loopback_host, is_loopback_peer, joined
from robosc_api.security.arguments import (
    add_client_arguments,
    add_server_arguments,
    add_token_arguments,
    credentials_of,
    issue_token,
    server_security_of,
)
from robosc_api.security.callers import CALLER, ENTRY, caller_of, is_admin, network_of, token_or_host_of
from robosc_api.security.client import Credentials, check_credentials, open_async_channel, open_channel
from robosc_api.security.errors import SecurityError
from robosc_api.security.guard import Guard, Rule
from robosc_api.security.listening import ServerSecurity, add_port, check_files, check_listening
from robosc_api.security.tokens import Entry, Quota, Scope, TokenFile, make_token, missing_scope

__all__ = [
    "CALLER",
    "ENTRY",
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
    "add_server_arguments",
    "add_token_arguments",
    "caller_of",
    "check_credentials",
    "check_files",
    "check_listening",
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
    "server_security_of",
    "token_or_host_of",
]
