"""Every rule of the study file has a refusal: exactly one problem, led by its key, that says what to do."""

from __future__ import annotations

import pytest

from lenscl.config import scene_from_toml, study_from_toml
from lenscl.errors import StudyError

# what to replace in the valid study, by what, and the whole problem that must be reported
RULES = [
    ("[source]", "titel = 'x'\n[source]", 'titel: unknown key; did you mean "title"?'),
    ("[source]", "title = 3\n[source]", "title: must be a text of at most 1000 characters, got 3"),
    ("[source]\nat = [0, 0, 4]", "source = 3", "source: must be a table [source], got 3"),
    ("at = [0, 0, 4]", "", 'source.at: is required where source.kind is "point"'),
    ("at = [0, 0, 4]", 'kind = "parallel"', 'source.direction: is required where source.kind is "parallel"'),
    (
        "at = [0, 0, 4]",
        "at = [0, 0, 4]\ndirection = [1, 0, 0]",
        'source.direction: is read only where source.kind is "parallel"; leave it out or change source.kind',
    ),
    (
        "at = [0, 0, 4]",
        'kind = "parallel"\ndirection = [0.0, 0.0, 0.0]',
        "source.direction: must not be shorter than 1e-12, got [0.0, 0.0, 0.0]",
    ),
    (
        "at = [0, 0, 4]",
        'at = [0, 0, 4]\nkind = "pont"',
        'source.kind: must be "point" or "parallel", got "pont"; did you mean "point"?',
    ),
    ("at = [0, 0, 4]", "at = [0, 0]", "source.at: must be three numbers [x, y, z], got [0, 0]"),
    (
        "at = [0, 0, 4]",
        "at = [0, nan, 4]",
        "source.at: must be three numbers [x, y, z]; the value at place 2 must be a finite number, got nan",
    ),
    (
        "at = [0, 0, 4]",
        "at = [0, true, 4]",
        "source.at: must be three numbers [x, y, z]; the value at place 2 must be a finite number, got true",
    ),
    (
        "at = [0, 0, 4]",
        "at = [0, 0, 1e30]",
        "source.at: must be three numbers [x, y, z]; the value at place 3 must lie from -1e+12 to 1e+12, got 1e+30",
    ),
    (
        "centre = [0, 0, 2.5]",
        "",
        "film.corner: one of the two is required, film.corner or film.centre",
    ),
    (
        "centre = [0, 0, 2.5]",
        "centre = [0, 0, 2.5]\ncorner = [1, 1, 1]",
        "film.corner: only one of the two may be given, film.corner or film.centre",
    ),
    ("right = [2, 0, 0]", "", "film.right: is required"),
    ("right = [2, 0, 0]", "right = [0, 0, 0]", "film.right: must not be shorter than 1e-12, got [0, 0, 0]"),
    (
        "right = [2, 0, 0]",
        "right = [0, 7, 0]",
        "film.down: is parallel to film.right; the two must span a parallelogram",
    ),
    ("size = [8, 6]", "size = [8, 6]\nscale = 0", "film.scale: must be greater than 0, got 0"),
    (
        "right = [2, 0, 0]",
        "right = [2, 0, 0]\nscale = 1e-20",
        "film.scale: makes film.right 2e-20 long; it must lie from 1e-12 to 1e+12",
    ),
    ("size = [8, 6]", "", "film.size: is required"),
    (
        "size = [8, 6]",
        "size = [8, 0]",
        "film.size: must be two whole numbers [columns, rows]; the value at place 2 must lie from 1 to 2147483648, "
        "got 0",
    ),
    (
        "size = [8, 6]",
        "size = [8.5, 6]",
        "film.size: must be two whole numbers [columns, rows]; the value at place 1 must be a whole number from 1 to "
        "2147483648, got 8.5",
    ),
    ("size = [8, 6]", "size = [65536, 65536]", "film.size: must have at most 2^31 pixels, got 65536 x 65536"),
    (
        "size = [8, 6]",
        "size = [8, 6]\ncolumns = 3",
        "film.columns: unknown key; known are corner, centre, right, down, scale, size",
    ),
    (
        "down = [0, -6, 0]",
        "down = [0, -6, 0]\noutside = [1, 2, 3, 4, 5]",
        "picture.outside: must be one to four numbers, the channels of a colour, got [1, 2, 3, 4, 5]",
    ),
    (
        "down = [0, -6, 0]",
        'down = [0, -6, 0]\nfilter = "bilinaer"',
        'picture.filter: must be "nearest" or "bilinear" or "bicubic", got "bilinaer"; did you mean "bilinear"?',
    ),
    (
        "down = [0, -6, 0]",
        'down = [0, -6, 0]\nencoding = "log"',
        'picture.encoding: must be "srgb" or "linear", got "log"',
    ),
    (
        "down = [0, -6, 0]",
        "down = [0, -6, 0]\nimages = 3",
        'picture.images: must be a pattern such as "pictures/*", or a list of patterns, got 3',
    ),
    (
        "down = [0, -6, 0]",
        'down = [0, -6, 0]\nimages = ["a/**/*.png"]',
        'picture.images: must not search whole trees (** or more than three wildcard parts), got "a/**/*.png"',
    ),
    (
        "[[lens]]",
        '[medium]\nn = "dimond"\n[[lens]]',
        "medium.n: must be a number, a material's name or a formula; unknown material 'dimond'; did you mean "
        '"diamond"?',
    ),
    ("n = 1.5", "n = 0", "lens.n: must be an index from 0.001 to 1000, got 0.0"),
    ("n = 1.5", "n = -1.5", "lens.n: must be an index from 0.001 to 1000, got -1.5"),
    ("n = 1.5", "n = inf", "lens.n: must be an index, a number, got inf"),
    ("n = 1.5", "", "lens.n: is required"),
    (
        "n = 1.5",
        "n = { sellmeier = [1, 2, 3] }",
        "lens.n: must be sellmeier = [B1, B2, ..., C1, C2, ...], as many C (in square micrometres) as B, got 3 numbers",
    ),
    (
        "n = 1.5",
        "n = { cauchi = [1.5] }",
        "lens.n: must be a number, a material's name, { nd = ..., vd = ... }, { sellmeier = [...] }, "
        '{ cauchy = [...] } or { table = [[nm, n], ...] }, got a table with "cauchi"',
    ),
    (
        "n = 1.5",
        "n = { table = [[500, 1.5], [400, 1.6]] }",
        "lens.n: must be table = [[nm, n], ...], two or more, rising in nm, got a wavelength that does not rise",
    ),
    (
        "n = 1.5",
        "n = { table = [[300, 1.5], [400, 1.6]] }",
        "lens.n: refractive index: known from 300 to 400 nm, not at 587.562 nm",
    ),
    (
        "[[lens]]",
        "[lens]",
        "lens: a study has one lens or more, so its table is written [[lens]], with double brackets",
    ),
    (
        "R = 0.7",
        "Q = 0.7",
        "lens.Q: unknown key; known are R, r, name, surface, bounds, centre, at, stretch, rotate, n, absorption, "
        "absorbs, mirror, priority",
    ),
    ("R = 0.7", "cetre = [0, 0, 1]", 'lens.cetre: unknown key; did you mean "centre"?'),
    ("R = 0.7", 'R = "wide"', 'lens.R: must be a finite number, got "wide"'),
    (
        "n = 1.5",
        "n = 1.5\nstretch = [1, 0, 1]",
        "lens.stretch: must have no factor of 0 (a squash goes down to 1e-12), got [1.0, 0.0, 1.0]",
    ),
    ("n = 1.5", 'n = 1.5\nname = "a b"', 'lens.name: must be a letter or _, then letters, digits or _, got "a b"'),
    ("n = 1.5", 'n = 1.5\nname = "stretch"', 'lens.name: must not be a key of the lens table, got "stretch"'),
    (
        "n = 1.5",
        "n = 1.5\nbounds = [[-1, -1, -1], [1, 1, 1]]",
        'lens.bounds: is only for expressions; "torus" knows its own',
    ),
    (
        'surface = "torus"\nR = 0.7\nr = 0.25',
        'surface = "x**2 + y**2 + z**2 - 1"',
        "lens.bounds: is required for an expression: a box [[x, y, z], [x, y, z]] that holds the solid",
    ),
    (
        'surface = "torus"\nR = 0.7\nr = 0.25',
        'surface = "x**2 + y**2 + z**2 - 1"\nbounds = [[-2, -2, -2], [2, -3, 2]]',
        "lens.bounds: must be two corners [[x, y, z], [x, y, z]], the lower first; along y -2.0 is not below -3.0",
    ),
    (
        'surface = "torus"\nR = 0.7\nr = 0.25',
        'surface = "x**2 + y**2 + z**2 - k"\nx = 1\nk = 1\nbounds = [[-2, -2, -2], [2, 2, 2]]',
        "lens.x: x, y and z are the coordinates; give the parameter another name",
    ),
    ("n = 1.5", "n = 1.5\nabsorbs = 1", "lens.absorbs: must be true or false, got 1"),
    (
        "n = 1.5",
        "n = 1.5\n[effects]\nfootprint = 'yes'",
        'effects.footprint: must be false or true, got "yes"',
    ),
    (
        "n = 1.5",
        "n = 1.5\n[effects]\ntotal_reflexion = 'end'",
        'effects.total_reflexion: unknown key; did you mean "total_reflection"?',
    ),
    (
        "n = 1.5",
        "n = 1.5\n[effects]\ntotal_reflection = 'folow'",
        'effects.total_reflection: must be "follow" or "end" or "auto", got "folow"; did you mean "follow"?',
    ),
    ("n = 1.5", "n = 1.5\n[numerics]\nstep = 0", "numerics.step: must be greater than 0, got 0"),
    ("n = 1.5", "n = 1.5\n[numerics]\nmax_events = 256", "numerics.max_events: must lie from 1 to 255, got 256"),
    (
        "n = 1.5",
        "n = 1.5\n[numerics]\naccuracy = '0.05 pixels'",
        'numerics.accuracy: must be a positive length, such as "0.05 px" in pixels of the picture or "1e-9" in scene '
        'units, got "0.05 pixels"',
    ),
    (
        "n = 1.5",
        "n = 1.5\n[output]\nformat = 'jpeg'",
        'output.format: must be "png" or "jpg" or "tif" or "exr", got "jpeg"; did you mean "jpg"?',
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep]\nmode = 'gird'",
        'sweep.mode: must be "grid" or "latin" or "halton" or "sobol" or "random", got "gird"; did you mean "grid"?',
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep.axes]\nlens.r = [1]",
        'sweep.axes.lens: put the whole key in quotes: "lens.r" = ...',
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep.axes]\n'lens.r' = 0.2",
        "sweep.axes.lens.r: must be a list of values, { linspace = [start, stop, count] }, { logspace = [...] } or "
        "{ range = [start, stop, step] }, got 0.2; a single value is written [0.2]",
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep.axes]\n'lens.r' = []",
        "sweep.axes.lens.r: must have a value at least, got an empty list",
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep.axes]\n'lens.r' = { range = [0.1, 0.2, -0.1] }",
        "sweep.axes.lens.r: range has no values: a step of -0.1 leads away from 0.2",
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep.axes]\n'lens.r' = { range = [0.1, 0.2, 0] }",
        "sweep.axes.lens.r: range step must not be 0",
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep.axes]\n'lens.r' = { logspace = [-3, -9, 7] }",
        "sweep.axes.lens.r: logspace takes two positive end values, not exponents, got [-3, -9]",
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep.axes]\n'lens.r' = { linspace = [0.1, 0.2, 1.5] }",
        "sweep.axes.lens.r: linspace count must be a whole number from 1 to 1000000000000000, got 1.5",
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep.axes]\n'lens.r' = { min = 0.1, max = 0.2 }",
        'sweep.axes.lens.r: { min, max } needs sweep.mode = "latin", "halton", "sobol" or "random"',
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep]\nmode = 'latin'\n[sweep.axes]\n'lens.r' = { min = 0.1, max = 0.2 }",
        'sweep.samples: is required where sweep.mode is "latin"',
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep]\nmode = 'latin'\nsamples = 3\n[sweep.axes]\n'lens.r' = [0.1]",
        'sweep.axes.lens.r: must be { min = ..., max = ... } where sweep.mode is "latin"',
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep]\nmode = 'latin'\nsamples = 3\n[sweep.axes]\n'lens.r' = { min = 0, max = 1, scale = 'log' }",
        'sweep.axes.lens.r: min must be positive where scale is "log", got 0',
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep]\nsamples = 3",
        'sweep.samples: is read only by the modes "latin", "halton", "sobol" and "random"; set sweep.mode',
    ),
    ("n = 1.5", "n = 1.5\n[sweep.axes]\n'lens.rr' = [0.1]", 'sweep.axes.lens.rr: unknown key; did you mean "lens.r"?'),
    ("n = 1.5", "n = 1.5\n[sweep.axes]\n'title' = ['a']", "sweep.axes.title: cannot vary from point to point"),
    (
        "n = 1.5",
        "n = 1.5\n[sweep.axes]\n'picture.images' = ['a']",
        "sweep.axes.picture.images: cannot vary from point to point",
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep.axes]\n'lens.stretch' = [[1, 1, 1]]\n'lens.stretch.x' = [1]",
        "sweep.axes.lens.stretch.x: varies already, by sweep.axes.lens.stretch; keep one of the two",
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep.axes]\n'lens.stretch.x' = [1]\n'lens.stretch' = [[1, 1, 1]]",
        "sweep.axes.lens.stretch: varies already in part, by sweep.axes.lens.stretch.x",
    ),
    (
        "n = 1.5",
        "n = 1.5\n[[sweep.zip]]\n'lens.r' = [0.1, 0.2]\n'lens.n' = [1.5]",
        "sweep.zip[0]: keys that vary together must have equally many values, but lens.r has 2, lens.n has 1",
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep.zip]\n'lens.r' = [0.1, 0.2]",
        "sweep.zip: is a list of tables, written [[sweep.zip]], with double brackets",
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep.axes]\n'lens.r' = [0.1]\n[[sweep.exclude]]\n'lens.n' = 1.5",
        "sweep.exclude[0].lens.n: does not vary; the keys that do: lens.r",
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep.axes]\n'lens.r' = { linspace = [0.1, 0.2, 1000000000] }",
        "sweep.max_points: the sweep has 1000000000 points; thin the axes or raise sweep.max_points (now 100000)",
    ),
    (
        "n = 1.5",
        "n = 1.5\n[sweep.axes]\n'lens.n' = [1.5, 0]",
        "lens.n: must be an index from 0.001 to 1000, got 0.0 (point 1: lens.n = 0)",
    ),
]


