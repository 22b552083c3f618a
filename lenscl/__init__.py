"""Look at pictures through lenses of any shape, and trust what you see."""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOMES = {
    "LensclError": "errors",
    "RayStatus": "status",
    "StudyError": "errors",
    "compile_count": "device",
    "load_study": "config",
    "paint": "imaging",
    "refractive_index": "materials",
    "scene_from_toml": "config",
    "trace": "tracing",
    "trace_rays": "tracing",
}  # imported when first used: `lenscl --help` must not wait for numpy or OpenCL

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'lenscl' has no attribute {name!r}")
    return getattr(import_module(f"lenscl.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return list(__all__)
