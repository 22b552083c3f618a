"""Where a device keeps the rays that one launch puts aside and another carries on, as kernels/parks.cl does."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lenscl.codegen import Structure
from lenscl.device import Device

_ALMOST_ALONE = 4  # of a packet's lanes, one in so many may be put aside, as in kernels/parks.cl


def can_park(chosen: Device, width: int) -> bool:
    """Say whether rays are put aside on a device: where a packet has lanes that wait for each other."""
    return chosen.run > 1 and width >= _ALMOST_ALONE


class Parking:
    """Where a launch puts aside the last few rays of its packets, as kernels/parks.cl does."""

    def __init__(self, chosen: Device, structure: Structure, packets: int) -> None:
        words, width = structure.ray_words, structure.width
        room = packets * (width // _ALMOST_ALONE) + width  # a packet's worth beyond is read, not used
        self._device = chosen
        self._count = chosen.upload(np.zeros(1, np.int32))
        self._places = chosen.empty(4 * room)
        self._words = chosen.empty(np.dtype(structure.carried).itemsize * words * room)

    def arguments(self, carries_on: bool) -> tuple[Any, ...]:
        """Return what the kernel takes; the second launch carries on what the first put aside."""
        return np.int32(carries_on), self._count, self._places, self._words

    def places(self) -> NDArray[np.int32]:
        """Return the rays that were put aside, by their numbers in the launch."""
        count = np.empty(1, np.int32)
        self._device.download(self._count, count)
        places = np.empty(int(count[0]), np.int32)
        self._device.download(self._places, places)
        return places
