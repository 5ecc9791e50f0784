"""How a storm is told: a generator that is given a Storm and yields the farm whose job must have the right pixels in the end."""

import contextlib

STORMS = {}  # name: function of (storm) -> farm, as a context


def storm(function):
    STORMS[function.__name__.replace("_", " ")] = contextlib.contextmanager(function)
    return function
