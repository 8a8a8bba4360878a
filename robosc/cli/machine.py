"""Machine that does the work on automata for a command: the one that the command runs on, or a server."""

from typing import TYPE_CHECKING, Protocol

from robosc.cli.output import ProgressLine, write_bytes

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from robosc.certification.progress import OnProgress
    from robosc.pipeline.exploring import Exploration
    from robosc.pipeline.findings import Findings
    from robosc.pipeline.loading import LoadedAutomata
    from robosc.pipeline.options import SynthesisOptions
    from robosc.pipeline.results import Explained, Generation, Verification
    from robosc.pipeline.systems import SystemSupervisor, SystemSynthesis
    from robosc.targets import GenerateOptions


class Machine(Protocol):
    """Machine that does the work on automata: this one, or a server; its functions are those of `robosc`."""

    def check(self, model: "LoadedAutomata") -> "Findings":
        """Return every finding."""

    def synthesize(
        self, model: "LoadedAutomata", options: "SynthesisOptions", *, is_modular: bool
    ) -> "SystemSynthesis":
        """Synthesize the supervisor."""

    def write_supervisor(self, output: "Path", made: "SystemSupervisor") -> None:
        """Write the file of a supervisor that this machine has synthesized, and what belongs beside it.

        Raises:
            UsageError: A file cannot be written.
            UnsupportedModelError: The supervisor is more than a file can hold.
        """

    def explore(self, model: "LoadedAutomata", options: "SynthesisOptions", *, maximum_states: int) -> "Exploration":
        """Return the graph of the controlled system."""

    def verify(
        self,
        model: "LoadedAutomata",
        options: "SynthesisOptions",
        *,
        maximum_states: int,
        is_strict: bool,
        controller: bool,
        as_is: bool,
    ) -> "Verification":
        """Synthesize the supervisor, unless automata are verified `as_is`, and verify it."""

    def generate(
        self,
        model: "LoadedAutomata",
        target: str,
        generation: "GenerateOptions",
        options: "SynthesisOptions",
        *,
        initial: str | None,
        is_modular: bool,
    ) -> "Generation":
        """Generate the files of a target."""

    def explain(
        self,
        model: "LoadedAutomata",
        options: "SynthesisOptions",
        *,
        event: str | None,
        state: str | None,
        after: str | None,
    ) -> "Explained":
        """Explain what synthesis does to the automata."""


class ThisMachine:
    """Machine that the command runs on."""

    def check(self, model: "LoadedAutomata") -> "Findings":
        """Return every finding."""
        from robosc.pipeline.checking import check

        return check(model)

    def synthesize(
        self, model: "LoadedAutomata", options: "SynthesisOptions", *, is_modular: bool
    ) -> "SystemSynthesis":
        """Synthesize the supervisor."""
        # Not `robosc.synthesize`: it loads what models of RoboSC need.
        from robosc.pipeline.automata_models import automata_synthesis

        return watched(lambda report: automata_synthesis(model, options, report, lambda: False, is_modular=is_modular))

    def write_supervisor(self, output: "Path", made: "SystemSupervisor") -> None:
        """Write a supervisor's file."""
        write_bytes(output, made.encode())

    def explore(self, model: "LoadedAutomata", options: "SynthesisOptions", *, maximum_states: int) -> "Exploration":
        """Return the graph of the controlled system."""
        from robosc.pipeline.exploring import explore

        return watched(lambda report: explore(model, options, maximum_states=maximum_states, on_progress=report))

    def verify(
        self,
        model: "LoadedAutomata",
        options: "SynthesisOptions",
        *,
        maximum_states: int,
        is_strict: bool,
        controller: bool,
        as_is: bool,
    ) -> "Verification":
        """Synthesize the supervisor, unless automata are verified `as_is`, and verify it."""
        from robosc.pipeline.verifying import verify

        return watched(
            lambda report: verify(
                model,
                options=options,
                maximum_states=maximum_states,
                is_strict=is_strict,
                controller=controller,
                as_is=as_is,
                on_progress=report,
            )
        )

    def generate(
        self,
        model: "LoadedAutomata",
        target: str,
        generation: "GenerateOptions",
        options: "SynthesisOptions",
        *,
        initial: str | None,
        is_modular: bool,
    ) -> "Generation":
        """Generate the files of a target."""
        from robosc.pipeline.generating import generate

        return watched(
            lambda report: generate(
                model, target, generation, options, initial=initial, is_modular=is_modular, on_progress=report
            )
        )

    def explain(
        self,
        model: "LoadedAutomata",
        options: "SynthesisOptions",
        *,
        event: str | None,
        state: str | None,
        after: str | None,
    ) -> "Explained":
        """Explain what synthesis does to the automata."""
        from robosc.pipeline.explaining import explain

        return watched(
            lambda report: explain(model, options, event=event, state=state, after=after, on_progress=report)
        )


def watched[T](work: "Callable[[OnProgress], T]") -> T:
    """Return the result of some work, with a progress line on a terminal meanwhile."""
    progress = ProgressLine()
    try:
        return work(lambda step: progress.show(f"{step.stage}: {step.message}"))
    finally:
        progress.clear()


THIS_MACHINE = ThisMachine()
