"""Symbolic supervisor synthesis on extended finite automata."""

from robosc.synthesis.engines import UnknownEngineError, engine_names, register, resolve_engine
from robosc.synthesis.result import Progress, Statistics, SynthesisResult, SynthesisStatus
from robosc.synthesis.synthesize import synthesize

__all__ = [
    "Progress",
    "Statistics",
    "SynthesisResult",
    "SynthesisStatus",
    "UnknownEngineError",
    "engine_names",
    "register",
    "resolve_engine",
    "synthesize",
]
