"""Write a surface as bands on a segment of a ray: its polynomial parts there, and of their bands its smooth leaves."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from itertools import count

from lenscl.codegen.forks import both_sides
from lenscl.codegen.text import Precision, function, function_of, shape_symbols, unlike
from lenscl.expr import (
    Expr,
    band_text,
    build,
    creased,
    degree,
    derivative_along,
    is_rational,
    jumps,
    least,
    magnitude,
    number,
    pieces,
    polynomial,
    symbol,
    twice_text,
)
from lenscl.expr.graph import node, walk
from lenscl.expr.joined import MOST_LEAVES
from lenscl.expr.jumps import STEPS
from lenscl.expr.planar import MOST_PLANES
from lenscl.expr.poles import OneSided, one_sided
from lenscl.lenses import Surface

_AXES = "xyz"
_KINDS = ("linear", "quadratic", "cubic", "quartic")  # polynomials of kernels/interval_polynomials.cl, by degree
_MOST_FORKS = 3  # floors of which both sides of a jump are looked at in turn: by 2^3 bands at most
_INNER = 2  # degree of what a part is made of, as far as roundings are followed
_HORNER = 4  # roundings a degree for the sums that follow, twice over to cover terms of second order
_UNIT = symbol("REAL_EPSILON")
_INPUT = symbol("INPUT_ROUNDINGS")


def band_functions(prefix: str, surface: Surface, precision: Precision) -> str:
    """Return what search_interval.cl asks of a surface: its parts, and the bands of F and of F's slope."""
    return _functions(prefix, surface, precision, _parts_function)


def band_functions_twice(prefix: str, surface: Surface, precision: Precision) -> str:
    """Return the same with the parts computed in twice the precision of double, for a surface that `has_twice`."""
    return _functions(prefix, surface, precision, _parts_function_twice)


def has_twice(surface: Surface) -> bool:
    """Say whether a surface's parts can be computed in twice the precision."""
    return is_rational(_taken_apart(surface)[2].values())


def _functions(prefix: str, surface: Surface, precision: Precision, write_parts: Callable[..., str]) -> str:
    joined, leaves, parts = _taken_apart(surface)
    taken = {*shape_symbols(surface), *parts}
    floors = {name: least(part) for name, part in parts.items()}
    roots = _roots(leaves.values(), parts, floors, taken)
    leaves = {name: _replaced(leaf, roots) for name, leaf in leaves.items()}
    kinds = {name: _KINDS[_degree(part) - 1] for name, part in parts.items()}
    kinds |= {str(root.name): "cbrt" for root in roots.values()}
    sloped = {name: unlike(f"{name}_slope", {*taken, *kinds}) for name in kinds}
    along = {name: symbol(of) for name, of in sloped.items()}
    leaf_slopes = {name: derivative_along(leaf, along) for name, leaf in leaves.items()}
    bands = {name: f"band_of_{kind}(parts->{name})" for name, kind in kinds.items()}
    starts = {name: f"start_of_{kind}(parts->{name})" for name, kind in kinds.items()}
    slopes = {sloped[name]: f"slope_of_{kind}(parts->{name})" for name, kind in kinds.items()}
    floors |= {str(root.name): 0.0 for root in roots.values()}
    finish = [f"parts.{root.name} = cbrt_of(parts.{each.args[0].name});" for each, root in roots.items()]
    return "\n".join(
        (
            _parts_struct(prefix, kinds),
            write_parts(prefix, surface, parts, finish, precision),
            leaves_text(prefix, joined, len(leaves)),
            _bands_function(prefix, "bands", surface, leaves, bands, floors, precision),
            _bands_function(prefix, "start_bands", surface, leaves, starts, floors, precision),
            _bands_function(prefix, "slope_bands", surface, leaf_slopes, bands | slopes, floors, precision, leaves),
        )
    )


def _roots(
    leaves: Iterable[Expr], parts: Mapping[str, Expr], floors: Mapping[str, float], taken: Collection[str]
) -> dict[Expr, Expr]:
    """Return the nodes that kernels/interval_cbrt.cl has words for, with the symbols that stand for them."""
    found: dict[Expr, Expr] = {}
    for each in walk(leaves):
        name = str(each.args[0].name) if each.op == "cbrt" else ""
        if name in parts and _degree(parts[name]) == 2 and floors[name] >= 0.0:
            found[each] = symbol(unlike(f"{each.args[0].name}_root", taken))
    return found


