from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import pytest

from lenscl.config import load_study
from lenscl.errors import StudyError
from lenscl.sweep import plan_sweep
from lenscl.sweep.pictures import output_names, survey
from lenscl.version import program_version


def keys(study_path: Path, **changes: object) -> list[str]:
    plan = dataclasses.replace(plan_sweep(load_study(study_path)), **changes)
    return [run.key for run in plan.runs()]


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))


def test_the_work_list_is_points_times_pictures_in_the_studys_order(study_path: Path) -> None:
    plan = plan_sweep(load_study(study_path))
    runs = list(plan.runs())
    assert len(runs) == plan.run_count == 4 * 3
    assert [run.position for run in runs] == list(range(12))
    assert [run.point for run in runs] == [0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3]
    assert [dict(run.values) for run in runs[::3]] == [
        {"lens.c": c, "lens.n": n} for c in (0.4, 0.6) for n in (1.3, 1.5)
    ]
    assert [run.picture for run in runs[:3]] == sorted(path.name for path in (study_path.parent / "pictures").iterdir())
    assert len({run.output for run in runs}) == len({run.key for run in runs}) == 12


def test_an_output_is_called_by_index_and_picture(study_path: Path) -> None:
    plan = plan_sweep(load_study(study_path), Path("elsewhere"))
    first = next(plan.runs())
    assert first.output == f"00000-{Path(first.picture).stem}.png"
    assert plan.out == Path("elsewhere")
    assert plan_sweep(load_study(study_path)).out == Path("out") / "small"


def test_more_points_rename_no_output(study_path: Path) -> None:
    before = [run.output for run in plan_sweep(load_study(study_path)).runs()]
    edit(study_path, "[0.4, 0.6]", "{ linspace = [0.4, 0.6, 50] }")
    after = [run.output for run in plan_sweep(load_study(study_path)).runs()]
    assert after[: len(before)] == before
    assert len(after) == 300


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("a = 1.0", "a = 1.1"),
        ("size = [20, 12]", "size = [20, 13]"),
        ('"pictures/*"', '"pictures/*"\nfilter = "nearest"'),
        ('"pictures/*"', '"pictures/*"\noutside = [1.0, 0.0, 0.0]'),
        ("A small study", "Another title"),
        ("[sweep.axes]", '[numerics]\nprecision = "single"\n[sweep.axes]'),
        ("[sweep.axes]", '[output]\nformat = "jpg"\n[sweep.axes]'),
    ],
)
def test_a_key_changes_with_all_that_the_bytes_depend_on(study_path: Path, old: str, new: str) -> None:
    before = keys(study_path)
    edit(study_path, old, new)
    after = keys(study_path)
    assert len(before) == len(after) == 12
    assert not set(before) & set(after)


def test_a_key_changes_with_a_pictures_content_and_with_the_program(study_path: Path) -> None:
    before = keys(study_path)
    assert not set(before) & set(keys(study_path, program="lenscl 0.1.0 (of other sources)"))
    first = min((study_path.parent / "pictures").iterdir())
    first.write_bytes(first.read_bytes() + b"\0")
    changed = [one != other for one, other in zip(before, keys(study_path), strict=True)]
    assert changed == [True, False, False] * 4


def test_a_key_does_not_change_with_what_leaves_the_bytes_alone(study_path: Path) -> None:
    before = keys(study_path)
    assert keys(study_path, out=Path("elsewhere")) == before
    edit(study_path, '"pictures/*"', '"pictures/*.png"')
    assert keys(study_path) == before
    moved = study_path.parent.rename(study_path.parent.parent / "moved")
    assert keys(moved / study_path.name) == before
    for path in (moved / "pictures").iterdir():
        os.utime(path, (1, 1))
    assert keys(moved / study_path.name) == before


def test_a_study_without_pictures_is_told_of_the_map_command(study_path: Path) -> None:
    edit(study_path, 'images = "pictures/*"\n', "")
    with pytest.raises(StudyError, match=r"^picture\.images: .*`lenscl map`"):
        plan_sweep(load_study(study_path))


def test_pictures_are_never_read_from_where_the_sweep_writes(study_path: Path) -> None:
    with pytest.raises(StudyError, match=r"^picture\.images: .*choose a folder with -o"):
        plan_sweep(load_study(study_path), study_path.parent / "pictures")


