"""The materials known by name, each with the source of its numbers."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, overload

from lenscl.errors import StudyError
from lenscl.materials.dispersion import D_LINE, Constant, Index, Sellmeier, Table

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


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
    aliases : tuple of str
        Other names of the same material with the same dispersion formula.
    """

    name: str | None
    index: Index
    source: str
    aliases: tuple[str, ...] = ()

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
        aliases=("H2O",),
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
        aliases=("UV fused silica", "UVFS"),
    ),
    Material(
        name="BK7",
        index=Sellmeier(
            (1.03961212, 0.231792344, 1.01046945), (0.00600069867, 0.0200179144, 103.560653), (300.0, 2500.0)
        ),
        source=_SCHOTT + ", N-BK7",
        aliases=("N-BK7", "N-BK7HT"),
    ),
    Material(
        name="BaK4",
        index=Sellmeier(
            (1.28834642, 0.132817724, 0.945395373), (0.00779980626, 0.0315631177, 105.965875), (334.0, 2500.0)
        ),
        source=_SCHOTT + ", N-BAK4",
        aliases=("N-BAK4", "N-BAK4HT"),
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
        name="N-BAF10",
        index=Sellmeier(
            (1.5851495, 0.143559385, 1.08521269), (0.00926681282, 0.0424489805, 105.613573), (350.0, 2500.0)
        ),
        source=_SCHOTT,
    ),
    Material(
        name="N-F2",
        index=Sellmeier(
            (1.39757037, 0.159201403, 1.2686543), (0.00995906143, 0.0546931752, 119.248346), (365.0, 2500.0)
        ),
        source=_SCHOTT,
    ),
    Material(
        name="N-LAK22",
        index=Sellmeier(
            (1.14229781, 0.535138441, 1.04088385), (0.00585778594, 0.0198546147, 100.834017), (320.0, 2500.0)
        ),
        source=_SCHOTT,
    ),
    Material(
        name="N-SF5",
        index=Sellmeier(
            (1.52481889, 0.187085527, 1.42729015), (0.011254756, 0.0588995392, 129.141675), (370.0, 2500.0)
        ),
        source=_SCHOTT,
    ),
    Material(
        name="N-SF6",
        index=Sellmeier(
            (1.77931763, 0.338149866, 2.08734474), (0.0133714182, 0.0617533621, 174.01759), (370.0, 2500.0)
        ),
        source=_SCHOTT,
    ),
    Material(
        name="N-SF10",
        index=Sellmeier(
            (1.62153902, 0.256287842, 1.64447552), (0.0122241457, 0.0595736775, 147.468793), (380.0, 2500.0)
        ),
        source=_SCHOTT,
    ),
    Material(
        name="N-SF11",
        index=Sellmeier((1.73759695, 0.313747346, 1.89878101), (0.013188707, 0.0623068142, 155.23629), (370.0, 2500.0)),
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
        aliases=("Al2O3",),
    ),
    Material(
        name="diamond",
        index=Sellmeier((0.3306, 4.3356), (0.1750**2, 0.1060**2), (226.0, 650.0)),
        source="Peter 1923, Z. Phys. 15, 358",
    ),
    Material(
        name="acrylic",
        index=Sellmeier((1.1819,), (0.011313,), (436.8, 1052.0)),
        source=_SULTANOVA + ", PMMA",
        aliases=("PMMA",),
    ),
    Material(
        name="polycarbonate",
        index=Sellmeier((1.4182,), (0.021304,), (436.8, 1052.0)),
        source=_SULTANOVA + ", PC",
        aliases=("PC",),
    ),
    Material(
        name="calcium fluoride",
        index=Sellmeier(
            (0.5675888, 0.4710914, 3.8484723),
            (0.050263605**2, 0.1003909**2, 34.649040**2),
            (230.0, 9700.0),
        ),
        source="Malitson 1963, Appl. Opt. 2, 1103, at 24 degrees C",
        aliases=("CaF2", "fluorite"),
    ),
)

CATALOGUE: Mapping[str, Material] = MappingProxyType({str(row.name): row for row in _ROWS})


def _plain(name: str) -> str:
    """Reduce a name to what counts: `Fused_Silica`, `fused-silica` and `fused silica` are one material."""
    return "".join(letter for letter in name.casefold() if letter not in " _-")


