"""A processor that is newer than PoCL's compiler is given the name of one that it knows."""

import ctypes
import sys

import pytest

from lenscl.device.unknown_cpu import best_target, name_processor

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


@LINUX
@pytest.mark.parametrize("place", [0, 80, 255])
def test_a_name_that_the_compiler_refuses_is_replaced_and_nothing_else(place: int) -> None:
    fake = Fake(b"generic", place)
    before = list(fake.words)
    target = name_processor(fake.own())
    if target is None:
        pytest.skip("a processor without AVX2")
    assert fake.pointed_to() == target.encode()
    assert [i for i in range(WORDS) if fake.words[i] != before[i]] == [place]
    assert name_processor(fake.own()) is None  # once is enough


@LINUX
@pytest.mark.parametrize("name", [b"znver3", b"generic-rv64", b""])
def test_a_processor_that_the_compiler_knows_keeps_its_name(name: bytes) -> None:
    fake = Fake(name, 80)
    assert name_processor(fake.own()) is None
    assert fake.pointed_to() == name


@pytest.mark.parametrize(
    ("flags", "target"),
    [
        ("fma avx2 bmi1 bmi2 f16c movbe avx512f avx512bw avx512cd avx512dq avx512vl avx512_vnni", "skylake-avx512"),
        ("fma avx2 bmi1 bmi2 f16c movbe avx512f avx512cd", "haswell"),
        ("fma avx2 bmi1 bmi2 f16c movbe", "haswell"),
        ("avx", None),
    ],
)
def test_the_target_has_no_instructions_that_the_processor_lacks(flags: str, target: str | None) -> None:
    assert best_target(f"processor\t: 0\nflags\t\t: fpu {flags}\nbugs\t\t: none\n") == target


def test_a_processor_of_another_family_has_no_target() -> None:
    assert best_target("processor\t: 0\nFeatures\t: fp asimd\n") is None
