"""The supervisor for the argument `--model`, which names a supervisor file or a model: events are compared with it."""

import argparse
from typing import TYPE_CHECKING

from robosc.certification.reasons import reasons_json
from robosc.cli import synth
from robosc.cli.arguments import read_bundle
from robosc.cli.output import print_json
from robosc.cli.sign import read_supervisor
from robosc.json_documents import diagnostics_json
from robosc.model.structure import Deployment

if TYPE_CHECKING:
    from robosc.supervisor import Supervisor


def supervisor_of_arguments(arguments: argparse.Namespace, *, is_json: bool = False) -> "Supervisor | None":
    """Read or synthesize the supervisor; None if there is none, which has been reported.

    Args:
        arguments: Arguments with `model`, and with those that `arguments.add_given_supervisor_options` has read.
        is_json: True if the reason why there is none is reported to machines, on standard output.

    Raises:
        UsageError: A file cannot be read.
        InvalidSupervisorError: The supervisor's file is malformed.
    """
    from robosc.supervisor import decode

    if arguments.model.suffix == ".rsup":
        return decode(read_supervisor(arguments.model))
    bundle = read_bundle(arguments)
    deployment = arguments.deployment or str(Deployment.CONTROLLER)
    # The log is of a run that has happened, however it would have gone on.
    outcome = synth.make(
        argparse.Namespace(**{**vars(arguments), "deployment": deployment}),
        bundle,
        allow_livelock=True,
        only_shown=True,
    )
    if outcome.supervisor is None:
        if is_json:
            print_json(
                {"status": str(outcome.status), **reasons_json(outcome), **diagnostics_json(outcome.diagnostics)}
            )
        else:
            synth.report_problems(outcome, bundle)
    return outcome.supervisor
