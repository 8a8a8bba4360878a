"""The stand-in for rclcpp as packages of a colcon workspace: the CMake files of generated C++ packages are run."""

from pathlib import Path

from support.rclcpp_nodes import STAND_IN

TARGETS = {
    "rclcpp": "rclcpp",
    "rclcpp_components": "component",
    "rclcpp_lifecycle": "rclcpp_lifecycle",
}
"""Target that each package exports: those that a node without actions needs."""

LINK_VARIABLES = {"LDFLAGS": "-Wl,--allow-shlib-undefined"}
"""Environment in which colcon links programs with the messages of wheels.

These have libraries for Python among them, whose symbols only Python has.
"""

_PACKAGE = """<?xml version="1.0"?>
<package format="3">
  <name>{name}</name>
  <version>0.0.0</version>
  <description>Stand-in for tests</description>
  <maintainer email="maintainer@example.org">Maintainer</maintainer>
  <license>MIT</license>
  <export><build_type>cmake</build_type></export>
</package>
"""
_BUILD = """cmake_minimum_required(VERSION 3.16)
project({name} NONE)
install(FILES {name}Config.cmake DESTINATION share/{name}/cmake)
install(FILES package.xml DESTINATION share/{name})
"""
_CONFIG = """if(NOT TARGET {name}::{target})
  add_library({name}::{target} INTERFACE IMPORTED)
  set_target_properties({name}::{target} PROPERTIES INTERFACE_INCLUDE_DIRECTORIES "{include}")
endif()
"""
# The real one also makes a plug-in of the library, which needs class_loader.
_REGISTER = """function(rclcpp_components_register_nodes)
endfunction()
"""


def write_stand_ins(folder: Path) -> None:
    """Write the packages, each in a folder below the one that is given."""
    for name, target in TARGETS.items():
        own = folder / name
        own.mkdir(parents=True)
        config = _CONFIG.format(name=name, target=target, include=STAND_IN)
        files = {
            "package.xml": _PACKAGE.format(name=name),
            "CMakeLists.txt": _BUILD.format(name=name),
            f"{name}Config.cmake": config + (_REGISTER if name == "rclcpp_components" else ""),
        }
        for file, text in files.items():
            (own / file).write_text(text, encoding="utf-8")
