"""Drift: differences between a robot's motion, the rotation of its wheels and the counts of its encoders."""

import random

from robosc_simulated.scene import Noise

EVERY_STEPS = 20
"""Number of steps of the world for which one draw holds."""


class Drift:
    """Slip and errors of encoders by chance, the same for the same seed.

    Args:
        noise: Amount of slip and errors.
        seed: Seed of the chance.

    Attributes:
        slips: Share of its way that the left and the right wheel lose now; 1 at most.
        errors: Share that the left and the right encoder count too much now.
    """

    def __init__(self, noise: Noise, seed: int) -> None:
        self.slips = (0.0, 0.0)
        self.errors = (0.0, 0.0)
        self._noise = noise
        self._chance = random.Random(f"drift {seed}")  # noqa: S311 (slip is no secret)
        self._steps = 0

    def step(self) -> None:
        """Live one step of the world."""
        if self._steps % EVERY_STEPS == 0:
            noise = self._noise
            draw = [self._chance.gauss(0.0, 1.0) for _ in range(4)]
            left, right = (min(noise.slip_share + noise.slip_deviation * value, 1.0) for value in draw[:2])
            self.slips = (left, right)
            self.errors = (noise.encoder_deviation * draw[2], noise.encoder_deviation * draw[3])
        self._steps += 1
