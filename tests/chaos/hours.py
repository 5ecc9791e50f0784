"""Hours of chaos: faults of every kind at once on one farm that five users share.

    tests/chaos/hours.py [--seed S] [--minutes M] [--workers N] [--record FILE] [--write PAGE]
    tests/chaos/hours.py --from FILE --write PAGE     makes the page again of what was recorded

Three coordinators with TLS on a real Redis and an S3 store, fake workers and two that render, jobs in proportion to the time (300 in two
hours). Ends with 1 if a finished job has another image than one undisturbed worker makes, a token opened what it must not, a job or
process was lost, or something was left behind or has grown. What is drawn (jobs, what users do to them, faults and their order) follows
from the seed; when things happen does not.
"""

import argparse
import hashlib
import json
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile
import threading
import time

from chaos_kit import ROOT
from hours_farm import Caller, Record, SharedFarm
from hours_faults import Storm
from hours_users import LARGEST, USERS, Strangers, Undisturbed, User, draw_tasks
from hours_page import page
from local_farm import wait_until
from soak import figures
from webhook_receiver import signed_by

PLANNED = {"jobs an hour": 150, "workers": 200, "of what the workers could": .3}  # that two hours have 300 jobs
NO_CONNECTION = ("06", "0A")  # TIME_WAIT and LISTEN in /proc/net/tcp
WAVE = 600.0  # seconds from one wave of jobs to the next
SHOWN = ("id", "owner", "state", "units_done", "units_total", "core_seconds", "queued_core_seconds", "priority", "spp")
COUNTED = re.compile(r"lightshaft_(units_freed_total|results_total|audits_total|workers_quarantined_total|tiles_discarded_total|workers\{|units_leased |leases |"
                     r"queued_core_seconds|webhook|redis|http_connections|http_event_streams|background_writes|results_)|process_(resident|open|threads|cpu)")


class Watch(threading.Thread):
    """Looks at everything, every few seconds, and writes it down."""

    def __init__(self, farm, every=5):
        super().__init__(daemon=True)
        self.farm, self.record, self.every, self.stopped = farm, farm.record, every, threading.Event()
        self.caller = Caller(farm, farm.admin_token)

    def coordinator(self, at):
        status, _, text = self.caller.try_ask(at, "GET", "/metrics", timeout=3)
        if status != 200:
            return {"answers": False}
        counted = {name: float(value) for name, _, value in (line.rpartition(" ") for line in text.decode().splitlines()) if COUNTED.match(name + " ")}
        status, _, jobs = self.caller.try_ask(at, "GET", "/api/v1/jobs", timeout=3)
        jobs = [[view[key] for key in SHOWN] for view in json.loads(jobs)["jobs"]] if status == 200 else []
        return {"answers": True, "counted": counted, "jobs": jobs}

    def quarantined(self, at):
        status, _, data = self.caller.try_ask(at, "GET", "/api/v1/workers", timeout=3)
        for worker in json.loads(data)["workers"] if status == 200 else []:
            if worker["activity"].startswith("quarantined") and worker["name"] not in self.farm.barred:
                self.farm.barred.add(worker["name"])
                self.record.write("quarantined", worker=worker["name"])
                if worker["name"] not in self.farm.liars:
                    self.record.wrong("an honest worker was quarantined", worker=worker["name"], why=worker["activity"])

    def processes(self):
        found, lines = {}, pathlib.Path("/proc/net/tcp").read_text().splitlines()[1:] + pathlib.Path("/proc/net/tcp6").read_text().splitlines()[1:]
        local = [int(line.split()[1].rpartition(":")[2], 16) for line in lines if line.split()[3] not in NO_CONNECTION]
        for name, process in [("abc"[n], c.coordinator.popen) for n, c in enumerate(self.farm.coordinators)] + \
                [(w.shown, w.popen) for w in self.farm.workers["steady"]] + [("redis", self.farm.redis.popen)]:
            try:
                found[name] = {"pid": process.pid, **figures(process.pid)}
            except (OSError, KeyError):
                pass  # it is dead now, or a child of it ended while it was looked at
        for name, coordinator in zip("abc", self.farm.coordinators):
            if name in found:  # workers keep a connection to coordinators that they have left
                found[name]["worker_connections"] = local.count(coordinator.grpc)
                found[name]["connections"] = local.count(coordinator.http) + local.count(coordinator.grpc)
        return found

    def look(self, kind="sample"):
        self.record.write(kind, alive=sum(w.size for w in self.farm.all_workers() if w.alive()), load=os.getloadavg()[0],
                          coordinators=[self.coordinator(at) for at in range(3)], processes=self.processes())

    def run(self):
        turn = 0
        while not self.stopped.wait(self.every):
            try:
                self.farm.look_after()
                self.look()
                if turn % 3 == 0:
                    for at in range(3):
                        self.quarantined(at)
            except Exception as error:
                self.record.wrong("the farm could not be looked after", error=repr(error))
            turn += 1


