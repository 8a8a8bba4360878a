"""Feeds the bridge's decoders of what comes over a line, guided by which code the bytes reach (atheris, libFuzzer).

    make fuzz                                    each decoder, a minute each
    make fuzz DECODERS="lds01 mavlink" SECONDS=600

or, with atheris on the path, `python soak/fuzz_decoders.py DECODER [options of libFuzzer] [folders]`. What is
asked of a decoder stands in tests/support/wire_decoders.py; how much it allocates is measured in the tests alone, since
that takes ten times as long, and bounded here by libFuzzer (-rss_limit_mb). An input that fails is saved as
`crash-...`; giving that file in place of a folder runs it again. Coverage guides well here, in contrast to models
(`fuzz_check.py`): frames are a few bytes with a checksum, which libFuzzer builds from the comparisons that it sees.
"""

import sys
import tempfile
from pathlib import Path

import atheris

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "bridge"), str(ROOT / "tests")]

with atheris.instrument_imports(include=["robosc_bridge.protocol"]):
    from support.wire_decoders import SEEDS, TARGETS


def main() -> None:
    """Fuzz the decoder that the first argument names; does not return."""
    if len(sys.argv) < 2 or sys.argv[1] not in TARGETS:
        sys.exit(f"usage: fuzz_decoders.py {'|'.join(TARGETS)} [options of libFuzzer] [folders]")
    name = sys.argv.pop(1)
    with tempfile.TemporaryDirectory(prefix=f"robosc-fuzz-{name}-") as folder:
        for number, seed in enumerate(SEEDS[name]):
            (Path(folder) / str(number)).write_bytes(seed)
        arguments = sys.argv if any(not item.startswith("-") for item in sys.argv[1:]) else [*sys.argv, folder]
        atheris.Setup(arguments, TARGETS[name])
        atheris.Fuzz()


if __name__ == "__main__":
    main()
