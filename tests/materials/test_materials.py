"""Catalogue and formulas against published figures."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lenscl.errors import StudyError
from lenscl.materials import (
    ALIASES,
    CATALOGUE,
    D_LINE,
    Abbe,
    Cauchy,
    Constant,
    Sellmeier,
    Table,
    index_problems,
    material,
    material_names,
    refractive_index,
)

F_LINE, C_LINE = 486.1327, 656.2725  # nm, hydrogen

# name, n_d, half a unit of its last digit, Abbe number or None. Glasses: Schott data sheets; fused silica: Malitson's
# table; sapphire: Malitson & Dodge; calcium fluoride: Schott, Calcium Fluoride (2003); water: Daimon & Masumura at 20
# degrees; plastics: Sultanova et al.
PUBLISHED = [
    ("vacuum", 1.0, 0.0, None),
    ("air", 1.000277, 5e-7, None),
    ("water", 1.3334, 5e-5, 55.8),
    ("ice", 1.3098, 5e-5, None),
    ("fused silica", 1.45846, 5e-6, 67.82),
    ("BK7", 1.5168, 5e-6, 64.17),
    ("BaK4", 1.56883, 5e-6, 55.98),
    ("F2", 1.62004, 5e-6, 36.37),
    ("SF10", 1.72825, 5e-6, 28.41),
    ("SF11", 1.78472, 5e-6, 25.76),
    ("N-BAF10", 1.67003, 5e-6, 47.11),
    ("N-F2", 1.62005, 5e-6, 36.43),
    ("N-LAK22", 1.65113, 5e-6, 55.89),
    ("N-SF5", 1.67271, 5e-6, 32.25),
    ("N-SF6", 1.80518, 5e-6, 25.36),
    ("N-SF10", 1.72828, 5e-6, 28.53),
    ("N-SF11", 1.78472, 5e-6, 25.68),
    ("calcium fluoride", 1.43385, 5e-6, 94.99),
    ("sapphire", 1.7682, 5e-5, 72.3),
    ("diamond", 2.417, 1e-3, None),
    ("acrylic", 1.4906, 5e-5, None),
    ("polycarbonate", 1.5848, 5e-5, None),
]


@pytest.mark.parametrize(("name", "n_d", "half_unit", "abbe"), PUBLISHED, ids=[row[0] for row in PUBLISHED])
def test_the_index_at_the_d_line_is_the_published_one(name, n_d, half_unit, abbe):
    assert abs(refractive_index(name, D_LINE) - n_d) <= half_unit
    if abbe is not None:
        spread = refractive_index(name, F_LINE) - refractive_index(name, C_LINE)
        assert (n_d - 1.0) / spread == pytest.approx(abbe, rel=2e-3)


def test_every_material_has_a_published_figure_and_a_source():
    assert {row[0] for row in PUBLISHED} == set(material_names())
    assert all(len(row.source) > 10 for row in CATALOGUE.values())


@pytest.mark.parametrize("name", ["Fused_Silica", "fused-silica", "FUSED SILICA", "fused silica"])
def test_a_name_is_found_whatever_its_case_and_joints(name):
    assert material(name).name == "fused silica"


def test_an_unknown_material_is_refused_with_the_nearest():
    with pytest.raises(StudyError, match=r"unknown material 'dimond'; did you mean \"diamond\"\?"):
        material("dimond")


@pytest.mark.parametrize("wavelength", [100.0, 5000.0])
def test_a_wavelength_outside_the_data_is_refused_with_the_range(wavelength):
    with pytest.raises(StudyError, match=f"BK7: refractive index: known from 300 to 2500 nm, not at {wavelength:g} nm"):
        refractive_index("BK7", wavelength)


@pytest.mark.parametrize("wavelength", [math.nan, math.inf, -1.0, 0.0, 1e-300])
@pytest.mark.parametrize("index", [Constant(1.5), Cauchy((1.5, 0.01)), Sellmeier((1.0,), (0.01,))])
def test_what_is_no_wavelength_is_refused(index, wavelength):
    with pytest.raises(StudyError, match="wavelength: must be a number of nanometres from 1 to"):
        index.at(wavelength)


def test_a_table_meets_its_points_and_is_straight_between_them():
    table = Table((400.0, 500.0, 700.0), (1.6, 1.5, 1.4))
    assert [table.at(nm) for nm in (400.0, 500.0, 700.0)] == [1.6, 1.5, 1.4]
    assert table.at(450.0) == pytest.approx(1.55)
    assert table.at(600.0) == pytest.approx(1.45)
    with pytest.raises(StudyError, match="known from 400 to 700 nm"):
        table.at(701.0)


def test_cauchy_is_the_printed_series():
    assert Cauchy((1.5, 0.004, 1e-4)).at(500.0) == pytest.approx(1.5 + 0.004 / 0.25 + 1e-4 / 0.0625, rel=1e-15)


def test_a_formula_without_a_real_index_is_a_message():
    assert next(index_problems(Sellmeier((-5.0,), (0.0,)))).startswith("refractive index: the formula gives no")
    # The resonance itself, in the arithmetic of the formula
    pole = (D_LINE * 1e-3) ** 2
    assert "resonance" in next(index_problems(Sellmeier((1.0,), (pole,))))


@pytest.mark.parametrize(("n", "fits"), [(1 + 1e-12, True), (1e3, True), (1e-3, True), (1001.0, False), (9e-4, False)])
def test_the_range_of_an_index_is_stated(n, fits):
    found = list(index_problems(Constant(n)))
    assert bool(found) is not fits
    assert all("must be an index from 0.001 to 1000" in problem for problem in found)


@pytest.mark.parametrize(
    ("written", "name", "n_d", "abbe"),
    [
        *[("N-BK7", "BK7", 1.5168, 64.17), ("n_bk7", "BK7", 1.5168, 64.17), ("N-BAK4", "BaK4", 1.56883, 55.98)],
        *[("PMMA", "acrylic", 1.4906, 53.2), ("UVFS", "fused silica", 1.45846, 67.82)],
        *[("CaF2", "calcium fluoride", 1.43385, 94.99), ("Al2O3", "sapphire", 1.7682, 72.3)],
    ],
)
def test_a_makers_name_is_the_material_itself(written, name, n_d, abbe):
    assert material(written) is CATALOGUE[name]
    assert refractive_index(written, D_LINE) == pytest.approx(n_d, abs=5e-5)
    spread = refractive_index(written, F_LINE) - refractive_index(written, C_LINE)
    assert (refractive_index(written, D_LINE) - 1) / spread == pytest.approx(abbe, rel=2e-3)


def test_an_alias_names_one_material_and_hides_no_other():
    assert len(ALIASES) >= 8
    for alias, name in ALIASES.items():
        assert alias not in CATALOGUE
        assert material(alias.lower()) is material(alias.upper()) is CATALOGUE[name]
    plain = ["".join(letter for letter in name.casefold() if letter not in " _-") for name in (*CATALOGUE, *ALIASES)]
    assert len(set(plain)) == len(plain)


@pytest.mark.parametrize(("leaded", "free"), [("SF10", "N-SF10"), ("SF11", "N-SF11"), ("F2", "N-F2")])
def test_a_glass_without_lead_is_no_alias_of_the_one_with(leaded, free):
    assert material(free).name == free
    apart = [refractive_index(free, nm) - refractive_index(leaded, nm) for nm in (440.0, D_LINE, 1000.0, 2000.0)]
    assert max(map(abs, apart)) > 3e-4


def test_indices_of_many_wavelengths_keep_their_shape():
    nm = np.linspace(400.0, 700.0, 24).reshape(2, 3, 4)
    found = refractive_index("N-BK7", nm)
    assert found.shape == (2, 3, 4)
    assert found.dtype == np.float64
    l2 = (nm * 1e-3) ** 2  # as Schott prints it
    terms = ((1.03961212, 0.00600069867), (0.231792344, 0.0200179144), (1.01046945, 103.560653))
    wanted = np.sqrt(1 + sum(b * l2 / (l2 - c) for b, c in terms))
    np.testing.assert_allclose(found, wanted, rtol=1e-15)
    assert refractive_index("BK7", [486, 656]).shape == (2,)
    assert refractive_index("vacuum", np.empty((0, 3))).shape == (0, 3)
    for one in (500, 500.0, np.float32(500), np.array(500)):
        assert float(refractive_index("BK7", one)) == refractive_index("BK7", 500.0)
    assert type(refractive_index("BK7", 500)) is float


@pytest.mark.parametrize(
    ("bad", "says"),
    [([500.0, 5000.0], "known from 300 to 2500 nm, not at 5000 nm"), ([math.nan], "got nan"), (["red"], "an array of")],
)
def test_a_wrong_wavelength_among_many_is_refused(bad, says):
    with pytest.raises(StudyError, match=says):
        refractive_index("BK7", bad)


@given(nd=st.floats(1.0, 4.0), vd=st.floats(2.0, 1e3), nm=st.floats(300.0, 2500.0))
def test_nd_and_vd_are_the_two_terms_of_cauchy_worked_out_by_hand(nd, vd, nm):
    with mpmath.workdps(40):
        d, f, c = (mpmath.mpf(text) / 1000 for text in ("587.5618", "486.1327", "656.2725"))
        b = (mpmath.mpf(nd) - 1) / (mpmath.mpf(vd) * (1 / f**2 - 1 / c**2))
        wanted = mpmath.mpf(nd) - b / d**2 + b / (mpmath.mpf(nm) / 1000) ** 2
        off = abs(Abbe(nd, vd).at(nm) - wanted) if wanted > 0 else 0
        assert off <= 1e-15 * (nd + abs(b) * 15)


@given(nd=st.floats(1.0 + 1e-3, 4.0), vd=st.floats(5.0, 200.0))
def test_nd_and_vd_are_recovered_at_the_lines(nd, vd):
    index = Abbe(nd, vd)
    assert index.at(D_LINE) == nd
    spread = index.at(F_LINE) - index.at(C_LINE)
    assert spread > 0
    assert (index.at(D_LINE) - 1) / spread == pytest.approx(vd, rel=1e-9)


@pytest.mark.parametrize(("name", "off"), [("BK7", 1e-4), ("acrylic", 2e-4), ("F2", 1e-3), ("N-SF6", 3e-3)])
def test_nd_and_vd_are_as_near_to_a_glass_as_is_said(name, off):
    glass = CATALOGUE[name]
    index = Abbe(glass.n, (glass.n - 1) / (glass.index.at(F_LINE) - glass.index.at(C_LINE)))
    nm = np.linspace(440.0, 650.0, 211)
    worst = np.abs(np.array([index.at(each) for each in nm]) - refractive_index(name, nm)).max()
    assert off / 10 < worst < off


def test_nd_and_vd_without_an_index_far_out_say_so():
    assert next(index_problems(Abbe(3.0, 0.5), 2000.0)).startswith("refractive index: the formula gives no positive")
