"""Devices that do what another does, and more: count what goes up to them, or compile programs with a fault."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from numpy.typing import NDArray

from lenscl.device import Buffer, Device, Program


@dataclass(frozen=True)
class CountingDevice(Device):
    """A device that notes each array that is uploaded: its shape and type."""

    uploads: list[tuple[tuple[int, ...], str]] = field(default_factory=list, compare=False)

    def upload(self, array: NDArray[Any]) -> Buffer:
        self.uploads.append((array.shape, array.dtype.name))
        return super().upload(array)


@dataclass(frozen=True)
class FaultyDevice(Device):
    """A device whose compiler sees a fault in the place of a part of the text, and counts the programs with it."""

    sound: str = ""
    fault: str = ""
    built: list[str] = field(default_factory=list, compare=False)

    def build(self, text: str, **how: Any) -> Program:
        if self.sound in text:
            self.built.append(text)
        return super().build(text.replace(self.sound, self.fault), **how)


def counting(device: Device) -> CountingDevice:
    return CountingDevice(**_fields_of(device))


def faulty(device: Device, sound: str, fault: str) -> FaultyDevice:
    return FaultyDevice(**_fields_of(device), sound=sound, fault=fault)


def _fields_of(device: Device) -> dict[str, Any]:
    return {each.name: getattr(device, each.name) for each in fields(Device)}
