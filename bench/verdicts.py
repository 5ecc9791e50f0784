"""What a comparison of two means allows to say: agrees, differs, or too few samples to say."""

BAND = 5e-3  # of the other mean: closer than that, two renderers count as one
ERRORS = 2   # standard errors to either side: an interval of 95 %
AGREES, DIFFERS, TOO_FEW = "agrees", "differs", "too few samples to say"


def verdict(channels, band=BAND):
    """channels: (ratio of means - 1, its standard error) of each.

    Agrees: every interval lies within the band. Differs: one lies outside of it. Else an interval crosses the band's edge: the
    samples do not tell on which side the answer is.
    """
    if all(abs(off) + ERRORS * error <= band for off, error in channels):
        return AGREES
    if any(abs(off) - ERRORS * error > band for off, error in channels):
        return DIFFERS
    return TOO_FEW
