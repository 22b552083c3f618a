"""Which effects a scene calls for, and why: what `auto` decides, from indices and geometry.

Input: a scene, or a study with all its points. Output: the facts that hold, each with its reason. A fact is said not to
hold only where that is proved; so what is left out changes no ray.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from lenscl.config import Lens, Scene, Study
from lenscl.config.scene import Effects
from lenscl.effects import EFFECTS, Effect, Fact, Value, Variant
from lenscl.errors import StudyError
from lenscl.tracing.start import locate

_MOST_POINTS = 250  # of a study that are looked at one by one; of a longer one nothing is proved that its axes touch
_HARMLESS = ("film.", "picture.", "numerics.max_events")  # keys that no fact hangs on
_OF_THE_ENVIRONMENT: frozenset[Fact] = frozenset({"the environment is the picture", "the environment is an image"})
_ROUNDINGS = 4 * 2.0**-52  # by which semi-axes of a sphere may seem to differ


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """Whether a fact holds, and why."""

    holds: bool
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Call:
    """What becomes of a variant of an effect in a scene's kernel.

    Attributes
    ----------
    effect : Effect
    variant : Variant or None
        None where the effect is not asked for, or is no part of the kernel.
    asked : str, bool or int
        The value of its key.
    is_in : bool
        Whether it is compiled in.
    why : str
    """

    effect: Effect
    variant: Variant | None
    asked: Value
    is_in: bool
    why: str


def findings(scene: Scene, *, rays_given: bool = False) -> dict[Fact, Finding]:
    """Return what holds of a scene.

    Parameters
    ----------
    scene : Scene
    rays_given : bool
        Whether the rays are a caller's own, which may start anywhere; else they are those of the scene's film.
    """
    found = {fact: _found(finder, scene, rays_given) for fact, finder in _FINDERS.items()}
    return {
        fact: Finding(holds=True, why="another point of the study needs it")
        if fact in scene.facts and not one.holds
        else one
        for fact, one in found.items()
    }


def _found(finder: Callable[[Scene, bool], Finding], scene: Scene, rays_given: bool) -> Finding:
    """Return whether a fact holds at the d line or at any wavelength of a scene."""
    here = finder(scene, rays_given)
    if here.holds:
        return here
    for nm, layer in zip(scene.wavelengths, scene.layers(), strict=False):  # without wavelengths it is its own layer
        one = finder(layer, rays_given)
        if one.holds:
            return replace(one, why=f"{one.why}, at {nm:g} nm")
    return here


def facts_of(scene: Scene, *, rays_given: bool = False) -> frozenset[Fact]:
    """Return the facts that hold of a scene, or of any point of the study that it belongs to."""
    return frozenset(fact for fact, one in findings(scene, rays_given=rays_given).items() if one.holds)


def study_facts(study: Study) -> frozenset[Fact]:
    """Return the facts that hold at any point of a study, or that cannot be ruled out."""
    if all(key.startswith(_HARMLESS) for key in study.axes):
        return facts_of(study.scene)
    if study.point_count() > _MOST_POINTS:
        return frozenset(_FINDERS) - _OF_THE_ENVIRONMENT | facts_of(study.scene)
    found: frozenset[Fact] = frozenset()
    for point in study.points():
        try:
            found |= facts_of(point.scene)
        except StudyError:  # which no kernel is made for
            continue
    return found


def with_facts(scene: Scene, facts: frozenset[Fact]) -> Scene:
    """Return the scene as one of a study of which some facts hold."""
    return replace(scene, facts=facts)


def steering(scene: Scene) -> Scene:
    """Return the scene without the effects that only observe: its rays take the same paths, by a shorter kernel."""
    asked = {key: EFFECTS[key].asked_for(value) for key, value in scene.effects.items() if value != "auto"}
    idle = {key: False for key, some in asked.items() if some and not any(one.steers for one in some)}
    return replace(scene, effects=Effects({**scene.effects, **idle})) if idle else scene


def calls(scene: Scene, *, rays_given: bool = False) -> Iterator[Call]:
    """Yield every effect's variants, in or out, with the reason."""
    found = findings(scene, rays_given=rays_given)
    for effect in EFFECTS.values():
        asked = scene.effects[effect.key]
        variants = effect.asked_for(asked)
        if not variants:
            is_in = bool(effect.beside) and asked != effect.default
            why = f"asked for: {effect.beside}" if is_in else "not asked for"
            yield Call(effect=effect, variant=None, asked=asked, is_in=is_in, why=why)
        for variant in variants:
            if variant.only is not None and not found[variant.only].holds:
                yield Call(effect=effect, variant=variant, asked=asked, is_in=False, why=found[variant.only].why)
            elif asked != "auto" or variant.fact is None:
                why = _wavelengths(scene) if variant.layers else "asked for"
                yield Call(effect=effect, variant=variant, asked=asked, is_in=True, why=why)
            else:
                one = found[variant.fact]
                yield Call(effect=effect, variant=variant, asked=asked, is_in=one.holds, why=one.why)


