"""Targets: what a finished supervisor is turned into.

A target reads a supervisor and returns files as text (`GeneratedFiles`); `write_files` is the one place
that writes them. Same supervisor, same bytes: no time, no machine path, everything sorted.
"""

from robosc.targets.all_targets import (
    ALL,
    Written,
    generate_or_refuse,
    require_generatable,
    targets_left_out,
    write_generated,
)
from robosc.targets.controller_config import (
    CONFIG_FILE,
    ControllerConfig,
    ControllerConfigError,
    read_controller_config,
)
from robosc.targets.files import GeneratedFiles, OverwriteError, Removal, remove_earlier, write_files
from robosc.targets.refusal import TargetRefusal, apply_target_errors
from robosc.targets.registry import (
    GenerateOptions,
    PackageMetadata,
    StateMessage,
    SupervisedController,
    SupervisedSystem,
    TargetInfo,
    UnknownTargetError,
    available_targets,
    generate,
    generate_automata,
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
    "PackageMetadata",
    "Removal",
    "StateMessage",
    "SupervisedController",
    "SupervisedSystem",
    "TargetInfo",
    "TargetRefusal",
    "UnknownTargetError",
    "Written",
    "apply_target_errors",
    "available_targets",
    "generate",
    "generate_automata",
    "generate_or_refuse",
    "read_controller_config",
    "register",
    "remove_earlier",
    "require_generatable",
    "require_target",
    "targets_left_out",
    "write_files",
    "write_generated",
]
