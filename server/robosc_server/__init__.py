"""The RoboSC service: checks, synthesizes and generates over gRPC what `robosc` does on one machine."""
