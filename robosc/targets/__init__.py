"""Targets: generators that turn a finished supervisor into files.

A target reads a supervisor and returns files as text (`GeneratedFiles`); only `write_files` writes them. The same
supervisor gives the same bytes: files contain no time and no machine path, and everything is sorted.
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
