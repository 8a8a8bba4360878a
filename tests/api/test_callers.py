"""Who is behind a call."""

from robosc_api.security import ENTRY, Entry, Scope, is_admin


def test_only_a_token_of_that_scope_makes_an_admin() -> None:
    assert not is_admin()
    for scopes, expected in (({Scope.SYNTHESIZE}, False), ({Scope.ADMIN}, True)):
        token = ENTRY.set(Entry("a", frozenset(scopes), "0" * 64))
        try:
            assert is_admin() is expected
        finally:
            ENTRY.reset(token)
