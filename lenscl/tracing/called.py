"""Which effects a scene calls for, which lenses its rays may reach, and why: from indices and geometry.

Input: a scene, or a study with all its points. Output: the facts that hold, and the lenses, each with its reason. A
fact is said not to hold, and a lens to be out of reach, only where that is proved; so what is left out changes no ray.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from lenscl.config import Effects, Lens, Needs, Scene, Study
from lenscl.effects import EFFECTS, NESTED, Effect, Fact, Value, Variant
from lenscl.errors import StudyError
from lenscl.tracing.apart import reaches, touching
from lenscl.tracing.reach import reached
from lenscl.tracing.start import locate

_MOST_POINTS = 250  # of a study that are looked at one by one; of a longer one nothing is proved that its axes touch
_HARMLESS = ("picture.", "numerics.max_events")  # keys on which nothing of this hangs
_HARMLESS_TO_FACTS = (*_HARMLESS, "film.")  # of any lens, whether it is reached or not
_OF_THE_ENVIRONMENT: frozenset[Fact] = frozenset({"the environment is the picture", "the environment is an image"})
_ENVIRONMENT = "effects.environment"
_NAMED = 3  # pairs of solids
_ELSEWHERE = "another point of the study needs it"
_ROUNDINGS = 4 * 2.0**-52  # by which semi-axes of a sphere may seem to differ


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """Whether a fact holds, and why."""

    holds: bool
    why: str


_Finder = Callable[[Scene, Collection[int], bool], Finding]  # of a scene, some of its lenses, and as `findings`


@dataclass(frozen=True, slots=True, kw_only=True)
class Call:
    """What becomes of a variant of an effect in a scene's kernel.

    Attributes
    ----------
    effect : Effect
    variant : Variant or None
        None where the effect is not asked for, or is no part of the kernel.
    asked : str, bool, int or tuple of float
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

    @property
    def is_beside(self) -> bool:
        """Whether the effect is asked for, and is all beside the kernel."""
        return self.variant is None and self.is_in


def findings(scene: Scene, *, rays_given: bool = False) -> dict[Fact, Finding]:
    """Return what holds of the lenses of a scene that its rays may reach.

    Parameters
    ----------
    scene : Scene
    rays_given : bool
        Whether the rays are a caller's own, which may start anywhere; else they are those of the scene's film.
    """
    return {
        fact: Finding(holds=True, why=_ELSEWHERE) if fact in scene.needs.facts and not one.holds else one
        for fact, one in _findings(scene, _reach(scene, rays_given), rays_given).items()
    }


def _findings(scene: Scene, lenses: Collection[int], rays_given: bool) -> dict[Fact, Finding]:
    return {fact: _found(finder, scene, lenses, rays_given) for fact, finder in _FINDERS.items()}


def _holding(found: Mapping[Fact, Finding]) -> frozenset[Fact]:
    return frozenset(fact for fact, one in found.items() if one.holds)


def reach_of(scene: Scene, *, rays_given: bool = False) -> dict[int, str]:
    """Return the lenses that rays may reach, by number, each with the reason; parameters as for `findings`."""
    own = _reach(scene, rays_given)
    return {number: own.get(number, _ELSEWHERE) for number in sorted(scene.needs.lenses | own.keys())}


def _reach(scene: Scene, rays_given: bool) -> dict[int, str]:
    every = range(len(scene.lenses))
    if rays_given:
        return dict.fromkeys(every, "rays may start anywhere")
    if touching(scene.lenses, every):
        return dict.fromkeys(every, "some solids may touch or overlap, and what those do to rays is not bounded")
    if scene.effects["total_reflection"] == "end":
        return reached(scene, ())
    at_each = (scene, *(scene.layers() if scene.wavelengths else ()))
    return reached(scene, [i for i in every if any(_reflects(one, [i], rays_given).holds for one in at_each)])


def _found(finder: _Finder, scene: Scene, lenses: Collection[int], rays_given: bool) -> Finding:
    """Return whether a fact holds at the d line or at any wavelength of a scene."""
    here = finder(scene, lenses, rays_given)
    if here.holds:
        return here
    for nm, layer in zip(scene.wavelengths, scene.layers(), strict=False):  # without wavelengths it is its own layer
        one = finder(layer, lenses, rays_given)
        if one.holds:
            return replace(one, why=f"{one.why}, at {nm:g} nm")
    return here


def needs_of(scene: Scene, *, rays_given: bool = False) -> Needs:
    """Return what a scene's kernel needs, or that of any point of the study that it belongs to."""
    lenses = _reach(scene, rays_given)
    facts = _holding(_findings(scene, lenses, rays_given))
    return scene.needs | Needs(facts=facts, lenses=frozenset(lenses))


def study_needs(study: Study) -> Needs:
    """Return what any point of a study needs, or may need where that cannot be ruled out."""
    found = needs_of(study.scene)
    if all(key.startswith(_HARMLESS) for key in study.axes):
        return found
    if study.point_count() > _MOST_POINTS:
        every = range(len(study.scene.lenses))
        is_one = all(key.startswith(_HARMLESS_TO_FACTS) for key in study.axes)
        # Each point says for itself whether its solids are apart: there are two kernels at most
        undecided = (
            frozenset(_FINDERS) - {NESTED} - (frozenset() if _ENVIRONMENT in study.axes else _OF_THE_ENVIRONMENT)
        )
        facts = _holding(_findings(study.scene, every, False)) if is_one else undecided
        return found | Needs(facts=facts, lenses=frozenset(every))
    found = Needs()
    for point in study.points():
        try:
            found |= needs_of(point.scene)
        except StudyError:  # which no kernel is made for
            continue
    return found


