"""Catalogue and formulas against published figures."""

from __future__ import annotations

import math

import pytest

from lenscl.errors import StudyError
from lenscl.materials import (
    CATALOGUE,
    D_LINE,
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
# table; sapphire: Malitson & Dodge; water: Daimon & Masumura at 20 degrees; plastics: Sultanova et al.
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
