"""Shares in [0, 1) for the sampled modes. NumPy and SciPy are imported only when a study asks for them."""

from __future__ import annotations

import warnings
from typing import Any

from lenscl.config.problems import study_error

MOST_SHARES = 2_000_000  # samples times axes
_ENGINES = {"latin": "LatinHypercube", "halton": "Halton", "sobol": "Sobol"}


def shares(mode: str, samples: int, dimensions: int, seed: int) -> list[list[float]]:
    """Return `samples` rows of `dimensions` shares, the same for the same seed.

    Raises
    ------
    StudyError
        If SciPy is needed and missing, or there are more dimensions than the sequence has.
    """
    import numpy as np

    generator = np.random.default_rng(seed)
    if mode == "random":
        return generator.random((samples, dimensions)).tolist()  # type: ignore[no-any-return]
    try:
        from scipy.stats import qmc
    except ImportError:
        fix = "install it with: pip install 'lenscl[sampling]'"
        raise study_error([f'sweep.mode: "{mode}" needs SciPy, which is not installed; {fix}']) from None
    if mode == "sobol" and dimensions > qmc.Sobol.MAXDIM:
        raise study_error([f"sweep.mode: sobol has at most {qmc.Sobol.MAXDIM} axes, got {dimensions}"])
    engine = _engine(getattr(qmc, _ENGINES[mode]), dimensions, generator)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # sobol is balanced only for powers of two; any count is allowed
        return engine.random(samples).tolist()  # type: ignore[no-any-return]


def _engine(kind: Any, dimensions: int, generator: Any) -> Any:
    """Return a scrambled engine; SciPy 1.15 renamed `seed` to `rng`."""
    try:
        return kind(dimensions, rng=generator)
    except TypeError:
        return kind(dimensions, seed=generator)
