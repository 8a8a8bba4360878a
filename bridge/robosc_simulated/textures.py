"""Look of a floor: shades that a formula gives for every point, so that it has no end.

The random shade of a cell of speckle is a hash of its place and of the seed, mixed as in MurmurHash3's last step
(A. Appleby, "MurmurHash3", fmix32, 2011): nothing is kept, and the same place always looks the same.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from robosc_simulated.walls import Floats

Shades = npt.NDArray[np.uint8]
TextureKind = Literal["plain", "tiles", "checkerboard", "speckle"]

# Farther away, places would not be whole numbers that a hash can tell apart.
_FAR_M = 1e4


@dataclass(frozen=True)
class Texture:
    """A floor.

    Attributes:
        kind: `tiles` have joints of the other shade between them, fields of a `checkerboard` take turns, and `speckle`
            is random from cell to cell.
        shade: From 0 (black) to 255 (white).
        other_shade: Of joints and of every other field; the farthest that a speckle goes.
        size_m: Width of a tile, of a field, of a cell of speckle.
        joint_m: Width of the joints between tiles.
        seed: Of the speckle.
    """

    kind: TextureKind = "plain"
    shade: int = 200
    other_shade: int = 170
    size_m: float = 0.3
    joint_m: float = 0.01
    seed: int = 0

    def shades(self, points: Floats) -> Shades:
        """Return the shades of points of the floor.

        Args:
            points: Shape (n, 2), in metres, finite.

        Returns:
            Shape (n,).
        """
        if self.kind == "plain":
            return np.full(len(points), self.shade, dtype=np.uint8)
        near = np.clip(points, -_FAR_M, _FAR_M)
        if self.kind == "tiles":
            tiles = near / self.size_m
            is_joint = (tiles - np.floor(tiles)) * self.size_m < self.joint_m
            return self._either(is_joint[:, 0] | is_joint[:, 1])
        cells = np.floor(near / self.size_m).astype(np.int64)
        if self.kind == "checkerboard":
            return self._either(cells.sum(axis=1) % 2 == 1)
        shares = _hashed(cells, self.seed) / 2.0**32
        return np.rint(self.shade + shares * (self.other_shade - self.shade)).astype(np.uint8)

    def _either(self, is_other: npt.NDArray[np.bool_]) -> Shades:
        return np.where(is_other, np.uint8(self.other_shade), np.uint8(self.shade))


def _hashed(cells: npt.NDArray[np.int64], seed: int) -> npt.NDArray[np.uint32]:
    mixed = (cells[:, 0] * 73_856_093 ^ cells[:, 1] * 19_349_663 ^ (seed * 83_492_791 & 0xFFFF_FFFF)).astype(np.uint32)
    for factor, shift in ((0x85EBCA6B, 16), (0xC2B2AE35, 13)):
        mixed ^= mixed >> np.uint32(shift)
        mixed *= np.uint32(factor)
    mixed ^= mixed >> np.uint32(16)
    return mixed


PLAIN = Texture()
"""Floor where nothing is specified."""
