"""The faults of the hours of chaos: a deck in which each is at least once, shuffled anew by the seed whenever it is used up. A fault is a
generator over its farm: what it does up to its `yield` begins it (what it yields is written down), and what is after that mends it."""

import contextlib
import os
import random
import signal
import socket
import threading
import time

from chaos_kit import flip_bytes
from hours_farm import wait
from hours_users import Task

FAULTS = {}  # name: (function, times in a deck)


class Busy(Exception):
    """What it would happen to is in another fault's hands."""


def fault(times=1):
    def remember(function):
        FAULTS[function.__name__.replace("_", " ")] = function, times
        return function
    return remember


# ---- workers ----

TAKING = threading.Lock()
MORTAL = ("fake", "cut", "meddled", "network", "watched", "crash")


@contextlib.contextmanager
def taken(farm, dice, most, groups=MORTAL):
    """Some workers that live, and that no other fault has: processes of altogether some `most` workers."""
    with TAKING:
        free = [w for group in groups for w in farm.workers.get(group, []) if w not in farm.away and w.alive()]
        if not free:
            raise Busy
        dice.shuffle(free)
        some, wanted = [], dice.randint(1, most)
        while free and sum(w.size for w in some) < wanted:
            some.append(free.pop())
        farm.away |= set(some)
    try:
        yield some
    finally:
        for worker in some:
            worker.resume()
            if not worker.alive():
                worker.start()
        farm.away -= set(some)


@fault(3)
def workers_killed(farm, dice):
    with taken(farm, dice, 20) as some:
        for worker in some:
            worker.kill()
        yield {"workers": sum(w.size for w in some)}
        wait(dice.uniform(0, 15))


@fault(2)
def workers_frozen(farm, dice):
    with taken(farm, dice, 15) as some:
        for worker in some:
            worker.stop()
        yield {"workers": sum(w.size for w in some)}
        wait(dice.uniform(3, 45))


@fault(2)
def workers_drained_by_SIGTERM(farm, dice):
    with taken(farm, dice, 10) as some:
        for worker in some:
            worker.signal(signal.SIGTERM)
        yield {"workers": sum(w.size for w in some)}
        for worker in some:
            try:
                code = worker.wait(60)
            except Exception:
                code = None
                worker.kill()
            if code != 0:
                farm.record.write("drain", worker=worker.shown, code=code, said=worker.output()[-300:])


@fault()
def slow_workers(farm, dice):
    with taken(farm, dice, 5, ("fake",)) as some:
        usual = {w: list(w.args) for w in some}
        try:
            for worker in some:
                worker.terminate()
                worker.args[worker.args.index("--fake-sample-seconds") + 1] = str(5 * farm.unit)
                worker.start()
            yield {"workers": sum(w.size for w in some)}
            wait(dice.uniform(40, 90))
        finally:
            for worker in some:
                worker.kill()
                worker.args = usual[worker]


@fault()
def real_worker_killed_and_its_cache_damaged(farm, dice):
    with taken(farm, dice, 1, ("real",)) as some:
        for worker in some:
            worker.kill()
            for file in (farm.coordinators[0].folder / "cache" / worker.name).rglob("*"):
                if file.is_file() and file.stat().st_size > 0:
                    flip_bytes(file, dice)
        yield {"workers": 1}
        wait(dice.uniform(0, 10))


@fault()
def real_worker_frozen(farm, dice):
    with taken(farm, dice, 1, ("real",)) as some:
        for worker in some:
            worker.stop()
        yield {"workers": 1}
        wait(dice.uniform(5, 40))


# ---- coordinators ----

@contextlib.contextmanager
def held(farm, dice, numbers):
    number = dice.choice(numbers)
    if not farm.busy[number].acquire(blocking=False):
        raise Busy
    try:
        yield number
    finally:
        farm.busy[number].release()


@contextlib.contextmanager
def dead(farm, dice, numbers=(1, 2), by=signal.SIGKILL):
    """The first coordinator is frozen and cut off, but never killed: whether it grows is looked at over the whole time."""
    with held(farm, dice, numbers) as number:
        farm.down.add(number)
        try:
            process = farm.coordinators[number].coordinator
            process.signal(by)
            code = process.wait(60)
            if code != (0 if by == signal.SIGTERM else -signal.SIGKILL):
                farm.record.wrong("a coordinator did not end as it was told", coordinator=number, code=code)
            yield number
        finally:
            try:
                farm.start(number)
            finally:
                farm.down.discard(number)


@fault(2)
def coordinator_killed_and_back_at_once(farm, dice):
    with dead(farm, dice) as number:
        yield {"coordinator": number}


@fault(2)
def coordinator_killed_and_taken_over(farm, dice):
    with dead(farm, dice) as number:
        yield {"coordinator": number}
        wait(dice.uniform(8, 25))


@fault()
def coordinator_ended_by_SIGTERM(farm, dice):
    with dead(farm, dice, by=signal.SIGTERM) as number:
        yield {"coordinator": number}