def _replaced(expr: Expr, symbols: Mapping[Expr, Expr]) -> Expr:
    made: dict[Expr, Expr] = {}
    for each in walk([expr]):
        made[each] = symbols.get(each) or (node(each.op, *(made[arg] for arg in each.args)) if each.args else each)
    return made[expr]


def leaves_of(surface: Surface) -> tuple[Expr, ...]:
    """Return the smooth leaves of F, as search_interval.cl numbers them."""
    return tuple(creased(surface.expression, MOST_LEAVES)[1].values())


def faces_of(surface: Surface) -> tuple[Expr, tuple[Expr, ...]]:
    """Return F as max and min of leaf_0, leaf_1, ..., and these leaves: of a polyhedron all its planes."""
    joined, leaves = creased(surface.expression, MOST_PLANES if surface.planes else MOST_LEAVES)
    return joined, tuple(leaves.values())


def _taken_apart(surface: Surface) -> tuple[Expr, dict[str, Expr], dict[str, Expr]]:
    """Return how a surface's leaves are joined, the leaves with symbols for their polynomial parts, and these parts."""
    joined, leaves = creased(surface.expression, MOST_LEAVES)
    rests, parts = pieces(tuple(leaves.values()), _AXES, len(_KINDS))
    return joined, dict(zip(leaves, rests, strict=True)), parts


def _degree(part: Expr) -> int:
    found = degree(part, _AXES)
    assert found is not None, "a part is a polynomial"
    return found


def _parts_struct(prefix: str, kinds: dict[str, str]) -> str:
    fields = "".join(f"  {kind}_t {name};\n" for name, kind in kinds.items())
    return f"typedef struct {{\n{fields}}} {prefix}_parts_t;\n"


def _parts_function(
    prefix: str, surface: Surface, parts: dict[str, Expr], finish: Sequence[str], precision: Precision
) -> str:
    """Return the function of the parts' coefficients and of what these may be wrong by.

    `finish` is what is made of the parts then, in C.
    """
    spelled = {"REAL_EPSILON": "REAL_EPSILON", "INPUT_ROUNDINGS": "INPUT_ROUNDINGS"} | shape_symbols(surface)
    vectors = {}
    for vector in ("origin", "along", "reach", "drift"):
        vectors[vector] = {axis: unlike(f"{vector}_{axis}", spelled) for axis in _AXES}
        spelled |= {vectors[vector][axis]: f"{vector}.{axis}" for axis in _AXES}
    origin, along, reach, drift = ({axis: symbol(name) for axis, name in names.items()} for names in vectors.values())
    outputs: dict[str, Expr] = {}
    lines = [f"{prefix}_parts_t parts;"]
    for name, part in parts.items():
        (whole,), inner = pieces([part], _AXES, _INNER)
        coefficients: dict[str, tuple[Expr, ...]] = {}
        errors: dict[str, Expr] = {}
        for each, quadric in inner.items():
            coefficients[each] = _polynomial(quadric, {axis: (origin[axis], along[axis]) for axis in _AXES})
            errors[each] = _error(quadric, _AXES, reach, drift)
        sizes = {each: _sum_of_sizes(coefficients[each]) + errors[each] for each in inner}
        error = errors[whole.name] if whole.name in errors else _error(whole, tuple(inner), sizes, errors)
        padded = (*_polynomial(whole, coefficients), *[number(0.0)] * _degree(part))
        for power in range(_degree(part) + 1):
            outputs[f"{name}_{power}"] = padded[power]
            lines.append(f"parts.{name}.c[{power}] = {{{name}_{power}}};")
        outputs[f"{name}_error"] = error
        lines.append(f"parts.{name}.error = ({{{name}_error}}) + UNDERFLOW;")
    return function(
        f"{prefix}_parts_t {prefix}_parts(real3v origin, real3v along, real3v reach, real3v drift, {prefix}_t shape)",
        outputs,
        "\n".join((*lines, *finish, "return parts;")),
        spelled,
        precision,
    )