def are_there(farm, caller, workers):
    """Nearly all: those without work go from one coordinator to the next."""
    found = 0
    for at in range(3):
        status, _, data = caller.try_ask(at, "GET", "/api/v1/workers")
        found += sum(w["state"] == "connected" for w in json.loads(data)["workers"]) if status == 200 else 0
    return found >= .95 * workers


def until_they_are_there(farm, caller, workers):
    """Seconds. A machine that is short of time may never have nearly all of them at once: then with those that there are."""
    began = time.monotonic()
    try:
        wait_until(lambda: are_there(farm, caller, workers), "all workers have joined", 60)
    except AssertionError as why:
        farm.record.write("note", what="workers were slow to join", why=str(why))
    return round(time.monotonic() - began, 1)


def make_token(farm, role, user):
    body = json.dumps({"role": role, "user": user}).encode()
    return json.loads(farm.coordinators[0].request("POST", "/api/v1/tokens", body))["token"]


def taken_webhooks(farm):
    """Events that the receiver took, each with a right signature."""
    secrets = [(c.data / "webhook-secret").read_text().strip() for c in farm.coordinators]
    taken = {}
    while not farm.receiver.came.empty():
        _, headers, body, status = farm.receiver.came.get()
        if status == 200:
            taken.setdefault(json.loads(body)["job"]["id"], []).append(headers["Lightshaft-Event"])
            if not any(signed_by(secret, headers, body) for secret in secrets):
                farm.record.wrong("a webhook has a wrong signature", headers=headers)
    return taken


def what_is_left(farm, caller, users):
    """After the last job was removed and everything mended: nothing of a job is anywhere."""
    record = farm.record
    for at, coordinator in enumerate(farm.coordinators):
        def empty():
            status, _, data = caller.try_ask(at, "GET", "/api/v1/jobs")
            for view in json.loads(data)["jobs"] if status == 200 else []:
                record.write("left", job=view["id"], state=view["state"], owner=view["owner"], at=at)
                caller.try_ask(at, "DELETE", f"/api/v1/jobs/{view['id']}")
            return status == 200 and not json.loads(data)["jobs"]
        try:
            wait_until(empty, f"coordinator {at} has no job", 120)
        except AssertionError:
            record.wrong("jobs are left that cannot be removed", coordinator=at)
        try:
            wait_until(lambda: not any((coordinator.data / "jobs").iterdir()), "no folder of a job is left", 120)
        except AssertionError:
            record.wrong("folders of jobs are left", coordinator=at, folders=sorted(f.name for f in (coordinator.data / "jobs").iterdir())[:20])
        try:
            wait_until(lambda: b"\nlightshaft_webhooks_waiting 0\n" in caller.try_ask(at, "GET", "/metrics")[2], "the receiver has taken all", 400)
        except AssertionError:
            record.wrong("events wait for a receiver that takes them", coordinator=at)
    try:
        wait_until(lambda: not farm.redis.ask("KEYS", "lightshaft:job:*"), "Redis has no job", 120)
    except AssertionError:
        record.wrong("Redis has records of removed jobs", keys=farm.redis.ask("KEYS", "lightshaft:job:*").split()[:20])
    for key, data in farm.s3.objects.items():
        if hashlib.sha256(data).hexdigest() != key.rsplit("/", 1)[-1]:
            record.wrong("the store has an object that is not what its name says", key=key)
    if farm.s3.uploads:
        record.wrong("uploads in parts are left in the store", uploads=len(farm.s3.uploads))
    taken = taken_webhooks(farm)
    told_of_no_end = [t.id for user in users for t in user.finished if f"job.{t.ended}" not in taken.get(t.id, ())]
    if told_of_no_end:
        record.wrong("no webhook told of a job's end", jobs=told_of_no_end)
    record.write("webhooks", taken=sum(map(len, taken.values())), jobs=len(taken))


