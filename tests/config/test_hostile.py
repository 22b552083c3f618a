"""Whatever a study file holds, the answer is a StudyError of readable size: no traceback, no hang."""

from __future__ import annotations

import os
import random
import tomllib

import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lenscl.config import load_study, parse_override, scene_from_toml, study_from_toml
from lenscl.errors import StudyError

LARGE = 990_000
LONGEST_MESSAGE = 40_000

scalars = st.one_of(
    st.sampled_from([0.5, 1, 2.0]),
    st.booleans(),
    st.integers(-(10**40), 10**40),
    st.integers(-3, 3),
    st.floats(),
    st.text(st.characters(blacklist_categories=["Cs"]), max_size=8),
    st.sampled_from(
        ["torus", "sphere", "point", "parallel", "air", "x", "x+y", "follow", "march", "grid", "lens.r", "1/0"]
    ),
    st.datetimes(),
)
values = st.recursive(
    scalars,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(st.sampled_from(["n", "min", "max", "linspace", "range", "table", "x"]), inner, max_size=3)
    ),
    max_leaves=8,
)
KEYS = {
    "source": ["kind", "at", "direction", "x"],
    "film": ["corner", "centre", "right", "down", "scale", "size", "y"],
    "picture": ["corner", "centre", "right", "down", "scale", "size", "images", "outside", "filter", "encoding"],
    "medium": ["n", "m"],
    "lens": ["name", "surface", "R", "r", "k", "bounds", "centre", "stretch", "rotate", "n", "absorption", "absorbs"],
    "effects": ["total_reflection", "fresnel", "dispersion", "antialias", "z"],
    "numerics": ["accuracy", "method", "precision", "snell", "step", "tolerance", "max_events"],
    "sweep": ["mode", "samples", "seed", "max_points", "axes", "zip", "exclude", "include"],
    "output": ["format", "q"],
}

PLAUSIBLE = {
    "source": {"at": [[1, 2, 3]], "kind": ["point"]},
    "film": {"scale": [0.5, 2, 1e-3], "size": [[1, 1], [3, 7]], "right": [[0, 0, 2], [1, 1, 0]]},
    "picture": {"scale": [2], "outside": [[0.5], [1, 2, 3]], "filter": ["nearest"], "images": ["a*"], "size": [[5, 5]]},
    "medium": {"n": ["air", 1.33, {"cauchy": [1.3]}]},
    "lens": {"r": [0.1, 1], "n": ["BK7", 2], "stretch": [[-1, 1, 1e-3]], "rotate": [[0, 720, 0]], "name": ["ring"]},
    "effects": {"total_reflection": ["follow", "end"], "fresnel": [False], "antialias": [1, 4, "edges"]},
    "numerics": {"precision": ["single"], "max_events": [1, 255], "tolerance": [1e-9], "method": ["march"]},
    "sweep": {
        "max_points": [2, 100],
        "axes": [{}, {"lens.n": {"linspace": [1, 2, 3]}}],
        "include": [[{"lens.r": 0.1}]],
    },
    "output": {"format": ["exr", "jpg"]},
}


def valid_document() -> dict:
    return {
        "source": {"at": [0, 0, 4]},
        "film": {"centre": [0, 0, 2.5], "right": [2, 0, 0], "down": [0, -2, 0], "size": [8, 6]},
        "picture": {"centre": [0, 0, -2.5], "right": [6, 0, 0], "down": [0, -6, 0]},
        "medium": {"n": 1.0},
        "lens": [{"surface": "torus", "R": 0.7, "r": 0.25, "n": 1.5}],
        "effects": {},
        "numerics": {},
        "sweep": {"axes": {"lens.r": [0.1, 0.2]}},
        "output": {},
    }


@st.composite
def documents(draw):
    """Draw a valid document with a few of its values replaced by anything."""
    document = valid_document()
    for _ in range(draw(st.integers(0, 3))):
        table = draw(st.sampled_from(list(KEYS)))
        if draw(st.integers(0, 15)) == 7:
            document[table] = draw(values)
            continue
        target = document[table]
        if isinstance(target, list) and target:
            target = target[0]
        if isinstance(target, dict) and draw(st.booleans()):
            key = draw(st.sampled_from(list(PLAUSIBLE[table])))
            target[key] = draw(st.sampled_from(PLAUSIBLE[table][key]))
        elif isinstance(target, dict):
            target[draw(st.sampled_from(KEYS[table]))] = draw(values)
    if draw(st.integers(0, 7)) == 5 and isinstance(document["sweep"], dict):
        key = draw(
            st.sampled_from(
                ["lens.n", "lens.stretch.x", "film.size.rows", "lens.surface", "source.at", "numerics.step"]
            )
        )
        document["sweep"]["axes"] = {key: draw(values)}
    return document


