"""The API of the synthesis service, generated from the .proto files beside it."""
