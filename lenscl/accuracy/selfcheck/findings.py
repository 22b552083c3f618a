"""What self-checks found, as frozen values: of one ray map, or of all the points of a sweep."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Self

LAWS = ("length", "surface", "contact", "snell", "stop", "return", "ahead", "place", "map")
_EXPECTED = {
    "length": "a unit direction",
    "surface": "|F| = 0 at the point where the surface is met",
    "contact": "one interface where faces of several lenses are in contact, and an end on a face that is the picture",
    "snell": "a ray that bends by the scene's rule",
    "stop": "a ray that ends at the first opaque lens it meets, in the direction in which it came, and at no other",
    "return": "a ray that comes back the way it came",
    "ahead": "nothing in the way of the leg",
    "place": "a place on the picture where the last leg meets it",
    "map": "the end that a ray through the pixel has when traced alone",
}
# Why a law may be broken, and what to do about it; `about` says what or where
CAUSES = {
    "media": (
        "{about} overlap, touch or lie in one another there, and the program seems to have mistaken which of them is "
        "the medium: report it with the study and this pixel; until it is mended, write both as one lens by `min` if "
        "they have one index, or leave a gap between them"
    ),
    "overlap": (  # in tables that were made before solids could overlap
        "{about} overlap, touch or lie in one another there, and no path through both is defined: move them apart, or "
        "write both as one lens by `min`"
    ),
    "no number": (
        "the expression of {about} has no finite value there: keep its poles, and the ends of its domain, outside the "
        "lens's `bounds`"
    ),
    "lost": (
        "`march` has passed over a part of {about} thinner than its step: set `numerics.method` to \"auto\", or "
        "`numerics.step` to less"
    ),
    "rounding": (
        "rounding: in double precision the same ray holds; set `numerics.precision` to \"double\""
    ),
    "device": (
        "neither the lenses nor rounding explain it, so the device or its compiler may compute wrongly ({about}): ask "
        "`lenscl doctor`, hold it against `lenscl bench`, and report it with the study, this pixel, device and driver"
    ),
}  # fmt: skip
_UNKNOWN_CAUSE = (  # in tables that were made before causes were looked for
    "its cause was not looked for: try another `numerics.precision` or `numerics.method`, hold it against "
    "`lenscl bench`, and report it if it stays"
)
UNCHECKED = {  # what was left out, in words for people
    "undecided": "left undecided",
    "cut": "with more surfaces than are looked at",
    "singular": "where rounding hides the surface or its normal",
    "unseen": "legs along which rounding hides F",
    "borderline": "within rounding of another path",
    "lost": "where march may have lost a surface",
}
MOST_FAILURES = 8  # kept by a check
_ENOUGH = 0.5  # of the rays: where fewer could be checked, that these hold shows nothing of the others


@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """A law that a ray broke.

    Attributes
    ----------
    row, column : int
        The film pixel.
    event : int
        The surface, counted from 1 along the ray; 0 for the source or the whole path.
    law : str
        One of `LAWS`.
    residual, bound : float
        What was found and what rounding allows, in the law's own unit.
    wavelength : float or None
        In vacuum, nm, where the map has several.
    cause : str or None
        The likely one, of `CAUSES`; None where it was not looked for.
    about : str
        The lenses, or the device with its driver, that the cause names.
    """

    row: int
    column: int
    event: int
    law: str
    residual: float
    bound: float
    wavelength: float | None = None
    cause: str | None = None
    about: str = ""

    def __str__(self) -> str:
        light = "" if self.wavelength is None else f" at {self.wavelength:.4g} nm"
        where = f"{light} at surface {self.event}" if self.event else light
        return (
            f"pixel ({self.row}, {self.column}){where}: expected {_EXPECTED[self.law]}, but the {self.law} check is "
            f"{self.residual:.3g} off where rounding allows {self.bound:.3g}; {self.advice}"
        )

    @property
    def advice(self) -> str:
        """The likely cause, and what to do about it."""
        if self.cause is None:
            return _UNKNOWN_CAUSE
        return f"likely cause: {CAUSES[self.cause].format(about=self.about)}"


@dataclass(frozen=True, slots=True, kw_only=True)
class SelfCheck:
    """What the checks of one ray map, or of several, found.

    Attributes
    ----------
    rays : int
        Sampled, all of which meet a lens, are left undecided, or end on a picture that stops light before any lens.
    untold : int
        How many of them could not be checked: no law could be held against a bound at any surface that they meet, or
        they were left undecided.
    surfaces : int
        Surface points looked at.
    returned : int
        Legs along which a ray was sent back, with a result.
    unchecked : mapping
        How many could not be told, by why: rays "undecided" or "cut" short, surfaces that are "singular", legs that are
        "unseen", "borderline" or "lost".
    worst : mapping
        The largest residual of each law that could be compared, as a multiple of its bound.
    failed : int
        Residuals beyond their bounds.
    failures : tuple of Failure
        The first few of them, one a ray.
    error : str or None
        Why nothing could be checked, if that is so.
    """

    rays: int = 0
    untold: int = 0
    surfaces: int = 0
    returned: int = 0
    unchecked: Mapping[str, int] = field(default_factory=dict)
    worst: Mapping[str, float] = field(default_factory=dict)
    failed: int = 0
    failures: tuple[Failure, ...] = ()
    error: str | None = None

    @property
    def checked(self) -> int:
        """How many of the rays were decided, and held against laws."""
        return self.rays - self.untold

    def at_wavelength(self, nm: float) -> SelfCheck:
        """Return the same with failures that name a wavelength."""
        return replace(self, failures=tuple(replace(failure, wavelength=nm) for failure in self.failures))

    def summary(self) -> str:
        """Return one line for people."""
        if self.error and not self.rays:
            return f"self-checks: not made: {self.error}"
        if not self.rays:
            return "self-checks: no ray of the film meets a lens, so there is nothing to check"
        left_out = ", ".join(f"{n} {UNCHECKED[why]}" for why, n in self.unchecked.items())
        broken_off = f"; some not made: {self.error}" if self.error else ""
        if not self.checked and not self.failed:
            all_undecided = self.unchecked.get("undecided") == self.rays
            why = "all are undecided" if all_undecided else left_out or "no bound is known"
            return f"self-checks: none of {self.rays} rays could be checked: {why}; nothing is shown{broken_off}"
        worst = ", ".join(f"{law} {self.worst[law]:.2g}" for law in LAWS if law in self.worst)
        return (
            f"self-checks: {self._verdict()} {self.surfaces} surfaces, {self.returned} legs followed back; "
            f"worst in units of what rounding allows: {worst or 'none'}"
            + (f"; not checked: {left_out}" if left_out else "")
            + broken_off
        )

    def _verdict(self) -> str:
        counted = f"{self.checked} of {self.rays} rays checked" if self.untold else f"{self.rays} rays"
        if self.failed:
            return f"{self.failed} FAILED: {counted},"
        if self.checked < _ENOUGH * self.rays:
            return f"nothing is shown, for only {self.checked} of {self.rays} rays could be checked (these hold):"
        return f"all hold: {counted},"

    def warnings(self) -> Iterator[str]:
        """Yield a sentence for each failure that is kept, led by its pixel, and one for a check that broke off."""
        for failure in self.failures:
            yield str(failure)
        if self.error is not None:
            yield f"the self-checks could not be made: {self.error}"

    def as_json(self) -> dict[str, Any]:
        """Return everything as plain data, for a table."""
        return {
            "rays": self.rays,
            "untold": self.untold,
            "surfaces": self.surfaces,
            "returned": self.returned,
            "unchecked": dict(self.unchecked),
            "worst": dict(self.worst),
            "failed": self.failed,
            "failures": [asdict(failure) for failure in self.failures],
            "error": self.error,
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Self:
        """Return what `as_json` wrote down, now or before it counted the rays that could not be checked."""
        untold = data.get("untold", data["unchecked"].get("undecided", 0))
        return cls(**{**data, "untold": untold, "failures": tuple(Failure(**failure) for failure in data["failures"])})

    def __add__(self, other: SelfCheck) -> SelfCheck:
        """Return both together; of failures the first few."""
        laws = [law for law in LAWS if law in self.worst or law in other.worst]
        unchecked = Counter(self.unchecked) + Counter(other.unchecked)
        return SelfCheck(
            rays=self.rays + other.rays,
            untold=self.untold + other.untold,
            surfaces=self.surfaces + other.surfaces,
            returned=self.returned + other.returned,
            unchecked={why: unchecked[why] for why in UNCHECKED if unchecked[why]},
            worst={law: max(self.worst.get(law, 0.0), other.worst.get(law, 0.0)) for law in laws},
            failed=self.failed + other.failed,
            failures=(self.failures + other.failures)[:MOST_FAILURES],
            error=self.error or other.error,
        )
