"""Supervisors that the server signs; and what is none."""

from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.serialization import Encoding, PublicFormat

from robosc.signatures import PublicKey, signer
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_server.signing import signed
from robosc_server.tasks.task import Result, TaskKind

KEY = Ed25519PrivateKey.generate()
PUBLIC = PublicKey(KEY.public_key().public_bytes(Encoding.OpenSSH, PublicFormat.OpenSSH).decode())


def test_a_supervisor_is_signed_and_nothing_else_is_touched() -> None:
    found = pb.SynthesizeResponse(result=pb.SynthesisResult(supervisor=b"supervisor"))
    result = Result((found.SerializeToString(),))
    answer = pb.SynthesizeResponse.FromString(signed(TaskKind.SYNTHESIZE, result, KEY).messages[0])
    assert signer(b"supervisor", answer.result.signature, [PUBLIC]) == PUBLIC
    assert answer.result.supervisor == b"supervisor"
    none = Result((pb.SynthesizeResponse(result=pb.SynthesisResult(reason="none")).SerializeToString(),))
    assert signed(TaskKind.SYNTHESIZE, none, KEY) is none
    assert signed(TaskKind.GENERATE, result, KEY) is result


def test_what_is_no_message_is_left_as_it_is() -> None:
    garbage = Result((b"\xff\xff",))
    assert signed(TaskKind.SYNTHESIZE, garbage, KEY) is garbage
