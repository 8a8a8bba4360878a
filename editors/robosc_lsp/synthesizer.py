"""Program for background synthesis: `python -m robosc_lsp.synthesizer`.

It reads a request as a line of JSON and writes the result of the synthesis as JSON. It exits when its input is closed,
so that it never outlives the language server.
"""

import os
import sys
import threading
from typing import IO, NoReturn

import msgspec

from robosc.automata import to_automata
from robosc.certification import make_supervisor
from robosc.conditions.summary import added_texts
from robosc.errors import NodeLimitError, RoboscError
from robosc.model.structure import Deployment
from robosc.source import Bundle, SourceFile
from robosc.synthesis.engines import EngineOptions
from robosc_lsp.messages import FindingMessage, SynthesisRequest, SynthesisResponse

_MOST_NODES = 4_000_000
"""Node limit of decision diagrams, with which CUDD takes a gigabyte at most."""


def outcome(request: SynthesisRequest) -> SynthesisResponse:
    """Return the result of synthesis for a robot."""
    bundle = Bundle(SourceFile(*request.main), tuple(SourceFile(*file) for file in request.libraries))
    try:
        made = make_supervisor(
            bundle, deployment=Deployment.CONTROLLER, engine=EngineOptions(maximum_nodes=_MOST_NODES)
        )
    except NodeLimitError:
        return SynthesisResponse("synthesis exceeds the memory limit of the language server")
    except RoboscError as error:
        return SynthesisResponse(reason=str(error))
    findings = tuple(
        FindingMessage(
            str(item.severity),
            item.code,
            item.message,
            item.fix,
            item.location,
            tuple((place.message, place.location) for place in item.related),
            item.accepted,
        )
        for item in (*made.diagnostics, *made.accepted)
    )
    if made.supervisor is None:
        return SynthesisResponse(reason=made.reason, findings=findings)
    system = to_automata(made.supervisor.model, made.supervisor.deployment)
    states = made.supervisor.certificate.states
    return SynthesisResponse(states=int(states), added=added_texts(made.supervisor, system), findings=findings)


def _end_with(server: IO[bytes]) -> None:
    """End this process as soon as the language server closes its input."""
    server.read()
    os._exit(1)


def main() -> NoReturn:
    """Answer one request."""
    # The editor has priority.
    os.nice(10)
    request = msgspec.json.decode(sys.stdin.buffer.readline(), type=SynthesisRequest)
    threading.Thread(target=_end_with, args=(sys.stdin.buffer,), daemon=True).start()
    sys.stdout.buffer.write(msgspec.json.encode(outcome(request)))
    sys.stdout.buffer.flush()
    # Not a normal exit, since the thread holds a lock of the input.
    os._exit(0)


if __name__ == "__main__":
    main()