@fault()
def coordinator_killed_and_its_partials_damaged(farm, dice):
    with dead(farm, dice) as number:
        files = [f for f in (farm.coordinators[number].data / "jobs").rglob("*") if f.is_file() and f.stat().st_size > 0]
        some = dice.sample(files, min(len(files), 6))
        for file in some:
            if dice.random() < .5:
                with open(file, "r+b") as whole:  # like flip_bytes, of files too large to be read at once
                    place = dice.randrange(file.stat().st_size)
                    whole.seek(place)
                    byte = whole.read(1)
                    whole.seek(place)
                    whole.write(bytes([byte[0] ^ 1 << dice.randrange(8)]))
            else:
                os.truncate(file, dice.randrange(file.stat().st_size))
        yield {"coordinator": number, "files": len(some)}


@contextlib.contextmanager
def frozen(farm, dice):
    with held(farm, dice, (0, 1, 2)) as number:
        farm.coordinators[number].coordinator.stop()
        try:
            yield number
        finally:
            farm.coordinators[number].coordinator.resume()


@fault()
def coordinator_frozen_for_a_moment(farm, dice):
    with frozen(farm, dice) as number:
        yield {"coordinator": number}
        wait(dice.uniform(1, 3.5))


@fault(2)
def coordinator_frozen_until_others_took_its_jobs(farm, dice):
    with frozen(farm, dice) as number:
        yield {"coordinator": number}
        wait(dice.uniform(10, 25))


@fault()
def clock_of_a_coordinator_jumps_by_days(farm, dice):
    if not farm.clock:
        raise Busy
    farm.clock.write_text("+3d")
    yield {"coordinator": 2}
    wait(dice.uniform(5, 30))
    farm.clock.write_text("+0")


@fault()
def disk_of_a_coordinator_full(farm, dice):
    if not farm.disk:
        raise Busy
    with held(farm, dice, (1,)) as number:  # not while it is dead: where it cannot write it does not start
        farm.disk.fill()
        yield {"coordinator": number}
        try:
            wait(dice.uniform(3, 10))
        finally:
            farm.disk.free()


# ---- Redis ----

REDIS = threading.Lock()


@contextlib.contextmanager
def redis_held():
    if not REDIS.acquire(blocking=False):
        raise Busy
    try:
        yield
    finally:
        REDIS.release()


@fault(2)
def redis_killed_and_empty(farm, dice):
    with redis_held():
        (farm.redis.folder / "dump.rdb").unlink(missing_ok=True)
        farm.redis.kill()
        yield {}
        wait(dice.uniform(0, 10))
        farm.redis.start()


@fault()
def redis_frozen(farm, dice):
    with redis_held():
        farm.redis.freeze()
        yield {}
        wait(dice.uniform(2, 12))
        farm.redis.resume()


@fault()
def redis_comes_back_older(farm, dice):
    with redis_held():
        farm.redis.ask("SAVE")
        wait(dice.uniform(2, 10))
        farm.redis.kill()
        yield {}
        farm.redis.start()


@fault(2)
def one_coordinator_cut_off_from_redis(farm, dice):
    with redis_held():
        number = dice.randrange(3)
        loud = dice.random() < .5
        farm.lines[number].cut(loud)
        yield {"coordinator": number, "loud": loud}
        wait(dice.uniform(2, 15))
        farm.lines[number].mend()


# ---- the store of blobs ----

@fault(2)
def s3_refuses(farm, dice):
    farm.s3.refuse = [503] * 1_000_000
    yield {}
    wait(dice.uniform(3, 20))
    farm.s3.refuse = []


@fault()
def s3_breaks_off(farm, dice):
    farm.s3.cut = dice.randint(3, 10)
    farm.s3.forget_ends = 2
    for number in (1, 2):  # so that there is something to fetch
        for copy in (farm.coordinators[number].data / "blobs").glob("??/*"):
            copy.unlink(missing_ok=True)
    yield {}
    wait(dice.uniform(5, 20))
    farm.s3.cut = farm.s3.forget_ends = 0


# ---- networks and messages ----

WEATHER = threading.Lock()


def weather(name, times=1, least=5, most=25, **what):
    def run(farm, dice):
        if not farm.network or not WEATHER.acquire(blocking=False):
            raise Busy
        try:
            farm.network.weather(**what)
            yield {"workers": sum(w.size for w in farm.workers["network"])}
            wait(dice.uniform(least, most))
        finally:
            farm.network.weather()
            WEATHER.release()
    run.__name__ = name
    fault(times)(run)


weather("network_of_some_workers_cut", loss=1)
weather("network_of_some_workers_one_way", deaf=True)
weather("a_tenth_of_some_workers_packets_lost", most=60, loss=.1)
weather("packets_late_doubled_and_out_of_order", most=60, delay=.02, jitter=.05, doubled=.1)
weather("packets_damaged", most=40, damaged=.05)