def refusal(text: str) -> StudyError | None:
    """Return the error a text is refused with; any other exception passes through and fails the test."""
    try:
        study = study_from_toml(text)
    except StudyError as error:
        return error
    assert scene_from_toml(study.scene.to_toml()) == study.scene
    return None


def test_a_random_document_is_read_or_refused_with_a_readable_message():
    seen = {"refused": 0, "accepted": 0}

    @settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.too_slow])
    @given(document=documents())
    def read(document):
        error = refusal(tomli_w.dumps(document))
        seen["accepted" if error is None else "refused"] += 1
        if error is not None:
            assert error.problems
            assert len(str(error)) < LONGEST_MESSAGE
            # A fault in an expression is shown below its message, on lines of their own
            assert all(": " in line and line.isprintable() for line in error.problems if "column" not in line)

    read()
    assert seen["refused"] > 100
    assert seen["accepted"] > 25


def test_random_damage_to_a_text_is_read_or_refused(base):
    rng = random.Random(1)
    refused = 0
    for _ in range(500):
        text = list(base)
        for _ in range(rng.randint(1, 6)):
            place = rng.randrange(len(text))
            text[place] = rng.choice(
                ["", "\0", "[", "]", '"', "=", "9" * 30, "\n", "é", "\x7f", "{", "nan", "1e999", text[place] * 2]
            )
        error = refusal("".join(text))
        refused += error is not None
        assert error is None or len(str(error)) < LONGEST_MESSAGE
    assert refused > 300


