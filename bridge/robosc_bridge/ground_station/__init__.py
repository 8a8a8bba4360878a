"""The bridge as a vehicle for a MAVLink ground station: telemetry out, commands in.

Functions convert snapshots of the daemon to messages (`telemetry`, `status`, `values`, `status_texts`) and messages to
commands (`commands`, `driving`). A session depends only on time and bytes (`session`); a thread runs it with a line
(`link`). The package sees the daemon only through `Operations`.
"""
