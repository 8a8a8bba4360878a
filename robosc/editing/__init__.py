"""Information about a text for editors, also while it is being typed; knows no protocol."""
