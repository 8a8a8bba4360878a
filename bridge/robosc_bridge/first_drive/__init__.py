"""Preparations for the first drive of a real robot: probe of the devices, set-up of servos, calibration."""
