"""`python -m lenscl`, the same as `lenscl`."""

from __future__ import annotations

from lenscl.cli import main

main(prog_name="lenscl")
