"""Generated rclcpp nodes as the C++ of each distribution: C++17, and C++20 where `uint8[]` is no vector."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from robosc.model.structure import Deployment
from robosc.supervisor import Supervisor
from robosc.targets import generate, write_files
from support.execution import supervisor_of
from support.models import model_of
from support.rclcpp_nodes import STAND_IN, WARNINGS, courier, missing

pytestmark = [
    pytest.mark.ros2,
    pytest.mark.skipif(missing("sensor_msgs") is not None, reason=str(missing("sensor_msgs"))),
]

INCLUDE = Path(sys.prefix) / "include"

CAMERA = """
robot Camera {
    interface image use CompressedImage from sensor_msgs
    datatype object Image { format: string data: array(integer) }
    datatype enum Seen from Image to { length(value.data) > 0 and value.data[0] = 255 -> something default -> nothing }
    component Eye {
        outgoing message image with identifier: "/image", type: Seen links image
        incoming message show with identifier: "/show", type: Image, stamped: "eye" links image
        behaviour {
            variable seen: Seen
            on response from image do seen := value
            initial marked state open { on request to show }
        }
    }
    requirement show needs Eye.seen = something
    provide show with { format: "jpeg" }
}
"""

# Stands for the class that Lyrical has for a field of the type uint8[]: it has elements, and is converted to no vector.
BUFFER = """#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>
namespace rosidl {
template <class T>
class Buffer {
public:
    Buffer() = default;
    explicit Buffer(std::size_t size) : items_(size) {}
    std::size_t size() const { return items_.size(); }
    bool empty() const { return items_.empty(); }
    void resize(std::size_t size) { items_.resize(size); }
    T& operator[](std::size_t place) { return items_[place]; }
    const T& operator[](std::size_t place) const { return items_[place]; }
    auto begin() const { return items_.begin(); }
    auto end() const { return items_.end(); }
    friend bool operator==(const Buffer& one, const Buffer& other) { return one.items_ == other.items_; }
    friend bool operator!=(const Buffer& one, const Buffer& other) { return !(one == other); }

private:
    std::vector<T> items_;
};
}  // namespace rosidl
"""


def buffered(folder: Path) -> int:
    """Write the headers of messages with such buffers, which are to be found first; the number of their fields."""
    (folder / "rosidl_buffer").mkdir(parents=True)
    (folder / "rosidl_buffer/buffer.hpp").write_text(BUFFER)
    count = 0
    for header in (INCLUDE / "sensor_msgs").rglob("*compressed_image__struct.hpp"):
        text, found = re.subn(r"std::vector<uint8_t, [^;]*?<uint8_t>>", "rosidl::Buffer<uint8_t>", header.read_text())
        path = folder / header.relative_to(INCLUDE / "sensor_msgs")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"#include <rosidl_buffer/buffer.hpp>\n{text}")
        count += found
    return count


def require_sound(supervisor: Supervisor, folder: Path, standard: str, *first: Path) -> None:
    """Assert that a node has no error and no warning as C++ of a standard."""
    write_files(generate(supervisor, "ros2-cpp"), folder)
    packages = [*first, *sorted(path for path in INCLUDE.iterdir() if path.is_dir())]
    includes = [word for path in packages for word in ("-isystem", str(path))]
    done = subprocess.run(
        [
            "g++",
            f"-std={standard}",
            *WARNINGS,
            "-fsyntax-only",
            "-I.",
            f"-I{STAND_IN}",
            *includes,
            "main.cpp",
            "node.cpp",
        ],
        cwd=folder / "src",
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[:6000]


@pytest.mark.parametrize("standard", ["c++17", "gnu++20"])
@pytest.mark.parametrize("deployment", Deployment)
def test_a_node_with_bytes_is_sound(deployment: Deployment, standard: str, tmp_path: Path) -> None:
    first = []
    if standard == "gnu++20":
        first = [tmp_path / "headers"]
        assert buffered(first[0]) > 1
    require_sound(supervisor_of(model_of(CAMERA), deployment), tmp_path / "package", standard, *first)


@pytest.mark.parametrize("standard", ["c++17", "gnu++20"])
def test_a_node_with_every_kind_of_server_is_sound(standard: str, tmp_path: Path) -> None:
    require_sound(courier(), tmp_path, standard)


def test_a_vector_that_is_none_would_be_noticed(tmp_path: Path) -> None:
    buffered(tmp_path / "headers")
    file = tmp_path / "wrong.cpp"
    file.write_text(
        "#include <sensor_msgs/msg/compressed_image.hpp>\n"
        "std::vector<uint8_t> bytes(const sensor_msgs::msg::CompressedImage& given) { return given.data; }\n"
    )
    packages = [tmp_path / "headers", *sorted(path for path in INCLUDE.iterdir() if path.is_dir())]
    includes = [word for path in packages for word in ("-isystem", str(path))]
    done = subprocess.run(
        ["g++", "-std=c++20", "-fsyntax-only", *includes, str(file)], capture_output=True, check=False
    )
    assert b"rosidl::Buffer" in done.stderr
