"""The pack itself: that it holds what it should, that it is proved, and that closed forms agree with it."""

from __future__ import annotations

import hashlib
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from lenscl import RayStatus
from lenscl.config import scene_from_toml
from lenscl.errors import LensclError
from lenscl.expr import FUNCTIONS, evaluate
from lenscl.hardcases import LEVELS, REASONS, Case, Level, Pack, load_pack, write_pack
from lenscl.hardcases.pack import _FOLDER as PACK
from lenscl.methods import METHODS
from lenscl.reference import film_rays
from lenscl.reference.oracle import Proof, prove_pixels, prove_rays

FAMILIES = {
    *("null lens", "air bubble", "critical angle", "normal incidence", "grazing incidence", "index"),
    *("tangent", "short chord", "step grid", "twin roots", "start", "squash", "units", "offset"),
    *("heart", "bifolia", "torus", "re-entry", "trapped", "lens after lens", "screens in a lens", "screens"),
    *("expression", "refused", "Snell's law", "reversibility", "etendue", "Malus and Dupin", "Fermat"),
    *("symmetry", "exact lens", "effects"),
}
LATER = {
    2: {"unknown operand", "noisy path", "opaque lens", "axis"},
    3: {"arrangements", "words"},
    4: {"pictures in glass"},
}  # families by the edition that they came with


_FIELDS = (
    "is_exact",
    "starts_exactly",
    "keeps_contact",
    "counts_from",
    "equals",
    "refused",
    "edition",
    "proved_as",
    "has_gaps",
    "counts_lengths",
)


@pytest.fixture(scope="module")
def pack() -> Pack:
    return load_pack()


def test_it_holds_every_family_and_many_rays(pack: Pack) -> None:
    editions = {edition: {case.family for case in pack.cases if case.edition == edition} for edition in (1, *LATER)}
    assert editions == {1: FAMILIES} | LATER
    assert [case.edition for case in pack.cases] == sorted(case.edition for case in pack.cases)
    names = [case.name for case in pack.cases]
    assert len(set(names)) == len(names) >= 150
    assert sum(len(each.answers.status) for each in pack.expected.values()) >= 20_000
    assert {case.equals for case in pack.cases} <= {"", *names}
    assert all(case.why for case in pack.cases)


def test_each_guaranteed_method_has_its_own_number_of_undecided_rays(pack: Pack) -> None:
    rays: Counter[str] = Counter()
    for case in pack.cases:
        rays[case.family] += 0 if case.refused else len(pack.expected[case.name].answers.status)
    assert set(pack.most_undecided) == {"double", "mixed", "single"}
    for precision, tables in pack.most_undecided.items():
        assert set(tables) == {"auto", *(name for name, row in METHODS.items() if row.is_guaranteed)}, precision
        for method, most in tables.items():
            assert all(0 < count < rays[family] for family, count in most.items()), (precision, method)
    assert pack.most_undecided["double"]["auto"]["start"] < pack.most_undecided["double"]["interval"]["start"]


def test_what_came_with_the_first_edition_stays_as_it_was(pack: Pack) -> None:
    first = [case for case in pack.cases if case.edition == 1]
    text = (PACK / "cases.toml").read_text(encoding="utf-8")
    later = next(case.name for case in pack.cases if case.edition > 1)
    digest = hashlib.sha256(text[: text.index(f'[[case]]\nname = "{later}"')].rstrip().encode())
    rays = 0
    for case in first:
        arrays = [case.origins, case.directions]
        if not case.refused:
            expected = pack.expected[case.name]
            answers = [expected.answers, *(expected.moved[level].beside for level in LEVELS)]
            arrays += [array for each in answers for array in (each.status, each.events, each.st)]
            moved = [expected.moved[level] for level in LEVELS]
            arrays += [array for each in moved for array in (each.spread, each.is_stable, each.ray)]
            rays += len(expected.answers.status)
        for array in arrays:
            digest.update(b"" if array is None else np.ascontiguousarray(array).tobytes())
    assert (len(first), rays) == (300, 25_168)
    assert digest.hexdigest() == "85dc071e369120d2dda1b766dd645e1d08bf0a7eee1dc0b36d29333156901b06"