def test_a_point_whose_values_do_not_go_together_is_planned_like_any_other(study_path: Path) -> None:
    plan = plan_sweep(load_study(study_path))
    (*_, last) = plan.study.points()

    class Impossible(type(last)):
        @property
        def scene(self):
            raise StudyError(["lens.c: does not fit (point 3)"])

    impossible = Impossible(index=3, values=last.values, study_scene=last.study_scene)
    assert len({run.key for run in plan.runs_of(impossible)}) == 3


def test_equal_stems_get_names_of_their_own() -> None:
    paths = [Path(text) for text in ("a/cat.png", "a/cat.jpg", "b/CAT.png", "b/cat.jpg", "b/dog.png", "c/cat.jpg~2.x")]
    names = output_names(paths)
    assert names == ["cat.png", "cat.jpg", "CAT.png~2", "cat.jpg~2", "dog", "cat.jpg~2~2"]
    assert len({name.casefold() for name in names}) == len(paths)


def test_long_and_odd_names_still_make_names_that_can_be_written(tmp_path: Path) -> None:
    odd = Path(os.fsdecode(b"caf\xe9 \n.png"))
    long = [Path(f"{'x' * 240}{end}.png") for end in "ab"]
    names = output_names([odd, *long])
    assert len(set(names)) == 3
    for name in names:
        (tmp_path / f"00000-{name}.png").write_bytes(name.encode())  # strict UTF-8, short enough


def test_pictures_are_shown_by_their_path_below_what_they_share(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    paths = [tmp_path / "a" / "x.png", tmp_path / "b" / "x.png"]
    for path in paths:
        path.write_bytes(b"x")
    assert [picture.shown for picture in survey(paths)] == ["a/x.png", "b/x.png"]
    assert [picture.shown for picture in survey(paths[:1])] == ["x.png"]


def test_a_picture_that_cannot_be_opened_is_noted_and_hinders_no_other(tmp_path: Path) -> None:
    (tmp_path / "good.png").write_bytes(b"x")
    gone, good = survey([tmp_path / "gone.png", tmp_path / "good.png"])
    assert gone.digest is None
    assert gone.error == f"{tmp_path}/gone.png: cannot be read: No such file or directory"
    assert good.error is None


def test_the_program_is_named_by_its_sources(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from lenscl import version

    (tmp_path / "lenscl").mkdir()
    (tmp_path / "kernels").mkdir()
    (tmp_path / "lenscl" / "a.py").write_text("1")
    (tmp_path / "kernels" / "a.cl").write_text("1")
    monkeypatch.setattr(version, "_PACKAGE", tmp_path / "lenscl")
    monkeypatch.setattr(version, "_KERNELS", (tmp_path / "none", tmp_path / "kernels"))
    seen = {program_version.__wrapped__()}
    for path, text in (("lenscl/a.py", "2"), ("kernels/a.cl", "2"), ("kernels/b.cl", "")):
        (tmp_path / path).write_text(text)
        seen.add(program_version.__wrapped__())
    assert len(seen) == 4


@pytest.mark.parametrize(
    "name", ["x" * 300 + ".png", "pipe.png", "folder.png", "locked/p.png", os.fsdecode(b"\xe9/p.png")]
)
def test_nothing_that_a_picture_may_be_keeps_the_others_from_being_surveyed(tmp_path: Path, name: str) -> None:
    (tmp_path / "good.png").write_bytes(b"x")
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "locked").mkdir(mode=0)
    os.mkfifo(tmp_path / "pipe.png")
    bad, good = survey([tmp_path / name, tmp_path / "good.png"])
    (tmp_path / "locked").chmod(0o700)
    assert good.error is None
    assert bad.error is not None
    assert bad.error.startswith(f"{tmp_path}/")  # as it can be found
    bad.error.encode()


def test_an_output_folder_whose_name_is_not_utf_8_is_refused(study_path: Path) -> None:
    with pytest.raises(StudyError, match=r"^caf\\xe9: the folder's name is not UTF-8; .* -o"):
        plan_sweep(load_study(study_path), Path(os.fsdecode(b"caf\xe9")))


def test_a_study_whose_points_are_all_excluded_is_refused(study_path: Path) -> None:
    edit(
        study_path, "[sweep.axes]", '[[sweep.exclude]]\n"lens.n" = 1.3\n[[sweep.exclude]]\n"lens.n" = 1.5\n[sweep.axes]'
    )
    with pytest.raises(StudyError, match=r"^sweep\.exclude: no point of the study is left"):
        plan_sweep(load_study(study_path))
