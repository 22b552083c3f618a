from __future__ import annotations

import json
from pathlib import Path

import pytest

from lenscl.accuracy.bench import Store
from lenscl.accuracy.bench import store as storing
from lenscl.errors import LensclError, StudyError


def test_what_is_saved_is_read_back(measurement, run, tmp_path: Path) -> None:
    store = Store(tmp_path / "not" / "there" / "yet")
    made = run(measurement(ratios=(0.1 + 0.2, 1 / 3, 1e-9)), measurement(method="march", undecided=0.25))
    path = store.save("first", made)
    assert path == tmp_path / "not" / "there" / "yet" / "first.json"
    assert store.load("first") == made
    assert store.names() == ["first"]
    document = json.loads(path.read_text())
    assert document["measurements"][0]["circumstances"]["driver"] == "3.0"
    assert [each.name for each in path.parent.iterdir()] == ["first.json"]  # nothing temporary is left


def test_runs_of_a_user_lie_in_their_data_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(storing.platformdirs, "user_data_dir", lambda name, appauthor: f"{tmp_path}/{name}")
    assert Store().folder == tmp_path / "lenscl" / "bench"


@pytest.mark.parametrize(
    "name", ["", ".", "..", ".hidden", "-x", "a/b", "../a", "a\\b", "a b", "a\nb", "a\0", "é", "x" * 101]
)
def test_a_name_that_is_no_plain_name_is_refused(measurement, run, tmp_path: Path, name: str) -> None:
    store = Store(tmp_path / "runs")
    with pytest.raises(StudyError, match="is no name for a run; use at most 100 letters"):
        store.save(name, run(measurement()))
    with pytest.raises(StudyError, match="is no name for a run"):
        store.load(name)
    assert not (tmp_path / "runs").exists()


def test_a_run_is_replaced_only_by_force(measurement, run, tmp_path: Path) -> None:
    store, (first, second) = Store(tmp_path), (run(measurement(undecided=share)) for share in (0.1, 0.2))
    store.save("v1.0-a_b", first)
    with pytest.raises(StudyError, match=r"v1\.0-a_b\.json: is there already; --force replaces it"):
        store.save("v1.0-a_b", second)
    assert store.load("v1.0-a_b") == first
    store.save("v1.0-a_b", second, force=True)
    assert store.load("v1.0-a_b") == second


def test_an_unknown_name_is_answered_by_those_known(measurement, run, tmp_path: Path) -> None:
    store = Store(tmp_path)
    with pytest.raises(StudyError, match=r'no run is saved as "gone" in .*; none is saved there yet; --save') as no:
        store.load("gone")
    assert no.value.exit_code == 2
    for name in ("one", "two"):
        store.save(name, run(measurement()))
    with pytest.raises(StudyError, match="known are one, two"):
        store.load("gone")


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda text: text[: len(text) // 2], "Invalid JSON"),
        (lambda text: "{}", "program"),
        (lambda text: text.replace('"form": 2', '"form": 1'), "form"),
        (lambda text: text.replace('"peak": 100000000000.0', '"peak": "fast"'), "measurements.0.peak"),
        (lambda text: text.replace('"peak": 100000000000.0', '"peak": 1e999'), "measurements.0.peak"),
        (lambda text: text.replace("1.0,", "0.0,"), "measurements.0.ratios.0"),
    ],
)
def test_a_file_that_is_no_run_is_refused_by_its_path(measurement, run, tmp_path: Path, spoil, says: str) -> None:
    store = Store(tmp_path)
    path = store.save("spoilt", run(measurement()))
    text = path.read_text()
    assert spoil(text) != text
    path.write_text(spoil(text))
    with pytest.raises(StudyError, match="is no run as this version saves it") as refused:
        store.load("spoilt")
    assert str(refused.value).startswith(f"{path}: ")
    assert says in str(refused.value)


def test_a_huge_file_is_not_read(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(storing, "_MOST_BYTES", 10)
    (tmp_path / "huge.json").write_text("x" * 11)
    with pytest.raises(StudyError, match="is larger than 10 bytes"):
        Store(tmp_path).load("huge")


def test_a_folder_that_cannot_be_made_is_named(measurement, run, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(LensclError, match=r"file/runs: cannot be made: .*; choose another by --folder") as refused:
        Store(tmp_path / "file" / "runs").save("x", run(measurement()))
    assert refused.value.exit_code == 1


def test_what_fails_half_way_leaves_what_was_there(measurement, run, tmp_path: Path, monkeypatch) -> None:
    store, first = Store(tmp_path), run(measurement())
    store.save("x", first)

    def breaks(self: Path, data: bytes) -> int:
        with self.open("wb") as file:
            file.write(data[:10])
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", breaks)
        with pytest.raises(LensclError, match="No space left on device"):
            store.save("x", run(measurement(), measurement(method="march")), force=True)
    assert store.load("x") == first
    assert [each.name for each in tmp_path.iterdir()] == ["x.json"]
