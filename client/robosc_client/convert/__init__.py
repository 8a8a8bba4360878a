"""The core's values to protobuf messages and back: the one package of the client that touches generated names.

What a server answers is not trusted: sizes, numbers, enums, digests and paths are checked here.
"""
