"""The parts of the C++ runtime that know no model, beside their twins in Python."""

import json
import math
import shutil
import struct
import subprocess
from array import array
from importlib import resources
from pathlib import Path
from random import Random

import pytest

from robosc.targets.ros.runtime.scans import Resampler

GXX = shutil.which("g++")

pytestmark = [
    pytest.mark.skipif(GXX is None, reason="g++ is not installed"),
]

MAIN = r"""
#include "json.hpp"
#include "scans.hpp"
#include <cstring>
#include <iostream>
#include <vector>

struct Scan {
    float angle_min, angle_max, angle_increment, time_increment, range_min, range_max;
    std::vector<float> ranges, intensities;
};

static std::uint64_t bits()
{
    std::uint64_t value = 0;
    std::cin >> std::hex >> value;
    return value;
}

static float single()
{
    const auto value = static_cast<std::uint32_t>(bits());
    float result = 0.0F;
    std::memcpy(&result, &value, sizeof result);
    return result;
}

int main()
{
    for (std::string word; std::cin >> word;) {
        if (word == "number") {
            const std::uint64_t value = bits();
            double number = 0.0;
            std::memcpy(&number, &value, sizeof number);
            std::cout << robosc::number_text(number) << std::endl;
        } else if (word == "text") {
            const std::uint64_t length = bits();
            std::string text;
            for (std::uint64_t k = 0; k < length; k++) {
                text += static_cast<char>(bits());
            }
            std::string out;
            robosc::put_json(out, std::string_view(text));
            std::cout << out << std::endl;
        } else {
            Scan scan{};
            scan.angle_min = single();
            scan.angle_increment = single();
            scan.range_min = single();
            scan.range_max = single();
            for (std::uint64_t count = bits(); count > 0; count--) {
                scan.ranges.push_back(single());
            }
            for (const float range : robosc::resampled(scan).ranges) {
                std::uint32_t value = 0;
                std::memcpy(&value, &range, sizeof value);
                std::cout << std::hex << value << ' ';
            }
            std::cout << std::endl;
        }
    }
}
"""


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runtime")
    for name in ("json.hpp", "scans.hpp"):
        text = resources.files("robosc.targets.cpp.runtime").joinpath(name).read_text(encoding="utf-8")
        (folder / name).write_text(text)
    (folder / "main.cpp").write_text(MAIN)
    sanitizers = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    command = ["g++", "-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Werror", *sanitizers, "main.cpp", "-o", "main"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "main"


def answers(program: Path, lines: list[str]) -> list[str]:
    done = subprocess.run(
        [str(program)], input="\n".join(lines) + "\n", capture_output=True, text=True, check=False, timeout=60
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def bits(value: float, code: str = "d") -> str:
    return struct.pack(f">{code}", value).hex()


def test_numbers_are_written_as_python_writes_them(program: Path) -> None:
    dice = Random(1)
    numbers = [0.0, -0.0, 1.0, 0.1, -2.5, 1e15, 1e16, 123456789012345680.0, 1e-4, 1e-5, 5e-324, 1.7976931348623157e308]
    numbers += [math.inf, -math.inf, math.nan]
    numbers += [struct.unpack(">d", dice.randbytes(8))[0] for _ in range(2000)]
    numbers += [dice.uniform(-1, 1) * 10 ** dice.randint(-8, 20) for _ in range(2000)]
    numbers += [float(dice.randint(-(10**6), 10**6)) / 10 ** dice.randint(0, 6) for _ in range(2000)]
    assert answers(program, [f"number {bits(number)}" for number in numbers]) == [repr(number) for number in numbers]


def test_texts_are_written_as_python_writes_them(program: Path) -> None:
    dice = Random(2)
    ranges = [(0, 0x80), (0x20, 0x7F), (0x80, 0x800), (0x800, 0xD800), (0xE000, 0x10000), (0x10000, 0x110000)]
    texts = ["", '"\\', "\x7f\x00\n", "é€😀"]
    texts += ["".join(chr(dice.randrange(*dice.choice(ranges))) for _ in range(dice.randrange(9))) for _ in range(1000)]
    lines = [f"text {len(raw):x} {raw.hex(' ')}" for raw in (text.encode() for text in texts)]
    assert [json.loads(answer) for answer in answers(program, lines)] == texts
    # Bytes that are no UTF-8 become valid JSON all the same.
    broken = [dice.randbytes(dice.randrange(1, 9)) for _ in range(1000)]
    for raw, answer in zip(broken, answers(program, [f"text {len(r):x} {r.hex(' ')}" for r in broken]), strict=True):
        assert json.loads(answer).replace("�", "") == raw.decode("utf-8", "ignore").replace("�", "")


def test_scans_are_resampled_as_in_python(program: Path) -> None:
    dice = Random(3)
    lines, expected = [], []
    for _ in range(200):
        count = dice.choice([0, 1, 90, 360, 361, 720, 1000])
        angle = dice.choice([0.0, -math.pi, -0.5 * math.pi, dice.uniform(-10, 10), 1e9, math.nan])
        step = dice.choice([2 * math.pi / max(count, 1), -math.radians(0.5), dice.uniform(-1, 1), math.inf])
        angles = array("f", [angle, step, dice.choice([0.0, 0.12]), dice.choice([3.5, 30.0, math.inf])])
        given = [dice.choice([dice.uniform(0, 5), 0.0, math.nan, math.inf, -1.0]) for _ in range(count)]
        ranges = array("f", given)
        low, high = angles[2], angles[3]
        lines.append(" ".join(["scan", *(bits(item, "f") for item in angles), f"{count:x}"]))
        lines[-1] += "".join(f" {bits(item, 'f')}" for item in ranges)
        expected.append(Resampler().ranges(angles[0], angles[1], ranges, low, high))
    for answer, wanted in zip(answers(program, lines), expected, strict=True):
        found = [struct.unpack(">f", bytes.fromhex(word.rjust(8, "0")))[0] for word in answer.split()]
        assert [repr(item) for item in found] == [repr(item) for item in wanted]
