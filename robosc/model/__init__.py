"""The checked model: what a robot is once every name is bound and every type is known."""
