"""Version 1 of the API: only the servers and clients convert between it and the core."""