HOSTILE = {
    "a key of half a million parts": "a" + ".a" * (LARGE // 2) + " = 1",
    "many long keys": "\n".join("a." * 400 + f"k{i} = 1" for i in range(LARGE // 820)),
    "a table of half a million parts": "[" + "a." * (LARGE // 2) + "a]",
    "nested brackets": "a = " + "[" * LARGE,
    "nested tables": "a = " + "{a=" * (LARGE // 3),
    "letters for parameters": (
        "[[lens]]\nn = 1\nbounds = [[0, 0, 0], [1, 1, 1]]\nsurface = '"
        + "+".join(f"k{i}" for i in range(60_000))
        + "'\n"
        + "\n".join(f"k{i} = 1" for i in range(45_000))
    ),
    "many tables": "\n".join(f"[t{i}]" for i in range(LARGE // 9)),
    "many keys": "\n".join(f"k{i} = 1" for i in range(LARGE // 12)),
    "many lenses": "[[lens]]\n" * (LARGE // 9),
    "a number of a million digits": "title = " + "9" * LARGE,
    "a hexadecimal number of a million digits": "[film]\nscale = 0x" + "f" * (LARGE - 30),
    "a text of a million letters": "title = '" + "x" * LARGE + "'",
    "a list of half a million values": "[film]\nsize = [" + "1," * (LARGE // 2) + "]",
    "many axes": "[sweep.axes]\n" + "\n".join(f"'lens.q{i}' = [1]" for i in range(50_000)),
    "an exclude of many keys beside an include of many": (
        "[[sweep.include]]\n"
        + "\n".join(f"k{i} = 1" for i in range(1000))
        + "\n[[sweep.exclude]]\n"
        + "\n".join(f"j{i} = 1" for i in range(60_000))
    ),
    "many excludes": "[sweep.axes]\n'lens.r' = [1]\n" + "[[sweep.exclude]]\n'lens.r' = 1\n" * 20_000,
    "zeros": "\0" * 1000,
    "ten megabytes": "#" * 10_000_000,
    "nothing": "",
}


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_text_is_refused_with_a_readable_message(text):
    with pytest.raises(StudyError) as caught:
        study_from_toml(text)
    assert 0 < len(str(caught.value)) < LONGEST_MESSAGE
    assert str(caught.value).isprintable() or "\n" in str(caught.value)


LONG_KEYS = {
    "bare parts": "a." * (LARGE // 2) + "x = 1",
    "parts with a space": '"a b".' * (LARGE // 6) + "x = 1",
    "parts with a dot": '"a.b".' * (LARGE // 6) + "x = 1",
    "parts with an escape": '"\\u0061\\"".' * (LARGE // 11) + "x = 1",
    "empty parts": "''.\"\"." * (LARGE // 6) + "x = 1",
    "literal parts": "'#\\' \t.\t" * (LARGE // 8) + "x = 1",
    "parts beyond latin": '"é☃".' * (LARGE // 5) + "x = 1",
    "a header": "[" + '"a b" . ' * (LARGE // 8) + "x]",
    "a header of a list": "[[" + "'a b'." * (LARGE // 6) + "x]]",
    "an inline table": "a = { " + "\"a'b\".'a\"b'." * (LARGE // 12) + "x = 1 }",
    "an inline table in a list": 'a = [\n# "\n{ b = { ' + '"]".' * (LARGE // 4) + "x = 1 } } ]",
    "a key after strings": "a = \"\"\"\\\"\"\"\"\"\nb = '''\\'''\nc = '\\' # '\n" + '"a b".' * (LARGE // 7) + "x = 1",
}


@pytest.mark.parametrize("text", LONG_KEYS.values(), ids=LONG_KEYS)
def test_a_key_of_many_parts_is_refused_before_tomllib_sees_it(text, monkeypatch):
    monkeypatch.setattr(tomllib, "loads", lambda text: pytest.fail("tomllib was asked"))
    with pytest.raises(StudyError) as caught:
        study_from_toml(text)
    assert caught.value.problems == ("study: has a key of more than 16 parts; a study's keys are shorter",)
    assert parse_override(f"title={{ {'q.' * 20}x = 1 }}") == ("title", f"{{ {'q.' * 20}x = 1 }}")


parts = st.sampled_from(
    ["a", "B-1_", "7", '"a b"', "'a.b'", '""', "''", r'"\"."', r'"\\"', "'\\'", "'\"'", '"\'#"', '"é"']
)
innocent = st.sampled_from(
    [
        "1.5",
        "2020-01-01T00:00:00.5",
        '"' + "a." * 40 + '"',
        "'" + "a . " * 40 + "\\'",
        '"""' + "a.\n" * 3 + '\\"""' + "a." * 40 + '"""""',
        "'''\n'" + "a." * 40 + "\"'''''",
        "[1.0, 'a.b', # " + "a." * 40 + "'\"\n]",
        r'"\\\"' + "a." * 40 + '"',
        '""',
        "''",
        "{ b.c = '\"' }",
    ]
)
lines = st.tuples(
    st.lists(parts, min_size=1, max_size=20),
    st.sampled_from([".", " . ", "\t.", ". "]),
    innocent,
    st.sampled_from(["", " # " + "a." * 40, ' # "', " # '''"]),
    st.sampled_from(["\n", "\r\n"]),
)


def test_only_keys_of_many_parts_are_refused_for_them_whatever_stands_in_strings_and_comments():
    seen = {True: 0, False: 0}

    @settings(max_examples=400, deadline=None)
    @given(written=st.lists(lines, min_size=1, max_size=4))
    def read(written):
        text = "".join(
            dot.join([f"k{i}", *key]) + f" = {value}{comment}{end}"
            for i, (key, dot, value, comment, end) in enumerate(written)
        )
        assert len(tomllib.loads(text)) == len(written)  # all of it is TOML
        long = any(len(key) + 1 > 16 for key, *_ in written)
        with pytest.raises(StudyError) as caught:  # no study in any case
            study_from_toml(text)
        assert ("key of more than 16 parts" in str(caught.value)) == long
        seen[long] += 1

    read()
    assert min(seen.values()) > 10  # 26 and more with draws anew


UNCLOSED = ['"', "'", '"""', "'''", 'a = "\\"', "\\", '"\\', "a.", '.""', "'\"", "\"'", '"""\\"', "'''\"", "#", '"\n']


@pytest.mark.parametrize("piece", UNCLOSED)
def test_a_repeated_piece_of_a_string_is_answered(piece):
    for text in (piece * (LARGE // len(piece)), f"a = {piece}" + piece[-1] * (LARGE - 20)):
        with pytest.raises(StudyError):
            study_from_toml(text)


@pytest.mark.parametrize(
    "axis",
    [
        "{ linspace = [0.1, 0.2, 1000000000] }",
        "{ linspace = [0.1, 0.2, 999999999999999999999999] }",
        "{ range = [0, 1, 1e-300] }",
        "{ range = [-1e12, 1e12, 1e-12] }",
        "{ logspace = [1e-12, 1e12, 1000000000000] }",
    ],
)
def test_a_sweep_of_too_many_points_is_refused_before_any_is_made(base, problems, axis):
    (problem,) = problems(base + f"[sweep.axes]\n'lens.r' = {axis}\n")
    assert problem.startswith("sweep.")
    assert len(problem) < 250


def test_a_control_sequence_in_a_key_does_not_reach_the_terminal(base, problems):
    (problem,) = problems('"\\u001b[31mred" = 1\n' + base)
    assert problem.startswith("\\x1b[31mred: unknown key")


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    def problem(path) -> str:
        with pytest.raises(StudyError) as caught:
            load_study(path)
        (only,) = caught.value.problems
        return only

    assert problem(tmp_path / "none.toml") == f"{tmp_path}/none.toml: there is no such file"
    assert problem(tmp_path) == f"{tmp_path}: is a folder; name a study file in it"
    binary = tmp_path / "binary.toml"
    binary.write_bytes(bytes(range(256)))
    assert problem(binary) == f"{binary}: is not UTF-8 text (byte 128); a study file is"
    large = tmp_path / "large.toml"
    with open(large, "wb") as file:
        file.truncate(50_000_000)
    assert problem(large) == f"{large}: is larger than 10000000 bytes; a study file is not"
    text = tmp_path / "text.toml"
    text.write_text("title = ")
    assert problem(text).startswith(f"{text}: is not TOML: ")
    assert "cannot be read: " in problem("a\0b")
    pipe = tmp_path / "pipe.toml"
    os.mkfifo(pipe)
    assert problem(pipe) == f"{pipe}: is not a plain file; name a study file"
    assert "cannot be read: " in problem(tmp_path / ("n" * 5000))


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="the superuser may read every file")
def test_a_file_without_permission_is_named(tmp_path):
    secret = tmp_path / "secret.toml"
    secret.write_text("")
    secret.chmod(0)
    with pytest.raises(StudyError, match="cannot be read: Permission denied"):
        load_study(secret)


def test_a_byte_order_mark_is_no_fault(base, tmp_path):
    path = tmp_path / "marked.toml"
    path.write_bytes(b"\xef\xbb\xbf" + base.encode())
    assert load_study(path).title == "marked"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("lens.r=0.2", ("lens.r", 0.2)),
        ("lens.r = 1", ("lens.r", 1)),
        ("lens.n=diamond", ("lens.n", "diamond")),
        ('lens.n="diamond"', ("lens.n", "diamond")),
        ("lens.n=fused silica", ("lens.n", "fused silica")),
        ("lens.centre=[1, 2, 3]", ("lens.centre", [1, 2, 3])),
        ("lens.n={ cauchy = [1.5] }", ("lens.n", {"cauchy": [1.5]})),
        ("lens.surface=x**2 + y**2 - 1", ("lens.surface", "x**2 + y**2 - 1")),
        ("title=a=b", ("title", "a=b")),
        ("title=1\nevil = 2", ("title", "1\nevil = 2")),
        ("title=" + "[" * 100_000, ("title", "[" * 100_000)),
    ],
)
def test_an_override_is_toml_or_bare_text(text, expected):
    assert parse_override(text) == expected


@pytest.mark.parametrize("text", ["", "lens.r", "=1", "lens.r=", "   =  "])
def test_an_override_without_key_or_value_is_refused(text):
    with pytest.raises(StudyError, match=r"^--set .*: must be KEY=VALUE, such as lens\.r=0\.2$"):
        parse_override(text)


def test_half_a_character_is_refused():
    with pytest.raises(StudyError, match=r"^study: is not Unicode text \(character 10\)$"):
        study_from_toml('title = "\ud800"')
