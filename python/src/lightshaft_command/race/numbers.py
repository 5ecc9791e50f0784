"""Numbers for people, as the reports of jobs show them (util/report/number_text.h)."""

import math

ABSENT = "–"
_DIGITS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def figure(x: float) -> str:
    """Three significant digits: "0.0213", "3.20 × 10⁻⁵"."""
    if not math.isfinite(x):
        return ABSENT
    if x == 0:
        return "0"
    mantissa, _, exponent = f"{x:.2e}".partition("e")  # rounded first, so that 9.996 gets the exponent of 10.0
    power = int(exponent)
    if power >= 5 or power < -3:
        return f"{mantissa} × 10{str(power).translate(_DIGITS)}"
    return f"{x:.{2 - power}f}" if power < 3 else count(float(f"{x:.3g}"))


def given(x: float) -> str:
    """A number that a user has chosen, with its own digits."""
    return figure(x) if x != 0 and abs(x) < 1e-4 else f"{x:g}"


def count(x: float) -> str:
    return f"{x:,.0f}"


def sample_count(spp: float) -> str:
    """ "1,024"; a mean below 100 has one decimal: "5.7"."""
    return f"{round(10 * spp) / 10:g}" if spp < 100 else count(spp)
