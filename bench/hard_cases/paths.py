"""Paths: re-entry, total reflection without end, lens after lens, lenses cut by screens."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hard_cases.aims import aimed_case, both_signs, down_on, generator, rays
from hard_cases.scenes import GYROID, PLACED, Table, lens, scene, user
from lenscl.hardcases import Case


def cases() -> Iterator[Case]:
    """Yield them."""
    yield from _re_entries()
    yield from _trapped()
    yield from _several_lenses()
    yield from _cut_screens()


def _re_entries() -> Iterator[Case]:
    for sheets in (2, 3, 5, 8):
        name = f"re-entry: {sheets} times"
        places = np.linspace(-0.8, 0.8, sheets)
        nearest = f"abs(z - {places[-1]:.17g})"
        for place in reversed(places[:-1]):
            nearest = f"min(abs(z - {place:.17g}), {nearest})"
        yield aimed_case(
            name,
            "re-entry",
            "one lens of several parts: light leaves and enters it again",
            scene(user(f"max({nearest} - 0.05, x^2 + y^2 - 1)", 1.1)),
            down_on(generator(name), 80, 0.5, height=2.0),
        )
    for name, table in (
        ("re-entry: gyroid", user(GYROID, 1.1, 1.2)),
        ("re-entry: bifolia", lens("bifolia", **PLACED)),
        ("re-entry: torus", lens("torus", 1.3, rotate=[90.0, 0.0, 0.0])),
    ):
        yield aimed_case(
            name,
            "re-entry",
            "light leaves a folded lens and meets it again, many times",
            scene(table, numerics={"max_events": 24}),
            down_on(generator(name), 100, 0.7),
        )


def _trapped() -> Iterator[Case]:
    for most, count in ((1, 60), (7, 60), (40, 60), (64, 8), (255, 2)):
        name = f"trapped: {most} events"
        random = generator(name)
        heights = random.uniform(0.8, 0.98, count)
        turn = random.uniform(0.0, 2.0 * np.pi, count)
        at = np.column_stack([-heights * np.sin(turn), heights * np.cos(turn), 0.1 * random.uniform(-1, 1, count)])
        yield aimed_case(
            name,
            "trapped",
            "light inside a ball, beyond the critical angle, is reflected for ever",
            scene(lens("sphere"), numerics={"max_events": most}),
            rays(at, np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])),
            is_exact=most > 40,  # far beyond the critical angle, though balls about the path grow too wide to tell
        )
    name = "trapped: a prism of strong glass"
    yield aimed_case(
        name,
        "trapped",
        "light in a prism of index 4 finds no way out for long",
        scene(lens("prism", 4.0, **PLACED), numerics={"max_events": 20}),
        down_on(generator(name), 100, 0.6),
    )
    for most in (1, 2, 3):
        name = f"trapped: not, leaving at event {most}"
        yield aimed_case(
            name,
            "trapped",
            "a ray that leaves at exactly the last event that is allowed lands",
            scene(lens("sphere"), numerics={"max_events": most}),
            down_on(generator("the last event"), 60, 0.9),
        )
    name = "total reflection ends"
    yield aimed_case(
        name,
        "trapped",
        "where total reflection is not followed, the ray ends there",
        scene(lens("prism", **PLACED), effects={"total_reflection": "end"}),
        down_on(generator(name), 100, 0.6),
    )


def _several_lenses() -> Iterator[Case]:
    stack: list[Table] = [
        lens("biconvex", 1.5168, centre=[0.0, 0.0, 1.5], name="first"),
        lens("meniscus", 1.62, centre=[0.05, 0.0, 0.5], name="second"),
        lens("sphere", 1.333, r=0.3, centre=[0.1, 0.1, -0.5], name="third"),
        lens("torus", 1.7, R=0.5, r=0.2, centre=[0.0, 0.0, -1.5], name="fourth"),
        lens("biconvex", 1.4, centre=[0.0, 0.0, -2.4], stretch=[0.5, 0.5, 0.5], name="fifth"),
    ]
    for count in (2, 3, 5):
        plain = f"lens after lens: {count}"
        why = "several lenses one behind the other, in any order of the file"
        some = down_on(generator(plain), 70, 0.6, slant=0.1)
        lenses = stack[:count]
        yield aimed_case(plain, "lens after lens", why, scene(*lenses), some)
        yield aimed_case(
            f"{plain}, the other way round", "lens after lens", why, scene(*reversed(lenses)), some, equals=plain
        )
    for first, rim in (("sphere", 0.5), ("torus", 0.8)):
        sizes = {"sphere": {"r": 0.5}, "torus": {"R": 0.6, "r": 0.2}}[first]
        turn = np.linspace(0.1, 6.1, 5)[:, None]
        radius = rim - both_signs(10.0 ** -np.arange(4.0, 17.0))
        at = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0.0 * radius + 4.0 + 0.0 * turn], axis=-1)
        for name, why, height, ball in (
            (
                f"lens after lens: the rim of a {first}, then a ball",
                "just at the rim of a lens: where it is not proved that it is missed, "
                "the ball behind must not be taken",
                1.0,
                lens("sphere", centre=[0.0, 0.0, -1.4], name="ball"),
            ),
            (
                f"lens after lens: a ball, and the rim of a {first} behind",
                "a ball turns the rays away before the rim that they come down on: what is behind casts no doubt on it",
                -1.0,
                lens("sphere", centre=[0.0, 0.0, 1.5], name="ball"),
            ),
        ):
            yield aimed_case(
                name,
                "lens after lens",
                why,
                scene(lens(first, centre=[0.0, 0.0, height], name="first", **sizes), ball),
                rays(at, [0.0, 0.0, -1.0]),
            )
    gap = 1e-9
    name = "lens after lens: nearly touching"
    yield aimed_case(
        name,
        "lens after lens",
        "two balls a billionth apart",
        scene(
            lens("sphere", r=0.5, centre=[0.0, 0.0, 0.5 + gap], name="one"),
            lens("sphere", r=0.5, centre=[0.0, 0.0, -0.5], name="other"),
        ),
        down_on(generator(name), 100, 0.2, slant=0.1),
    )


def _cut_screens() -> Iterator[Case]:
    name = "screens in a lens: the picture"
    picture = {"corner": [-1.0, 1.0, 0.1], "right": [2.0, 0.0, 0.0], "down": [0.0, -2.0, 0.0]}
    yield aimed_case(
        name,
        "screens in a lens",
        "the picture cuts the lens: rays end on it in the glass",
        scene(lens("sphere"), picture=picture),
        down_on(generator(name), 100, 1.2),
    )
    yield Case(
        name="screens in a lens: the film",
        family="screens in a lens",
        why="the film cuts the lens: rays meet the lens before it",
        scene=scene(
            lens("torus"),
            film={"corner": [-1.0, 1.0, 0.1], "right": [2.0, 0.0, 0.0], "down": [0.0, -2.0, 0.0], "size": [13, 11]},
        ),
    )
    for surface in ("sphere", "torus"):
        inner = {"sphere": [0.1, 0.2, 0.3], "torus": [0.7, 0.0, 0.05]}[surface]
        yield Case(
            name=f"screens in a lens: source and film in the {surface}",
            family="screens in a lens",
            why="source and film both lie inside the lens",
            scene=scene(
                lens(surface),
                source={"at": inner},
                film={"corner": [-0.3, 0.3, -0.5], "right": [1.4, 0.0, 0.0], "down": [0.0, -0.6, 0.0], "size": [14, 7]},
                numerics={"max_events": 10},
            ),
        )
    name = "screens in a lens: flat film"
    random = generator(name)
    yield aimed_case(
        name,
        "screens in a lens",
        "rays start in the picture's own plane, inside the lens and beside the picture",
        scene(lens("ellipsoid", a=1.0, b=0.8, c=0.6), picture=picture | {"corner": [1.2, 1.0, 0.1]}),
        rays(np.column_stack([random.uniform(-0.4, 0.4, (80, 2)), np.full(80, 0.1)]), random.normal(size=(80, 3))),
    )
