"""A front as rows for programs, and as sentences for people."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from math import isfinite
from typing import Any

from lenscl.accuracy.front import Front, Tried
from lenscl.accuracy.judgement import MOST_DIFFER
from lenscl.accuracy.statistics import Estimate
from lenscl.config import Accuracy

USUAL_ACCURACY = Accuracy(0.05, "px")  # that the sentence speaks of where a study asks for none


def front_rows(front: Front) -> Iterator[dict[str, Any]]:
    """Yield one row a combination, the most accurate first, each with all that it takes to be believed."""
    for one in front.tried:
        combination, judgement, (least, most) = one.combination, one.judgement, one.time_bounds
        yield {
            "method": combination.method,
            "precision": combination.precision,
            "snell": combination.snell,
            "step": combination.step,
            "tolerance": combination.tolerance,
            "searches": "+".join(dict.fromkeys(one.searches)),
            "place": front.places[combination],
            "ns_per_ray": one.time,
            "ns_per_ray_low": least,
            "ns_per_ray_high": most,
            "ns_per_ray_least": min(one.ns),
            **_estimate("error_px_median", judgement.pixels.median),
            **_estimate("error_px_99", judgement.pixels.high),
            "error_px_largest": judgement.pixels.largest,
            **_estimate("error_units_median", judgement.units.median),
            **_estimate("error_units_99", judgement.units.high),
            "error_units_largest": judgement.units.largest,
            "differ_of_film": one.differ,
            **_estimate("differ_of_sample", judgement.differ),
            **_estimate("colours", judgement.colours),
            "undecided": one.undecided,
            "escalated": one.escalated,
            "first_seconds": one.first_seconds,
            "against": judgement.against,
            "sampled": judgement.sampled,
            "compared": judgement.compared,
            "unknown": judgement.unknown,
            **_estimate("unknown_share", judgement.unknown_share),
            **front.circumstances,
            "width": one.width,
            "rays": front.film[0] * front.film[1],
            "film": f"{front.film[0]}x{front.film[1]}",
            "picture": f"{front.picture[0]}x{front.picture[1]}",
            "state": "warm",
            "rounds": front.rounds,
            "program": front.program,
            "made": front.made,
            "scene_key": front.scene_key,
            "kernel_key": one.kernel_key,
        }


def front_csv(front: Front) -> str:
    """Return the rows as CSV (RFC 4180, lines ending in a newline); a bound that is not known is empty."""
    rows, text = list(front_rows(front)), io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def front_sentence(front: Front, wanted: Accuracy | None = None) -> str:
    """Return what a user wants to know first: what a wanted accuracy needs, and what all there is costs."""
    wanted = wanted or USUAL_ACCURACY
    asked = f"{wanted.value:g} px" if wanted.unit == "px" else f"{wanted.value:g} scene units"
    cheapest = front.cheapest(wanted)
    parts = [f"within {asked}: " + ("nothing here is" if cheapest is None else _told(cheapest))]
    if exact := front.on_front()[:1]:
        parts.append(f"as exact as can be told: {_told(exact[0])}")
    for march in (each for each in front.tried if each.combination == front.forerunner):
        beaten = [each for each in front.on_front() if each.error <= march.most_error]
        fastest = min(beaten, key=lambda each: each.time, default=march)
        low, high = march.ratio_bounds(fastest)
        compared = f", {march.time / fastest.time:.1f} x ({low:.1f}-{high:.1f}) the time of {fastest.combination}"
        tail = "" if fastest is march else f"{compared}, which is as accurate"
        parts.append(f"the forerunner's method: {_told(march)}{tail}")
    return "; ".join(parts)


def circumstances(front: Front) -> list[str]:
    """Return what the figures need beside them to be believed."""
    about, judged = front.circumstances, front.tried[0].judgement
    widths = {each.combination.precision: each.width for each in front.tried}
    sampled = ", ".join(f"{count} {name}" for name, count in front.sampled.items())
    units = f"{about['units']} compute unit{'' if about['units'] == 1 else 's'}"
    driver = " ".join(about["driver"].split())
    return [
        f"device  {about['platform']}: {about['device']}, {driver}; {about['kind']}, {units}",
        f"rays    {front.film[0]} x {front.film[1]} of the film; to a packet: "
        + ", ".join(f"{width} ({precision})" for precision, width in widths.items()),
        f"time    warm, median of {front.rounds} rounds in which all take turns, by the device's clock; 95 % bounds",
        f"error   99 % of the rays through a lens are within it, in pixels of a {front.picture[0]} x "
        f"{front.picture[1]} picture, 95 % bounds",
        f"        against {judged.against} of {judged.sampled} rays ({sampled}); nobody can tell {judged.unknown}, "
        f"{100 * judged.unknown_share.value:.2g} % of those through a lens, which count as infinitely far off",
        "place   front: faster than all that are as accurate, by more than noise; not eligible: more than "
        f"{100 * MOST_DIFFER:g} % of the rays through a lens end otherwise or are unknown",
        f"program {front.program}, {front.made}",
    ]


def _told(one: Tried) -> str:
    return f"{one.combination}, {one.time:.3g} ns a ray (99 % within {one.error:.2g} px)"


def _estimate(name: str, estimate: Estimate) -> dict[str, float | None]:
    """Return a figure with its bounds; None for one that is not known, as where too many rays are not."""
    figures = {name: estimate.value, f"{name}_low": estimate.low, f"{name}_high": estimate.high}
    return {key: figure if figure is not None and isfinite(figure) else None for key, figure in figures.items()}
