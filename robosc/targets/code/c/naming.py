"""C identifiers for a model's names: distinct, of bounded length, no keyword and no name that C reserves."""

import re

from robosc.targets.code.naming import Namer, snake_case

_MAXIMUM = 120
_MAXIMUM_PREFIX = 60

# Words that C99, C11, C23 and C++ keep for themselves, and macros of common headers that look like ordinary names.
_TAKEN = frozenset(
    """
    alignas alignof and and_eq asm auto bitand bitor bool break case catch char char16_t char32_t char8_t class compl
    concept const const_cast consteval constexpr constinit continue co_await co_return co_yield decltype default delete
    do double dynamic_cast else enum explicit export extern false float for friend goto if inline int long mutable
    namespace new noexcept not not_eq nullptr operator or or_eq private protected public register reinterpret_cast
    requires restrict return short signed sizeof static static_assert static_cast struct switch template this
    thread_local throw true try typedef typeid typename typeof typeof_unqual union unsigned using virtual void volatile
    wchar_t while xor xor_eq assert complex errno imaginary isfinite isinf isnan isnormal linux noreturn offsetof
    setjmp signbit stderr stdin stdout unix
    """.split()
)

# C99 7.26 keeps these beginnings for its library, POSIX others, and local variables begin with the last: a prefix must
# not be one of them.
_KEPT_PREFIX = re.compile(
    r"(is|to|str|mem|wcs|u?int|atomic|cnd|mtx|thrd|tss|sig|f[eo])[a-z]"
    r"|(aio|clock|dl|mq|posix|pthread|sched|sem|shm|sig|timer|msg|net|poll|stdc|va|wait|value)(_|\Z)"
)


def prefix_for(robot: str) -> str:
    """The beginning of every global name, and the name of the files: `LineFollower` -> `line_follower_supervisor`.

    Its last word stands in no name of the standard library, of the generated code itself, of a system header or of a
    target of CMake, so that no robot's name makes it one of these: `size` and `_t`, `main` and `.c`.
    """
    name = snake_case(robot)
    name = name.removesuffix("_supervisor")[:_MAXIMUM_PREFIX].rstrip("_") + "_supervisor"
    return f"robot_{name}" if _KEPT_PREFIX.match(name) else name


def member_name(preferred_name: str) -> str:
    """A legal name for a member of a struct: never a keyword, a macro or a name that C reserves."""
    name = preferred_name[:_MAXIMUM]
    is_reserved = name in _TAKEN or name.startswith("_") or (len(name) > 1 and name.upper() == name)
    return f"{'x' if name.startswith('_') else ''}{name}_" if is_reserved else name


class CNamer(Namer):
    """Hands out distinct names of C."""

    def legal(self, preferred_name: str) -> str:
        """A name of bounded length; it is legal if `preferred_name` is, but for its length."""
        return super().legal(preferred_name)[:_MAXIMUM]

    def member(self, preferred_name: str) -> str:
        """A new name for a member of a struct."""
        return self.name(member_name(preferred_name))
