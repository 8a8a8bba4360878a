"""Frames of the wire protocols: pure functions and incremental decoders that know no port and no clock."""
