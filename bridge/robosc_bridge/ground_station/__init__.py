"""The bridge as a vehicle for a MAVLink ground station: telemetry out, commands in.

Functions from what the daemon shows to messages (`telemetry`, `status`, `values`, `texts`) and from messages to what is
wanted (`commands`, `driving`); a session that is driven by time and bytes alone (`session`); a thread around it and a
line (`link`). It sees the daemon only through `Operations`.
"""
