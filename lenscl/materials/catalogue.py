"""The materials known by name, each with the source of its numbers."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from lenscl.errors import StudyError
from lenscl.materials.dispersion import D_LINE, Constant, Index, Sellmeier, Table


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """What light passes through.

    Parameters
    ----------
    name : str or None
        Its name in the catalogue; None for an index that a study states itself.
    index : Index
        Refractive index against wavelength.
    source : str
        Where the numbers come from.
    """

    name: str | None
    index: Index
    source: str

    @property
    def n(self) -> float:
        """The refractive index at the d line, 587.5618 nm."""
        return self.index.at(D_LINE)


_SCHOTT = "Schott, Optical Glass: Data Sheets (2017), dispersion formula with B1 ... C3"
_SULTANOVA = "Sultanova, Kasarova & Nikolov 2009, Acta Phys. Pol. A 116, 585, at 20 degrees C"

_ROWS = (
    Material(name="vacuum", index=Constant(1.0), source="by definition"),
    Material(
        name="air",
        index=Constant(1.000277),
        source="Ciddor 1996, Appl. Opt. 35, 1566, at the d line, 15 degrees C, 101325 Pa, 450 ppm CO2, dry; rounded",
    ),
    Material(
        name="water",
        index=Sellmeier(
            (5.684027565e-1, 1.726177391e-1, 2.086189578e-2, 1.130748688e-1),
            (5.101829712e-3, 1.821153936e-2, 2.620722293e-2, 1.069792721e1),
            (182.0, 1129.0),
        ),
        source="Daimon & Masumura 2007, Appl. Opt. 46, 3811, distilled, at 20 degrees C",
    ),
    Material(
        name="ice",
        index=Table(
            (400.0, 450.0, 500.0, 550.0, 580.0, 590.0, 600.0, 650.0, 700.0, 750.0, 800.0),
            (1.3194, 1.3157, 1.3130, 1.3110, 1.3100, 1.3097, 1.3094, 1.3080, 1.3069, 1.3059, 1.3049),
        ),
        source="Warren & Brandt 2008, J. Geophys. Res. 113, D14220, at -7 degrees C",
    ),
    Material(
        name="fused silica",
        index=Sellmeier(
            (0.6961663, 0.4079426, 0.8974794),
            (0.0684043**2, 0.1162414**2, 9.896161**2),
            (210.0, 3710.0),
        ),
        source="Malitson 1965, J. Opt. Soc. Am. 55, 1205, at 20 degrees C",
    ),
    Material(
        name="BK7",
        index=Sellmeier(
            (1.03961212, 0.231792344, 1.01046945), (0.00600069867, 0.0200179144, 103.560653), (300.0, 2500.0)
        ),
        source=_SCHOTT + ", N-BK7",
    ),
    Material(
        name="BaK4",
        index=Sellmeier(
            (1.28834642, 0.132817724, 0.945395373), (0.00779980626, 0.0315631177, 105.965875), (334.0, 2500.0)
        ),
        source=_SCHOTT + ", N-BAK4",
    ),
    Material(
        name="F2",
        index=Sellmeier(
            (1.34533359, 0.209073176, 0.937357162), (0.00997743871, 0.0470450767, 111.886764), (320.0, 2500.0)
        ),
        source=_SCHOTT,
    ),
    Material(
        name="SF10",
        index=Sellmeier(
            (1.61625977, 0.259229334, 1.07762317), (0.0127534559, 0.0581983954, 116.60768), (380.0, 2500.0)
        ),
        source=_SCHOTT,
    ),
    Material(
        name="SF11",
        index=Sellmeier(
            (1.73848403, 0.311168974, 1.17490871), (0.0136068604, 0.0615960463, 121.922711), (380.0, 2500.0)
        ),
        source=_SCHOTT,
    ),
    Material(
        name="sapphire",
        index=Sellmeier(
            (1.4313493, 0.65054713, 5.3414021),
            (0.0726631**2, 0.1193242**2, 18.028251**2),
            (200.0, 5500.0),
        ),
        source="Malitson & Dodge 1972, J. Opt. Soc. Am. 62, 1405, ordinary ray, at 20 degrees C",
    ),
    Material(
        name="diamond",
        index=Sellmeier((0.3306, 4.3356), (0.1750**2, 0.1060**2), (226.0, 650.0)),
        source="Peter 1923, Z. Phys. 15, 358",
    ),
    Material(name="acrylic", index=Sellmeier((1.1819,), (0.011313,), (436.8, 1052.0)), source=_SULTANOVA + ", PMMA"),
    Material(
        name="polycarbonate", index=Sellmeier((1.4182,), (0.021304,), (436.8, 1052.0)), source=_SULTANOVA + ", PC"
    ),
)

CATALOGUE: Mapping[str, Material] = MappingProxyType({str(row.name): row for row in _ROWS})


def _plain(name: str) -> str:
    """Reduce a name to what counts: `Fused_Silica`, `fused-silica` and `fused silica` are one material."""
    return "".join(letter for letter in name.casefold() if letter not in " _-")


_BY_PLAIN_NAME = {_plain(str(row.name)): row for row in _ROWS}


def _nearest(plain: str) -> Material | None:
    """Return the material whose name, or other name in its source, is nearest; a glass keeps its number."""
    named = {**_by_source(), **_BY_PLAIN_NAME}
    if plain in named:
        return named[plain]
    digits = re.sub(r"\D", "", plain)
    fits = [other for other in named if re.sub(r"\D", "", other) == digits]
    near = difflib.get_close_matches(plain, fits, n=1, cutoff=0.6) or [
        other for other in fits if len(other) > 2 and (other in plain or (len(plain) > 2 and plain in other))
    ]
    return named[near[0]] if near else None


def _by_source() -> dict[str, Material]:
    """Return the materials by what their sources call them: the last words, as in "..., N-BK7"."""
    return {_plain(row.source.rpartition(", ")[2]): row for row in _ROWS if re.fullmatch(r".*, [A-Z0-9-]+", row.source)}


def material_names() -> tuple[str, ...]:
    """Return the names of the catalogue, in its order."""
    return tuple(CATALOGUE)


def material(name: str) -> Material:
    """Return a material of the catalogue; case, blanks, `-` and `_` do not matter.

    Raises
    ------
    StudyError
        If there is none of that name; the message gives the nearest.
    """
    found = _BY_PLAIN_NAME.get(_plain(name[:100]))
    if found is not None:
        return found
    near = _nearest(_plain(name[:100]))
    advice = f'did you mean "{near.name}"?' if near else f"known are {', '.join(CATALOGUE)}"
    raise StudyError([f"unknown material {name[:60]!r}; {advice}"])


def refractive_index(material_name: str, wavelength_nm: float) -> float:
    """Return the refractive index of a catalogue material at a wavelength.

    Parameters
    ----------
    material_name : str
        A name of `material_names()`.
    wavelength_nm : float
        Vacuum wavelength in nanometres. A material without dispersion data has the same index at all of them.

    Raises
    ------
    StudyError
        If the material is unknown or the wavelength is outside the range of its data.

    Examples
    --------
    >>> round(refractive_index("BK7", 587.5618), 4)
    1.5168
    """
    found = material(material_name)
    try:
        return found.index.at(wavelength_nm)
    except StudyError as error:
        raise StudyError([f"{found.name}: {error}"]) from None
