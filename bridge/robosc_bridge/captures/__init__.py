"""Captures: the bytes of a robot's lines, recorded with their times, replayed to the decoders, and redacted."""
