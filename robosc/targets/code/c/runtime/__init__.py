"""C text that does not depend on a model."""
