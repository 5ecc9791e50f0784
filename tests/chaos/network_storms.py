"""Storms between workers and coordinator: bad networks, and messages that are not what was sent.

Workers are fake: their pixels are a pure function of the unit, so any unit that is lost, doubled, swapped or folded out of order
changes the digest. What is random is drawn from the storm's seed.
"""

import contextlib

from chaos_kit import after
from meddler import Meddler
from storm_list import storm
from weather import Network


@contextlib.contextmanager
def divided_farm(s, inside=2, outside=0):
    with Network(s.dice.random()) as network, s.farm(host=network.host) as farm:
        for _ in range(inside):
            farm.fast_worker(within=network.inside)
        farm.fast_workers(outside)
        farm.wait_for_workers(inside + outside)
        farm.submit_storm()
        farm.until_share(s.dice.uniform(.05, .4))
        yield farm, network


@storm
def a_partition_of_some_workers(s):
    with divided_farm(s, inside=2, outside=1) as (farm, network):
        network.weather(loss=1)
        after(s.dice.uniform(2, 6))
        network.weather()
        yield farm


@storm
def a_partition_of_all_workers(s):
    with divided_farm(s) as (farm, network):
        network.weather(loss=1)
        after(s.dice.uniform(2, 6))
        network.weather()
        yield farm


@storm
def a_partition_one_way(s):
    with divided_farm(s) as (farm, network):
        network.weather(deaf=True)
        after(s.dice.uniform(2, 6))
        network.weather()
        yield farm


@storm
def a_tenth_of_all_packets_lost(s):
    with divided_farm(s) as (farm, network):
        network.weather(loss=.1)
        yield farm


@storm
def packets_late_doubled_and_out_of_order(s):
    with divided_farm(s) as (farm, network):
        network.weather(delay=.02, jitter=.05, doubled=.1)
        yield farm


@storm
def packets_damaged(s):
    with divided_farm(s) as (farm, network):
        network.weather(damaged=.05)
        yield farm


@storm
def half_open_connections(s):
    """Workers die behind a cut: no FIN, no RST ever comes, and they are still thought to be there."""
    with divided_farm(s) as (farm, network):
        network.weather(loss=1)
        for worker in farm.workers:
            worker.kill()
        after(1)
        network.weather()
        for _ in range(2):
            farm.fast_worker(within=network.inside)
        yield farm


# ---- messages ----

def meddled(name, **chances):
    def run(s):
        with s.farm() as farm, Meddler(s.folder, f"127.0.0.1:{farm.grpc}", s.dice.random(), **chances) as meddler:
            for _ in range(2):
                farm.fast_worker(coordinator=f"127.0.0.1:{meddler.port}")
            farm.fast_worker()
            farm.wait_for_workers(3)
            farm.submit_storm()
            yield farm
            assert any(meddler.done.values()), "no message was meddled with"
    run.__name__ = name
    storm(run)


meddled("results come twice", doubled=.5)
meddled("results come in another order", held=.5)
meddled("results cut short", cut=.3)
meddled("messages far too large", oversized=.02)
meddled("all of that together", doubled=.2, held=.2, cut=.1, oversized=.01)
meddled("leases and acknowledgements come twice", to_doubled=.5)
meddled("leases and acknowledgements come in another order", to_held=.5)
meddled("leases and acknowledgements cut short", to_cut=.02)
meddled("messages both ways doubled moved and cut", doubled=.2, held=.2, cut=.1, oversized=.01, to_doubled=.2, to_held=.2, to_cut=.01)
