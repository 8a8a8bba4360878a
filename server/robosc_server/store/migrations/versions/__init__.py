"""Migration scripts, each from one schema version to the next; a script that was released never changes."""