def _parts_function_twice(
    prefix: str, surface: Surface, parts: dict[str, Expr], finish: Sequence[str], precision: Precision
) -> str:
    """Return the function of the parts' coefficients in twice the precision, rounded at the end.

    An operation's relative error is at most 15 u^2, less than 4 REAL_EPSILON^2; the last rounding's and those of the
    sums that follow are of the coefficients themselves.
    """
    assert precision == "double"
    spelled = shape_symbols(surface)
    names = {vector: {axis: unlike(f"{vector}_{axis}", spelled) for axis in _AXES} for vector in ("middle", "along")}
    vectors = {names[vector][axis]: f"{vector}.{axis}" for vector in names for axis in _AXES}
    line = {axis: (symbol(names["middle"][axis]), symbol(names["along"][axis])) for axis in _AXES}
    moves = {axis: symbol(unlike(f"drift_{axis}", spelled)) for axis in _AXES}
    outputs: dict[str, Expr] = {}
    bounds: dict[str, Expr] = {}
    lines, errors = [f"{prefix}_parts_t parts;"], []
    for name, part in parts.items():
        padded = (*_polynomial(part, line), *[number(0.0)] * _degree(part))
        powers = range(_degree(part) + 1)
        outputs |= {f"{name}_{power}": padded[power] for power in powers}
        lines += [f"parts.{name}.c[{power}] = dd_round({{{name}_{power}}});" for power in powers]
        bounds[f"{name}_size"], roundings = magnitude(part, _AXES)
        bounds[f"{name}_drift"] = derivative_along(bounds[f"{name}_size"], moves)
        total = " + ".join(f"abs_v(parts->{name}.c[{power}])" for power in powers)
        count = 4 * (2 * roundings + _HORNER * _degree(part))
        errors.append(
            f"parts->{name}.error = (realv)REAL_EPSILON * ((realv)4 * ({total}) +"
            f" (realv)(REAL_EPSILON * {count}) * ({{{name}_size}})) + ({{{name}_drift}}) + UNDERFLOW;"
        )
    coordinates = {axis: f"reach.{axis}" for axis in _AXES} | {
        str(move.name): f"drift.{axis}" for axis, move in moves.items()
    }
    return "\n".join(
        (
            function(
                f"void {prefix}_errors(real3v reach, real3v drift, {prefix}_t shape, {prefix}_parts_t *parts)",
                bounds,
                "\n".join(errors),
                coordinates | spelled,
                precision,
            ),
            function_of(
                f"{prefix}_parts_t {prefix}_parts_twice(dd3_t middle, dd3_t along, real3v reach, real3v drift,"
                f" {prefix}_t shape)",
                twice_text(outputs, symbols=vectors | spelled, lanes=vectors),
                "\n".join((*lines, f"{prefix}_errors(reach, drift, shape, &parts);", *finish, "return parts;")),
            ),
        )
    )


def _error(form: Expr, along: Collection[str], sizes: Mapping[str, Expr], errors: Mapping[str, Expr]) -> Expr:
    """Bound what a polynomial is wrong by: its own roundings, and the errors of what it is made of.

    To first order the latter come in by the slopes of the polynomial with all terms positive, whose values at `sizes`,
    which hold the errors, are the largest.
    """
    size, roundings = magnitude(form, along)
    top = degree(form, along)
    assert top is not None
    count = number(2.0 * roundings + _HORNER * top) + _INPUT * (2.0 * (roundings + top))
    own, passed_on = (
        _polynomial(each, {name: (value,) for name, value in sizes.items()})[0]
        for each in (size, derivative_along(size, errors))
    )
    return count * _UNIT * own + passed_on


def _polynomial(form: Expr, along: Mapping[str, tuple[Expr, ...]]) -> tuple[Expr, ...]:
    found = polynomial(form, along)
    assert found is not None
    return found


def _sum_of_sizes(coefficients: Iterable[Expr]) -> Expr:
    total = number(0.0)
    for each in coefficients:
        total = total + build("abs", each)
    return total


def leaves_text(prefix: str, joined: Expr, count: int) -> str:
    """Return how many leaves there are, and the function that joins numbers of theirs as F joins their values."""

    def spelled(tree: Expr) -> str:
        if tree.args:
            return f"{tree.op}_v({', '.join(spelled(arg) for arg in tree.args)})"
        return f"of_leaf[{str(tree.name).removeprefix('leaf_')}]"

    return (
        f"#define {prefix}_LEAVES {count}\n"
        f"static inline realv {prefix}_joined(const realv of_leaf[{prefix}_LEAVES]) {{ return {spelled(joined)}; }}\n"
    )