@pytest.mark.parametrize(("old", "new", "problem"), RULES)
def test_a_broken_rule_is_the_one_problem_reported(base, problems, old, new, problem):
    assert problems(base) == ()
    text = base.replace(old, new, 1)
    assert text != base
    found = problems(text)
    assert len(found) == 1
    assert found[0] == problem


def test_a_wrong_parameter_of_a_surface_names_its_key(base, problems):
    (found,) = problems(base.replace("r = 0.25", "r = -1"))
    assert found.startswith("lens.r: ")


def test_an_unknown_surface_is_refused_with_the_nearest(base, problems):
    (found,) = problems(base.replace('"torus"', '"taurus"').replace("R = 0.7\nr = 0.25\n", ""))
    assert found.startswith("lens.surface: ")
    assert "torus" in found


@pytest.mark.parametrize(
    ("old", "new", "key", "number"),
    [
        ("n = 1.5", 'n = "1,5"', "lens.n", "1.5"),
        ("n = 1.5", 'n = "1.5"', "lens.n", "1.5"),
        ("R = 0.7", 'R = ".7"', "lens.R", "0.7"),
        ("size = [8, 6]", 'size = ["8", 6]', "film.size", "8"),
        ("at = [0, 0, 4]", 'at = [0, 0, "4,0e0"]', "source.at", "4"),
    ],
)
def test_a_number_that_is_written_as_a_text_is_said_as_a_number(base, problems, old, new, key, number):
    (found,) = problems(base.replace(old, new))
    assert found.startswith(f"{key}: ")
    assert found.endswith(f"; a number is written without quotation marks and with a point, {number}")


