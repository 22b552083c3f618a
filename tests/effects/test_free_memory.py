"""What would not fit into memory is refused before it is begun, by the key that asks for it."""

from __future__ import annotations

import os
import tracemalloc
from pathlib import Path
from typing import Any

import pytest
from scenes import make_scene

from lenscl import trace
from lenscl.config import Scene
from lenscl.errors import TraceError
from lenscl.tracing import job, memory, samples

GIB = 2**30
SIZES = {
    # A limit of its own group, of which 100 bytes are files' pages, and a narrower one around it
    "second kind": ("0::/batch/job\n", {
        "batch/job/memory.max": "9000", "batch/job/memory.current": "1000", "batch/job/memory.stat": "anon 1\n"
        "inactive_file 100\n", "batch/memory.max": "5000", "batch/memory.current": "3000", "memory.max": "max",
        "memory.current": "1"}, 2000),
    "second kind, not limited": ("0::/\n", {"memory.max": "max", "memory.current": "7000"}, None),
    # A container names the group by a path that it does not see itself
    "first kind": ("5:cpu,cpuacct:/\n4:memory:/far/off\n", {
        "memory/memory.limit_in_bytes": "8000", "memory/memory.usage_in_bytes": "7000",
        "memory/memory.stat": "inactive_file 1\ntotal_inactive_file 500"}, 1500),
    "used beyond its limit": ("0::/\n", {"memory.max": "10", "memory.current": "99"}, 0),
}  # fmt: skip


@pytest.mark.parametrize("name", SIZES)
def test_the_narrowest_limit_around_the_process_counts(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    groups, files, wanted = SIZES[name]
    files = {f"groups/{file}": text for file, text in files.items()}
    files |= {"proc/self/cgroup": groups, "proc/meminfo": "MemTotal: 900 kB\nMemFree: 1 kB\nMemAvailable:    20 kB\n"}
    for file, text in files.items():
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text(text)
    monkeypatch.setattr(memory, "_PROCESSES", tmp_path / "proc")
    monkeypatch.setattr(memory, "_GROUPS", tmp_path / "groups")
    assert memory.free_memory() == (20 * 1024 if wanted is None else wanted)


def test_where_only_the_size_of_memory_is_known_that_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "_PROCESSES", tmp_path)
    monkeypatch.setattr(os, "sysconf", {"SC_PHYS_PAGES": 5, "SC_PAGE_SIZE": 4096}.__getitem__)
    assert memory.free_memory() == 5 * 4096
    monkeypatch.delattr(os, "sysconf")
    assert memory.free_memory() is None
    memory.hold(2**60, "film.size", "rays", "")  # which nobody can tell


def test_what_fits_to_the_byte_is_not_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory, "free_memory", lambda: 3 * GIB)
    memory.hold(3 * GIB, "film.size", "rays", "")
    with pytest.raises(TraceError, match=r"^film\.size: rays take 3\.0 GiB, and 3\.0 GiB of memory are free; do less$"):
        memory.hold(3 * GIB + 1, "film.size", "rays", "do less")


def seen(**effects: Any) -> Scene:
    return make_scene({"surface": "torus", "n": "SF11"}, film={"size": [32, 32]}, effects=effects)


def refuse_launches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(job.Job, "_launch", lambda *_: pytest.fail("it was begun"))


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({}, r"^film\.size: the rays of 16,777,216 pixels take 0\.3 GiB, and 0\.2 GiB of memory are free; use a"),
        (
            {"dispersion": 16},
            r"^effects\.dispersion: the rays of 16,777,216 pixels at 16 wavelengths take 4\.5 GiB, and 0\.2 GiB of "
            "memory are free; ask for fewer wavelengths, or use a smaller film",
        ),
        ({"path_length": True}, r"^film\.size: the rays of 16,777,216 pixels take 0\.4 GiB"),
    ],
)
def test_a_map_that_does_not_fit_is_refused_before_it_is_traced(
    asked: dict[str, Any], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory, "free_memory", lambda: GIB // 4)
    refuse_launches(monkeypatch)
    with pytest.raises(TraceError, match=said):
        trace(seen(**asked).replace({"film.size": [4096, 4096]}))


@pytest.mark.parametrize(
    ("asked", "free", "said"),
    [
        ({"antialias": 16}, GIB, r"16 x 16 rays of each of 262,144 film pixels take 1\.1 GiB, and 1\.0 GiB"),
        (
            {"antialias": 4, "dispersion": 16},
            GIB,
            r"4 x 4 rays of each of 262,144 film pixels at 16 wavelengths take 1\.2 GiB, .*for fewer wavelengths,",
        ),
    ],
)
def test_samples_that_do_not_fit_are_refused_before_they_are_traced(
    asked: dict[str, Any], free: int, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = seen(**asked).replace({"film.size": [512, 512]})
    raymap = samples.with_samples(trace(scene.replace({"effects.antialias": 1})))  # which is the map alone
    assert raymap.samples is None
    monkeypatch.setattr(memory, "free_memory", lambda: free)
    refuse_launches(monkeypatch)
    with pytest.raises(TraceError, match=rf"^effects\.antialias: {said}"):
        samples.with_samples(samples.replace(raymap, scene=scene))


@pytest.mark.parametrize(("asked", "many"), [({}, 1), ({"dispersion": 3}, 3)])
def test_samples_take_no_more_than_they_were_held_against(
    asked: dict[str, Any], many: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    held: list[int] = []
    monkeypatch.setattr(samples, "hold", lambda nbytes, *_: held.append(nbytes))
    monkeypatch.setattr(job, "_TILE_PIXELS", 2**14)
    scene = seen(antialias=16, **asked)
    raymap = trace(scene)
    samples.with_samples(raymap)  # whatever is kept from the first time on
    tracemalloc.start()
    found = samples.with_samples(raymap)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found.samples is not None
    assert found.samples.status.size == many * 32**2 * 16**2
    assert held[1] == (many + (many > 1)) * 18 * 32**2 * 16**2
    assert 0.8 * held[1] < peak < 1.2 * held[1]
