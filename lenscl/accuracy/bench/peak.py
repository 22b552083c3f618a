"""The multiply-add peak of a device: what every figure of speed is held against."""

from __future__ import annotations

import numpy as np

from lenscl.device import WIDEST, Device, Precision

_CHAINS = 12  # independent sums in flight: more than latency times ports of today's processors
_ROUNDS = 20_000
# Work-items for every compute unit: a few groups for each core of a CPU, as many as a multiprocessor of a GPU holds
_ITEMS_A_UNIT = {"cpu": 128, "gpu": 2048}
_LEAST_ITEMS = 256
_KERNEL = """
kernel void peak(global REAL *numbers, const int rounds) {
  const REAL start = numbers[get_global_id(0)];
  const PACKET factor = (PACKET)numbers[1], term = (PACKET)numbers[2];
  PACKET BEGIN;
  for (int round = 0; round < rounds; ++round) {
    STEP
  }
  const PACKET all = END;
  numbers[get_global_id(0)] = TOTAL;
}
"""


def multiply_add_peak(device: Device, precision: Precision, tries: int = 5) -> float:
    """Return the most flop/s seen in a few tries; a multiply-add counts two."""
    width = min(device.width(precision), WIDEST)
    real, dtype = ("float", np.float32) if precision == "single" else ("double", np.float64)
    total = " + ".join(f"all.s{lane:x}" for lane in range(width)) if width > 1 else "all"
    sums = [f"sum_{chain}" for chain in range(_CHAINS)]  # named: in an array, PoCL may run one chain after the other
    head = {
        "REAL": real,
        "PACKET": real + (str(width) if width > 1 else ""),
        "BEGIN": ", ".join(f"{name} = (PACKET)(start + {chain})" for chain, name in enumerate(sums)),
        "STEP": " ".join(f"{name} = {name} * factor + term;" for name in sums),
        "END": " + ".join(sums),
        "TOTAL": total,
    }
    text = "".join(f"#define {name} {value}\n" for name, value in head.items()) + _KERNEL
    items = max(_LEAST_ITEMS, device.units * _ITEMS_A_UNIT.get(device.kind, _ITEMS_A_UNIT["cpu"]))
    program, numbers = device.build(text, kind="peak"), device.upload(np.full(items, 0.5, dtype))
    seconds = min(program.run("peak", items, [numbers, np.int32(_ROUNDS)]) for _ in range(tries))
    return 2.0 * items * _ROUNDS * _CHAINS * width / seconds
