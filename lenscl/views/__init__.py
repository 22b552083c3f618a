"""Pictures and pages of what the program knows. Input: a value of the floors below; output: a file."""

from __future__ import annotations

from lenscl.views.front_plot import require_plotting, write_front_page, write_front_picture

__all__ = ["require_plotting", "write_front_page", "write_front_picture"]
