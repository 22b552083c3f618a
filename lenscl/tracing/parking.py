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
    """Where a launch puts aside the last few rays of its packets, in a part for each of its layers."""

    def __init__(self, chosen: Device, structure: Structure, packets: int, layers: int) -> None:
        words, width = structure.ray_words, structure.width
        self._room = packets * (width // _ALMOST_ALONE) + width  # a packet's worth beyond is read, not used
        self._device, self._layers = chosen, layers
        self._counts = chosen.upload(np.zeros(layers, np.int32))
        self._places = chosen.empty(4 * layers * self._room)
        self._words = chosen.empty(np.dtype(structure.carried).itemsize * words * layers * self._room)

    def arguments(self, carries_on: bool) -> tuple[Any, ...]:
        """Return what the kernel takes; the second launch carries on what the first put aside."""
        return np.int32(carries_on), np.int32(self._room), self._counts, self._places, self._words

    def places(self) -> list[NDArray[np.int32]]:
        """Return the rays that each layer has put aside, by their numbers in the launch."""
        counts = np.empty(self._layers, np.int32)
        self._device.download(self._counts, counts)
        begins = np.arange(self._layers) * self._room
        places = np.empty(begins[-1] + counts[-1], np.int32)
        self._device.download(self._places, places)
        return [places[begin : begin + count] for begin, count in zip(begins, counts, strict=True)]
