"""The paper's experiments, run whole: scenarios with a supervisor and a robot, and checks of their outcome."""
