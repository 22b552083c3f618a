"""How long tests wait for what should end: a guard against what hangs, on a machine however busy."""

from __future__ import annotations

PATIENCE = 3600.0  # seconds; an idle machine takes some