def test_messages_keep_the_letters_of_all_scripts(base, problems):
    (found,) = problems(base.replace("n = 1.5", 'n = "Glas größer 5 \\u202e"'))
    assert "'Glas größer 5 \\u202e'" in found
    (found,) = problems(base.replace('surface = "torus"\nR = 0.7\nr = 0.25', 'surface = "modèle.stl"'))
    assert '"modèle.stl" looks like the name of a file' in found
    (found,) = problems(base.replace("at = [0, 0, 4]", 'at = [0, 0, 4]\n"größe\\u001b" = 1'))
    assert found.startswith("source.größe\\x1b: unknown key")


NO_SURFACES = [  # texts that are neither of the catalogue nor expressions, and what is said of them
    ("bunny.stl", '"bunny.stl" looks like the name of a file, and files of meshes are not read'),
    ("models/bunny.OBJ", "looks like the name of a file"),
    ("./a.ply", "looks like the name of a file"),
    ("scan-2 (final).glb", "looks like the name of a file"),
    ("C:/models/part.step", "looks like the name of a file"),
    ("~/models/bunny", "looks like the name of a file"),
    ("models/bunny", "looks like the name of a file"),
    ("lens.zmx", "looks like the name of a file"),
    ("thing.xyz", "looks like the name of a file"),
    ("torus.stl", '(did you mean "torus"?)'),
    ("https://example.org/bunny.stl", "is an address, and nothing is fetched"),
    ("file:///bunny.stl", "is an address, and nothing is fetched"),
    ("", "is empty; write a name of the catalogue"),
    ("  ", "is empty; write a name of the catalogue"),
    ("elipsoid", 'did you mean "ellipsoid"?'),
    ("Torus", 'did you mean "torus"?'),
    (" torus ", 'did you mean "torus"?'),
    ("plano-convex", 'did you mean "plano_convex"?'),
    ("ball lens", 'did you mean "ball"?'),
    ("gyroid", "the catalogue has sphere, ellipsoid, torus"),
    ("my own lens", "the catalogue has sphere, ellipsoid, torus"),
    ("torus(0.7, 0.2)", 'surface = "torus", with R = ..., r = ...'),
    ("x^2 + y^2 + z^2 - rad^2", "given in the lens table: rad = ..."),
]


