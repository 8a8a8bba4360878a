"""The configuration of a bridge: its devices, and the mapping of a model's communications to channels."""

from robosc_bridge.configuration.channel_mapping import ChannelMapping, map_channels, unsuitable_because
from robosc_bridge.configuration.channels import CHANNELS, Channel, channel_name
from robosc_bridge.configuration.load import Loaded, load, parse
from robosc_bridge.configuration.problems import ConfigurationError, Problem
from robosc_bridge.configuration.reference import reference
from robosc_bridge.configuration.structure import Configuration, Safety, schema
from robosc_bridge.configuration.template import init

__all__ = [
    "CHANNELS",
    "Channel",
    "ChannelMapping",
    "Configuration",
    "ConfigurationError",
    "Loaded",
    "Problem",
    "Safety",
    "channel_name",
    "init",
    "load",
    "map_channels",
    "parse",
    "reference",
    "schema",
    "unsuitable_because",
]
