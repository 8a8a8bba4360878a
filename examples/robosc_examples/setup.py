"""The nodes around the example robots, as a ROS 2 package."""

from pathlib import Path

from setuptools import setup

PACKAGE = "robosc_examples"
NODES = (
    "announcer",
    "blob_detector",
    "calibrator",
    "careless_line_follower",
    "drive_to_pose",
    "household",
    "line_detector",
    "person_detector",
    "pusher",
    "rotator",
    "stop_panel",
)

setup(
    name=PACKAGE,
    version="0.1.0",
    packages=[PACKAGE],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE}"]),
        (f"share/{PACKAGE}", ["package.xml", "README.md"]),
        (f"share/{PACKAGE}/launch", sorted(str(path) for path in Path("launch").glob("*.launch.py"))),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    maintainer="The RoboSC developers",
    maintainer_email="maintainer@example.org",
    description="The nodes around RoboSC's example robots: detectors, a rotator, a stop panel and others",
    license="MIT",
    entry_points={"console_scripts": [f"{node} = {PACKAGE}.{node}:main" for node in NODES]},
)
