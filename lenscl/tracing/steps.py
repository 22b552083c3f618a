"""Count the steps that searches take: what a method's time is made of, whatever the device."""

from __future__ import annotations

from dataclasses import dataclass

from lenscl.config import Scene
from lenscl.device import Device
from lenscl.tracing.job import Job


@dataclass(frozen=True, slots=True, kw_only=True)
class StepCount:
    """How hard a film's rays were to search, as they were traced first; not again in a higher precision.

    Attributes
    ----------
    searches : int
        How often a ray asked a lens for its next surface, in the lens's box.
    steps : int
        What the searches took together: looks at F along the ray, at its polynomial, or at its bounds on a segment,
        and Newton's steps.
    """

    searches: int
    steps: int

    @property
    def mean(self) -> float:
        """Steps a search; 0 where there was none."""
        return self.steps / self.searches if self.searches else 0.0


def count_steps(
    scene: Scene, *, method: str | None = None, precision: str | None = None, device: Device | str | None = None
) -> StepCount:
    """Trace the film once more, by a kernel that counts; parameters and errors as for `trace`."""
    job = Job.prepare(scene, scene.source.kind, "map", method, precision, device, counts=True)
    job.run_film()
    return StepCount(searches=job.searches, steps=job.steps)
