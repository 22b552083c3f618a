"""Why a ray ended. Failure is data: a status, never NaN."""

from __future__ import annotations

from enum import IntEnum


class RayStatus(IntEnum):
    """The end of one ray; the values are part of the file formats and never change."""

    PICTURE = 0  # landed on the picture
    OFF_PICTURE = 1  # met the picture's plane outside the picture
    BEHIND = 2  # never meets the picture's plane ahead
    TOTAL_REFLECTION = 3  # ended at a total reflection, reflecting being left out
    TRAPPED = 4  # a further event existed when the event limit was reached
    UNDECIDED = 5  # the search could not prove its answer
    BLOCKED = 6  # hit an absorbing part

    @property
    def lands(self) -> bool:
        """Whether such a ray has a place (s, t) on the picture's plane."""
        return self in (RayStatus.PICTURE, RayStatus.OFF_PICTURE)
