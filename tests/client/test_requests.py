"""Tasks of the client as messages."""

from typing import Any

from robosc.model.structure import Deployment
from robosc.source import Bundle, SourceFile
from robosc.targets import GenerateOptions, PackageMetadata, StateMessage, SupervisedController
from robosc_api.v1 import synthesis_pb2 as pb
from robosc_client import Check, Explore, Format, Generate, SynthesisOptions, Synthesize, Verify
from robosc_client.convert.requests import request_of


def test_every_field_of_every_request_says_what_was_meant() -> None:
    bundle = Bundle(
        SourceFile("robot.rscd", "robot \u00e9"),
        (SourceFile("../shared/a.rscd", ""),),
        ("here",),
        (SourceFile("std_msgs/msg/Bool.msg", "bool data"),),
        distribution="kilted",
    )
    options = SynthesisOptions(
        deployment=Deployment.LAYER,
        engine="autoref",
        allow_livelock=True,
        allow_reordering=True,
        maximum_nodes=5,
        verified_states=0,
    )
    sent_options = pb.SynthesisOptions(
        deployment=pb.DEPLOYMENT_LAYER,
        engine="autoref",
        allow_livelock=True,
        allow_reordering=True,
        maximum_nodes=5,
        verified_states=0,
    )
    assert sent_options.HasField("verified_states")
    sent = pb.Bundle(
        main=pb.SourceFile(name="robot.rscd", text="robot \u00e9"),
        libraries=[pb.SourceFile(name="../shared/a.rscd")],
        searched=["here"],
        interfaces=[pb.SourceFile(name="std_msgs/msg/Bool.msg", text="bool data")],
        distribution="kilted",
    )
    assert request_of(Check(bundle)) == pb.CheckRequest(bundle=sent)
    assert request_of(Synthesize(bundle, options)) == pb.SynthesizeRequest(bundle=sent, options=sent_options)
    plain = pb.SynthesisOptions(deployment=pb.DEPLOYMENT_CONTROLLER)
    assert request_of(Synthesize(bundle)) == pb.SynthesizeRequest(bundle=sent, options=plain)
    chosen = GenerateOptions("walker", True, True, SupervisedController("p", executable="x"))
    assert request_of(Generate(bundle, "ros2", chosen, options)) == pb.GenerateRequest(
        bundle=sent,
        options=sent_options,
        target="ros2",
        generation=pb.GenerateOptions(
            package="walker",
            publish_state=True,
            log_events=True,
            supervised=pb.SupervisedController(package="p", executable="x"),
        ),
    )
    metadata = PackageMetadata("Jane", "jane@example.org", "BSD-3-Clause", "1.2.3", "2024 Jane")
    described = GenerateOptions(metadata=metadata, state_message=StateMessage.TYPED)
    found: Any = request_of(Generate(bundle, "ros2", described))
    assert found.generation.metadata == pb.PackageMetadata(
        maintainer="Jane",
        email="jane@example.org",
        license="BSD-3-Clause",
        version="1.2.3",
        copyright="2024 Jane",
    )
    assert found.generation.state_message == "typed"
    launched = GenerateOptions(supervised=SupervisedController("p", launch_file="x.launch.py"))
    found = request_of(Generate(bundle, "ros2", launched))
    assert found.generation.supervised == pb.SupervisedController(package="p", launch_file="x.launch.py")
    assert request_of(Explore(bundle, options, 7)) == pb.ExploreRequest(
        bundle=sent, options=sent_options, maximum_states=7
    )
    assert request_of(Format(bundle.main)) == pb.FormatRequest(file=sent.main)
    assert request_of(
        Verify(
            model=bundle,
            supervisor=b"x",
            deployment=Deployment.LAYER,
            properties=("AG a",),
            property_files=(SourceFile("p", "AG b"),),
            engine="cudd",
            allow_reordering=True,
            maximum_nodes=3,
            maximum_states=9,
            is_strict=True,
            controller=True,
            as_is=True,
        )
    ) == pb.VerifyRequest(
        bundle=sent,
        options=pb.SynthesisOptions(
            deployment=pb.DEPLOYMENT_LAYER, engine="cudd", allow_reordering=True, maximum_nodes=3
        ),
        supervisor=b"x",
        properties=["AG a"],
        property_files=[pb.SourceFile(name="p", text="AG b")],
        maximum_states=9,
        strict=True,
        controller=True,
        as_is=True,
    )
    assert request_of(Verify(model=bundle)) == pb.VerifyRequest(bundle=sent, options=pb.SynthesisOptions())