@pytest.mark.parametrize("bounds", ["", "bounds = [[-1, -1, -1], [1, 1, 1]]"])
@pytest.mark.parametrize("more", ["", "scale = 2.0"])
@pytest.mark.parametrize(("text", "says"), NO_SURFACES)
def test_what_is_no_surface_is_told_as_what_it_is(base, problems, text, says, bounds, more):
    written = f"surface = '{text}'\n{bounds}\n{more}"
    found = problems(base.replace('surface = "torus"\nR = 0.7\nr = 0.25', written))
    told = [problem for problem in found if not problem.startswith("lens.scale: unknown key")]
    assert len(told) == 1
    assert told[0].startswith("lens.surface: ")
    assert says in told[0]


@pytest.mark.parametrize("text", ["rad/height-x/rad", "rod - x", "x - ball - sphere"])
def test_what_could_be_a_path_or_a_name_but_reads_as_an_expression_is_one(base, problems, text):
    numbers = "".join(f"\n{name} = 0.5" for name in ("rad", "height", "rod", "ball", "sphere") if name in text)
    written = f"surface = '{text}'\nbounds = [[-2, -2, -2], [2, 2, 2]]{numbers}"
    (found,) = problems(base.replace('surface = "torus"\nR = 0.7\nr = 0.25', written))
    assert found.startswith("lens.bounds: the solid must lie strictly inside")  # it is a half of space