def _bands_function(
    prefix: str,
    name: str,
    surface: Surface,
    leaves: dict[str, Expr],
    bands: dict[str, str],
    floors: Mapping[str, float],
    precision: Precision,
    slopes_of: Mapping[str, Expr] | None = None,
) -> str:
    """Return the function of the leaves' bands, `bands` being the C text of those that they are made of.

    `floors` says what these are never below. Slopes, of `slopes_of`, are unknown where an angle, a sign or a floor
    makes that jump. Values are those on both sides of a floor's jump, and not what lies between: see `both_sides`.
    """
    turning = {leaf: jumps(of) for leaf, of in (slopes_of or {}).items()}
    labels = {
        each: f"jump_{i}" for i, each in enumerate(dict.fromkeys(each for some in turning.values() for each in some))
    }
    outputs = leaves | {label: each for each, label in labels.items()}
    symbols = {part: part for part in bands} | shape_symbols(surface)
    used = {each.name for each in walk(outputs.values())}
    sided = {} if slopes_of else _one_sided(leaves, bands, floors, {*symbols})
    outputs |= {f"{mark.name}_of": part for some in sided.values() for one in some for mark, part in one.parts.items()}
    jumping = [each for each in walk(leaves.values()) if each.op == "floor" and each.depends_on(bands)]
    forks = [] if slopes_of else jumping[:_MOST_FORKS]
    text = band_text(outputs, symbols=symbols, bands=bands, precision=precision, floors=floors, forks=forks)
    spelled = {leaf: f"{{{leaf}}}" for leaf in leaves}
    for leaf, some in turning.items():
        for each in some:
            known = "band_whole" if each.op in STEPS else "band_unbroken"
            spelled[leaf] = f"{known}({{{labels[each]}}}, {spelled[leaf]})"
    own, sides = (f"{name}_on", ", int way, maskv *forks") if forks else (name, "")
    made = function_of(
        f"void {prefix}_{own}(const {prefix}_parts_t *parts, {prefix}_t shape{sides}, band_t of_leaf[{prefix}_LEAVES])",
        text.after(f"const band_t {part} = {made};" for part, made in bands.items() if part in used),
        "\n".join(
            [
                *(f"of_leaf[{i}] = {one};" for i, one in enumerate(spelled.values())),
                *_signs_at_poles(list(leaves), sided, symbols, bands, floors, precision),
            ]
        ),
    )
    return made + both_sides(prefix, name, len(forks)) if forks else made


def _one_sided(
    leaves: Mapping[str, Expr], bands: Collection[str], floors: Mapping[str, float], taken: Collection[str]
) -> dict[str, list[OneSided]]:
    """Return the leaves that go to infinity, and how."""
    names = (unlike(f"most_{i}", taken) for i in count())
    found = {
        leaf: one_sided(
            of, lambda u: least(u, floors) >= 0.0, lambda u: u.depends_on(bands), lambda _: symbol(next(names))
        )
        for leaf, of in leaves.items()
    }
    return {leaf: some for leaf, some in found.items() if some}


def _signs_at_poles(
    leaves: Sequence[str],
    sided: Mapping[str, Sequence[OneSided]],
    symbols: Mapping[str, str],
    bands: Collection[str],
    floors: Mapping[str, float],
    precision: Precision,
) -> Iterator[str]:
    """Yield what tells a leaf's sign where its band is unknown because it goes to infinity."""
    for leaf, one in ((leaf, one) for leaf, some in sided.items() for one in some):
        most = {str(mark.name): f"{{{mark.name}_of}}" for mark in one.parts}
        bound = band_text(
            {"bound": one.bound},
            symbols={**symbols, **{name: name for name in most}},
            bands=[*bands, *most],
            precision=precision,
            floors={**floors, **dict.fromkeys(most, 0.0)},
        )
        place = f"of_leaf[{leaves.index(leaf)}]"
        yield "{{"
        yield from (f"  const band_t {name} = band_top({part});" for name, part in most.items())
        yield from (f"  {line}" for line in bound.statements)
        yield f"  {place} = band_or_sign({place}, {bound.results['bound']}, {str(one.falls).lower()});"
        yield "}}"