def test_solids_that_answers_are_proved_on_are_those_of_the_cases(pack: Pack) -> None:
    twins = inside = 0
    for case in pack.cases:
        if not case.proved_as:
            continue
        own, twin = (scene_from_toml(text).lenses for text in (case.scene, case.proved_as))
        assert len(own) == len(twin)
        for one, other in zip(own, twin, strict=True):
            assert (one.n, one.centre, one.stretch, one.rotate) == (other.n, other.centre, other.stretch, other.rotate)
            low, high = (np.asarray(corner) for corner in one.surface.box(one.values))
            at = dict(zip("xyz", np.random.default_rng(1).uniform(low, high, (20_000, 3)).T, strict=True))
            own_value, value = (evaluate(lens.surface.expression, {**lens.values, **at}) for lens in (one, other))
            told = np.isfinite(own_value) & (np.abs(value) > 1e-9)
            np.testing.assert_array_equal(own_value[told] <= 0, value[told] <= 0, err_msg=case.name)
            assert told.mean() > 0.4, case.name
            inside += int((value[told] <= 0).sum())
        twins += 1
    assert twins > 40
    assert inside > 20_000


def test_what_is_no_solid_is_never_met(pack: Pack) -> None:
    names = ("unknown: max: no solid", "unknown: max: no solid, the other way round")
    assert all((pack.expected[name].answers.events == 0).all() for name in names)


def test_opaque_lenses_end_rays_at_once_and_nothing_else_does(pack: Pack) -> None:
    blocked = 0
    for case in pack.cases:
        if case.family == "opaque lens":
            exact = pack.expected[case.name].answers
            dark = [lens for lens in scene_from_toml(case.scene).lenses if lens.absorbs]
            is_blocked = exact.status == RayStatus.BLOCKED
            assert dark
            if len(scene_from_toml(case.scene).lenses) == 1:
                assert ((exact.events == 1) == is_blocked).all(), case.name
            blocked += int(is_blocked.sum())
    assert blocked > 200


def test_rays_that_cannot_be_told_have_a_reason(pack: Pack) -> None:
    seen = set()
    for each in pack.expected.values():
        assert each.reasons is not None
        dark = each.answers.status == RayStatus.UNDECIDED
        untold = {name for name in pack.expected if pack.expected[name] is each and not each.reasons[dark].all()}
        assert untold <= {"expression: huge slopes"}  # of which the oracle has learned to tell some since
        assert not each.reasons[each.moved["double"].is_stable].any()
        seen |= {REASONS[number] for number in each.reasons[dark]}
    assert seen >= {"no value of F", "multiple root", "edge", "start on a surface", "screen"}


def test_the_documentation_says_how_large_it_is(pack: Pack) -> None:
    rays = sum(len(each.answers.status) for each in pack.expected.values())
    said = f"{len(pack.cases)} scenes with {rays:,} rays"
    assert said in (Path(__file__).parents[2] / "docs" / "hard-cases.md").read_text(encoding="utf-8")


def test_each_case_holds_rays_firmly_in_double(pack: Pack) -> None:
    loose = {
        case.name
        for case in pack.cases
        if case.name in pack.expected
        and not (case.is_exact or pack.expected[case.name].moved["double"].is_stable.any())
    }
    # A touch of multiplicity 4; along a surface; where there is no normal
    along = ("along the sphere", "along the torus, outside", "along the torus, in its hole", "along the end of a rod")
    at = ("at the tip of a cone", "at the dimple of the heart", "at the pinch of the bifolia")
    on_it = "pictures in glass: a source on the picture"
    assert loose == {"bifolia: the axis", on_it, *(f"start: {place}" for place in (*along, *at))}


def test_every_function_that_users_may_write_stands_in_a_case(pack: Pack) -> None:
    text = " ".join(case.scene for case in pack.cases if not case.refused)
    assert {name for name in FUNCTIONS if f"{name}(" not in text} == set()


def test_what_is_stored_fits_together(pack: Pack) -> None:
    counted = 0
    for case in pack.cases:
        if case.refused:
            assert case.name not in pack.expected
            continue
        expected = pack.expected[case.name]
        count = len(expected.answers.status)
        assert count == (_pixels(case) if case.origins is None else len(case.origins))
        assert np.isfinite(expected.answers.st).all()
        for level in LEVELS:
            moved = expected.moved[level]
            assert moved.spread.shape == moved.is_stable.shape == (count,)
            assert (moved.spread >= 0).all()
            assert set(moved.ray.tolist()) == set(np.flatnonzero(~moved.is_stable).tolist())
        assert (expected.lengths is not None) == case.counts_lengths
        if expected.lengths is not None:
            assert expected.lengths.shape == (count, len(scene_from_toml(case.scene).lenses) + 1)
            for level in LEVELS:
                spread = expected.moved[level].length_spread
                assert spread is not None
                assert spread.shape == expected.lengths.shape
                assert (spread[:, -1] > 0).any()
            counted += 1
        # What rounding to double may do, rounding to single may do all the more
        assert (expected.moved["double"].is_stable | ~expected.moved["single"].is_stable).mean() > 0.99
    assert counted >= 8


