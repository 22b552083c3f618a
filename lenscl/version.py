"""Which program made a result: its version and the content of its sources.

>>> program_version().startswith("lenscl ")
True
"""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.metadata import version
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
_KERNELS = (_PACKAGE / "kernels", _PACKAGE.parent / "kernels")  # in a wheel, in a checkout


@cache
def program_version() -> str:
    """Return "lenscl VERSION (DIGEST)", the digest being of every source file of the package and of the kernels.

    A version number does not change while one edits; the digest does, so that no result of older code is kept.
    """
    kernels = next((folder for folder in _KERNELS if folder.is_dir()), _KERNELS[0])
    sources = [*(("lenscl", path, _PACKAGE) for path in _PACKAGE.rglob("*.py")),
               *(("kernels", path, kernels) for path in kernels.rglob("*.cl"))]  # fmt: skip
    digest = hashlib.sha256()
    for name, path in sorted((f"{home}/{path.relative_to(base).as_posix()}", path) for home, path, base in sources):
        content = path.read_bytes()
        digest.update(f"{name} {len(content)}\n".encode())
        digest.update(content)
    return f"lenscl {version('lenscl')} ({digest.hexdigest()[:12]})"