@fault(2)
def lines_of_some_workers_cut(farm, dice):
    lines, loud = dice.sample(farm.worker_lines, dice.randint(1, 3)), dice.random() < .5
    for line in lines:
        line.cut(loud)
    yield {"workers": sum(w.size for w in farm.workers["cut"]), "loud": loud}
    wait(dice.uniform(2, 20))
    for line in lines:
        line.mend()


@fault(2)
def messages_doubled_moved_and_cut(farm, dice):
    meddler = farm.meddler
    meddler.chances = dict(doubled=.3, held=.2, cut=.1, oversized=.01, to_doubled=.3, to_held=.2)
    meddler.cuts_left = 2
    before = dict(meddler.done)
    yield {"workers": sum(w.size for w in farm.workers["meddled"])}
    wait(dice.uniform(20, 60))
    meddler.chances = dict.fromkeys(meddler.chances, 0)
    farm.record.write("meddled", **{k: meddler.done[k] - before[k] for k in before})


# ---- clients ----

@fault()
def requests_without_a_right(farm, dice):
    """Half requests, garbage, and connections that say nothing, at both ports of all coordinators."""
    sent = (b"", b"GET / HTTP/1.1\r\n\r\n", b"\x16\x03\x01\x02", b"\x16" + b"\xff" * 600, os.urandom(4096))
    held_open = []
    for coordinator in farm.coordinators:
        for port in (coordinator.http, coordinator.grpc):
            for what in sent * 3:
                with contextlib.suppress(OSError):
                    held_open.append(socket.create_connection(("127.0.0.1", port), timeout=5))
                    held_open[-1].sendall(what)
    yield {"connections": len(held_open)}
    wait(dice.uniform(5, 30))
    for connection in held_open:
        connection.close()


@fault()
def receiver_of_webhooks_refuses(farm, dice):
    farm.receiver.statuses[:] = [503, 500, 302] * 100_000
    yield {}
    wait(dice.uniform(5, 25))
    farm.receiver.statuses.clear()


# ---- a worker that lies ----

@fault()
def a_worker_lies(farm, dice):
    """It takes part in a job of its own kind alone, until it is found: what it gives to a job that ends before is in that job's image, as
    docs/design/scheduling.md says. So that job is large enough that audits find it for certain, nearly."""
    task = Task(len(farm.liars), farm.keeper.name_, 0, "watched", "512x384", 64, 77, [])
    name = f"liar-{len(farm.liars)}"
    farm.liars.add(name)
    farm.keeper.hand_in(task)
    if not task.id:
        raise Busy
    farm.liar_found[task.id] = True
    liar = farm.add("liars", name, "--fake-sample-seconds", farm.unit / 4, "--tags", "watched", "--fake-fault", "wrong",
                    coordinator=",".join(f"127.0.0.1:{c.grpc}" for c in farm.coordinators))
    yield {"workers": 1, "job": task.id}
    end = time.monotonic() + 900
    while time.monotonic() < end and name not in farm.barred and not task.ended:
        wait(2)
    farm.liar_found[task.id] = name in farm.barred
    farm.away.add(liar)
    liar.kill()
    farm.workers["liars"].remove(liar)
    farm.record.write("liar", name=name, job=task.id, found=name in farm.barred, ended=task.ended)


class Storm(threading.Thread):
    """Faults, several at once, from now until `ends`; each minute has a quieter part in which none begins."""

    def __init__(self, farm, seed, ends, rate=2.0, slot=60.0):
        super().__init__()
        self.farm, self.dice, self.ends, self.rate, self.slot = farm, random.Random(seed), ends, rate, slot
        self.deck, self.under_way, self.stopped = [], [], threading.Event()

    def draw(self):
        if not self.deck:
            self.deck = [name for name, (_, times) in FAULTS.items() for _ in range(times)]
            self.dice.shuffle(self.deck)
        return self.deck.pop()

    def make(self, name, number, dice):
        record, began, told = self.farm.record, time.monotonic(), None
        story = FAULTS[name][0](self.farm, dice)
        try:
            told = next(story)
            record.write("fault begins", name=name, number=number, **told)
            next(story, None)
        except Busy:
            record.write("fault left out", name=name, number=number)
            return
        except Exception as error:
            record.wrong("a fault could not be made or mended", name=name, error=repr(error))
        finally:
            story.close()
        record.write("fault ends", name=name, number=number, lasted=round(time.monotonic() - began, 2))

    def run(self):
        number = 0
        while not self.stopped.is_set() and time.monotonic() < self.ends:
            count = max(1, round(self.rate * self.slot / 60 * self.dice.uniform(.6, 1.4)))
            begins = sorted(self.dice.uniform(0, .55 * self.slot) for _ in range(count))
            slot = time.monotonic()
            for at in begins:
                if self.stopped.wait(max(0, slot + at - time.monotonic())):
                    break
                number += 1
                thread = threading.Thread(target=self.make, args=(self.draw(), number, random.Random(self.dice.random())))
                thread.start()
                self.under_way.append(thread)
            self.stopped.wait(max(0, slot + self.slot - time.monotonic()))
        for thread in self.under_way:
            thread.join()

