"""Feeds damaged models to the parser, the checks, the formatter and synthesis for as long as you like.

    python soak/fuzz_check.py --minutes 30 --seed 1
    python soak/fuzz_check.py --minutes 30 --seed 1 --goals

A child process with 500 MB of address space takes one input after the other; it is killed and replaced when an input
takes longer than two seconds, and an input that it raises or dies on is a failure. Failures are saved with their
reason; `--replay FILE` runs one again. A loop with a mutator that knows the language's tokens beats a
coverage-guided fuzzer of bytes here: most of what that would try ends at the first token.

With `--goals` every model has random goals and assumptions, too, and only some are damaged; what comes out with a
strategy is written to a file, read and verified, told in words, executed for a while and generated in Python and C.

Exit status: 0 no failures, 1 failures, 2 wrong use.
"""

import argparse
import contextlib
import json
import multiprocessing
import resource
import sys
import time
from collections import Counter
from collections.abc import Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from random import Random

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

import msgspec  # noqa: E402

from robosc.model.check import check  # noqa: E402  # found through the path above
from robosc.model.structure import Model  # noqa: E402
from robosc.source import Bundle, SourceFile  # noqa: E402
from robosc.supervisor import Supervisor  # noqa: E402
from support.model_text import model_text  # noqa: E402
from support.mutate import mutated  # noqa: E402
from support.random_errands import random_errands  # noqa: E402
from support.random_goals import with_random_goals  # noqa: E402

LIMIT_S = 2.0
START_LIMIT_S = 60.0
MEMORY_BYTES = 500 * 1024 * 1024
SYNTHESIS_TOKENS = 1500
"""Models without errors and with fewer tokens than this are synthesized too."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run as the arguments say."""
    parser = argparse.ArgumentParser(prog="fuzz_check.py", description=__doc__.partition("\n\n")[0])
    parser.add_argument("--minutes", type=float, default=1.0, help="duration in minutes (default: 1)")
    parser.add_argument(
        "--seed", type=int, default=0, help="seed of what is tried: the same tries the same (default: 0)"
    )
    parser.add_argument("--failures", type=Path, default=Path("out/fuzz"), metavar="DIR", help="folder for failures")
    parser.add_argument("--goals", action="store_true", help="give every model random goals and assumptions")
    parser.add_argument("--replay", type=Path, metavar="FILE", help="run one saved input and print what happens")
    arguments = parser.parse_args(argv)
    if arguments.minutes <= 0:
        parser.error("--minutes takes a number above 0")
    if arguments.replay:
        try:
            text = arguments.replay.read_text(encoding="utf-8", errors="surrogatepass")
        except OSError as error:
            parser.error(f"cannot read {arguments.replay}: {error.strerror}")
        fault, seconds = Child().run(text)
        print(f"{fault or 'no failure'} ({seconds:.2f} s)")
        return 1 if fault else 0
    return Fuzzer(arguments.seed, arguments.failures, goals=arguments.goals).run(arguments.minutes * 60)


