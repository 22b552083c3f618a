"""The generated text, read and compiled: it must agree with `evaluate` in both precisions and every packet width."""

from __future__ import annotations

import re
from itertools import product
from pathlib import Path

import numpy as np
import pyopencl as cl
import pytest
from probe import quiet, users_device
from thinned import thinned

from lenscl import device
from lenscl.expr import OPERATIONS, c_text, differentiate, evaluate, gradient, parse
from lenscl.expr.c_writer import RESERVED_WORDS, spell_number
from lenscl.expr.graph import node, number, symbol
from lenscl.lenses import catalogue

KERNELS = Path(__file__).parents[2] / "kernels"
VOCABULARY = "".join(
    (KERNELS / name).read_text() for name in ("lanes.cl", "prelude.cl", "functions.cl", "waves.cl", "memory.cl")
)
WORDS = tuple(dict.fromkeys(name for row in OPERATIONS.values() for name in row.fragments))
POINTS = 1024
COORDINATES = {name: f"p.{name}" for name in "xyz"}
BUILDS = thinned(
    product(("single", "double"), (1, 4, 8, 16)), [("single", 1), ("single", 16), ("double", 4), ("double", 8)]
)
FORMS = (("single", 8), ("double", 8), ("single", 1))
# Each surface in one form, the next surface in the next: every row of the table that they are made of runs in more
CATALOGUE = thinned(
    ((name, *form) for name in catalogue() for form in FORMS),
    [(name, *FORMS[number % len(FORMS)]) for number, name in enumerate(catalogue())],
)


@pytest.fixture(scope="session")
def context():
    return cl.Context([device.choose("Portable Computing Language").handle])


