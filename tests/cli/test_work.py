"""What the commands print and write."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import sqlite3
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest
from patience import PATIENCE

from lenscl import accuracy
from lenscl.accuracy import Failure, SelfCheck
from lenscl.errors import BuildError
from lenscl.imaging import read_picture, write_image
from lenscl.sweep import Steps, Store, run_sweep
from lenscl.tracing import RayMap

AXES = ["lens.r", "lens.n"]


def table(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def test_a_sweep_prints_a_row_for_each_image_and_exports_the_same(lenscl, study_path: Path) -> None:
    out = study_path.parent / "out"
    result = lenscl("sweep", study_path, "-o", out)
    assert result.exit_code == 0
    rows = table(result.stdout)
    assert len(rows) == 18
    assert [(row["index"], row["picture"]) for row in rows] == sorted((row["index"], row["picture"]) for row in rows)
    for row in rows:
        assert Path(row["output"]).is_file()
        counts = [int(row[name]) for name in list(row)[4:11]]
        assert sum(counts) == 32 * 20
        assert float(row["seconds"]) > 0
    assert re.search(r"^stages: .*\btrace \d+ %.*, .* of \d+\.\d s in all threads$", result.stderr, re.MULTILINE)
    assert lenscl("export", out, "--csv").stdout == result.stdout
    assert lenscl("export", out, "--csv", study_path.parent / "table.csv").stdout == ""
    assert (study_path.parent / "table.csv").read_text() == result.stdout
    assert lenscl("sweep", study_path, "-o", out).stdout == result.stdout


def test_the_default_folder_is_below_the_current_one(lenscl, study_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (study_path.parent / "here").mkdir()
    monkeypatch.chdir(study_path.parent / "here")
    result = lenscl("sweep", "../study.toml", "--set", "lens.n=1.5", "--set", "lens.r=0.2")
    assert result.exit_code == 0
    assert {row["output"].rpartition("/")[0] for row in table(result.stdout)} == {"out/study"}
    assert len(list(Path("out/study").glob("00000-*.png"))) == 2


def test_a_set_value_holds_its_axis(lenscl, study_path: Path) -> None:
    result = lenscl("sweep", study_path, "--set", "lens.n=1.5", "--dry-run")
    assert len(table(result.stdout)) == 3 * 2


def test_a_dry_run_lists_points_pictures_outputs_and_kernels_and_makes_nothing(lenscl, study_path: Path) -> None:
    out = study_path.parent / "out"
    result = lenscl("sweep", study_path, "-o", out, "--dry-run")
    assert result.exit_code == 0
    assert not out.exists()
    rows = table(result.stdout)
    assert list(rows[0]) == ["index", *AXES, "picture", "output", "kernel"]
    assert len(rows) == 18
    assert len({row["kernel"] for row in rows}) == 1  # all its axes are numbers
    assert "9 points x 2 pictures = 18 images" in result.stderr
    made = table(lenscl("sweep", study_path, "-o", out).stdout)
    assert [row["output"] for row in made] == [row["output"] for row in rows]


def test_a_dry_run_tells_kernels_apart(lenscl, study_path: Path) -> None:
    study_path.write_text(
        study_path.read_text().replace("[sweep.axes]", '[sweep.axes]\n"numerics.precision" = ["single", "double"]')
    )
    rows = table(lenscl("sweep", study_path, "--dry-run").stdout)
    kernels = {(row["numerics.precision"], row["kernel"]) for row in rows}
    assert len(rows) == 36
    assert len(kernels) == len({kernel for _, kernel in kernels}) == 2


def test_a_bad_picture_is_exit_code_3_and_named_in_row_and_summary(lenscl, study_path: Path) -> None:
    (study_path.parent / "pictures" / "zz-notes.png").write_text("no picture at all")
    result = lenscl("sweep", study_path, "-o", study_path.parent / "out")
    assert result.exit_code == 3
    rows = table(result.stdout)
    failed = [row for row in rows if row["error"]]
    assert {row["picture"] for row in failed} == {"zz-notes.png"}
    assert (len(rows), len(failed)) == (27, 9)
    assert all(row["output"] == "" for row in failed)
    assert "18 made, 0 kept, 9 failed" in result.stderr
    assert "failed: 00000-zz-notes.png: " in result.stderr


def test_images_of_an_earlier_form_of_the_study_are_told_of(lenscl, study_path: Path) -> None:
    out = study_path.parent / "out"
    lenscl("sweep", study_path, "-o", out)
    fewer = lenscl("sweep", study_path, "-o", out, "--set", "lens.n=1.5")
    assert len(table(fewer.stdout)) == 6
    assert "12 images of an earlier form of the study stay there" in fewer.stderr
    assert len(list(out.glob("*.png"))) == 18
    fresh = lenscl("sweep", study_path, "-o", out, "--set", "lens.n=1.5", "--fresh")
    assert "earlier form" not in fresh.stderr
    assert len(list(out.glob("*.png"))) == 6


@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")
def test_a_bar_is_drawn_on_a_terminal_only(command, study_path: Path) -> None:
    import pty

    ours, theirs = pty.openpty()
    line = command("sweep", study_path, "-o", study_path.parent / "out")
    pieces: list[bytes] = []

    def watch() -> None:
        with suppress(OSError):  # how a terminal says that nobody writes any more
            while piece := os.read(ours, 4096):
                pieces.append(piece)

    # The bar is drawn again with the time that passes: a terminal that is read too late is full, and stops the sweep
    with (
        ThreadPoolExecutor(1) as watcher,
        subprocess.Popen(line, stdout=subprocess.PIPE, stderr=theirs, text=True) as process,
    ):
        os.close(theirs)
        watcher.submit(watch)
        rows = process.stdout.read()
    os.close(ours)
    assert process.returncode == 0
    assert b"18/18" in b"".join(pieces)
    assert len(table(rows)) == 18
    assert "18/18" not in subprocess.run(line, capture_output=True, text=True, timeout=PATIENCE).stderr


def test_a_study_without_pictures_is_sent_to_map_or_to_i(lenscl, study_path: Path) -> None:
    study_path.write_text(re.sub(r"images = .*", "", study_path.read_text()))
    swept = lenscl("sweep", study_path)
    assert swept.exit_code == 2
    assert swept.stderr.startswith("Error: picture.images: ")
    assert "`lenscl map`" in swept.stderr
    rendered = lenscl("render", study_path, "-o", study_path.parent / "x.png")
    assert rendered.exit_code == 2
    assert "-i IMAGE" in rendered.stderr


def test_render_paints_the_scene_itself_with_the_first_picture_or_the_one_asked_for(lenscl, study_path: Path) -> None:
    folder = study_path.parent
    first, second = sorted((folder / "pictures").iterdir())
    for name, options in (
        ("default", ()),
        ("first", ("-i", first)),
        ("second", ("-i", second)),
        ("set", ("--set", "lens.r=0.4")),
    ):
        assert lenscl("render", study_path, *options, "-o", folder / f"{name}.png").exit_code == 0
    painted = {name: read_picture(folder / f"{name}.png").pixels for name in ("default", "first", "second", "set")}
    assert painted["default"].shape == (20, 32, 3)
    assert np.array_equal(painted["default"], painted["first"])
    assert not np.array_equal(painted["default"], painted["second"])
    assert not np.array_equal(painted["default"], painted["set"])


def test_render_and_sweep_paint_the_same_colours(lenscl, study_path: Path) -> None:
    settings = ("--set", "lens.r=0.25", "--set", "lens.n=1.5")
    rows = table(lenscl("sweep", study_path, *settings, "-o", study_path.parent / "out").stdout)
    lenscl("render", study_path, *settings, "-o", study_path.parent / "one.png")
    swept = read_picture(Path(rows[0]["output"])).pixels
    assert np.array_equal(swept, read_picture(study_path.parent / "one.png").pixels)


@pytest.mark.parametrize("asked", ["2", "edges"])
def test_antialiasing_smooths_what_is_painted_and_says_how_many_rays_it_took(lenscl, study_path: Path, asked) -> None:
    folder, settings = study_path.parent, ("--set", "lens.r=0.25", "--set", "lens.n=1.5")
    lenscl("render", study_path, *settings, "-o", folder / "plain.png")
    result = lenscl("render", study_path, *settings, "--set", f"effects.antialias={asked}", "-o", folder / "x.png")
    said = re.search(r"antialias: (\d+) of 640 pixels have (\d) x \2 rays more, ([\d,]+) together", result.stderr)
    assert said is not None, result.stderr
    pixels, side, rays = (int(number.replace(",", "")) for number in said.groups())
    assert rays == pixels * side**2
    assert pixels == 640 if asked == "2" else 50 < pixels < 400
    rows = table(
        lenscl("sweep", study_path, *settings, "--set", f"effects.antialias={asked}", "-o", folder / "out").stdout
    )
    smooth = read_picture(folder / "x.png").pixels
    assert np.array_equal(read_picture(Path(rows[0]["output"])).pixels, smooth)
    assert not np.array_equal(smooth, read_picture(folder / "plain.png").pixels)


def test_with_caustics_the_picture_is_painted_in_its_light_and_it_is_said_where_the_light_goes(
    lenscl, study_path: Path
) -> None:
    folder = study_path.parent
    asked = ("--set", "effects.caustics=true", "--set", "picture.size=[40, 24]", "--set", "effects.fresnel=true")
    asked += ("--set", "lens.r=0.25", "--set", "lens.n=1.5")
    result = lenscl("render", study_path, *asked, "-o", folder / "lit.png")
    said = re.search(r"caustics: of the light, (.*)", result.stderr)
    assert said is not None, result.stderr
    shares = {name: float(share) for share, name in re.findall(r"([\d.e-]+) % ([a-z ]+)", said[1])}
    assert {"picture", "reflected"} <= set(shares)
    assert sum(shares.values()) == pytest.approx(100, abs=0.5)
    assert re.search(r"caustics: not excluded: at most [\d.e-]+ % of the light, at outlines", result.stderr)
    lit = read_picture(folder / "lit.png").pixels
    assert lit.shape == (24, 40, 3)
    rows = table(lenscl("sweep", study_path, *asked, "-o", folder / "out").stdout)
    assert np.array_equal(read_picture(Path(rows[0]["output"])).pixels, lit)
    assert lenscl("map", study_path, *asked, "-o", folder / "map.npz").exit_code == 0
    with np.load(folder / "map.npz") as stored:
        assert stored["irradiance"].shape == (24, 40)


@pytest.mark.parametrize(("dtype", "white"), [(np.uint8, 255), (np.uint16, 65535)])
def test_the_colour_outside_means_the_same_for_every_depth(lenscl, study_path: Path, dtype, white: int) -> None:
    folder = study_path.parent
    write_image(folder / "black.tif", np.zeros((4, 4, 3), dtype), metadata={})
    aside = ("--set", "picture.centre=[0, 100, -2.5]", "--set", "picture.outside=[1.0, 0.5, 0.0]")
    lenscl("render", study_path, *aside, "-i", folder / "black.tif", "-o", folder / "x.tif")
    painted = read_picture(folder / "x.tif").pixels
    assert painted.dtype == dtype
    assert np.array_equal(painted[0, 0], np.rint(np.array([1.0, 0.5, 0.0]) * white).astype(dtype))


def test_a_picture_that_cannot_be_read_is_named(lenscl, study_path: Path) -> None:
    result = lenscl("render", study_path, "-i", study_path.parent / "gone.png", "-o", study_path.parent / "x.png")
    assert result.exit_code == 1
    assert "gone.png" in result.stderr


def test_map_writes_what_trace_yields(lenscl, study_path: Path) -> None:
    folder = study_path.parent
    assert lenscl("map", study_path, "-o", folder / "map.npz").exit_code == 0
    assert lenscl("map", study_path, "-o", folder / "map.exr").exit_code == 0
    with np.load(folder / "map.npz") as arrays:
        st, status = arrays["st"], arrays["status"]
        assert arrays["st"].shape == (20, 32, 2)
    exr = read_picture(folder / "map.exr").pixels
    on = status == 0
    assert on.sum() > 100
    assert np.array_equal(exr[on][:, 0], st[on][:, 0].astype(np.float32))
    refused = lenscl("map", study_path, "-o", folder / "map.docx")
    assert refused.exit_code != 0
    assert refused.stderr.splitlines()[-1].startswith("Error: ")


def test_map_adds_error_bounds_when_asked_and_says_how_large_they_are(lenscl, study_path: Path) -> None:
    from lenscl.accuracy import error_map
    from lenscl.config import load_study
    from lenscl.imaging import read_size
    from lenscl.tracing import trace

    folder, coarse = study_path.parent, ("--set", "numerics.precision=single", "--set", "lens.n=2.417")
    plain = lenscl("map", study_path, *coarse, "-o", folder / "plain.npz")
    assert "error bounds" not in plain.stderr
    result = lenscl("map", study_path, *coarse, "--error", "-o", folder / "map.npz")
    assert result.exit_code == 0
    assert result.stdout == ""
    as_exr = lenscl("map", study_path, *coarse, "--error", "-o", folder / "map.exr")
    assert as_exr.exit_code == 0
    with np.load(folder / "map.npz") as arrays, np.load(folder / "plain.npz") as before:
        error, status = arrays["error"], arrays["status"]
        for name in before.files:
            assert np.array_equal(arrays[name], before[name])
        assert "error" not in before.files
    assert error.shape == (20, 32)
    assert np.array_equal(
        error, error_map(trace(load_study(study_path).scene.replace({"lens.n": 2.417}), precision="single"))
    )
    assert np.array_equal(error < 0, status > 1)  # here rounding decides no path
    some = error[error >= 0]
    assert 1e-9 < np.median(some) < 1e-6
    (said,) = [line for line in result.stderr.splitlines() if line.startswith("error bounds: ")]
    widest = max(max(read_size(path)) for path in load_study(study_path).images)
    assert f": {some.size} of 640 pixels have one; median {np.median(some) * widest:.2g}, 99 % " in said
    assert f"largest {some.max():.2g} in coordinates" in said
    assert f"; {640 - some.size} have none as they land nowhere" in said

    written = OpenImageIO.ImageBuf(str(folder / "map.exr"))
    assert written.spec().channelnames == ("R", "G", "B", "A", "error")
    stored = written.get_pixels(OpenImageIO.FLOAT)[..., 4]
    assert (stored[error >= 0] >= some).all()
    assert f"largest {stored.max():.2g} in coordinates" in as_exr.stderr


def test_what_map_says_of_an_exr_counts_what_float32_loses(lenscl, study_path: Path) -> None:
    folder = study_path.parent
    said = {}
    for suffix in ("exr", "npz"):
        result = lenscl("map", study_path, "--error", "-o", folder / f"fine.{suffix}")
        (said[suffix],) = [line for line in result.stderr.splitlines() if line.startswith("error bounds: ")]
    with np.load(folder / "fine.npz") as arrays:
        st, error = arrays["st"], arrays["error"]
    written = OpenImageIO.ImageBuf(str(folder / "fine.exr")).get_pixels(OpenImageIO.FLOAT)
    has = error >= 0
    lost = np.abs(written[..., 0].astype(np.float64) - st[..., 0])[has]
    assert lost.max() > 1e-9  # the map's own bounds are far smaller
    assert np.median(error[has]) < 1e-13
    assert (written[..., 4][has] >= lost).all()
    assert f" median {np.median(written[..., 4][has]):.2g}, 99 % " in said["exr"]
    assert "float32" in said["exr"]
    assert f"{np.median(error[has]):.2g}" in said["npz"]
    assert "float32" not in said["npz"]


def test_map_without_error_writes_the_same_bytes_as_ever(lenscl, study_path: Path) -> None:
    from lenscl.config import load_study
    from lenscl.imaging import write_map
    from lenscl.tracing import trace

    folder = study_path.parent
    for suffix in ("npz", "exr"):
        lenscl("map", study_path, "-o", folder / f"map.{suffix}")
        write_map(folder / f"own.{suffix}", trace(load_study(study_path).scene))
        assert (folder / f"map.{suffix}").read_bytes() == (folder / f"own.{suffix}").read_bytes()


def test_check_lists_points_pictures_and_hard_spots(lenscl, study_path: Path) -> None:
    (study_path.parent / "pictures" / "zz-notes.png").write_text("no picture at all")
    result = lenscl("check", study_path, "--set", "source.at=[0.0, 0.7, 0.0]", "--set", "lens.rotate=[0,0,0]")
    assert result.exit_code == 3
    assert "9 points, 3 pictures" in result.stdout
    assert "lens.r = 0.15, lens.n = 1.33" in result.stdout
    assert "zz-notes.png  UNREADABLE" in result.stdout
    assert "source: lies inside lens" in result.stdout
    found = json.loads(lenscl("check", study_path, "--json", "--set", "numerics.method=march").stdout)
    assert found["points"] == 9
    assert [picture["error"] is None for picture in found["pictures"]] == [True, True, False]
    assert found["hard_spots"][0].keys() == {"key", "kind", "message", "points"}


def test_kernel_prints_what_tracing_compiles(lenscl, study_path: Path) -> None:
    from lenscl.config import load_study
    from lenscl.tracing import trace

    text = lenscl("kernel", study_path).stdout
    assert text == trace(load_study(study_path).scene).kernel.text + "\n"
    assert "__kernel" in text or "kernel void" in text


def test_devices_lists_them_best_first(lenscl) -> None:
    from lenscl.device import choose, devices

    found = json.loads(lenscl("devices", "--json").stdout)
    assert [row["device"] for row in found] == [device.label for device in devices()]
    assert [row["device"] for row in found if row["chosen"]] == [choose().label]
    text = lenscl("devices").stdout
    assert f"* {choose().label}" in text
    assert choose().driver in text


def test_lenses_lists_the_whole_catalogue(lenscl) -> None:
    from lenscl.lenses import catalogue

    found = {row["name"]: row for row in json.loads(lenscl("lenses", "--json").stdout)}
    text = lenscl("lenses").stdout
    assert list(found) == list(catalogue())
    for name, surface in catalogue().items():
        assert f"{name}: {surface.summary}" in text
        assert surface.formula in text
        assert [row["name"] for row in found[name]["parameters"]] == [p.name for p in surface.parameters]
    assert "R = 0.7 in (0" in text


def test_schema_is_json_that_knows_the_tables(lenscl) -> None:
    schema = json.loads(lenscl("schema").stdout)
    assert {"source", "film", "picture", "lens", "sweep", "numerics"} <= schema["properties"].keys()


@pytest.mark.parametrize(("arguments", "expected"), [((), "--csv"), (("--parquet",), "not available in this version")])
def test_export_says_what_it_can(lenscl, tmp_path: Path, arguments: tuple[str, ...], expected: str) -> None:
    result = lenscl("export", tmp_path, *arguments)
    assert result.exit_code == 2
    assert expected in result.stderr


def test_export_of_no_sweep_is_named(lenscl, tmp_path: Path) -> None:
    result = lenscl("export", tmp_path, "--csv")
    assert result.exit_code == 1
    assert result.stderr.startswith(f"Error: {tmp_path / 'sweep.sqlite'}: no such file")


def test_new_makes_a_study_that_is_sound_and_has_nothing_to_warn_of(lenscl, starter: Path) -> None:
    found = json.loads(lenscl("check", starter / "study.toml", "--json").stdout)
    assert found["points"] == 9
    assert len(found["pictures"]) >= 2
    assert all(picture["error"] is None for picture in found["pictures"])
    assert {spot["kind"] for spot in found["hard_spots"]} <= {"march-step"}


def test_new_refuses_a_folder_with_anything_in_it(lenscl, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    result = lenscl("new", tmp_path)
    assert result.exit_code == 1
    assert "is not empty" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
    (tmp_path / "empty folder").mkdir()
    made = lenscl("new", tmp_path / "empty folder")
    assert made.exit_code == 0
    assert f"lenscl sweep '{tmp_path}/empty folder/study.toml'" in made.stdout


def test_a_map_and_a_picture_are_checked_and_the_summary_follows_the_result(lenscl, study_path: Path) -> None:
    folder = study_path.parent
    square = ("--set", "film.down=[0, -1.25, 0]")  # pixels, of which nothing is to be noted
    for result in (
        lenscl("map", study_path, *square, "-o", folder / "map.npz"),
        lenscl("render", study_path, *square, "-o", folder / "seen.png"),
    ):
        assert result.exit_code == 0
        made, checks = result.stderr.splitlines()
        assert " picture" in made
        rays, surfaces = re.match(r"self-checks: all hold: (\d+) rays, (\d+) surfaces, ", checks).groups()
        assert int(surfaces) >= int(rays) > 20
        assert result.stdout == ""
    nothing = lenscl(
        "map", study_path, "-o", folder / "map.npz", "--set", "film.scale=0.001", "--set", "lens.centre=[9, 9, 9]"
    )
    assert "self-checks: no ray of the film meets a lens" in nothing.stderr


FAILURE = Failure(row=7, column=9, event=2, law="snell", residual=1e-3, bound=1e-12)


def test_a_check_that_fails_is_a_warning_with_its_pixel_and_an_exit_code(
    lenscl, study_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(accuracy, "check_map", lambda _: SelfCheck(rays=5, surfaces=9, failed=1, failures=(FAILURE,)))
    for command, name, more in (
        ("map", "map.npz", ()),
        ("map", "map.exr", ("--error",)),
        ("render", "seen.png", ()),
    ):
        written = study_path.parent / name
        result = lenscl(command, study_path, "-o", written, *more)
        assert result.exit_code == 3
        assert "self-checks: 1 FAILED" in result.stderr
        assert "warning: pixel (7, 9) at surface 2: expected " in result.stderr
        assert ("error bounds: " in result.stderr) == bool(more)  # all there is to say is said
        assert written.stat().st_size > 100  # the result stands

    def refused(_: object) -> SelfCheck:
        raise BuildError("no room\nfor it")

    monkeypatch.setattr(accuracy, "check_map", refused)
    result = lenscl("map", study_path, "-o", study_path.parent / "map.npz")
    assert result.exit_code == 0
    assert "warning: the self-checks could not be made: no room for it" in result.stderr


def test_a_sweep_ends_with_one_line_of_checks_over_all_its_points(lenscl, study_path: Path) -> None:
    out = study_path.parent / "out"
    first, again = (lenscl("sweep", study_path, "-o", out).stderr for _ in range(2))
    (line,) = (line for line in first.splitlines() if line.startswith("self-checks: "))
    with Store.reading(out) as store:
        every = {row.index: row.checks for row in store.rows()}
    assert len(every) == 9
    rays = sum(checks["rays"] for checks in every.values())
    assert f"all hold: {rays} rays, " in line
    assert line in again  # what was kept was checked when it was made
    assert "warning" not in first


def test_warnings_of_a_sweep_name_point_and_pixel_and_are_few(
    lenscl, study_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    three = SelfCheck(rays=5, surfaces=9, failed=3, failures=(FAILURE,) * 3)
    monkeypatch.setattr("lenscl.sweep.run_sweep", partial(run_sweep, steps=Steps(check=lambda _: three)))
    result = lenscl("sweep", study_path, "-o", study_path.parent / "out")
    assert result.exit_code == 3
    assert "self-checks: 27 FAILED: 45 rays, 81 surfaces" in result.stderr
    assert "self-checks failed at 9 points: 0, 1, 2, 3, 4, 5, 6, 7, 8\n" in result.stderr
    warnings = [line for line in result.stderr.splitlines() if line.startswith("warning: ")]
    assert len(warnings) == 10
    assert warnings[3].startswith("warning: point 1, pixel (7, 9) at surface 2: ")
    assert "... and 17 more warnings of self-checks" in result.stderr


def test_a_sweep_with_failed_checks_marks_its_rows_and_says_so_again(
    lenscl, study_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also from a table of before causes were looked for; nothing is made anew for it."""
    real = accuracy.check_map
    calls = []

    def found(raymap: RayMap) -> SelfCheck:
        calls.append(raymap)
        return replace(real(raymap), failed=2, failures=(FAILURE,)) if len(calls) == 4 else real(raymap)

    monkeypatch.setattr("lenscl.sweep.run_sweep", partial(run_sweep, steps=Steps(check=found)))
    out = study_path.parent / "out"
    first = lenscl("sweep", study_path, "-o", out)
    made = {path: path.stat().st_mtime_ns for path in out.iterdir() if path.suffix == ".png"}
    with closing(sqlite3.connect(out / "sweep.sqlite")) as table, table:
        for output, checks in table.execute("SELECT output, checks FROM run").fetchall():
            older = json.loads(checks)
            del older["untold"]
            for failure in older["failures"]:
                del failure["cause"], failure["about"]
            table.execute("UPDATE run SET checks = ? WHERE output = ?", (json.dumps(older), output))
    again, exported = lenscl("sweep", study_path, "-o", out), lenscl("export", out, "--csv")
    assert (first.exit_code, again.exit_code, exported.exit_code) == (3, 3, 0)
    assert len(calls) == 9
    assert {path: path.stat().st_mtime_ns for path in made} == made
    for result in (first, again):
        assert "self-checks: 2 FAILED: " in result.stderr
        assert "self-checks failed at 1 point: 3\n" in result.stderr
        assert "warning: point 3, pixel (7, 9) at surface 2: expected " in result.stderr
    assert "0 made, " in again.stderr
    for result in (first, again, exported):
        rows = list(csv.DictReader(result.stdout.splitlines()))
        marked = [row for row in rows if row["error"]]
        assert {row["index"] for row in marked} == {"3"}
        assert all(row["error"].startswith("self-checks: 2 FAILED among ") for row in marked)
        assert all(row["output"] for row in rows)  # which were made
        assert list(rows[0])[:4] == ["index", *AXES, "picture"]
        assert list(rows[0])[-3:] == ["seconds", "output", "error"]