def test_rays_of_a_slab_travel_as_far_as_snells_law_says(pack: Pack) -> None:
    """The slab's upper face lies at z = 0.5, its index is 1.5, and the source at z = 4."""
    seen = 0
    for where, z in (("just below the face", 0.499), ("in the middle", 0.1), ("on its far face", -0.5)):
        name = f"pictures in glass: slab, {where}"
        exact = pack.expected[name]
        scene = scene_from_toml(next(case.scene for case in pack.cases if case.name == name))
        origins, ahead = film_rays(scene)
        sine = np.linalg.norm(ahead[:, :2], axis=1) / np.linalg.norm(ahead, axis=1)
        assert exact.lengths is not None
        np.testing.assert_allclose(exact.lengths[:, 1], 3.5 / np.sqrt(1.0 - sine**2), rtol=1e-14)
        np.testing.assert_allclose(exact.lengths[:, 0], (0.5 - z) / np.sqrt(1.0 - (sine / 1.5) ** 2), rtol=1e-13)
        seen += len(origins)
    assert seen == 48


def test_most_rays_are_held_to_their_path_in_either_precision(pack: Pack) -> None:
    held = {level: [each.moved[level].is_stable for each in pack.expected.values()] for level in LEVELS}
    assert np.concatenate(held["double"]).mean() > 0.97
    assert np.concatenate(held["single"]).mean() > 0.75
    untold = {level: _untold(pack, level) for level in LEVELS}  # whose places nothing is known of
    assert untold["double"] < 0.01
    assert untold["single"] < 0.05


def test_rays_picked_from_every_case_are_proved_again(pack: Pack) -> None:
    checked = 0
    for number, case in enumerate(pack.cases):
        if case.refused or case.counts_from is not None:
            continue
        exact = pack.expected[case.name].answers
        ray = number * 7919 % len(exact.status)
        proof = _proved(case, ray)
        assert exact.status[ray] == (RayStatus.UNDECIDED if proof.status is None else proof.status), case.name
        if proof.status is not None:
            assert exact.events[ray] == proof.events, case.name
        if proof.status is not None and proof.st is not None:
            s, t = exact.st[ray].tolist()
            assert proof.distance(s, t) <= 2.0**-53 * max(1.0, abs(s), abs(t)), case.name
            checked += 1
    assert checked > 150


@pytest.mark.parametrize(
    ("name", "unstable"),
    [("torus: the axis", 0), ("screens: a film of 3 x 7", 0), ("critical angle: the flat face of a slab of 1.7", 10)],
)
def test_moves_are_made_again(pack: Pack, name: str, unstable: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "bench"))
    from hard_cases.prove import expected_of

    case, kept = next(case for case in pack.cases if case.name == name), pack.expected[name]
    again = expected_of(case)
    for level in LEVELS:
        now, then = again.moved[level], kept.moved[level]
        np.testing.assert_array_equal(now.is_stable, then.is_stable)
        np.testing.assert_allclose(now.spread, then.spread, rtol=1e-6)
        np.testing.assert_array_equal(now.ray, then.ray)
        np.testing.assert_array_equal(now.beside.status, then.beside.status)
        np.testing.assert_array_equal(now.beside.events, then.beside.events)
        np.testing.assert_allclose(now.beside.st, then.beside.st, rtol=1e-6)
    assert (~again.moved["single"].is_stable).sum() >= unstable
    assert (again.moved["single"].spread > 2.0**20 * again.moved["double"].spread).any()