def _run(context, outputs, values, parameters, precision, width, spelled=None):
    """Evaluate outputs at `values` (x, y, z: float64 arrays) on the device."""
    real, kind = ("float", np.float32) if precision == "single" else ("double", np.float64)
    spelled = spelled or {name: f"s.{name}" for name in parameters}
    text = c_text(outputs, symbols=COORDINATES | spelled, lanes="xyz", precision=precision)
    members = "".join(f"  real {each.removeprefix('s.')};\n" for each in spelled.values())
    lines = [*text.statements, *(f"result[{k}] = {each};" for k, each in enumerate(text.results.values()))]
    body = "\n  ".join(lines)
    suffix = "f" if precision == "single" else ""
    source = f"""
#define REAL {real}
#define MASK {"int" if precision == "single" else "long"}
#define VW {width}
#define REAL_MAX {"FLT_MAX" if precision == "single" else "DBL_MAX"}
#define REAL_TINY {"FLT_MIN" if precision == "single" else "DBL_MIN"}
#define REAL_EPSILON {"FLT_EPSILON" if precision == "single" else "DBL_EPSILON"}
#define NUMBER(x) x{"##f" if suffix else ""}
#pragma OPENCL FP_CONTRACT OFF
{VOCABULARY}
{"".join((KERNELS / name).read_text() for name in WORDS)}
typedef struct {{
  real unused;
{members}}} shape;
static void outputs(real3v p, shape s, realv *result) {{
  {body}
}}
kernel void go(global const real *points, global const real *numbers, global real *out, int n) {{
  const int at = get_global_id(0) * VW;
  real3v p;
  p.x = gather(points + at, 1), p.y = gather(points + n + at, 1), p.z = gather(points + 2 * n + at, 1);
  shape s;
  {"".join(f"{each} = numbers[{k}]; " for k, each in enumerate(spelled.values()))}
  realv result[{len(outputs)}];
  outputs(p, s, result);
  for (int k = 0; k < {len(outputs)}; ++k) scatter(result[k], out + k * n + at, 1);
}}"""
    points = np.stack([values[name] for name in "xyz"]).astype(kind)
    numbers = np.array([*parameters.values(), 0.0], dtype=kind)
    result = np.empty((len(outputs), points.shape[1]), kind)
    read_only = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    queue = cl.CommandQueue(context)
    held = [cl.Buffer(context, read_only, hostbuf=each) for each in (points, numbers)]
    held.append(cl.Buffer(context, cl.mem_flags.WRITE_ONLY, result.nbytes))
    kernel = cl.Kernel(cl.Program(context, source).build(quiet(users_device(), width, width)), "go")
    kernel(queue, (points.shape[1] // width,), (8,), *held, np.int32(points.shape[1]))
    cl.enqueue_copy(queue, result, held[2])
    as_seen = {name: column.astype(np.float64) for name, column in zip("xyz", points, strict=True)}
    return result, as_seen | {name: float(kind(value)) for name, value in parameters.items()}


def _points(seed):
    rng = np.random.default_rng(seed)
    return {name: rng.uniform(-1.5, 1.5, POINTS) for name in "xyz"}


@pytest.mark.parametrize(("precision", "width"), BUILDS)
def test_every_row_runs_on_the_device_as_evaluate_says(context, samples, precision, width):
    """Each row of lanes, of scalars (parameters alone), and of both mixed; with the derivatives of the first."""
    # abs(x) + small keeps to every row's domain; sizes stay where a float's rounding does not grow
    lanes = [parse(text, "xyz") for text in ["abs(x) + 0.25", "y + 0.1*z", "z - x", "0.5*y"]]
    scalars = [symbol(name) for name in ["a", "b", "c", "d"]]
    parameters = {"a": 0.75, "b": 1.25, "c": -0.5, "d": 2.5}
    outputs = {}
    for sample in samples:
        arity = len(sample.expr.args)
        if sample.name == "power":
            for n in (2, 3, 7, 10):
                outputs[f"power {n}"] = node("power", lanes[1], number(n))
            outputs["power of a scalar"] = node("power", scalars[2], number(5))
            continue
        if sample.name.startswith("norm"):  # made by the catalogue alone, of coordinates and an exponent of 1 or more
            exponents = parse("abs(x) + 1.25", "xyz"), scalars[1]
            norms = [node(sample.name, *lanes[1:3], exponent) for exponent in exponents]
            outputs |= dict(zip((f"{sample.name} of lanes", f"{sample.name} mixed"), norms, strict=True))
            outputs[f"{sample.name}, its slope"] = differentiate(norms[0], "x")
            continue
        own = lanes if sample.name not in ("asin", "acos") else lanes[::-1]
        outputs[f"{sample.name} of lanes"] = whole = node(sample.name, *own[:arity])
        outputs[f"{sample.name} of scalars"] = node(sample.name, *scalars[:arity])
        outputs[f"{sample.name} mixed"] = node(sample.name, own[0], *scalars[1:arity])
        outputs[f"{sample.name} mixed otherwise"] = node(sample.name, *scalars[: arity - 1], own[0])
        outputs[f"{sample.name}, its slope"] = differentiate(whole, "x")
    got, values = _run(context, outputs, _points(8), parameters, precision, width)
    eps = 2.0**-24 if precision == "single" else 2.0**-53
    for (name, expr), result in zip(outputs.items(), got, strict=True):
        want = evaluate(expr, values)
        poor = np.abs(want) > 20.0 if "tan" in name else np.zeros(POINTS, bool)  # near a pole
        assert np.isfinite(want).all(), name
        np.testing.assert_allclose(result[~poor], want[~poor], rtol=256 * eps, atol=64 * eps, err_msg=f"{name}: {expr}")
    assert len(outputs) > 100


@pytest.mark.parametrize(("precision", "width"), [("single", 8), ("double", 1)])
def test_values_that_are_none_are_none_on_the_device(context, precision, width):
    outputs = {text: parse(text, "xyz") for text in ["pow(x, 0.5)", "sqrt(x)", "pow(0*y + abs(x) - abs(x), 0.5)"]}
    outputs["0^0"] = node("pow", node("-", symbol("x"), symbol("x")), node("-", symbol("y"), symbol("y")))
    outputs["min"] = parse("min(sqrt(x), 5)", "xyz")
    got, values = _run(context, outputs, _points(9), {}, precision, width)
    for expr, result in zip(outputs.values(), got, strict=True):
        np.testing.assert_array_equal(np.isnan(result), np.isnan(evaluate(expr, values)))
    assert np.isnan(got[0]).sum() > 100
    assert (got[3] == 1.0).all()


@pytest.mark.parametrize(("precision", "width"), [("single", 16), ("double", 8), ("single", 1)])
def test_names_that_users_may_choose_do_not_break_the_text(context, precision, width):
    names = [
        "V",
        "W",
        "atan",
        "double",
        "x2",
        "sum1",
        "product1",
        "R",
        "e",
        "M_PI2",
        "gamma",
        "lens_f",
        "p",
        "s",
        "result",
    ]
    text = (
        "V*W + (V*W)^3*x + atan^2*y + atan^2 + x2*x^2 + x^2 + sum1*(x + y) + (x + y)^2 + product1*x*y + (x*y)^2 + R*e"
        " + double^2*x + double^2*y + (e*R)^2 + M_PI2^2*gamma + lens_f*p*s + (p*s)^2*result"
    )
    expr = parse(text, ["x", "y", "z", *names])
    outputs = {"f": expr, **dict(zip("xyz", gradient(expr), strict=True))}
    parameters = {name: 0.1 * k + 0.3 for k, name in enumerate(names)}
    spelled = {name: f"s.k_{name}" for name in names}  # as the kernels do, since a name may be a word of C
    got, values = _run(context, outputs, _points(10), parameters, precision, width, spelled)
    eps = 2.0**-24 if precision == "single" else 2.0**-53
    for expr, result in zip(outputs.values(), got, strict=True):
        np.testing.assert_allclose(result, evaluate(expr, values), rtol=64 * eps, atol=64 * eps)


@pytest.mark.parametrize(("name", "precision", "width"), CATALOGUE)
def test_the_catalogue_runs_on_the_device_as_evaluate_says(context, name, precision, width):
    row = catalogue()[name]
    parameters = {parameter.name: parameter.default for parameter in row.parameters}
    outputs = {"f": row.expression, **dict(zip("xyz", gradient(row.expression), strict=True))}
    got, values = _run(context, outputs, _points(13), parameters, precision, width)
    eps = 2.0**-24 if precision == "single" else 2.0**-53
    for expr, result in zip(outputs.values(), got, strict=True):
        want = evaluate(expr, values)
        np.testing.assert_allclose(result, want, rtol=64 * eps, atol=512 * eps * max(1.0, np.abs(want).max()))


@pytest.mark.parametrize(("e1", "e2"), [(0.2, 2.0), (2.0, 0.2), (2.0, 2.0), (0.5, 0.5)])
@pytest.mark.parametrize(("precision", "width"), [("single", 8), ("double", 1)])
def test_the_superellipsoid_has_slopes_at_special_points_on_the_device(context, e1, e2, precision, width):
    special = [-1.0, -0.5, -1e-8, -1e-30, -0.0, 0.0, 1e-30, 1e-8, 0.5, 1.0]
    at = dict(zip("xyz", (np.resize(part, POINTS) for part in np.meshgrid(*[special] * 3)), strict=True))
    F = catalogue()["superellipsoid"].expression
    outputs = {"f": F, **dict(zip("xyz", gradient(F), strict=True))}
    got, _ = _run(context, outputs, at, {"e1": e1, "e2": e2}, precision, width)
    assert np.isfinite(got).all()
    assert (got[0] <= 0.0).sum() > 100


@pytest.mark.parametrize(("precision", "width"), [("single", 8), ("double", 4)])
def test_a_long_expression_is_well_formed(context, precision, width):
    terms = [f"{n}*sin({n}*x/100 + y)/(1 + {n}*z^2)" for n in range(1, 101)]
    expr = parse(" + ".join(terms) + " - max(" + ", ".join(f"abs(x - {n}/50)" for n in range(40)) + ")", "xyz")
    outputs = {"f": expr, **dict(zip("xyz", gradient(expr), strict=True))}
    text = c_text(outputs, symbols=COORDINATES, lanes="xyz", precision=precision)
    assert max(map(len, text.statements)) <= 120
    assert all("\n" not in line for line in text.statements)
    got, values = _run(context, outputs, _points(11), {}, precision, width)
    eps = 2.0**-24 if precision == "single" else 2.0**-53
    np.testing.assert_allclose(got[0], evaluate(expr, values), rtol=0, atol=1e5 * eps)


def test_the_text_reads_as_a_person_would_write_it():
    F = parse("(x^2 + y^2 + z^2)^2 - 3*y*(x^2 + z^2)/R^4", ["x", "y", "z", "R"])
    outputs = {"f": F, "fx": gradient(F)[0]}
    text = c_text(outputs, symbols=COORDINATES | {"R": "s.R"}, lanes="xyz", precision="single")
    assert text.statements == (
        "const realv x2 = p.x * p.x;   // x^2",
        "const realv z2 = p.z * p.z;   // z^2",
        "const realv sum1 = x2 + p.y * p.y + z2;   // x^2 + y^2 + z^2",
        "const real R2 = s.R * s.R;   // R^2",
        "const real R4 = R2 * R2;   // R^4",
    )
    assert text.results == {
        "f": "sum1 * sum1 - 3.0f * p.y * (x2 + z2) / R4",
        "fx": "4.0f * sum1 * p.x - 6.0f * p.y * p.x / R4",
    }


def test_results_of_scalars_are_widened_to_lanes():
    text = c_text({"f": parse("R^2", ["R"]), "zero": number(0)}, symbols={"R": "R"}, lanes="xyz", precision="double")
    assert text.results == {"f": "(realv)(R * R)", "zero": "(realv)0.0"}
    text = c_text({"f": parse("R^2", ["R"])}, symbols={"R": "R"}, lanes="", precision="double")
    assert text.results == {"f": "R * R"}


def test_integer_powers_call_no_function():
    F = parse("x^13 + (x + y)^6", "xyz")
    text = c_text({"f": F}, symbols=COORDINATES, lanes="xyz", precision="double")
    code = " ".join(line.split("//")[0] for line in [*text.statements, *text.results.values()])
    assert code.count("*") == 8  # x2 x3 x6 x12 x13 and three for the sixth power
    assert not re.search(r"\w\(", code)


@pytest.mark.parametrize("word", ["fma", "mad", "fabs", "fmax", "fmin", "select", "copysign", "floor", "any", "powr"])
def test_what_is_slow_or_wrong_on_pocl_is_not_in_the_text(samples, word):
    outputs = {sample.name: sample.expr for sample in samples}
    outputs |= {f"{sample.name}'": differentiate(sample.expr, "u0") for sample in samples}
    names = [f"u{k}" for k in range(4)]
    text = c_text(outputs, symbols={name: name for name in names}, lanes=names, precision="single")
    code = " ".join(line.split("//")[0] for line in [*text.statements, *text.results.values()])
    assert len(code) > 1000
    assert not re.search(rf"\b{word}\b", code)


@pytest.mark.parametrize(
    ("value", "single", "double"),
    [
        (2.0, "2.0f", "2.0"),
        (0.6, "0.6f", "0.6"),
        (1 / 3, "0.33333334f", "0.3333333333333333"),
        (1e22, "1.0e+22f", "1.0e+22"),
        (1e-37, "1.0e-37f", "1.0e-37"),
        (1e-300, "0.0f", "1.0e-300"),
        (1e300, "INFINITY", "1.0e+300"),
        (-0.5, "-0.5f", "-0.5"),
        (16777217.0, "16777216.0f", "16777217.0"),
    ],
)
def test_numbers_are_spelled_for_their_precision(value, single, double):
    assert spell_number(value, "single") == single
    assert spell_number(value, "double") == double


def test_spelled_numbers_read_back():
    rng = np.random.default_rng(12)
    for value in rng.normal(size=500) * 10.0 ** rng.integers(-30, 30, 500):
        assert float(spell_number(float(value), "double")) == value
        assert np.float32(spell_number(float(value), "single").removesuffix("f")) == np.float32(value)


def test_words_of_the_prelude_are_reserved():
    text = VOCABULARY
    macros = set(re.findall(r"#define (\w+)", text)) | {"REAL", "MASK", "VW", "RUN"}
    types = set(re.findall(r"typedef .*?(\w+);", text)) | set(re.findall(r"\}\s*(\w+);", text))
    assert len(macros) > 8
    assert {"real", "realv", "maskv", "real3v"} <= types
    assert macros | types <= RESERVED_WORDS