@pytest.mark.parametrize("table", ["source", "film", "picture", "medium", "effects", "numerics", "output", "sweep"])
@pytest.mark.parametrize("count", [1, 2])
def test_a_table_that_there_is_once_is_no_list_of_tables(base, problems, table, count):
    head = f"[{table}]\n"
    text = base if head in base else base + head
    own = text.split(head)[1].split("[")[0] if table not in ("source", "film", "picture") else ""
    text = text.replace(head, f"[[{table}]]\n{own}" * (count - 1) + f"[[{table}]]\n")
    (found,) = [problem for problem in problems(text) if problem.startswith(f"{table}: ")]
    assert f"is a single table, written [{table}]" in found
    assert (f"here are {count} of it; " in found) == (count == 2)


def test_lenses_as_tables_of_their_own_are_named_lenses(base, problems):
    (found,) = problems(base.replace("[[lens]]", "[lens.front]"))
    assert found.startswith(
        "lens: a study has one lens or more, so its table is written [[lens]], with double brackets"
    )
    assert '[lens.front] is [[lens]] with a key name = "front"' in found


@pytest.mark.parametrize(
    ("name", "nearest"),
    [
        *[("N-BK7A", "N-BK7"), ("Schott SF11", "SF11"), ("NBAKK4", "N-BAK4"), ("PMMMA", "PMMA")],
        *[("silica", "fused silica"), ("fluorit", "fluorite"), ("s-bk7", "BK7")],
    ],
)
def test_a_material_of_another_name_is_refused_with_the_nearest(base, problems, name, nearest):
    (found,) = problems(base.replace("n = 1.5", f'n = "{name}"'))
    assert f'did you mean "{nearest}"?' in found


