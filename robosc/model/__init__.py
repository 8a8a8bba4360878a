"""The checked model: the description of a robot with every name bound and every type known."""