class Fuzzer:
    """Tries inputs and counts what becomes of them.

    Args:
        seed: Seed of what is tried.
        folder: Folder for failures.
        goals: True if every model gets random goals.
    """

    def __init__(self, seed: int, folder: Path, *, goals: bool = False) -> None:
        self._seeds = seeds()
        self._robots = [model for text in self._seeds if (model := robot_of(text)) is not None] if goals else []
        self._dice = Random(seed)
        self._folder = folder
        self._counts: Counter[str] = Counter()
        self._slowest = 0.0
        self._most_memory = 0

    def run(self, seconds: float) -> int:
        """Try inputs for some time; 0 if nothing failed."""
        child = Child()
        begin = reported = time.monotonic()
        while (now := time.monotonic()) - begin < seconds:
            text = self._next()
            fault, took = child.run(text)
            self._counts["inputs"] += 1
            self._counts[child.outcome] += 1
            self._slowest = max(self._slowest, took)
            self._most_memory = max(self._most_memory, child.memory)
            if fault:
                self._save(text, fault)
                child.close()
                child = Child()
            if now - reported > 10:
                reported = now
                print(f"{now - begin:6.0f} s: {self._line()}", flush=True)
        child.close()
        print(f"done: {self._line()}, {self._counts['inputs'] / seconds:.0f} inputs a second")
        return 1 if self._counts["failures"] else 0

    def _next(self) -> str:
        dice = self._dice
        if not self._robots:
            return mutated(dice.choice(self._seeds), self._seeds, dice)
        if dice.random() < 0.5:
            model = random_errands(dice.randrange(2**32))
        else:
            model = with_random_goals(dice.choice(self._robots), dice)
        if dice.random() < 0.7:
            assumptions = tuple(msgspec.structs.replace(item, is_allowed=True) for item in model.assumptions)
            model = msgspec.structs.replace(model, assumptions=assumptions)
        text = model_text(model)
        return mutated(text, self._seeds, dice) if dice.random() < 0.4 else text

    def _line(self) -> str:
        counts = self._counts
        return (
            f"{counts['inputs']} inputs ({counts['sound']} sound, {counts['refused']} refused, "
            f"{counts['synthesized']} synthesized, {counts['strategic']} with a strategy), "
            f"{counts['failures']} failures, slowest {self._slowest:.2f} s, "
            f"most memory {self._most_memory / 1024:.0f} MB"
        )

    def _save(self, text: str, fault: str) -> None:
        self._counts["failures"] += 1
        self._folder.mkdir(parents=True, exist_ok=True)
        path = self._folder / f"failure_{self._counts['failures']}.rscd"
        path.write_text(text, encoding="utf-8", errors="surrogatepass")
        path.with_suffix(".txt").write_text(fault + "\n", encoding="utf-8")
        print(f"failure: {path}: {fault.splitlines()[-1]}", flush=True)


def seeds() -> list[str]:
    """The texts that are damaged: examples, the corpus, what the language reference shows."""
    files = [*ROOT.glob("examples/*/*.rscd"), *ROOT.glob("tests/corpus/**/*.rscd"), *ROOT.glob("docs/*.md")]
    texts = [path.read_text(encoding="utf-8", errors="replace") for path in sorted(files)]
    models = [text for text in texts if not text.startswith("# ")]
    for text in texts:
        if text.startswith("# "):
            models += [part.partition("```")[0].partition("\n")[2] for part in text.split("```robosc")[1:]]
    return [text for text in models if text.strip()]


def robot_of(text: str) -> Model | None:
    """The robot of a text with a behaviour in it, or None if it is none or has errors."""
    model = check(Bundle(SourceFile("model.rscd", text))).model
    return model if model is not None and any(item.behaviour for item in model.components) else None


class Child:
    """A process that takes inputs.

    Attributes:
        outcome: Outcome of the last input: `sound`, `refused`, `synthesized`, `strategic` (also a strategy) or
            `failed`.
        memory: The most memory that the process had so far, in KiB.
    """

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=serve, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()
        self.outcome, self.memory = "failed", 0
        if not self._pipe.poll(START_LIMIT_S):
            raise TimeoutError("the child process does not start")
        self._pipe.recv()

    def run(self, text: str) -> tuple[str, float]:
        """Return the reason why an input failed (empty: it did not), and the seconds that it took."""
        begin = time.monotonic()
        self.outcome = "failed"
        try:
            self._pipe.send_bytes(text.encode("utf-8", errors="surrogatepass"))
            if not self._pipe.poll(LIMIT_S):
                return f"it takes longer than {LIMIT_S} s", time.monotonic() - begin
            answer = json.loads(self._pipe.recv_bytes())
        except (EOFError, OSError):
            self._process.join(5)
            return f"the process died with exit code {self._process.exitcode}", time.monotonic() - begin
        self.memory = int(answer["memory"])
        if not answer["fault"]:
            self.outcome = str(answer["outcome"])
        return str(answer["fault"]), time.monotonic() - begin

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.join()
        self._pipe.close()


