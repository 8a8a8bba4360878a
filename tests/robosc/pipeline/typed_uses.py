"""Right and wrong uses of the Python API, for mypy: each wrong one is an error of the kind that is named beside it.

Nothing here is called. What mypy finds right although it is said to be wrong, it reports as an unused comment.
"""

from pathlib import Path

import robosc
from robosc.automata import System


def right(system: System) -> None:
    model: robosc.LoadedModel = robosc.load("robot.rscd", library_paths=[Path("shared")], interface_paths=["ros"])
    for given in (model, "robot.rscd", Path("robot.rscd")):
        findings: robosc.Findings = robosc.check(given)
        result: robosc.Synthesis = robosc.synthesize(given)
        exploration: robosc.Exploration = robosc.explore(given, maximum_states=10)
        explained: robosc.Explained = robosc.explain(given, event="move", state="A.b", after="move")
        generation: robosc.Generation = robosc.generate(given, "ros2", robosc.GenerateOptions(package="p"))
        verification: robosc.Verification = robosc.verify(given, ["AG EF true"], property_files=["p.txt"])
        print(findings.has_errors, exploration.graph, explained.explanation, generation.files, verification.passed)
        code: str = robosc.explain(findings[0]).code + robosc.explain(code="unknown-name").markdown
        if result.supervisor is not None:
            text: str = result.supervisor.conditions["move.request"].text + code
            run: robosc.Run = robosc.simulate(result.supervisor)
            step: robosc.Step = run.step("scan.response", front=text)
            enabled: tuple[str, ...] = run.enabled
            files: tuple[Path, ...] = robosc.generate(result.supervisor, "ros2").write("out", force=True).files
            saved: Path = result.supervisor.write(Path("robot.rsup"))
            checked = robosc.verify(model, supervisor=result.supervisor, options=robosc.SynthesisOptions())
            robosc.verify(result.supervisor, "invariant true")
            robosc.simulate(robosc.Supervisor.read(saved))
            print(step.data, enabled, files, checked.report)
    of_system: robosc.SystemSynthesis = robosc.synthesize(system)
    in_modules: robosc.SystemSynthesis = robosc.synthesize(system, is_modular=True)
    of_robot: robosc.Synthesis = robosc.synthesize("robot.rscd", is_modular=True)
    print(in_modules.reason, of_robot.reason)
    if of_system.supervisor is not None:
        print(robosc.verify(of_system.supervisor, is_strict=True).passed, of_system.supervisor.conditions["a"])
        by_hand: robosc.SystemRun = robosc.simulate(of_system.supervisor, initial={"A": "idle"})
        taken: robosc.Step = by_hand.step("a", to={"A": "busy", "A.n": 3})
        saved = robosc.explore(of_system.supervisor).write("graph.svg")
        print(taken.state.components, by_hand.choices("a"), robosc.explore(system).graph, saved)
        print(robosc.generate(of_system.supervisor, "c99").files, robosc.generate(system, "python").files)


def wrong(system: System, model: robosc.LoadedModel, result: robosc.Synthesis, run: robosc.Run) -> None:
    robosc.load(3)  # type: ignore[arg-type]
    robosc.load("robot.rscd", library_paths="shared", name=3)  # type: ignore[arg-type]
    robosc.check(system)  # type: ignore[arg-type]
    robosc.check(None)  # type: ignore[arg-type]
    robosc.synthesize(model, deployment="layer")  # type: ignore[call-overload]
    robosc.SynthesisOptions(deployment="layer")  # type: ignore[arg-type]
    robosc.SynthesisOptions(robosc.Deployment.LAYER)  # type: ignore[call-arg]
    # The supervisor may be missing.
    robosc.simulate(result.supervisor)  # type: ignore[arg-type]
    robosc.generate(result.supervisor, "ros2")  # type: ignore[arg-type]
    print(result.supervisor.conditions)  # type: ignore[union-attr]
    print(robosc.explore(model).graph.states)  # type: ignore[union-attr]
    robosc.generate(model)  # type: ignore[call-arg]
    robosc.generate(model, "ros2", package="p")  # type: ignore[call-arg]
    robosc.verify(model, 3)  # type: ignore[call-overload]
    robosc.verify(system)  # type: ignore[call-overload]
    robosc.explain()  # type: ignore[call-overload]
    robosc.explain(model, code="unknown-name")  # type: ignore[call-overload]
    robosc.simulate(system)  # type: ignore[call-overload]
    robosc.simulate("robot.rsup", initial={"A": "idle"})  # type: ignore[call-overload]
    run.step(3)  # type: ignore[arg-type]
    run.step(event="scan.response")  # type: ignore[call-arg]
    run.enabled = ()  # type: ignore[misc]
    result.reason = ""  # type: ignore[misc]
    print(result.statsu)  # type: ignore[attr-defined]
    robosc.synthesise(model)  # type: ignore[attr-defined]
