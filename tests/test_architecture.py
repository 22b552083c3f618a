"""Imports run one way. Read from the syntax trees, so that an import inside a function counts as well."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import lenscl

PACKAGE = Path(lenscl.__file__).parent

# A room may import rooms of lower floors only. Rooms on one floor do not know each other.
FLOORS = (
    {"errors", "status", "version"},
    {"expr"},
    {"effects", "methods", "lenses", "materials"},
    {"device", "codegen"},
    {"tracing", "imaging"},
    {"accuracy", "hardcases"},  # below sweep, which traces as accurately as a study asks
    {"views", "sweep"},
    {"cli"},
    {"__main__"},  # `python -m lenscl`
)
FLOOR = {room: number for number, rooms in enumerate(FLOORS) for room in rooms}

# config stands beside the stairs: it reads the registries only, and is read by all above codegen
CONFIG_READS = {"errors", "lenses", "materials", "methods", "effects"}
CONFIG_READERS_FLOOR = FLOOR["tracing"]
# reference is a house of its own: it shares no code with what it judges
REFERENCE_READS = {"errors", "status", "expr", "lenses", "materials", "config"}
REFERENCE_READERS = {"accuracy", "cli"}  # what measures errors, and `lenscl doctor`
EXCEPTIONS = {
    ("imaging", "tracing"),  # painting and ST maps take a RayMap
}


def imports_of(source: str) -> Iterator[str]:
    """Yield the rooms of lenscl that a module imports."""
    for node in ast.walk(ast.parse(source)):
        names = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide the room they come from"
            names = [
                f"{node.module}.{alias.name}" if node.module == "lenscl" else str(node.module) for alias in node.names
            ]
        for name in names:
            parts = name.split(".")
            if parts[0] == "lenscl" and len(parts) > 1:
                yield parts[1]


def fault(room: str, imported: str) -> str | None:
    """Return what is wrong with one room importing another, None if nothing."""
    if room == imported or (room, imported) in EXCEPTIONS:
        return None
    if room == "config":
        allowed = imported in CONFIG_READS
    elif room == "reference":
        allowed = imported in REFERENCE_READS
    elif imported == "config":
        allowed = FLOOR[room] >= CONFIG_READERS_FLOOR
    elif imported == "reference":
        allowed = room in REFERENCE_READERS
    else:
        allowed = FLOOR[imported] < FLOOR[room]
    return None if allowed else f"{room} imports {imported}"


def modules() -> Iterator[tuple[str, Path]]:
    for path in sorted(PACKAGE.rglob("*.py")):
        room = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
        if room != "__init__":
            yield room, path


def test_imports_run_one_way() -> None:
    pairs = [(room, imported, path) for room, path in modules() for imported in imports_of(path.read_text())]
    faults = [
        f"{path.relative_to(PACKAGE)}: {wrong}" for room, imported, path in pairs if (wrong := fault(room, imported))
    ]
    assert len(pairs) > 50  # the reading finds something
    assert faults == []


def test_only_device_imports_pyopencl_and_only_imaging_imports_openimageio() -> None:
    homes = {"pyopencl": "device", "OpenImageIO": "imaging", "sqlite3": "sweep"}
    seen = set()
    for room, path in modules():
        for node in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            for library in homes.keys() & {name.split(".")[0] for name in names}:
                seen.add(library)
                assert room == homes[library], f"{path} imports {library}"
    assert seen == homes.keys()


def test_a_wrong_import_is_seen() -> None:
    assert list(imports_of("def f():\n    from lenscl import tracing")) == ["tracing"]
    assert fault("expr", "tracing") == "expr imports tracing"
    assert fault("reference", "codegen") == "reference imports codegen"
    assert fault("codegen", "config") == "codegen imports config"
    assert fault("config", "expr") == "config imports expr"
    assert fault("tracing", "config") is None


def test_what_a_room_offers_is_there() -> None:
    offered = 0
    for path in sorted(PACKAGE.rglob("__init__.py")):
        name = ".".join(("lenscl", *path.parent.relative_to(PACKAGE).parts))
        room = import_module(name)
        for each in getattr(room, "__all__", ()):
            offered += 1
            assert hasattr(room, each), f"{name} does not have {each}"
    assert offered > 150


def test_importing_the_package_loads_nothing_heavy() -> None:
    code = "import sys, lenscl, lenscl.cli; print(*sorted({m.split('.')[0] for m in sys.modules}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(done.stdout.split())
    assert "lenscl" in loaded
    assert loaded.isdisjoint({"numpy", "pyopencl", "OpenImageIO", "pydantic", "scipy", "rich", "sqlite3"})
