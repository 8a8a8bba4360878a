"""Messages of the API to the core's values and back; the worker's side, which imports the core."""
