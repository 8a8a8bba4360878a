"""First drive of a real robot: what is plugged in, servos that are set up, figures that are measured."""