@pytest.mark.parametrize("name", ["SF6", "BAF10", "F5", "N-F5", "LAK9", "N-BK8", "SF1", "N-BK10", "perspex"])
def test_a_glass_of_another_number_is_not_called_the_nearest(base, problems, name):
    (found,) = problems(base.replace("n = 1.5", f'n = "{name}"'))
    assert "did you mean" not in found
    assert "known are vacuum, air, water" in found


def test_an_expression_that_cannot_be_read_says_where(base, problems):
    text = base.replace(
        'surface = "torus"\nR = 0.7\nr = 0.25', "surface = \"x + __import__('os')\"\nbounds = [[-1,-1,-1],[1,1,1]]"
    )
    (found,) = problems(text)
    assert found.startswith("lens.surface: column ")


@pytest.mark.parametrize("method", ["auto", "march", "guarded", "polynomial", "interval"])
def test_every_method_can_be_asked_for(base, problems, method):
    assert problems(base + f'[numerics]\nmethod = "{method}"\n') == ()


@pytest.mark.parametrize(
    "key", ["method = 'march'", "precision = 'single'", "snell = 'exact'", "step = 0.1", "tolerance = 1e-9"]
)
def test_accuracy_beside_what_it_chooses_is_an_error_of_its_own(base, problems, key):
    found = problems(base + f"[numerics]\naccuracy = '0.05 px'\n{key}\n")
    name = key.split()[0]
    assert found == (f"numerics.accuracy: chooses {name} itself; give either accuracy or those",)


