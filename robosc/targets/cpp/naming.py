"""Names of ROS that are no names in C++."""

import re

from robosc.errors import UnsupportedModelError

KEYWORDS = frozenset(
    """
    alignas alignof and and_eq asm auto bitand bitor bool break case catch char char16_t char32_t class compl const
    const_cast constexpr continue decltype default delete do double dynamic_cast else enum explicit export extern false
    float for friend goto if inline int long mutable namespace new noexcept not not_eq nullptr operator or or_eq private
    protected public register reinterpret_cast return short signed sizeof static static_assert static_cast struct switch
    template this thread_local throw true try typedef typeid typename union unsigned using virtual void volatile wchar_t
    while xor xor_eq
    """.split()
)


_TAKEN = frozenset(
    """
    actionlib boost diagnostic_msgs lifecycle_msgs main rcl_interfaces rclcpp rclcpp_action rclcpp_components
    rclcpp_lifecycle robosc_msgs ros std std_msgs
    """.split()
)
"""Names that a program around the supervisor has anyway."""


def require_namespace(package: str) -> None:
    """Do nothing if the generated package can have this name, which is that of its namespace.

    Raises:
        UnsupportedModelError: It cannot.
    """
    if package in KEYWORDS or package in _TAKEN:
        raise UnsupportedModelError(
            f"the generated package would be called {package}, which cannot be its namespace in C++: choose another "
            "name for it"
        )


def require_field_name(name: str) -> None:
    """Do nothing if a message in C++ can have a field of this name.

    Neither generator of ROS messages for C++ renames fields: one that is called like a keyword exists in no message.

    Raises:
        UnsupportedModelError: It cannot.
    """
    if name in KEYWORDS:
        raise UnsupportedModelError(
            f"no message in C++ has a field '{name}', which is a keyword there: the model's property cannot be read "
            "or sent"
        )


def require_package_name(name: str) -> None:
    """Do nothing if a package of messages can have this name in C++, where it is a namespace.

    Raises:
        UnsupportedModelError: It cannot.
    """
    if name in KEYWORDS:
        raise UnsupportedModelError(
            f"the package '{name}' is called like a keyword of C++, which has no messages of it"
        )


def file_name(type_name: str) -> str:
    """The file of a ROS 2 type without its ending: `LaserScan` -> `laser_scan`, as rosidl names it."""
    spaced = re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", re.sub(r"(.)([A-Z][a-z]+)", r"\1_\2", type_name))
    return spaced.lower()
