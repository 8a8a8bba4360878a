"""The nodes around the example robots: what sees, turns, pushes, drives, announces and stops for their controllers."""
