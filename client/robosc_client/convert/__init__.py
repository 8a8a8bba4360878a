"""Conversion between protobuf messages and values of the core; only this package uses generated names.

Responses are not trusted: sizes, numbers, enums, digests and paths are checked here.
"""
