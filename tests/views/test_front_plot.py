"""A front's picture and page hold what was measured, and the page loads nothing from elsewhere."""

from __future__ import annotations

from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
from scenes import make_scene

from lenscl.accuracy import Combination, Front, front, measure_front
from lenscl.config import Accuracy
from lenscl.device import choose
from lenscl.errors import LensclError
from lenscl.imaging import read_picture
from lenscl.views import front_plot, write_front_page, write_front_picture


@pytest.fixture(scope="module")
def measured() -> Front:
    few = [
        Combination(method="polynomial", precision="single"),
        Combination(method="polynomial"),
        Combination(method="march", step=0.01),
    ]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(front, "every_combination", lambda *_: few)
        scene = make_scene({"surface": "sphere"}, film={"size": [32, 32]})
        return measure_front(scene, choose(), title='<b>"A ball"</b> & more', made="then", rounds=6)


def test_the_picture_is_one(measured: Front, tmp_path: Path) -> None:
    write_front_picture(tmp_path / "front.png", measured, Accuracy(0.05, "px"))
    picture = read_picture(tmp_path / "front.png")
    assert picture.size == (1280, 860)
    for title in ("Costs $5 and $x^", "bad $\\frac$", "\x1b[31m a bell \a", "日本"):  # no mathematics, no control
        write_front_picture(tmp_path / "front.png", replace(measured, title=title))
        write_front_page(tmp_path / "front.html", replace(measured, title=title))
        assert "\x1b" not in (tmp_path / "front.html").read_text()
    assert len({tuple(pixel) for pixel in picture.pixels.reshape(-1, picture.pixels.shape[2])[::7].tolist()}) > 20


class _Loads(HTMLParser):
    """Collects what a page would fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found += [str(value) for name, value in attrs if name in ("src", "href", "srcset") and tag != "a"]


def test_the_page_labels_every_point_and_loads_nothing(measured: Front, tmp_path: Path) -> None:
    write_front_page(tmp_path / "front.html", measured, Accuracy(0.05, "px"))
    text = (tmp_path / "front.html").read_text()
    page = _Loads()
    page.feed(text)
    assert page.found == []
    drawn = text[text.rindex("Plotly.newPlot(") :]
    for one in measured.tried:
        assert str(one.combination) in drawn
    assert '<b>"A ball"' not in drawn.replace("\\u003c", "<").replace('\\"', '"')  # the title is text, not markup
    device = choose()
    assert " ".join(device.driver.split())[:40] in drawn
    assert "warm" in drawn


def test_a_missing_library_is_named_with_its_cure(
    measured: Front, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(front_plot, "find_spec", lambda name: None if name == "plotly" else object())
    with pytest.raises(LensclError, match=r"needs plotly, .*pip install 'lenscl\[plot\]'"):
        write_front_page(tmp_path / "front.html", measured)
    assert not list(tmp_path.iterdir())


def test_errors_of_zero_and_fronts_of_nothing_are_drawn(measured: Front, tmp_path: Path) -> None:
    zero = measured.tried[0].judgement
    distances = replace(zero.pixels, high=replace(zero.pixels.high, value=0.0, low=None, high=None), largest=0.0)
    lossy = [replace(each, differ=0.5, judgement=replace(zero, pixels=distances)) for each in measured.tried]
    here = replace(measured, tried=tuple(lossy))
    write_front_picture(tmp_path / "front.png", here)
    write_front_page(tmp_path / "front.html", here)
    assert (tmp_path / "front.html").stat().st_size > 1000
