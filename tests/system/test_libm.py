"""cmake/libm.sh: the mathematical functions that the programs bring along are those of the C library that they were built with, and
no program takes one from the system that it runs on, whose results may be others."""

import re
import subprocess

import pytest
from local_farm import ROOT, bin_dir

# Their results are exact in every C library.
EXACT = {"fmod", "frexp", "ldexp", "modf", "nextafter", "remainder", "scalbn", "floor", "ceil", "rint", "nearbyint", "round", "roundeven", "trunc", "fma", "fabs", "sqrt",
         "fmax", "fmin", "copysign", "lrint", "lround", "llrint", "llround", "logb", "ilogb"}  # fmt: skip
LIBM = subprocess.run(["g++", "-print-file-name=libm.so.6"], capture_output=True, text=True).stdout.strip()
OWN = bin_dir().parent / "libls_m.a"

pytestmark = pytest.mark.skipif(not OWN.exists(), reason="this build takes mathematical functions from the system (cmake/libm.cmake)")

VALUES = r"""
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

static uint64_t state;
static double uniform(void) { state ^= state << 13; state ^= state >> 7; state ^= state << 17; return (state >> 11) * 0x1p-53; }
#define TRY(name, T, ...) { \
    state = 1; \
    uint64_t all = 0; \
    for (int i = 0; i < 100000; ++i) { \
      volatile T u = uniform(), x = ldexp(uniform() - 0.5, (int)(40 * uniform()) - 20); \
      T value = __VA_ARGS__; \
      uint64_t bits = 0; \
      memcpy(&bits, &value, sizeof value); \
      all = all * 6364136223846793005u + (value == value ? bits : 1); \
    } \
    printf("%s %016lx\n", name, all); }
#define BOTH(name) TRY(#name, double, name(x)) TRY(#name "f", float, name##f(x))
int main(void) {
  BOTH(exp) BOTH(exp2) BOTH(expm1) BOTH(log) BOTH(log2) BOTH(log10) BOTH(log1p) BOTH(sin) BOTH(cos) BOTH(tan) BOTH(asin) BOTH(acos)
  BOTH(atan) BOTH(sinh) BOTH(cosh) BOTH(tanh) BOTH(cbrt) BOTH(erf) BOTH(erfc) BOTH(tgamma) BOTH(lgamma)
  TRY("pow", double, pow(u, x)) TRY("powf", float, powf(u, x)) TRY("atan2", double, atan2(u, x)) TRY("atan2f", float, atan2f(u, x))
  TRY("hypot", double, hypot(u, x)) TRY("hypotf", float, hypotf(u, x))
  TRY("sincos", double, ({ double s, c; sincos(x, &s, &c); s + 2 * c; })) TRY("sincosf", float, ({ float s, c; sincosf(x, &s, &c); s + 2 * c; }))
}
"""


def imports(file):
    listed = subprocess.run(["nm", "-D", "--undefined-only", file], check=True, capture_output=True, text=True).stdout
    return {re.sub("@.*", "", line.split()[-1]) for line in listed.splitlines()}


def test_no_program_takes_a_function_that_rounds_from_the_system():
    listed = subprocess.run(["nm", "-D", "--defined-only", LIBM], check=True, capture_output=True, text=True).stdout
    functions = {re.sub("@.*", "", line.split()[-1]) for line in listed.splitlines()}
    assert {"exp", "expm1f", "atan2f"} <= functions
    rounding = {name for name in functions if name.removesuffix("f") not in EXACT}
    programs = [file for file in bin_dir().glob("lightshaft*") if file.is_file()]
    assert len(programs) > 5

    taken = {(file.name, name) for file in programs for name in imports(file) & rounding}
    assert taken == set()


def test_the_functions_give_the_bits_of_the_c_library_they_come_from(tmp_path):
    (tmp_path / "values.c").write_text(VALUES)
    said = {}
    for name, archive in (("shared", []), ("own", [OWN])):
        # -fno-builtin: the compiler computes nothing by itself.
        subprocess.run(["gcc", "-D_GNU_SOURCE", "-O1", "-fno-builtin", "-o", tmp_path / name, tmp_path / "values.c", *archive, "-lm"], check=True)
        said[name] = subprocess.run([tmp_path / name], check=True, capture_output=True, text=True).stdout.splitlines()

    assert len(said["own"]) > 40 and len({line.split()[1] for line in said["own"]}) > 40
    assert said["own"] == said["shared"]
    assert {"expm1f", "sincos", "pow"} <= imports(tmp_path / "shared") and not {"expm1f", "sincos", "pow"} & imports(tmp_path / "own")


@pytest.mark.parametrize("text, words", [(b"", "libm.a is no archive"), (b"!<arch>\n", "no functions with fused multiply-add")])
def test_an_archive_without_the_functions_is_refused(tmp_path, text, words):
    (tmp_path / "libm.a").write_bytes(text)
    done = subprocess.run([ROOT / "cmake/libm.sh", tmp_path / "libm.a", tmp_path / "out.a", "nm", "objcopy", "ar", "gcc"], capture_output=True, text=True)
    assert done.returncode != 0 and words in done.stderr
    assert not (tmp_path / "out.a").exists()