def serve(pipe: Connection) -> None:
    """Take inputs until the other side is gone."""
    import traceback

    # All that an input may need is loaded, so that only inputs are timed.
    assert try_one(model_text(random_errands(0))) == "strategic"
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    pipe.send("ready")
    while True:
        try:
            text = pipe.recv_bytes().decode("utf-8", errors="surrogatepass")
        except EOFError:
            return
        fault = outcome = ""
        try:
            outcome = try_one(text)
        except BaseException:  # whatever it is, it is a failure
            fault = traceback.format_exc()
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        pipe.send_bytes(json.dumps({"fault": fault, "outcome": outcome, "memory": memory}).encode())


def try_one(text: str) -> str:
    """Put a text through all steps, with what must be true of the findings.

    Raises:
        AssertionError: Something is wrong with them.
    """
    from robosc.certification import make_supervisor
    from robosc.errors import Severity, UnsupportedModelError
    from robosc.formatting import format_text
    from robosc.language import parse
    from robosc.language.tokens import tokenize

    bundle = Bundle(SourceFile("model.rscd", text))
    parsed = parse(bundle.main)
    checked = check(bundle)
    errors = [item for item in checked.diagnostics if item.severity is Severity.ERROR]
    assert (parsed.tree is None) == bool(parsed.diagnostics)
    assert checked.model is None or not errors
    lines = text.split("\n")
    for item in checked.diagnostics:
        place = item.location
        assert place is not None
        assert 1 <= place.line <= len(lines), str(item)
        assert 1 <= place.column <= len(lines[place.line - 1]) + 1, str(item)
        assert place.length >= 1
        assert item.code
        assert item.message
        assert item.fix
        json.dumps(item.to_json())
        item.render(bundle)
    if parsed.tree is not None:
        formatted = format_text(text)
        assert format_text(formatted) == formatted, "formatting twice differs from once"
        assert tokenize(formatted).texts == tokenize(text).texts, "formatting changed the tokens"
    if checked.model is None:
        return "refused"
    if len(tokenize(text).texts) > SYNTHESIS_TOKENS:
        return "sound"
    begin = time.monotonic()
    try:
        # Synthesis may take long by its nature: what is asked here is that it can be stopped and raises nothing else.
        made = make_supervisor(bundle, should_stop=lambda: time.monotonic() - begin > LIMIT_S / 4)
    except UnsupportedModelError:
        return "sound"
    except Exception as error:
        if type(error).__name__ != "SynthesisCancelled":
            raise
        return "synthesized"
    if made.supervisor is None or made.supervisor.strategy is None:
        return "synthesized"
    use_strategy(bundle, made.supervisor)
    return "strategic"


def use_strategy(bundle: Bundle, supervisor: Supervisor) -> None:
    """Put a supervisor with a strategy through all that can be done with it.

    Raises:
        AssertionError: Something is wrong with it.
    """
    from robosc.certification.supervisor_file import verify_supervisor_file
    from robosc.errors import UnsupportedModelError
    from robosc.pipeline.goals import goals_of
    from robosc.pipeline.simulation import simulate
    from robosc.supervisor import decode, encode
    from robosc.targets import generate
    from robosc.verification import Limits

    read = decode(encode(supervisor))
    assert read == supervisor, "another supervisor comes out of a file"
    found = verify_supervisor_file(read, bundle, Limits.of(2_000))
    assert not found.faults, found.faults
    assert all(item.rows() for item in goals_of(supervisor))
    simulate(supervisor).walk(30, 0, strategy=True)
    for target in ("python", "c99"):
        with contextlib.suppress(UnsupportedModelError):
            for name, content in generate(supervisor, target).items():
                if name.endswith(".py"):
                    compile(content, name, "exec")


if __name__ == "__main__":
    sys.exit(main())