@pytest.mark.parametrize(
    "idle",
    [
        "fresnel = false",
        "dispersion = false",
        "absorption = 'auto'",
        "absorption = false",
        "antialias = 1",
        "caustics = false",
    ],
)
def test_an_effect_that_asks_for_nothing_is_accepted(base, problems, idle):
    assert problems(base + f"[effects]\n{idle}\n") == ()


@pytest.mark.parametrize("value", ["0", "17", "-2", "2.5", "true", "false", "'edge'", "'4'", "[4]"])
def test_what_is_no_count_of_rays_is_refused_with_what_is(base, problems, value):
    (found,) = problems(base + f"[effects]\nantialias = {value}\n")
    assert found.startswith('effects.antialias: must be "edges" or a whole number from 1 to 16, got ')
    assert problems(base + "[effects]\nantialias = 4.0\n") == ()


def test_all_problems_come_at_once_each_led_by_its_key(base, problems):
    text = (
        base.replace("at = [0, 0, 4]", "at = [0, 0]\nfoo = 1")
        .replace("size = [8, 6]", "size = [0, 6]")
        .replace("n = 1.5", 'n = "aer"')
        .replace("r = 0.25", "q = 0.25")
        + "[numerics]\nstep = -1\n[sweep.axes]\n'lens.R' = []\n[output]\nformat = 'bmp'\n"
    )
    keys = [problem.split(": ")[0] for problem in problems(text)]
    assert keys == [
        "source.at",
        "source.foo",
        "film.size",
        "numerics.step",
        "lens.q",
        "lens.n",
        "sweep.axes.lens.R",
        "output.format",
    ]


def test_several_lenses_need_names_that_differ(base, problems):
    second = '[[lens]]\nsurface = "sphere"\nr = 0.1\ncentre = [0, 0, 1.5]\nn = 1.5\n'
    assert [problem.split(": ")[0] for problem in problems(base + second)] == ["lens[0].name", "lens[1].name"]
    named = base.replace("n = 1.5", 'n = 1.5\nname = "ring"')
    assert problems(named + second + 'name = "ball"\n') == ()
    (found,) = problems(named + second + 'name = "ring"\n')
    assert found == 'lens[1].name: "ring" is the name of an earlier lens; names must differ'
    (found,) = problems(named + second.replace("r = 0.1", "r = -0.1") + 'name = "ball"\n')
    assert found.startswith("lens.ball.r: ")
    (found,) = problems(named + second + "name = 'ball'\n[sweep.axes]\n'lens.r' = [0.1]\n")
    assert found == "sweep.axes.lens.r: with several lenses write lens.NAME.r; the names are ring, ball"


def test_there_are_at_most_100000_lenses_with_every_place_counted(base, problems):
    many = "[" + "[0, 0, 0]," * 99_999 + "]"
    array = base.replace("n = 1.5", f"n = 1.5\nname = 'many'\nat = {many}")
    one = '[[lens]]\nsurface = "sphere"\nr = 0.1\nn = 1.5\nname = '
    assert len(study_from_toml(f"{array}{one}'one'").scene.lenses) == 100_000
    (found,) = problems(f"{array}{one}'one'\n{one}'two'")
    assert found == "lens: at most 100000 lenses are supported, every place of an array counted, got 100001"
    (found,) = problems(array.replace("[[0, 0, 0],", "[[0, 0, 0]," * 1 + "[0, 0, 0]," * 2))
    assert found == "lens.at: must have at most 100000 places, got 100001; leave some out"


def test_a_scene_text_is_refused_as_its_study_is(base):
    with pytest.raises(StudyError, match=r"source\.at: is required"):
        scene_from_toml(base.replace("at = [0, 0, 4]", ""))
    with pytest.raises(StudyError, match=r"output\.format"):
        study_from_toml(base + "[output]\nformat = 'gif'\n")
