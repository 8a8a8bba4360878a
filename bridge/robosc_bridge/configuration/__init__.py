"""The configuration of a bridge: which devices it has, and what the communications of a model are tied to."""

from robosc_bridge.configuration.channels import CHANNELS, Channel, channel_name
from robosc_bridge.configuration.load import Loaded, load, parse
from robosc_bridge.configuration.problems import ConfigurationError, Problem
from robosc_bridge.configuration.reference import reference
from robosc_bridge.configuration.structure import Configuration, Safety, schema, schema_text
from robosc_bridge.configuration.template import init
from robosc_bridge.configuration.ties import Ties, tie, why_not

__all__ = [
    "CHANNELS",
    "Channel",
    "Configuration",
    "ConfigurationError",
    "Loaded",
    "Problem",
    "Safety",
    "Ties",
    "channel_name",
    "init",
    "load",
    "parse",
    "reference",
    "schema",
    "schema_text",
    "tie",
    "why_not",
]
