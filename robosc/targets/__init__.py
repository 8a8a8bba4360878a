"""Targets: what a finished supervisor is turned into.

A target reads a supervisor and returns files as text (`GeneratedFiles`); `write_files` is the one place
that writes them. Same supervisor, same bytes: no time, no machine path, everything sorted.
"""

from robosc.targets.controller_config import (
    CONFIG_FILE,
    ControllerConfig,
    ControllerConfigError,
    read_controller_config,
)
from robosc.targets.everything import ALL, Written, generated, refusals, require_generatable, write_generated
from robosc.targets.files import GeneratedFiles, OverwriteError, Removal, remove_earlier, write_files
from robosc.targets.judgement import judged_for
from robosc.targets.registry import (
    GenerateOptions,
    SupervisedController,
    TargetInfo,
    UnknownTargetError,
    available_targets,
    generate,
    register,
    require_target,
)

__all__ = [
    "ALL",
    "CONFIG_FILE",
    "ControllerConfig",
    "ControllerConfigError",
    "GenerateOptions",
    "GeneratedFiles",
    "OverwriteError",
    "Removal",
    "SupervisedController",
    "TargetInfo",
    "UnknownTargetError",
    "Written",
    "available_targets",
    "generate",
    "generated",
    "judged_for",
    "read_controller_config",
    "refusals",
    "register",
    "remove_earlier",
    "require_generatable",
    "require_target",
    "write_files",
    "write_generated",
]
