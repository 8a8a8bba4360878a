"""Information about a text for editors, also while it is being typed, independent of any editor protocol."""
