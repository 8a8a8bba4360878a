"""What operators need: settings, health, metrics, logs, traces."""
