"""python-flint, of the extra `accuracy`, imported when the first certified answer is asked for."""

from __future__ import annotations

from typing import Any

from lenscl.errors import LensclError

_USED = ("arb", "ctx", "fmpq", "fmpq_poly", "fmpz_poly")


def python_flint() -> Any:
    """Import python-flint; the module.

    Raises
    ------
    LensclError
        If it is missing or broken; the message says which, and how to mend it.
    """
    try:
        import flint as library
    except Exception as error:  # a broken library may raise anything on its way in
        if isinstance(error, ModuleNotFoundError) and error.name == "flint":
            raise LensclError(
                "certified answers need python-flint, which is not installed: pip install 'lenscl[accuracy]'"
            ) from None
        raise _broken(f"{type(error).__name__}: {' '.join(str(error).split())}") from error
    if lacking := [name for name in _USED if not hasattr(library, name)]:
        raise _broken(f"it has no {', '.join(lacking)}")
    return library


def flint_trouble() -> str | None:
    """Say why certified answers cannot be had here, and how to mend it; None where they can."""
    try:
        python_flint()
    except LensclError as error:
        return str(error)
    return None


def _broken(why: str) -> LensclError:
    return LensclError(
        f"certified answers need python-flint, which is installed but cannot be used ({why}): "
        "pip install --force-reinstall python-flint"
    )
