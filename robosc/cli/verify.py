"""`robosc verify`: properties of the controlled system."""

import argparse

from robosc.cli import properties
from robosc.cli.arguments import add_deployment_argument, add_engine_argument, add_model_arguments


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command."""
    parser = commands.add_parser(
        "verify",
        help="verify properties of the controlled system",
        description="Synthesize the supervisor of a model and verify properties of the robot under it, with a run that "
        "shows why each of them holds or fails.",
        epilog=properties.EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_model_arguments(parser)
    properties.add_arguments(parser)
    add_deployment_argument(parser)
    add_engine_argument(parser)
    parser.set_defaults(run=properties.run)
