"""The robot as the executor sees it: channels, motion, rotations, the operator's stop."""
