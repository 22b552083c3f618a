"""Refractive index against wavelength: the formulas that glass makers and handbooks print.

Wavelengths are in nanometres at the interface and in micrometres inside the formulas, as their sources have them.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass

from lenscl.errors import StudyError

D_LINE = 587.5618  # nm, the helium d line, at which a catalogue states its n_d
F_LINE, C_LINE = 486.1327, 656.2725  # nm, of hydrogen; they define the Abbe number V_d = (n_d - 1) / (n_F - n_C)
LOWEST_N, HIGHEST_N = 1e-3, 1e3  # what a study may ask for; single precision still refracts there
_SHORTEST_NM, _LONGEST_NM = 1.0, 1e7  # far beyond every table, and safe to square

Range = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Constant:
    """The same index at every wavelength."""

    n: float

    def at(self, wavelength_nm: float) -> float:
        """Return the index; see `Sellmeier.at`."""
        _check_wavelength(wavelength_nm, None)
        return self.n

    def written(self) -> float:
        """Return the value as a study file writes it."""
        return self.n


@dataclass(frozen=True, slots=True)
class Sellmeier:
    """n^2 = 1 + sum of B_i L^2 / (L^2 - C_i), L the wavelength in micrometres.

    Parameters
    ----------
    b : tuple of float
        Strengths, dimensionless.
    c : tuple of float
        Squared resonances, in square micrometres, as many as `b`.
    valid : (float, float) or None
        Wavelengths in nm for which the coefficients were fitted; None where nobody has said.
    """

    b: tuple[float, ...]
    c: tuple[float, ...]
    valid: Range | None = None

    def at(self, wavelength_nm: float) -> float:
        """Return the index at a wavelength in nanometres.

        Raises
        ------
        StudyError
            If the wavelength is outside the range of the data, or the formula has no real index there.
        """
        _check_wavelength(wavelength_nm, self.valid)
        l2 = (wavelength_nm * 1e-3) ** 2
        if any(l2 == c for c in self.c):
            raise StudyError([f"refractive index: the formula has a resonance at {wavelength_nm:g} nm"])
        n2 = 1.0 + sum(b * l2 / (l2 - c) for b, c in zip(self.b, self.c, strict=True))
        return _real_index(math.sqrt(n2) if 0.0 < n2 < math.inf else math.nan, wavelength_nm)

    def written(self) -> dict[str, list[float]]:
        """Return the table as a study file writes it."""
        return {"sellmeier": [*self.b, *self.c]}


@dataclass(frozen=True, slots=True)
class Cauchy:
    """n = A + B / L^2 + C / L^4 + ..., L the wavelength in micrometres."""

    coefficients: tuple[float, ...]
    valid: Range | None = None

    def at(self, wavelength_nm: float) -> float:
        """Return the index at a wavelength in nanometres; raises as `Sellmeier.at`."""
        _check_wavelength(wavelength_nm, self.valid)
        u = (wavelength_nm * 1e-3) ** -2.0
        n = 0.0
        for coefficient in reversed(self.coefficients):
            n = n * u + coefficient
        return _real_index(n, wavelength_nm)

    def written(self) -> dict[str, list[float]]:
        """Return the table as a study file writes it."""
        return {"cauchy": list(self.coefficients)}


@dataclass(frozen=True, slots=True)
class Abbe:
    """n = A + B / L^2 with a stated index at the d line and a stated Abbe number, V_d = (n_d - 1) / (n_F - n_C).

    This is Cauchy's formula with two terms: B = (n_d - 1) / (V_d (F^-2 - C^-2)) and A = n_d - B / d^2, with the lines
    d, F and C in micrometres. From 440 to 650 nm it is off a real glass by up to 1e-4 for a crown such as BK7, and
    by up to 3e-3 for a dense flint such as N-SF6.

    Parameters
    ----------
    nd : float
        Refractive index at the d line, 587.5618 nm, 1 or more.
    vd : float
        Abbe number, positive.
    """

    nd: float
    vd: float

    def at(self, wavelength_nm: float) -> float:
        """Return the index at a wavelength in nanometres, exactly `nd` at the d line; raises as `Sellmeier.at`."""
        _check_wavelength(wavelength_nm, None)
        d, f, c, u = ((nm * 1e-3) ** -2.0 for nm in (D_LINE, F_LINE, C_LINE, wavelength_nm))
        slope = (self.nd - 1.0) / (f - c) / self.vd
        return _real_index(self.nd + slope * (u - d), wavelength_nm)

    def written(self) -> dict[str, float]:
        """Return the table as a study file writes it."""
        return {"nd": self.nd, "vd": self.vd}


@dataclass(frozen=True, slots=True)
class Table:
    """Measured points, rising in wavelength, with straight lines between them; nothing outside."""

    wavelengths_nm: tuple[float, ...]
    indices: tuple[float, ...]

    @property
    def valid(self) -> Range:
        """Wavelengths covered, in nm, both ends in."""
        return self.wavelengths_nm[0], self.wavelengths_nm[-1]

    def at(self, wavelength_nm: float) -> float:
        """Return the index at a wavelength in nanometres; raises as `Sellmeier.at`."""
        _check_wavelength(wavelength_nm, self.valid)
        right = min(bisect_right(self.wavelengths_nm, wavelength_nm), len(self.indices) - 1)
        left = max(right - 1, 0)
        if left == right:
            return self.indices[right]
        start, stop = self.wavelengths_nm[left], self.wavelengths_nm[right]
        share = (wavelength_nm - start) / (stop - start)
        return self.indices[left] * (1.0 - share) + self.indices[right] * share

    def written(self) -> dict[str, list[list[float]]]:
        """Return the table as a study file writes it."""
        return {"table": [[nm, n] for nm, n in zip(self.wavelengths_nm, self.indices, strict=True)]}


Index = Constant | Sellmeier | Cauchy | Abbe | Table


def index_problems(index: Index, wavelength_nm: float = D_LINE) -> Iterator[str]:
    """Yield what keeps an index from being used in a study: its value at the wavelength must be known and in range."""
    try:
        n = index.at(wavelength_nm)
    except StudyError as error:
        yield str(error)
        return
    if not LOWEST_N <= n <= HIGHEST_N:
        where = "" if wavelength_nm == D_LINE else f" at {wavelength_nm:g} nm"
        yield f"must be an index from {LOWEST_N:g} to {HIGHEST_N:g}, got {n!r}{where}"


def _check_wavelength(wavelength_nm: float, valid: Range | None) -> None:
    if not _SHORTEST_NM <= wavelength_nm <= _LONGEST_NM:
        expected = f"must be a number of nanometres from {_SHORTEST_NM:g} to {_LONGEST_NM:g}"
        raise StudyError([f"wavelength: {expected}, got {wavelength_nm!r}"])
    if valid is not None and not valid[0] <= wavelength_nm <= valid[1]:
        raise StudyError([f"refractive index: known from {valid[0]:g} to {valid[1]:g} nm, not at {wavelength_nm:g} nm"])


def _real_index(n: float, wavelength_nm: float) -> float:
    if not 0.0 < n < math.inf:
        raise StudyError([f"refractive index: the formula gives no positive index at {wavelength_nm:g} nm"])
    return n
