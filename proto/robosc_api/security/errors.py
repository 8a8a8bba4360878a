"""Error in certificates, keys, tokens or where a service is to listen."""


class SecurityError(Exception):
    """A service or client cannot be secured as it is told to; one sentence for a person, never with a secret in it."""
