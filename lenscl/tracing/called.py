"""Which effects a scene calls for, which lenses its rays may reach, and why: from indices and geometry.

Input: a scene, or a study with all its points. Output: the facts that hold, and the lenses, each with its reason. A
fact is said not to hold, and a lens to be out of reach, only where that is proved; so what is left out changes no ray.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace

from lenscl.config import Effects, Group, Lens, Needs, Scene, Study
from lenscl.effects import EFFECTS, NESTED, Effect, Fact, Value, Variant
from lenscl.errors import StudyError
from lenscl.tracing.apart import MOST_PAIRS, touching
from lenscl.tracing.filled import is_sphere
from lenscl.tracing.reach import reached
from lenscl.tracing.reaching import reaching
from lenscl.tracing.start import holding

_MOST_POINTS = 250  # of a study that are looked at one by one; of a longer one nothing is proved that its axes touch
_HARMLESS = ("picture.", "numerics.max_events")  # keys on which nothing of this hangs
_HARMLESS_TO_FACTS = (*_HARMLESS, "film.")  # of any lens, whether it is reached or not
_OF_THE_ENVIRONMENT: frozenset[Fact] = frozenset({"the environment is the picture", "the environment is an image"})
_ENVIRONMENT = "effects.environment"
_NAMED = 3  # pairs of solids
_ELSEWHERE = "another point of the study needs it"


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
    return {number: own.get(number, _ELSEWHERE) for number in sorted(_needed(scene) | own.keys())}


def _needed(scene: Scene) -> frozenset[int]:
    """Return the lenses that other points of the study need, of those that a scene has: an array's length may vary."""
    count = len(scene.lenses)
    return frozenset(number for number in scene.needs.lenses if number < count)


def _reach(scene: Scene, rays_given: bool) -> dict[int, str]:
    every = range(len(scene.lenses))
    if rays_given:
        return dict.fromkeys(every, "rays may start anywhere")
    if touching(scene.lenses, every):
        return dict.fromkeys(every, "some solids may touch or overlap, and what those do to rays is not bounded")
    if scene.effects["total_reflection"] == "end":
        return reached(scene, ())
    at_each = (scene, *(scene.layers() if scene.wavelengths else ()))
    reflecting = {i for one in at_each for i in _reflecting(one, every, rays_given)}
    return reached(scene, reflecting)


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
    return Needs(facts=scene.needs.facts | facts, lenses=_needed(scene) | frozenset(lenses))


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
    for group, _ in _by_table(scene, lenses):
        if has(group.lens):
            return Finding(holds=True, why=f"{scene.table_key(group)} {what}")
    beyond = [scene.table_key(group) for group in scene.lenses.groups if has(group.lens)]
    return Finding(holds=False, why=f"no ray gets to {' or '.join(beyond)}" if beyond else none)


def _by_table(scene: Scene, lenses: Collection[int]) -> Iterator[tuple[Group, Collection[int]]]:
    """Yield each table that some lenses are of, with their numbers."""
    if len(lenses) == len(scene.lenses):
        yield from ((group, group.numbers) for group in scene.lenses.groups)
        return
    numbers: dict[int, list[int]] = {}
    for number in sorted(lenses):
        numbers.setdefault(scene.lenses.group_of(number).first, []).append(number)
    yield from ((scene.lenses.group_of(first), some) for first, some in numbers.items())


def _reflects(scene: Scene, lenses: Collection[int], rays_given: bool) -> Finding:
    """Return whether a surface may reflect totally."""
    if scene.numerics.snell == "paraxial":
        return Finding(holds=False, why="the paraxial rule never reflects totally")
    if touching(scene.lenses, lenses):
        alike = len({scene.n_medium, *(group.lens.n for group, _ in _by_table(scene, lenses))}) == 1
        why = "all indices are the same" if alike else "solids may touch or overlap, of unlike index"
        return Finding(holds=not alike, why=why)
    reasons: list[str] = []
    starts = _starts(scene, rays_given)
    for group, numbers in _by_table(scene, lenses):
        one = _reflects_in(scene, group, rays_given or not starts.isdisjoint(numbers))
        if one.holds:
            return one
        reasons.append(one.why)
    return Finding(holds=False, why="; ".join(dict.fromkeys(reasons)))


def _reflecting(scene: Scene, lenses: Collection[int], rays_given: bool) -> Iterator[int]:
    """Yield the lenses, of solids that are apart, in which a ray may be reflected totally."""
    if scene.numerics.snell == "paraxial":
        return
    starts = _starts(scene, rays_given)
    for group, numbers in _by_table(scene, lenses):
        if _reflects_in(scene, group, rays_given).holds:
            yield from numbers
        elif (within := starts.intersection(numbers)) and _reflects_in(scene, group, True).holds:
            yield from within


def _reflects_in(scene: Scene, group: Group, may_start: bool) -> Finding:
    """Return whether the surface of a lens may reflect totally; `may_start`: rays may start in it, too."""
    lens, key = group.lens, scene.table_key(group)
    if lens.is_mirror:
        return Finding(holds=False, why=f"{key} is a mirror")
    if scene.stops_light(group):
        return Finding(holds=False, why=f"{key} is opaque")
    if lens.n == scene.n_medium:
        return Finding(holds=False, why=f"{key} has the index around it")
    if lens.n < scene.n_medium:
        return Finding(holds=True, why=f"rays enter {key} to a lower index")
    if lens.mirror or not is_sphere(lens):
        return Finding(holds=True, why=f"rays leave {key} to a lower index, and no bound on their angles is known")
    if may_start:
        return Finding(holds=True, why=f"rays leave {key} to a lower index that may start within it")
    return Finding(holds=False, why=f"rays leave the sphere {key} at the angle at which they have entered it")


def _starts(scene: Scene, rays_given: bool) -> set[int]:
    """Return the lenses that the film's rays may start in; parallel light starts before every lens."""
    if scene.source.at is None or rays_given:
        return set()
    inside, on = holding(scene, scene.source.at)
    return {*inside, *on}


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
    if asked is True:
        return Finding(holds=True, why="picture.stops is true")
    on = next((scene.lens_key(number) for number in reaching(scene.lenses, picture)), None)
    if on is None:
        return Finding(holds=False, why="picture.stops is false" if asked is False else "no solid reaches the picture")
    if asked is False:
        raise StudyError(
            [
                f"picture.stops: the picture may lie on or in {on}, where a last straight leg has no meaning; "
                'use "auto" or true, or move one away'
            ]
        )
    return Finding(holds=True, why=f"{on} may reach the picture")


def _nested(scene: Scene, lenses: Collection[int], _: bool) -> Finding:
    pairs = touching(scene.lenses, lenses)
    if not pairs:
        return Finding(holds=False, why="all solids are proved apart" if len(lenses) > 1 else "there is one solid")
    named = [f"{scene.lens_key(first)} and {scene.lens_key(second)}" for first, second in pairs[:_NAMED]]
    if len(pairs) == MOST_PAIRS:
        named.append("very many more pairs")
    elif more := len(pairs) - len(named):
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
