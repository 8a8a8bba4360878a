"""Error of the security configuration."""


class SecurityError(Exception):
    """A service or client cannot be secured as configured; one sentence without secrets."""
