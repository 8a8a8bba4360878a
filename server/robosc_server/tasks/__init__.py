"""Tasks of the server: requests, limits, execution and outcomes."""