def _wavelengths(scene: Scene) -> str:
    low, high = min(scene.wavelengths), max(scene.wavelengths)
    return f"asked for: {len(scene.wavelengths)} wavelengths from {low:g} to {high:g} nm, each traced"


def _opaque(scene: Scene, _: bool) -> Finding:
    return _any(scene, lambda lens: lens.absorbs, "is opaque", "no lens has absorbs = true")


def _absorbs(scene: Scene, _: bool) -> Finding:
    return _any(scene, lambda lens: any(lens.absorption), "absorbs", "no lens has an absorption")


def _any(scene: Scene, has: Callable[[Lens], bool], what: str, none: str) -> Finding:
    for number, lens in enumerate(scene.lenses):
        if has(lens):
            return Finding(holds=True, why=f"{scene.lens_key(number)} {what}")
    return Finding(holds=False, why=none)


def _reflects(scene: Scene, rays_given: bool) -> Finding:
    """Return whether a surface may reflect totally."""
    if scene.numerics.snell == "paraxial":
        return Finding(holds=False, why="the paraxial rule never reflects totally")
    reasons: list[str] = []
    for number, lens in enumerate(scene.lenses):
        key = scene.lens_key(number)
        if scene.blocks(number):
            reasons.append(f"{key} is opaque")
        elif lens.n == scene.n_medium:
            reasons.append(f"{key} has the index around it")
        elif lens.n < scene.n_medium:
            return Finding(holds=True, why=f"rays enter {key} to a lower index")
        elif not _is_sphere(lens):
            return Finding(holds=True, why=f"rays leave {key} to a lower index, and no bound on their angles is known")
        elif rays_given or _may_start_in(scene, number):
            return Finding(holds=True, why=f"rays leave {key} to a lower index that may start within it")
        else:
            reasons.append(f"rays leave the sphere {key} at the angle at which they have entered it")
    return Finding(holds=False, why="; ".join(dict.fromkeys(reasons)))


def _is_sphere(lens: Lens) -> bool:
    """Say whether a lens is a sphere: every chord of it makes the same angle with both normals."""
    if lens.formula not in ("sphere", "ball", "ellipsoid"):
        return False
    axes = [lens.values.get(name, 1.0) for name in "abc"]  # an ellipsoid's
    sizes = np.abs(np.multiply(axes, lens.stretch))
    return bool(np.ptp(sizes) <= _ROUNDINGS * sizes.max())


def _may_start_in(scene: Scene, lens: int) -> bool:
    if scene.source.at is None:  # parallel light starts before every lens
        return False
    inside, on = locate(scene, np.array([scene.source.at], dtype=np.float64))
    return lens in (int(inside[0]), int(on[0]))


def _shows_the_picture(scene: Scene, _: bool) -> Finding:
    return _shows(scene, scene.environment == "picture", "the picture")


def _shows_an_image(scene: Scene, _: bool) -> Finding:
    return _shows(scene, isinstance(scene.environment, str) and scene.environment != "picture", "an image")


def _shows(scene: Scene, holds: bool, what: str) -> Finding:
    return Finding(holds=holds, why=f"effects.environment is {'' if holds else 'not '}{what}")


_FINDERS: Mapping[Fact, Callable[[Scene, bool], Finding]] = {
    "a lens is opaque": _opaque,
    "a lens absorbs": _absorbs,
    "total reflection is possible": _reflects,
    "the environment is the picture": _shows_the_picture,
    "the environment is an image": _shows_an_image,
}