# Every name that a study may write, as it is spelled, and its material
_BY_SPELLING = {str(name): row for row in _ROWS for name in (row.name, *row.aliases)}
_BY_PLAIN_NAME = {_plain(name): (name, row) for name, row in _BY_SPELLING.items()}
ALIASES: Mapping[str, str] = MappingProxyType({alias: str(row.name) for row in _ROWS for alias in row.aliases})


def _nearest(plain: str) -> str | None:
    """Return the name, of a material or an alias, that is nearest to a plain one; a glass keeps its number."""
    digits, letters = _parted(plain)
    fits = {other: _parted(other)[1] for other in _BY_PLAIN_NAME if _parted(other)[0] == digits}
    if digits:  # the letters are a family of glasses, few and telling: F5 is no SF5, LAK9 no BaK9
        fits = {other: family for other, family in fits.items() if _is_family(family, letters)}
        fits.pop(f"n{plain}", None)  # SF6, with lead, is another glass than N-SF6
    near = difflib.get_close_matches(plain, fits, n=1, cutoff=0.6) or [
        other for other in fits if len(other) > 2 and (other in plain or (len(plain) > 2 and plain in other))
    ]
    return _BY_PLAIN_NAME[near[0]][0] if near else None


def _parted(plain: str) -> tuple[str, str]:
    """Return the digits of a plain name, and its letters without the N of glass that is free of lead and arsenic."""
    return re.sub(r"\D", "", plain), re.sub(r"^n(?=.*\d)|\d", "", plain)


def _is_family(family: str, letters: str) -> bool:
    """Return whether letters are those of a family of glasses, misspelled or with a maker's name beside them."""
    alike = difflib.SequenceMatcher(None, family, letters).ratio()
    return alike > 0.7 or (len(family) > 1 and letters.endswith(family))


def material_names() -> tuple[str, ...]:
    """Return the names of the catalogue, in its order, without aliases; those are in `ALIASES`."""
    return tuple(CATALOGUE)


def material(name: str) -> Material:
    """Return a material by its name or an alias; case, blanks, `-` and `_` do not matter.

    Raises
    ------
    StudyError
        If there is none of that name; the message gives the nearest.
    """
    found = _BY_PLAIN_NAME.get(_plain(name[:100]))
    if found is not None:
        return found[1]
    near = _nearest(_plain(name[:100]))
    advice = f'did you mean "{near}"?' if near else f"known are {', '.join(CATALOGUE)}"
    raise StudyError([f"unknown material {name[:60]!r}; {advice}"])


@overload
def refractive_index(material_name: str, wavelength_nm: float) -> float: ...
@overload
def refractive_index(material_name: str, wavelength_nm: NDArray[Any] | Sequence[Any]) -> NDArray[np.float64]: ...
def refractive_index(
    material_name: str, wavelength_nm: float | NDArray[Any] | Sequence[Any]
) -> float | NDArray[np.float64]:
    """Return the refractive index of a catalogue material at a wavelength, or at many.

    Parameters
    ----------
    material_name : str
        A name of `material_names()`, or an alias.
    wavelength_nm : float or array_like
        Vacuum wavelength in nanometres. A material without dispersion data has the same index at all of them.

    Returns
    -------
    float or float64 array
        An array of the shape of `wavelength_nm` where that is an array or a sequence.

    Raises
    ------
    StudyError
        If the material is unknown or a wavelength is outside the range of its data.

    Examples
    --------
    >>> round(refractive_index("BK7", 587.5618), 4)
    1.5168
    >>> refractive_index("N-BK7", [486.1327, 656.2725]).round(4).tolist()
    [1.5224, 1.5143]
    """
    found = material(material_name)
    try:
        if isinstance(wavelength_nm, Real):
            return found.index.at(float(wavelength_nm))
        return _indices(found.index, wavelength_nm)
    except StudyError as error:
        raise StudyError([f"{found.name}: {error}"]) from None


def _indices(index: Index, wavelengths_nm: Any) -> NDArray[np.float64]:
    """Return the index at each wavelength of an array or a sequence, in its shape."""
    import numpy as np  # only here, so that reading a study need not wait for it

    try:
        many = np.asarray(wavelengths_nm, dtype=np.float64)
    except (TypeError, ValueError):
        raise StudyError(["wavelength: must be a number of nanometres or an array of such numbers"]) from None
    return np.array([index.at(nm) for nm in many.ravel().tolist()], dtype=np.float64).reshape(many.shape)
