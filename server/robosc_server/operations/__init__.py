"""Tools for operators: settings, health, metrics, logs, traces."""
