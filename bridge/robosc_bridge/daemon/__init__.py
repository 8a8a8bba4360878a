"""The daemon: devices in threads of their own, and the loop that executes the supervisor between them."""
