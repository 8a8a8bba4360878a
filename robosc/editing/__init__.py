"""What editors ask about a text, also while it is being typed; knows no protocol."""
