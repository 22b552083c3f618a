"""A processor that is newer than PoCL's compiler is given the name of one that it knows."""

import ctypes
import sys

import pytest

from lenscl.device.unknown_cpu import name_processor

WORDS = 512
LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="it reads /proc")


class Fake:
    """Memory laid out as no release of PoCL has it: numbers, bad pointers, and among them one to a name."""

    def __init__(self, name: bytes, place: int) -> None:
        self.name = ctypes.create_string_buffer(name)
        self.words = (ctypes.c_uint64 * WORDS)(*(0xDEAD0000 + 8 * i for i in range(WORDS)))
        self.words[3], self.words[4], self.words[5] = 0, 2**64 - 8, 7
        self.words[place] = ctypes.addressof(self.name)
        self.place = place

    def pointed_to(self) -> bytes | None:
        return ctypes.cast(self.words[self.place], ctypes.c_char_p).value

    def own(self) -> int:
        return ctypes.addressof(self.words)


AVX2 = "fma avx2 bmi1 bmi2 f16c movbe"
AVX512 = f"{AVX2} avx512f avx512bw avx512cd avx512dq avx512vl"


def cpuinfo(flags: str) -> str:
    return f"processor\t: 0\nflags\t\t: fpu {flags}\nbugs\t\t: none\n"


@LINUX
@pytest.mark.parametrize("place", [0, 80, 255])
def test_a_name_that_the_compiler_refuses_is_replaced_and_nothing_else(place: int) -> None:
    fake = Fake(b"generic", place)
    before = list(fake.words)
    assert name_processor(fake.own(), cpuinfo(AVX2)) == "haswell"
    assert fake.pointed_to() == b"haswell"
    assert [i for i in range(WORDS) if fake.words[i] != before[i]] == [place]
    assert name_processor(fake.own(), cpuinfo(AVX2)) is None  # once is enough


@LINUX
@pytest.mark.parametrize(
    ("name", "flags", "target"),
    [
        (b"generic", f"{AVX512} avx512_vnni", "skylake-avx512"),
        (b"znver3", AVX512, "skylake-avx512"),  # its compiler knows nothing newer, and that one has no AVX-512
        (b"generic", f"{AVX2} avx512f avx512cd", "haswell"),
        (b"generic", AVX2, "haswell"),
        (b"znver3", AVX2, None),
        (b"sapphirerapids", AVX512, None),
        (b"generic-rv64", AVX512, None),
        (b"generic", "avx", None),
        (b"", AVX512, None),
    ],
)
def test_the_target_has_no_instructions_that_the_processor_lacks(name: bytes, flags: str, target: str | None) -> None:
    fake = Fake(name, 80)
    assert name_processor(fake.own(), cpuinfo(flags)) == target
    assert fake.pointed_to() == (name if target is None else target.encode())


@LINUX
def test_a_processor_of_another_family_has_no_target() -> None:
    fake = Fake(b"generic", 80)
    assert name_processor(fake.own(), "processor\t: 0\nFeatures\t: fp asimd\n") is None
