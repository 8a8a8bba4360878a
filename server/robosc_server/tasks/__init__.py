"""Work that the server is asked to do, whoever does it: tasks, their limits, and how they end."""
