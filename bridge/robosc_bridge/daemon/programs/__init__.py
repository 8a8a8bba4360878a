"""Programs that are connected to the daemon, and what the loop exchanges with them."""
