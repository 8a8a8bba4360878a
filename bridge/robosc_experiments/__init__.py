"""The paper's experiments, run whole: scenarios with a supervisor, a robot, and a judgement of what happened."""
