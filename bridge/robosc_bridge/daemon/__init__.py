"""The daemon: a thread for each device, and the loop that executes the supervisor between them."""
