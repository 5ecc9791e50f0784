"""Storms with the renderer in the place of fake workers, one of each kind: of the network, of messages, of a disk, of Redis. Their
pixels must be those of `lightshaft render`.
"""

import contextlib

import machine_storms  # noqa: F401
import network_storms  # noqa: F401
import process_storms  # noqa: F401
from storm_list import STORMS


def with_real_pixels(name):
    told = STORMS[name]

    @contextlib.contextmanager
    def run(s):
        s.render()
        with told(s) as farm:
            yield farm

    STORMS[f"{name}, with real pixels"] = run


for _name in ("a tenth of all packets lost", "results come in another order", "partials on disk damaged", "redis killed at random"):
    with_real_pixels(_name)
