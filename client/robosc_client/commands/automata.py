"""Commands for automata (CIF, libFAUDES, Supremica) that a server carries out."""

import argparse
from collections.abc import Collection
from dataclasses import replace
from typing import TYPE_CHECKING

from robosc.cli import automata
from robosc.cli.output import UsageError
from robosc.pipeline.options import SynthesisOptions
from robosc_client import Check, Client, Explain, Explore, Generate, Synthesis, Synthesize, Task, Verify
from robosc_client.commands.connection import checked_number
from robosc_client.commands.progress_line import ProgressLine
from robosc_client.commands.signature_checks import require_signature
from robosc_client.commands.supervisor_file import write_supervisor

if TYPE_CHECKING:
    from pathlib import Path

    from robosc.pipeline.exploring import Exploration
    from robosc.pipeline.findings import Findings
    from robosc.pipeline.loading import LoadedAutomata
    from robosc.pipeline.results import Explained, Generation, Verification
    from robosc.pipeline.systems import SystemSupervisor, SystemSynthesis
    from robosc.signatures import PublicKey
    from robosc.targets import GenerateOptions


class Server:
    """Server as a machine of `robosc.cli.machine`; its answers are not trusted.

    Args:
        client: Connection to the server.
        deadline_s: Time limit for each call, in seconds; None: no limit.
        keys: Keys of which one must have signed a supervisor; empty: it need not be signed.
    """

    def __init__(self, client: Client, deadline_s: float | None, keys: "Collection[PublicKey]" = ()) -> None:
        self._client = client
        self._deadline_s = deadline_s
        self._keys = keys
        self._answers: list[tuple[SystemSupervisor, Synthesis]] = []

    def check(self, model: "LoadedAutomata") -> "Findings":
        """Return every finding."""
        return self._client.check(model, deadline_s=self._deadline_s)

    def synthesize(self, model: "LoadedAutomata", options: SynthesisOptions, *, is_modular: bool) -> "SystemSynthesis":
        """Synthesize the supervisor."""
        from robosc_client.outcomes import automata_synthesis_of

        with ProgressLine() as line:
            found = self._client.synthesize(
                model,
                _sendable(options),
                is_modular=is_modular,
                deadline_s=self._deadline_s,
                on_progress=line.report,
            )
        made = automata_synthesis_of(found, model)
        if made.supervisor is not None:
            if self._keys:
                require_signature(self._keys, found.supervisor, found.signature)
            self._answers.append((made.supervisor, found))
        return made

    def write_supervisor(self, output: "Path", made: "SystemSupervisor") -> None:
        """Write the file of a supervisor that the server has made, byte for byte, with its signature."""
        # The signature fits the bytes that the supervisor was read from, and no others.
        found = next(answer for supervisor, answer in self._answers if supervisor is made)
        write_supervisor(output, found.supervisor, found.signature)

    def explore(self, model: "LoadedAutomata", options: SynthesisOptions, *, maximum_states: int) -> "Exploration":
        """Return the graph of the controlled system."""
        from robosc_client.outcomes import automata_exploration_of

        with ProgressLine() as line:
            found = self._client.explore(
                model,
                _sendable(options),
                maximum_states=checked_number(maximum_states, "--limit"),
                deadline_s=self._deadline_s,
                on_progress=line.report,
            )
        return automata_exploration_of(found, model)

    def verify(
        self,
        model: "LoadedAutomata",
        options: SynthesisOptions,
        *,
        maximum_states: int,
        is_strict: bool,
        controller: bool,
        as_is: bool,
    ) -> "Verification":
        """Synthesize the supervisor, unless automata are verified `as_is`, and verify it."""
        from robosc_client.outcomes import require_automata_report

        if maximum_states < 1:
            raise UsageError("--limit must be at least 1 for a server")
        with ProgressLine() as line:
            found = self._client.verify(
                model,
                options=_sendable(options),
                maximum_states=maximum_states,
                is_strict=is_strict,
                controller=controller,
                as_is=as_is,
                deadline_s=self._deadline_s,
                on_progress=line.report,
            )
        return require_automata_report(found)

    def generate(
        self,
        model: "LoadedAutomata",
        target: str,
        generation: "GenerateOptions",
        options: SynthesisOptions,
        *,
        initial: str | None,
        is_modular: bool,
    ) -> "Generation":
        """Generate the files of a target."""
        with ProgressLine() as line:
            return self._client.generate(
                model,
                target,
                generation,
                _sendable(options),
                initial=initial,
                is_modular=is_modular,
                deadline_s=self._deadline_s,
                on_progress=line.report,
            )

    def explain(
        self,
        model: "LoadedAutomata",
        options: SynthesisOptions,
        *,
        event: str | None,
        state: str | None,
        after: str | None,
    ) -> "Explained":
        """Explain what synthesis does to the automata."""
        with ProgressLine() as line:
            return self._client.explain(
                model,
                _sendable(options),
                event=event,
                state=state,
                after=after,
                deadline_s=self._deadline_s,
                on_progress=line.report,
            )


def task_of(arguments: argparse.Namespace, package: str | None) -> Task:
    """Return the task that the arguments of `submit` ask for.

    Args:
        arguments: Arguments of the command.
        package: Name of the generated package; None: a name made from the model's name.

    Raises:
        UsageError: An argument has no effect for automata, or the model cannot be read.
    """
    from robosc.targets import GenerateOptions

    if arguments.task == "check":
        return Check(automata.loaded(arguments))
    options = _sendable(automata.synthesis_options(arguments))
    match arguments.task:
        case "synth":
            return Synthesize(automata.loaded_for_synthesis(arguments), options, arguments.modular)
        case "generate":
            model = automata.loaded_for_generation(arguments)
            return Generate(
                model, arguments.target, GenerateOptions(package=package), options, arguments.initial, arguments.modular
            )
        case "explore":
            return Explore(automata.loaded(arguments), options, arguments.limit)
        case "explain-synthesis":
            return Explain(
                model=automata.loaded(arguments),
                options=options,
                event=arguments.event,
                state=arguments.state,
                after=arguments.after,
            )
        case _:
            automata.refuse(arguments.supervisor is not None, automata.NO_FILE)
            return Verify(
                model=automata.loaded_for_verification(arguments),
                engine=options.engine,
                allow_reordering=options.allow_reordering,
                maximum_nodes=options.maximum_nodes,
                maximum_states=arguments.limit,
                is_strict=arguments.strict,
                controller=arguments.controller,
                as_is=arguments.as_is,
            )


def _sendable(options: SynthesisOptions) -> SynthesisOptions:
    return replace(options, maximum_nodes=checked_number(options.maximum_nodes, "--max-nodes"))
