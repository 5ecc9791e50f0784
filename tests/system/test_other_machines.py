"""The same program on other machines: where its numeric class is the same, so are the pixels."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from cli_kit import lightshaft, load, write_fog

SHIM = Path(__file__).parent.parent / "support/other_machine.cpp"
HERE = {}
# The mathematical library picks its code by what the processor can: without fused multiply-add it takes another one.
WITHOUT_FMA = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA"}


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    """A function of further environment variables: (numeric class, pixels_sha256) of a picture of fog and triangles."""
    folder = tmp_path_factory.mktemp("machines")
    scene, shim = write_fog(folder), folder / "other_machine.so"
    subprocess.run(["c++", "-std=c++20", "-O1", "-shared", "-fPIC", SHIM, "-o", shim, "-ldl"], check=True)

    def render(settings):
        environment = {**os.environ, "LD_PRELOAD": str(shim), **settings}
        lightshaft("render", scene, "-o", folder / "out.exr", "--spp", 32, "--threads", 1, "--report", folder / "report.json", env=environment)
        report = load(folder / "report.json")
        return report["numeric_class"], report["pixels_sha256"]
    return render


@pytest.fixture(scope="module")
def here(rendered):
    return rendered(HERE)


def last_digits(settings):
    """Values of the mathematical library under these settings, in a process of their own."""
    program = ("import ctypes, ctypes.util; m = ctypes.CDLL(ctypes.util.find_library('m')); m.exp.restype = ctypes.c_double\n"
               "print([m.exp(ctypes.c_double(i / 997)).hex() for i in range(20000)])")
    return subprocess.run([sys.executable, "-c", program], env={**os.environ, **settings}, check=True, capture_output=True, text=True).stdout


def test_the_mathematical_library_of_another_processor_changes_nothing(rendered, here):
    """Programs bring their mathematical functions along (cmake/libm.sh)."""
    assert last_digits(WITHOUT_FMA) != last_digits(HERE), "the setting must change values, or what follows proves nothing"

    assert rendered(WITHOUT_FMA) == here


@pytest.mark.parametrize("isa", ["sse2", "sse4.2", "avx"])
def test_embree_with_other_instructions_gives_the_same_pixels_or_is_another_class(rendered, here, isa):
    numeric_class, pixels = rendered({"LIGHTSHAFT_TEST_ISA": isa})

    assert pixels == here[1] or numeric_class != here[0]


def test_a_machine_that_gives_other_pixels_is_of_another_class(rendered, here):
    numeric_class, pixels = rendered({"LIGHTSHAFT_TEST_OFF": "rtcIntersect1"})

    assert pixels != here[1], "the difference must show, or what follows proves nothing"
    assert numeric_class != here[0]
