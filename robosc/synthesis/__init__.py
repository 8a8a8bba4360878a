"""Symbolic supervisor synthesis on extended finite automata."""

from robosc.synthesis.choices import EdgeChoice, edge_choices
from robosc.synthesis.engines import EngineOptions, UnknownEngineError, engine_names, register, resolve_engine
from robosc.synthesis.findings import findings, questions_about
from robosc.synthesis.parts import synthesize_in_parts
from robosc.synthesis.questions import Answers, Cause, EnabledTogether, NeverEnabled, Questions, Restriction
from robosc.synthesis.result import Statistics, SynthesisProgress, SynthesisResult, SynthesisStatus
from robosc.synthesis.synthesize import synthesize

__all__ = [
    "Answers",
    "Cause",
    "EdgeChoice",
    "EnabledTogether",
    "EngineOptions",
    "NeverEnabled",
    "Questions",
    "Restriction",
    "Statistics",
    "SynthesisProgress",
    "SynthesisResult",
    "SynthesisStatus",
    "UnknownEngineError",
    "edge_choices",
    "engine_names",
    "findings",
    "questions_about",
    "register",
    "resolve_engine",
    "synthesize",
    "synthesize_in_parts",
]