def run(arguments, folder, record):
    seconds, dice = 60 * arguments.minutes, random.Random(arguments.seed)
    count = max(10, round(PLANNED["jobs an hour"] * arguments.minutes / 60 * arguments.workers / PLANNED["workers"])) if not arguments.jobs else arguments.jobs
    handing_in, storming = .84 * seconds, .93 * seconds
    tasks = draw_tasks(arguments.seed, count, handing_in, min(WAVE, seconds / 2))
    fake_samples = sum(t.samples() for t in tasks if t.kind != "real")
    unit = PLANNED["of what the workers could"] * arguments.workers * handing_in / fake_samples
    with SharedFarm(folder, record, arguments.seed, arguments.workers, 2, unit) as farm:
        admin = Caller(farm, farm.admin_token)
        joined = until_they_are_there(farm, admin, arguments.workers + 2)
        tokens = {name: make_token(farm, "submit", name) for name in (*USERS, "keeper")}
        everybody = dict(tokens, read=make_token(farm, "read", "monitor"), admin=farm.admin_token, join=farm.coordinators[0].join_token, none="")
        undisturbed = Undisturbed(folder, farm)
        record.began = time.monotonic()
        record.write("begin", seed=arguments.seed, minutes=arguments.minutes, workers=arguments.workers, jobs=count, unit=unit, largest=LARGEST * unit, cores=os.cpu_count(),
                     joined=joined, left_out=farm.left_out, commit=commit(), audits=farm.audits, waves=min(WAVE, seconds / 2),
                     groups={group: sum(w.size for w in workers) for group, workers in farm.workers.items()})
        users = [User(farm, name, tokens[name], [t for t in tasks if t.user == name], undisturbed, dice.random(), handing_in) for name in USERS]
        farm.keeper = User(farm, "keeper", tokens["keeper"], [], undisturbed, dice.random(), handing_in)
        farm.keeper.stays = True
        watch, strangers = Watch(farm), Strangers(farm, users, everybody, dice.random())
        watch.look("quiet before")
        storm = Storm(farm, dice.random(), record.began + storming, arguments.faults)
        for thread in (undisturbed, watch, strangers, storm, farm.keeper, *users):
            thread.start()
        storm.join()
        record.write("storm ends")
        farm.keeper.stays = False
        for user in (*users, farm.keeper):
            user.join(max(0, record.began + seconds + arguments.patience - time.monotonic()))
            if user.is_alive():
                user.hurry.set()
                user.join(120)
                for task in (*user.tasks.values(), *user.todo):
                    record.wrong("a job has not ended in time", number=task.number, job=task.id, asked=task.asked)
        strangers.stopped.set()
        undisturbed.finish()
        record.write("strangers", tried=strangers.count, redirects=strangers.redirects)
        what_is_left(farm, admin, users)
        until_they_are_there(farm, admin, arguments.workers + 2)
        watch.stopped.set()
        watch.join()
        watch.look("quiet after")
        lied = len(farm.liars)
        record.write("end", right=undisturbed.right, other=undisturbed.wrong, liars=lied, found=len(farm.barred & farm.liars))


def commit():
    return subprocess.run(["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout.strip()


def read_options(words=None):
    parser = argparse.ArgumentParser()
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=5)
    parser.add_argument("--workers", type=int, default=200, help="that are fake")
    parser.add_argument("--jobs", type=int, default=0, help="instead of a number in proportion to time and workers")
    parser.add_argument("--faults", type=float, default=2.0, help="that begin in a minute")
    parser.add_argument("--patience", type=float, default=300, help="seconds after the end that jobs may still take")
    parser.add_argument("--record", default="", help="where to write what happens, a line of JSON each")
    parser.add_argument("--from", dest="recorded", default="", help="make the page of this record; nothing is run")
    parser.add_argument("--write", default="")
    return parser.parse_args(words)


def main():
    arguments = read_options()
    with tempfile.TemporaryDirectory(prefix="lightshaft-hours-", ignore_cleanup_errors=True) as folder:
        path = pathlib.Path(arguments.recorded or arguments.record or pathlib.Path(folder) / "record.jsonl")
        if not arguments.recorded:
            path.unlink(missing_ok=True)
            record = Record(path)
            try:
                run(arguments, pathlib.Path(folder), record)
            except Exception as error:
                record.wrong("the run broke off", error=repr(error))
                raise
        text, wrong = page(path)
    if arguments.write:
        pathlib.Path(arguments.write).write_text(text)
    else:
        print(text)
    for what in wrong:
        print(f"wrong: {what}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
