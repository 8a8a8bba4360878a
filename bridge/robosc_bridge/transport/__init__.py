"""Bytes on a line: what opens, waits for, reads, writes and closes one, and says in one way what went wrong."""