def with_needs(scene: Scene, needs: Needs) -> Scene:
    """Return the scene as one of a study whose points need so much."""
    return replace(scene, needs=needs)


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
    if len(scene.wavelengths) == 1:
        return f"asked for: one wavelength, {low:g} nm"
    return f"asked for: {len(scene.wavelengths)} wavelengths from {low:g} to {high:g} nm, each traced"


def _opaque(scene: Scene, lenses: Collection[int], _: bool) -> Finding:
    return _any(scene, lenses, lambda lens: lens.absorbs, "is opaque", "no lens has absorbs = true")


def _absorbs(scene: Scene, lenses: Collection[int], _: bool) -> Finding:
    return _any(scene, lenses, lambda lens: any(lens.absorption), "absorbs", "no lens has an absorption")


def _any(scene: Scene, lenses: Collection[int], has: Callable[[Lens], bool], what: str, none: str) -> Finding:
    for number in lenses:
        if has(scene.lenses[number]):
            return Finding(holds=True, why=f"{scene.lens_key(number)} {what}")
    beyond = [scene.lens_key(number) for number, lens in enumerate(scene.lenses) if has(lens)]
    return Finding(holds=False, why=f"no ray gets to {' or '.join(beyond)}" if beyond else none)


def _reflects(scene: Scene, lenses: Collection[int], rays_given: bool) -> Finding:
    """Return whether a surface may reflect totally."""
    if scene.numerics.snell == "paraxial":
        return Finding(holds=False, why="the paraxial rule never reflects totally")
    if touching(scene.lenses, lenses):
        alike = len({scene.n_medium, *(scene.lenses[number].n for number in lenses)}) == 1
        why = "all indices are the same" if alike else "solids may touch or overlap, of unlike index"
        return Finding(holds=not alike, why=why)
    reasons: list[str] = []
    for number in lenses:
        lens, key = scene.lenses[number], scene.lens_key(number)
        if lens.is_mirror:
            reasons.append(f"{key} is a mirror")
        elif scene.blocks(number):
            reasons.append(f"{key} is opaque")
        elif lens.n == scene.n_medium:
            reasons.append(f"{key} has the index around it")
        elif lens.n < scene.n_medium:
            return Finding(holds=True, why=f"rays enter {key} to a lower index")
        elif lens.mirror or not _is_sphere(lens):
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
    alone = replace(scene, lenses=(scene.lenses[lens],))
    inside, on = locate(alone, np.array([scene.source.at], dtype=np.float64))
    return bool(inside[0] >= 0 or on[0] >= 0)


def _shows_the_picture(scene: Scene, *_: object) -> Finding:
    return _shows(scene, scene.environment == "picture", "the picture")


def _shows_an_image(scene: Scene, *_: object) -> Finding:
    return _shows(scene, isinstance(scene.environment, str) and scene.environment != "picture", "an image")


def _shows(scene: Scene, holds: bool, what: str) -> Finding:
    return Finding(holds=holds, why=f"effects.environment is {'' if holds else 'not '}{what}")


def stopping(scene: Scene) -> Finding:
    """Return whether the picture stops light, and why: where it lies on or in a solid, or was told to.

    Raises
    ------
    StudyError
        If it lies on or in a solid, and was told not to.
    """
    asked, picture = scene.picture.stops, scene.picture
    on = [
        scene.lens_key(number)
        for number, lens in enumerate(scene.lenses)
        if reaches(lens, picture.corner, picture.right, picture.down)
    ]
    if asked is True:
        return Finding(holds=True, why="picture.stops is true")
    if not on:
        return Finding(holds=False, why="picture.stops is false" if asked is False else "no solid reaches the picture")
    if asked is False:
        raise StudyError(
            [
                f"picture.stops: the picture may lie on or in {on[0]}, where a last straight leg has no meaning; "
                'use "auto" or true, or move one away'
            ]
        )
    return Finding(holds=True, why=f"{on[0]} may reach the picture")


def _nested(scene: Scene, lenses: Collection[int], _: bool) -> Finding:
    pairs = touching(scene.lenses, lenses)
    if not pairs:
        return Finding(holds=False, why="all solids are proved apart" if len(lenses) > 1 else "there is one solid")
    named = [f"{scene.lens_key(first)} and {scene.lens_key(second)}" for first, second in pairs[:_NAMED]]
    if more := len(pairs) - len(named):
        named.append(f"{more} more pair{'s' if more > 1 else ''}")
    return Finding(holds=True, why=f"not proved apart: {', '.join(named)}")


_FINDERS: Mapping[Fact, _Finder] = {
    "a lens is opaque": _opaque,
    "a lens absorbs": _absorbs,
    "total reflection is possible": _reflects,
    "the environment is the picture": _shows_the_picture,
    "the environment is an image": _shows_an_image,
    NESTED: _nested,
}
