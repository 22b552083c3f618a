"""Draw a front: error against time, each combination a labelled point, the front a step line.

As a picture by matplotlib, and as a page by plotly that needs nothing from elsewhere. Both need the extra `plot`.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from math import floor, isfinite, log10
from pathlib import Path
from textwrap import wrap
from typing import Any

from lenscl.accuracy import Front, Tried, circumstances, front_sentence
from lenscl.config import Accuracy
from lenscl.errors import LensclError
from lenscl.imaging.atomic import whole_file
from lenscl.views.labels import Box, place_labels

_WIDTH, _HEIGHT = 1280, 860  # pixels
_LEFT, _RIGHT, _BOTTOM, _TOP = 90, 190, 225, 60  # margins; the legend is at the right
_LETTER, _LINE = 6.1, 13  # pixels of a letter, and of a line, at the size of the labels
_SMALLEST = 1e-18  # picture pixels: an error of exactly 0 has no logarithm
# Okabe & Ito's colours, which the colour-blind tell apart
_COLOURS = {"polynomial": "#0072B2", "guarded": "#009E73", "interval": "#CC79A7", "march": "#D55E00", "auto": "#000000"}
_MARKERS = {"single": ("o", "circle"), "mixed": ("D", "diamond"), "double": ("s", "square")}
_PALE = 0.35  # of what has no place on the front
_LONGEST, _INDENT = 190, " " * 8  # letters of a line below the drawing
_MOST_BYTES = 20_000_000  # a page carries the whole of plotly


@dataclass(frozen=True, slots=True)
class _Axes:
    """Decades of an axis each, and where a point of them lies in pixels of the drawing."""

    x: tuple[float, float]
    y: tuple[float, float]

    def place(self, time: float, error: float) -> tuple[float, float]:
        across, up = _WIDTH - _LEFT - _RIGHT, _HEIGHT - _BOTTOM - _TOP
        return (
            across * (log10(time) - self.x[0]) / (self.x[1] - self.x[0]),
            up * (log10(error) - self.y[0]) / (self.y[1] - self.y[0]),
        )


def require_plotting() -> None:
    """Raise a `LensclError` that says what to install where a plot cannot be drawn."""
    missing = [library for library in ("matplotlib", "plotly") if find_spec(library) is None]
    if missing:
        raise LensclError(f"a plot needs {' and '.join(missing)}, not installed here: pip install 'lenscl[plot]'")


def write_front_picture(path: Path, front: Front, wanted: Accuracy | None = None) -> None:
    """Write a front as a PNG.

    Raises
    ------
    LensclError
        If a library is missing, or the file cannot be written.
    """
    require_plotting()
    import matplotlib.ticker
    from matplotlib.figure import Figure

    front = _drawable(front)
    axes, labels = _axes(front), _labels(front)
    dots = 100
    figure = Figure(figsize=(_WIDTH / dots, _HEIGHT / dots), dpi=dots, facecolor="white")
    across, up = _WIDTH - _LEFT - _RIGHT, _HEIGHT - _BOTTOM - _TOP
    plot = figure.add_axes((_LEFT / _WIDTH, _BOTTOM / _HEIGHT, across / _WIDTH, up / _HEIGHT))
    plot.set(xscale="log", yscale="log", xlim=[10**x for x in axes.x], ylim=[10**y for y in axes.y])
    plot.grid(True, which="major", color="#dddddd", linewidth=0.6)
    plot.set_xlabel("time, ns a ray")
    plot.set_ylabel("error, picture pixels: 99 % of the rays land within it")
    as_it_is: dict[str, Any] = {"parse_math": False}  # a dollar sign in a title is one
    title = _plain(f"What accuracy costs in time: {front.title}")
    figure.text(_LEFT / _WIDTH, 1 - 28 / _HEIGHT, title, fontsize=13, va="center", **as_it_is)

    line = _step_line(front, axes)
    plot.plot(*zip(*line, strict=True), color="#444444", linewidth=1.4, zorder=2, label="the front")
    if wanted is not None and wanted.unit == "px":
        plot.axhline(wanted.value, color="#888888", linestyle=":", linewidth=1)
        plot.text(10 ** axes.x[1], wanted.value, f"{wanted.value:g} px ", ha="right", va="bottom", fontsize=8)
    for one, (x, y) in zip(front.tried, labels, strict=True):
        look = _look(front, one)
        low, high = one.time_bounds
        error = _drawn(one.error)
        if one.is_eligible:  # others have bounds of many decades, and no say
            plot.plot([low, high], [error, error], color=look.colour, alpha=0.5, linewidth=1, zorder=1)
            plot.plot([one.time] * 2, _error_bounds(one), color=look.colour, alpha=0.5, linewidth=1, zorder=1)
        plot.plot(
            one.time, error, _MARKERS[one.combination.precision][0], color=look.colour, alpha=look.alpha, zorder=3,
            markerfacecolor="white" if look.is_hollow else look.colour, markersize=9 if look.is_front else 6,
            markeredgecolor="black" if look.is_front else look.colour,
        )  # fmt: skip
        here = axes.place(one.time, error)
        plot.annotate(
            str(one.combination), xy=(one.time, error), xytext=(x - here[0], y - here[1]), textcoords="offset pixels",
            ha="center", va="center", fontsize=7.5, alpha=max(look.alpha, 0.6), color="black", zorder=4, **as_it_is,
            fontweight="bold" if look.is_front else "normal",
            arrowprops={"arrowstyle": "-", "color": "#aaaaaa", "linewidth": 0.5, "shrinkA": 0, "shrinkB": 3},
        )  # fmt: skip
    plot.legend(handles=_legend(front), loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=8, frameon=False)
    plot.xaxis.set_major_formatter(plain := matplotlib.ticker.FuncFormatter(lambda value, _: f"{value:g}"))
    plot.xaxis.set_minor_locator(matplotlib.ticker.LogLocator(subs=(2, 5)))
    plot.xaxis.set_minor_formatter(plain)
    below = "\n".join(_below(front, wanted))
    figure.text(_LEFT / _WIDTH, (_BOTTOM - 52) / _HEIGHT, below, fontsize=7.5, va="top", family="monospace",
                linespacing=1.35, **as_it_is)  # fmt: skip
    with whole_file(path, 4 * _WIDTH * _HEIGHT) as temporary, warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing")  # letters that the font lacks are drawn as boxes
        figure.savefig(temporary, format="png")


def write_front_page(path: Path, front: Front, wanted: Accuracy | None = None) -> None:
    """Write a front as one HTML page that can be looked at closely, without a network.

    Raises
    ------
    LensclError
        If a library is missing, or the file cannot be written.
    """
    require_plotting()
    import plotly.graph_objects as go

    front = _drawable(front)
    axes, labels = _axes(front), _labels(front)
    figure = go.Figure()
    x, y = zip(*_step_line(front, axes), strict=True)
    figure.add_scatter(
        x=x, y=y, mode="lines", line={"color": "#444444", "width": 1.5}, name="the front", hoverinfo="skip"
    )
    methods, precisions = _kinds(front)
    for method in methods:
        for precision in precisions:
            some = [
                each
                for each in front.tried
                if (each.combination.method, each.combination.precision) == (method, precision)
            ]
            if some:
                looks = [_look(front, each) for each in some]
                symbol = _MARKERS[precision][1]
                figure.add_scatter(
                    x=[each.time for each in some], y=[_drawn(each.error) for each in some], mode="markers",
                    name=f"{method}, {precision}", hovertext=[_hover(front, each) for each in some], hoverinfo="text",
                    error_x=_bars([_time_bar(each) for each in some]),
                    error_y=_bars([_error_bar(each) for each in some]),
                    marker={
                        "color": _COLOURS.get(method, "#000000"), "opacity": [look.alpha for look in looks],
                        "symbol": [f"{symbol}-open" if look.is_hollow else symbol for look in looks],
                        "size": [13 if look.is_front else 9 for look in looks],
                        "line": {"width": [1.5 if look.is_front else 1 for look in looks]},
                    },
                )  # fmt: skip
    for one, (across, up) in zip(front.tried, labels, strict=True):
        here = axes.place(one.time, _drawn(one.error))
        text = str(one.combination)
        figure.add_annotation(
            x=log10(one.time), y=log10(_drawn(one.error)), ax=across - here[0], ay=here[1] - up, arrowhead=0,
            arrowwidth=0.5, arrowcolor="#aaaaaa", text=f"<b>{text}</b>" if _look(front, one).is_front else text,
            font={"size": 10, "color": "black"}, opacity=max(_look(front, one).alpha, 0.6), standoff=5,
        )  # fmt: skip
    if wanted is not None and wanted.unit == "px":
        figure.add_hline(y=wanted.value, line={"dash": "dot", "color": "#888888", "width": 1})
    decades = {"type": "log", "dtick": 1, "exponentformat": "power", "gridcolor": "#dddddd"}
    figure.update_layout(
        title={"text": _escaped(_plain(f"What accuracy costs in time: {front.title}")), "x": _LEFT / _WIDTH},
        xaxis={**decades, "dtick": "D2", "exponentformat": "none", "range": axes.x, "title": "time, ns a ray"},
        yaxis={**decades, "range": axes.y, "title": "error, picture pixels: 99 % of the rays land within it"},
        width=_WIDTH, height=_HEIGHT, plot_bgcolor="white", showlegend=True,
        margin={"l": _LEFT, "r": _RIGHT, "b": _BOTTOM, "t": _TOP},
    )  # fmt: skip
    figure.add_annotation(
        text="<br>".join(_escaped(line).replace("  ", "&nbsp;&nbsp;") for line in _below(front, wanted)),
        xref="paper", yref="paper", x=0, y=0, yshift=-48, xanchor="left", yanchor="top", align="left",
        showarrow=False, font={"family": "monospace", "size": 10},
    )  # fmt: skip
    text = figure.to_html(include_plotlyjs=True, full_html=True, div_id="front", config={"displaylogo": False}).encode()
    if len(text) > _MOST_BYTES:
        raise LensclError(f"{path}: the page would be {len(text):,} bytes; another version of plotly may be smaller")
    with whole_file(path, len(text)) as temporary:
        temporary.write_bytes(text)


@dataclass(frozen=True, slots=True)
class _Look:
    colour: str
    alpha: float
    is_front: bool
    is_hollow: bool


def _look(front: Front, one: Tried) -> _Look:
    place = front.places[one.combination]
    return _Look(
        colour=_COLOURS.get(one.combination.method, "#000000"),
        alpha=_PALE if place == "not eligible" else 1.0,
        is_front=place == "front",
        is_hollow=one.combination.snell == "paraxial" or place == "not eligible",
    )


def _drawable(front: Front) -> Front:
    """Return a front without what has no known error, for too many of its rays are unknown; such has no place on it."""
    some = tuple(each for each in front.tried if isfinite(each.error))
    if not some:
        raise LensclError(f"{front.title}: no combination has a known error, so there is nothing to draw")
    return replace(front, tried=some)


def _axes(front: Front) -> _Axes:
    times = [each.time for each in front.tried]  # a disturbed round's bar may stick out
    errors = [_drawn(each.error) for each in front.tried]
    room = 0.08 * (log10(max(times)) - log10(min(times))) + 0.05
    return _Axes(
        (log10(min(times)) - room, log10(max(times)) + room), (floor(log10(min(errors))) - 1.5, log10(max(errors)) + 2)
    )


def _labels(front: Front) -> list[tuple[float, float]]:
    """Return the middles of the labels, in pixels of the plot; those of the front are placed first."""
    axes = _axes(front)
    order = sorted(range(len(front.tried)), key=lambda k: not _look(front, front.tried[k]).is_front)
    some = [front.tried[k] for k in order]
    points = [axes.place(each.time, _drawn(each.error)) for each in some]
    sizes = [(_LETTER * len(str(each.combination)), float(_LINE)) for each in some]
    frame = Box(4, 4, _WIDTH - _LEFT - _RIGHT - 4, _HEIGHT - _BOTTOM - _TOP - 4)
    placed = dict(zip(order, place_labels(points, sizes, frame), strict=True))
    return [placed[k] for k in range(len(front.tried))]


def _step_line(front: Front, axes: _Axes) -> list[tuple[float, float]]:
    """Return the front from its fastest to its most accurate: what so much time buys at best."""
    corners: list[tuple[float, float]] = []
    for one in sorted(front.on_front(), key=lambda each: each.time):
        above = corners[-1][1] if corners else 10 ** axes.y[1]
        corners += [(one.time, above), (one.time, _drawn(one.error))]
    return [*corners, (10 ** axes.x[1], corners[-1][1])] if corners else [(10 ** axes.x[0], 10 ** axes.y[1])]


def _error_bounds(one: Tried) -> tuple[float, float]:
    bounds = one.judgement.pixels.high
    return _drawn(bounds.value if bounds.low is None else bounds.low), _drawn(one.most_error)


def _time_bar(one: Tried) -> tuple[float, float, float]:
    return (one.time, *one.time_bounds) if one.is_eligible else (one.time, one.time, one.time)


def _error_bar(one: Tried) -> tuple[float, float, float]:
    error = _drawn(one.error)
    return (error, *_error_bounds(one)) if one.is_eligible else (error, error, error)


def _bars(triples: Sequence[tuple[float, float, float]]) -> dict[str, Any]:
    up = [most - value for value, _, most in triples]
    down = [value - least for value, least, _ in triples]
    return {"type": "data", "symmetric": False, "array": up, "arrayminus": down, "thickness": 0.8, "width": 0}


def _drawn(error: float) -> float:
    return max(error, _SMALLEST)


def _hover(front: Front, one: Tried) -> str:
    pixels, units = one.judgement.pixels, one.judgement.units
    low, high = one.time_bounds
    return "<br>".join(
        [
            f"<b>{one.combination}</b> ({'+'.join(dict.fromkeys(one.searches))})",
            f"{one.time:.3g} ns a ray ({low:.3g}-{high:.3g})",
            f"99 % within {pixels.high.value:.2g} px, {units.high.value:.2g} scene units",
            f"median {pixels.median.value:.2g} px, largest {pixels.largest:.2g} px",
            f"{100 * one.judgement.unknown_share.value:.2g} % unknown, {100 * one.differ:.2g} % end otherwise, "
            f"{100 * one.escalated:.2g} % escalated",
            f"place: {front.places[one.combination]}",
        ]
    )


def _below(front: Front, wanted: Accuracy | None) -> list[str]:
    sentence = front_sentence(front, wanted).split("; ")
    lines = [*sentence, "", *circumstances(front)]
    return [_plain(part) for line in lines for part in wrap(line, _LONGEST, subsequent_indent=_INDENT) or [""]]


def _kinds(front: Front) -> tuple[list[str], list[str]]:
    """Return the methods and precisions that were tried, in the order of the tables above."""
    methods = {each.combination.method for each in front.tried}
    precisions = {each.combination.precision for each in front.tried}
    return [name for name in _COLOURS if name in methods], [name for name in _MARKERS if name in precisions]


def _legend(front: Front) -> list[Any]:
    from matplotlib.lines import Line2D

    methods, precisions = _kinds(front)
    colours = [Line2D([], [], color=_COLOURS.get(method, "black"), linewidth=4, label=method) for method in methods]
    shapes = [
        Line2D([], [], color="#555555", marker=_MARKERS[each][0], linestyle="", label=each) for each in precisions
    ]
    hollow = Line2D([], [], color="#555555", marker="o", linestyle="", markerfacecolor="white", label="paraxial")
    pale = Line2D([], [], color="#555555", marker="o", linestyle="", markerfacecolor="white", alpha=_PALE,
                  label="not eligible")  # fmt: skip
    front_line = Line2D([], [], color="#444444", linewidth=1.4, label="the front")
    return [front_line, *colours, *shapes, hollow, pale]


def _plain(text: str) -> str:
    """Return text that draws as it reads: what is not printable is spelled out."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