@pytest.mark.parametrize(
    "name",
    [
        *("exact lens: an ellipsoid's focus", "exact lens: an aplanatic ball", "exact lens: a Cartesian oval"),
        *(f"reversed: {surface}" for surface in ("sphere", "torus", "heart", "bifolia", "biconvex")),
    ],
)
def test_closed_forms_bring_every_ray_to_the_middle_of_the_picture(pack: Pack, name: str) -> None:
    expected = pack.expected[name]
    lands = expected.answers.status == RayStatus.PICTURE
    assert lands.sum() > 40
    assert lands.mean() > (0.9 if name.startswith("exact") else 0.3)  # of what is sent back some goes elsewhere first
    off = np.abs(expected.answers.st[lands] - 0.5).max(axis=1)
    assert (off <= expected.moved["double"].spread[lands]).all()


def test_null_lenses_and_shells_leave_every_ray_straight(pack: Pack) -> None:
    straight = 0
    for case in pack.cases:
        if case.family == "null lens" or case.name == "exact lens: a hollow shell":
            assert case.origins is not None
            assert case.directions is not None
            exact = pack.expected[case.name].answers
            down = case.origins[:, 2] + 3.0
            at = case.origins[:, :2] - (down / case.directions[:, 2])[:, None] * case.directions[:, :2]
            np.testing.assert_allclose(exact.st, (at * [1, -1] + 4.0) / 8.0, rtol=0, atol=1e-14)
            straight += int((exact.events > 0).sum())
    assert straight > 300


def test_the_script_still_makes_these_cases(pack: Pack, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "bench"))
    from make_hard_cases import every_case

    made = {case.name: case for case in every_case()}
    assert list(made) == [case.name for case in pack.cases]
    for case in pack.cases:
        again = made[case.name]
        assert (again.family, again.why, again.scene) == (case.family, case.why, case.scene)
        for name in _FIELDS:
            assert getattr(again, name) == getattr(case, name), case.name
        lacking = np.zeros(0 if case.origins is None else len(case.origins), bool)
        lacking = lacking if again.lacks_values is None else again.lacks_values
        np.testing.assert_array_equal(lacking, [] if case.lacks_values is None else case.lacks_values)
        if case.origins is not None and case.directions is not None:
            size = np.abs(case.origins).max()
            np.testing.assert_allclose(again.origins, case.origins, rtol=0, atol=1e-12 * size)
            np.testing.assert_allclose(again.directions, case.directions, rtol=0, atol=1e-9)


def _untold(pack: Pack, level: Level) -> float:
    """Return the share of rays with a place of which no move ends alike."""
    untold = rays = 0
    for each in pack.expected.values():
        moved, lands = each.moved[level], (each.answers.st != -1.0).any(axis=1)
        untold += int((lands & ~moved.is_stable & (moved.spread == 0.0)).sum())
        rays += len(lands)
    return untold / rays


def _pixels(case: Case) -> int:
    film = scene_from_toml(case.scene).film
    return film.rows * film.columns


def _proved(case: Case, ray: int) -> Proof:
    scene = scene_from_toml(case.proved_as or case.scene)
    if case.origins is None or case.directions is None:
        return prove_pixels(scene, [ray])[0]
    return prove_rays(scene, [case.origins[ray].tolist()], [case.directions[ray].tolist()])[0]


def test_a_pack_that_is_not_whole_says_what_to_do(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    folder = tmp_path / "pack"
    monkeypatch.setattr("lenscl.hardcases.pack._FOLDER", folder)
    with pytest.raises(LensclError, match="install lenscl again"):
        load_pack()
    monkeypatch.undo()
    pack = load_pack()
    monkeypatch.setattr("lenscl.hardcases.pack._FOLDER", folder)
    write_pack(pack)
    again = load_pack()
    assert [case.name for case in again.cases] == [case.name for case in pack.cases]
    for name in ("cases.toml", "undecided.toml"):
        assert (folder / name).read_bytes() == (PACK / name).read_bytes()
    with np.load(folder / "rays.npz") as written, np.load(PACK / "rays.npz") as shipped:
        assert written.files == shipped.files  # the archive's own bytes hang on the version of Python
        for name in written.files:
            assert written[name].dtype == shipped[name].dtype
            np.testing.assert_array_equal(written[name], shipped[name])
    cases = (folder / "cases.toml").read_bytes()
    (folder / "cases.toml").write_bytes(cases.replace(b"n = 1.5", b"n = 1.6", 1))
    with pytest.raises(LensclError, match="belongs to other cases"):
        load_pack()
    (folder / "cases.toml").write_bytes(cases)
    (folder / "rays.npz").write_bytes((folder / "rays.npz").read_bytes()[:-1000])
    with pytest.raises(LensclError, match="install lenscl again"):
        load_pack()
