"""What `lightshaft farm up` decides and counts: its state machines under a clock that the test sets, without programs or farms."""

import os
import random
import signal
import sys

import pytest
from local_farm import ROOT

sys.path.insert(0, str(ROOT / "python" / "src"))
from lightshaft_command.farm_up import loop  # noqa: E402
from lightshaft_command.farm_up.costs import CORE_HOUR, Budgets, JobCost, Ledger, Spending, WorkerCost  # noqa: E402
from lightshaft_command.farm_up.demand import Ours, demand_of  # noqa: E402
from lightshaft_command.farm_up.engine import Unreadable, Worker  # noqa: E402
from lightshaft_command.farm_up.scaler import Demand, Limits, Scaler  # noqa: E402


class World:
    """A scaler; the test sets the time, the demand and the engine's list of workers."""

    def __init__(self, **limits):
        self.limits = Limits(**{"farm": "f", "most_workers": 8, "threads": 2, "finish_in": 100, **limits})
        self.scaler = Scaler(self.limits)
        self.now, self.spent = 0, 0
        self.demand, self.workers = Demand(), []

    def look(self, after=0):
        self.now += after
        return self.scaler.decide(self.demand, self.workers, self.spent, self.now)

    def work(self, core_seconds, open_jobs=1):
        self.demand.open_jobs, self.demand.queued_core_seconds = open_jobs, core_seconds

    def no_work(self):
        self.work(0, open_jobs=0)

    def run(self, id, idle=False):
        self.workers.append(Worker(id, "running", 10, self.limits.threads))
        self.demand.joined.add(f"f-{id}")
        if idle:
            self.demand.idle.add(f"f-{id}")

    def wait(self, id, state="waiting"):
        self.workers.append(Worker(id, state, 0, 2))


def ids(workers):
    return [w.id for w in workers]


def test_starts_nothing_without_jobs():
    assert World().look().start == 0


@pytest.mark.parametrize("core_seconds, started", [
    (900, 5),  # 9 threads for 100 s: 5 workers of 2 threads
    (0, 1),  # the cost is unknown until a worker has measured it
    (1e9, 8),  # no more than it may
])
def test_starts_as_many_workers_as_finish_the_queue_in_time(core_seconds, started):
    w = World()
    w.work(core_seconds)

    assert w.look().start == started


def test_counts_workers_that_wait_and_those_of_others():
    w = World()
    w.work(900)
    w.demand.other_threads = 3  # of 9 threads, 6 are left: 3 workers
    w.run("1")
    w.wait("2")

    assert w.look().start == 1


def test_starts_no_more_where_the_forecast_says_that_more_do_not_help():
    w = World()
    w.work(900)
    w.demand.more_helps = False
    assert w.look().start == 1

    w.run("1")
    assert w.look().start == 0


def test_drains_idle_workers_after_a_while_down_to_none():
    w = World()
    w.run("1", idle=True)
    w.run("2", idle=True)

    assert not w.look().drain
    assert not w.look(after=59).drain
    assert ids(w.look(after=1).drain) == ["1", "2"]
    assert not w.look(after=1).drain, "each is asked once"


def test_a_worker_that_got_work_in_between_begins_to_wait_anew():
    w = World()
    w.run("1", idle=True)
    w.look()
    w.demand.idle.clear()
    w.look(after=50)
    w.demand.idle.add("f-1")

    assert not w.look(after=20).drain
    assert ids(w.look(after=60).drain) == ["1"]


def test_does_not_drain_a_busy_worker_because_the_queue_is_shorter():
    w = World()
    w.work(100)
    w.run("1")
    w.run("2")
    w.look()

    assert not w.look(after=1000).drain


def test_withdraws_workers_that_still_wait_when_the_queue_is_shorter():
    w = World()
    w.work(100)
    w.run("1")
    w.wait("2")

    assert ids(w.look().drain) == ["2"]


def test_ends_a_worker_that_does_not_drain():
    w = World()
    w.run("1", idle=True)
    w.look()
    w.look(after=60)

    assert not w.look(after=119).kill
    assert ids(w.look(after=1).kill) == ["1"]


def test_asks_again_for_a_drain_that_the_engine_did_not_pass_on():
    w = World()
    w.run("1", idle=True)
    w.look()
    w.scaler.drain_failed(w.look(after=60).drain)

    assert ids(w.look(after=5).drain) == ["1"]


def test_waits_before_it_replaces_a_worker_that_the_engine_never_started():
    w = World()
    w.work(100)
    w.wait("1", state="stuck")

    actions = w.look()

    assert ids(actions.drain) == ["1"] and actions.start == 0
    assert w.look(after=5).start == 1


def test_replaces_a_worker_at_once_that_the_engine_does_not_start_again():
    w = World()
    w.work(100)
    w.run("1")
    w.look()
    w.workers = [Worker("1", "stuck", 0, 2)]
    w.demand.joined.clear()

    actions = w.look()

    assert ids(actions.drain) == ["1"] and actions.start == 1


def test_waits_longer_after_each_worker_that_ended_without_joining():
    w = World()
    w.work(100)

    def fails(id):
        w.workers = [Worker(id, "running", 1, 2)]
        w.look()
        w.workers = []

    fails("1")
    assert w.look().start == 0
    assert w.look(after=5).start == 1
    fails("2")
    assert w.look().start == 0
    assert w.look(after=5).start == 0
    assert "2 starts of workers in a row failed" in w.look().why
    assert w.look(after=5).start == 1


def test_the_pause_after_failed_starts_has_a_limit():
    w = World()
    w.work(100)
    for _ in range(100):
        w.scaler.start_failed(w.now)

    assert w.look(after=599).start == 0
    assert w.look(after=1).start == 1


def test_waits_after_workers_that_ended_before_they_were_listed():
    w = World()
    w.work(100)
    w.look()
    w.scaler.started(["1", "2"])

    actions = w.look()

    assert actions.start == 0 and "1 starts of workers in a row failed" in actions.why
    assert w.look(after=5).start == 1


def test_replaces_a_worker_that_had_joined_at_once():
    w = World()
    w.work(100)
    w.run("1")
    w.look()
    w.workers = []  # its machine was lost
    w.demand.joined.clear()

    assert w.look().start == 1


def test_starts_only_what_the_budget_lets_run():
    w = World(drain_seconds=40, budget_core_seconds=500)  # each worker needs 2 x (60 + 40 + 2 x 5) of it
    w.work(1e6)
    assert w.look().start == 2

    w.spent = 301
    none = w.look()
    assert none.start == 0 and "the budget allows no more workers" in none.why


def test_drains_all_while_the_budget_still_pays_for_it():
    w = World(drain_seconds=40, budget_core_seconds=500)
    w.work(1e6)
    w.run("1")
    w.run("2")  # draining both takes 2 x 2 x (40 + 2 x 5) = 200 core seconds
    w.spent = 299
    assert not w.look().drain

    w.spent = 300
    actions = w.look()

    assert ids(actions.drain) == ["1", "2"] and actions.start == 0


def test_drains_all_where_no_open_job_has_something_left_of_its_budget():
    w = World()
    w.work(1000)
    w.run("1")
    w.demand.unpaid_jobs = 1
    assert not w.look().drain, "another job pays for it"

    w.no_work()
    actions = w.look()

    assert ids(actions.drain) == ["1"] and actions.start == 0 and "used up" in actions.why


def test_ending_drains_all_starts_nothing_and_kills_what_does_not_end():
    w = World()
    w.work(1e6)
    w.run("1")
    w.look()

    actions = w.scaler.end(w.workers, w.now)

    assert ids(actions.drain) == ["1"] and actions.start == 0 and not actions.kill
    assert ids(w.scaler.end(w.workers, w.now + 120).kill) == ["1"]


@pytest.mark.parametrize("seed", range(50))
def test_keeps_its_limits_whatever_the_engine_does(seed):
    """The engine loses workers at random. There are never more than allowed, the cost stays within the budget, and all end without jobs."""
    chance = random.Random(seed)
    w = World(most_workers=5, idle_seconds=30, drain_seconds=40, budget_core_seconds=20_000)
    ledger, draining, count = Ledger(), set(), 0

    def percent(share):
        return chance.randrange(100) < share

    for step in range(660):
        work = 5000 if step < 600 and percent(80) else 0
        w.now += 5
        w.work(work) if work else w.no_work()
        w.demand.joined, w.demand.idle = set(), set()
        for worker in w.workers:
            if worker.state == "running":
                worker.seconds += 5
            elif percent(50):
                worker.state = "running"
            if worker.state == "running" and percent(2):
                worker.state, worker.seconds = "waiting", 0
            if worker.state == "running":
                w.demand.joined.add(f"f-{worker.id}")
                if not work:
                    w.demand.idle.add(f"f-{worker.id}")
        w.workers = [x for x in w.workers if not percent(60 if x.id in draining else 1)]
        ledger.observe(w.workers, 5)
        w.spent = ledger.core_seconds()
        actions = w.look()
        draining.update(ids(actions.drain))
        w.workers = [x for x in w.workers if x not in actions.kill]
        for _ in range(actions.start):
            count += 1
            w.wait(str(count))
        assert sum(x.id not in draining for x in w.workers) <= 5
        assert w.spent <= 20_000
    assert not w.workers


# ---- the ledger: what workers reserve at the engine ----


def running(id, seconds, cores):
    return Worker(id, "running", seconds, cores)


def test_the_ledger_sums_what_workers_reserve():
    ledger = Ledger()
    ledger.observe([running("1", 10, 4), running("2", 5, 1), Worker("3", "waiting", 0, 4)], 0)

    assert ledger.core_seconds() == 45 and ledger.started_count == 2


def test_a_worker_that_is_gone_is_charged_up_to_the_look_that_missed_it():
    ledger = Ledger()
    ledger.observe([running("1", 10, 4)], 0)
    ledger.observe([], 5)

    assert ledger.core_seconds() == 60


def test_a_worker_that_ended_before_it_was_listed_is_charged_too():
    ledger = Ledger()
    ledger.observe([], 0)
    ledger.started(["1", "2"], 4)
    ledger.observe([running("2", 3, 4)], 5)

    assert ledger.core_seconds() == 5 * 4 + 3 * 4 and ledger.started_count == 2


def test_a_requeued_worker_begins_a_second_run():
    ledger = Ledger()
    ledger.observe([running("1", 100, 1)], 0)
    ledger.observe([running("1", 3, 1)], 5)

    assert ledger.core_seconds() == 100 + 5 + 3 and ledger.started_count == 2


def test_the_ledger_goes_on_from_its_file():
    ledger = Ledger()
    ledger.observe([running("1", 10, 2), running("2", 10, 1)], 0)
    ledger.observe([running("1", 20, 2)], 10)

    again = Ledger.from_json(ledger.to_json())
    again.observe([running("1", 90, 2)], 0)

    assert again.core_seconds() == 90 * 2 + 20 and again.started_count == 2


@pytest.mark.parametrize("value", [None, {}, {"started": 2}, {"ended_core_seconds": 1, "running": 2}, {"ended_core_seconds": 1, "running": {"1": {}}}])
def test_the_ledger_refuses_a_file_without_a_sum(value):
    with pytest.raises(Unreadable):
        Ledger.from_json(value)


# ---- the spending: what jobs and users have cost ----


def job(id, owner, core_seconds, name="fog"):
    return JobCost(id, name, owner, core_seconds)


def test_spending_counts_from_the_first_report_on():
    spending = Spending()
    spending.observe([job("j-1", "ann", 100)], [WorkerCost("w-1", "slurm", 50)])
    spending.observe([job("j-1", "ann", 130), job("j-2", "bob", 20, "bath")], [WorkerCost("w-1", "slurm", 80), WorkerCost("w-2", "others", 20)])

    assert (spending.of_job("j-1"), spending.of_job("j-2"), spending.of_user("ann")) == (30, 20, 30)
    assert spending.report() == {
        "by_job": {"j-1": {"name": "fog", "user": "ann", "core_hours": 30 / CORE_HOUR}, "j-2": {"name": "bath", "user": "bob", "core_hours": 20 / CORE_HOUR}},
        "by_user": {"ann": 30 / CORE_HOUR, "bob": 20 / CORE_HOUR},
        "by_engine": {"slurm": 30 / CORE_HOUR, "others": 20 / CORE_HOUR}}


def test_spending_keeps_what_the_coordinator_forgets():
    spending = Spending()
    spending.observe([], [])
    spending.observe([job("j-1", "ann", 100)], [WorkerCost("w-1", "slurm", 100)])
    spending.observe([], [])
    spending.observe([job("j-2", "ann", 7)], [WorkerCost("w-1", "slurm", 107)])

    assert spending.of_user("ann") == 107
    assert spending.report()["by_engine"] == {"slurm": 107 / CORE_HOUR}, "it was the same worker"


def test_results_that_are_rendered_again_after_a_crash_are_not_counted_twice_until_they_cost_more():
    spending = Spending()
    spending.observe([], [])
    for seconds in (100, 60, 90, 110):
        spending.observe([job("j-1", "ann", seconds)], [])

    assert spending.of_job("j-1") == 110


def test_a_worker_that_was_started_again_goes_on_with_its_sum():
    spending = Spending()
    spending.observe([], [WorkerCost("w-1", "slurm", 40)])
    for seconds in (100, 3, 5):
        spending.observe([], [WorkerCost("w-1", "slurm", seconds)])

    assert spending.report()["by_engine"] == {"slurm": (60 + 5) / CORE_HOUR}


def test_budgets_hold_for_each_job_for_each_user_and_for_named_users():
    spending = Spending(Budgets(job=50, user=80, users={"ann": 200, "": 10}))
    spending.observe([], [])
    spending.observe([job("j-1", "ann", 50), job("j-2", "ann", 10), job("j-3", "bob", 30), job("j-4", "", 10)], [])

    assert [spending.left_of_job(id) for id in ("j-1", "j-2", "unheard of")] == [0, 40, 50]
    assert [spending.left_of_user(owner) for owner in ("ann", "bob", "")] == [140, 50, 0]
    assert Spending().left_of_user("bob") == float("inf")


@pytest.mark.parametrize("value", [None, {}, {"jobs": 1, "workers": 2}, {"jobs": {"j-1": {"before": 0}}, "workers": {}}, {"jobs": {}, "workers": {"w-1": 5}}])
def test_spending_refuses_a_file_without_sums(value):
    with pytest.raises(Unreadable):
        Spending().go_on_from(value)


@pytest.mark.parametrize("seed", range(50))
def test_spending_counts_every_second_once_whatever_happens(seed):
    """Jobs and workers appear, end, restart and are forgotten by the coordinator, and `farm up` restarts from its file at any time.

    Every core second is counted once, and a user's sum is that of the user's jobs.
    """
    chance = random.Random(seed)

    def percent(share):
        return chance.randrange(100) < share

    spending, jobs, workers, rendered = Spending(), {}, {}, 0
    spending.observe([], [])
    for step in range(400):
        if percent(10):
            jobs[f"j-{step}"] = job(f"j-{step}", chance.choice("abc"), 0)
        if percent(10):
            workers[f"w-{step}"] = WorkerCost(f"w-{step}", "slurm" if percent(50) else "others", 0)
        for worker in workers.values():
            if percent(3):
                worker.core_seconds = 0
            if jobs:
                seconds = 1 + chance.randrange(9)
                chance.choice(list(jobs.values())).core_seconds += seconds
                worker.core_seconds += seconds
                rendered += seconds
        spending.observe(jobs.values(), workers.values())
        if percent(20):
            spending.observe([], [])  # the coordinator has just restarted
        if percent(5):
            again = Spending()
            again.go_on_from(spending.to_json())
            spending = again
        if percent(5) and jobs:
            jobs.pop(min(jobs))
    report = spending.report()
    # Sums of whole seconds are exact. Dividing each of some hundred sums by 3600 has a relative rounding error of 2^-53.
    assert sum(line["core_hours"] for line in report["by_job"].values()) * CORE_HOUR == pytest.approx(rendered, rel=1e-12)
    assert sum(report["by_user"].values()) * CORE_HOUR == pytest.approx(rendered, rel=1e-12)
    # If a worker restarts and renders at least as much as before until the next report, its restart is not noticed. So the sum by
    # engines may be too small, never too large.
    assert sum(report["by_engine"].values()) * CORE_HOUR <= rendered * (1 + 1e-12)


# ---- the demand: what the coordinator answers ----

OURS = Ours("f", "an engine")


def listed_job(id, owner, spent, queued):
    return {"id": id, "owner": owner, "state": "running", "core_seconds": spent, "queued_core_seconds": queued}


def forecast(state, eta, more):
    return {"state": state, "eta_seconds": eta, "eta_with_more": more}


def listed_worker(name, state, job):
    return {"name": name, "state": state, "threads": 4, "job": job}


def test_the_demand_is_read_from_the_coordinators_answers():
    jobs = [listed_job("j-1", "", 0, 100), listed_job("j-2", "", 0, 23.5), forecast("paused", 9, None), forecast("done", None, None), 7]
    workers = [listed_worker("f-1", "connected", "j-1"), listed_worker("f-2", "connected", None), listed_worker("f-3", "lost", None), listed_worker("desk", "connected", None)]

    demand = demand_of({"jobs": jobs}, {"workers": workers}, OURS, Spending())

    assert demand == Demand(open_jobs=2, queued_core_seconds=123.5, more_helps=True, other_threads=4, joined={"f-1", "f-2"}, idle={"f-2"})


@pytest.mark.parametrize("jobs, helps", [
    ([forecast("running", 5, None)], False),
    ([forecast("running", 5, {"seconds": 3})], True),
    ([forecast("running", 5, None), forecast("queued", None, None)], True),
    ([forecast("queued", None, None)], True),
])
def test_more_workers_do_not_help_if_every_forecast_says_so(jobs, helps):
    assert demand_of({"jobs": jobs}, {}, OURS, Spending()).more_helps == helps


def test_the_demand_leaves_out_jobs_whose_budget_is_used_up_and_asks_for_no_more_than_budgets_pay():
    spending = Spending(Budgets(job=100, users={"ann": 150}))
    demand_of({"jobs": []}, {}, OURS, spending)

    demand = demand_of({"jobs": [listed_job("j-1", "bob", 100, 5000),  # used up
                                 listed_job("j-2", "bob", 40, 5000),  # 60 are left of the job's budget
                                 listed_job("j-3", "ann", 30, 5000),  # 70 are left of the job's budget;
                                 listed_job("j-4", "ann", 10, 5000)]}, {}, OURS, spending)  # 110 are left of ann's budget

    assert (demand.open_jobs, demand.unpaid_jobs, demand.queued_core_seconds) == (3, 1, 60 + 110)


# ---- the loop ----


def test_a_signal_during_a_check_starts_no_workers(tmp_path):
    class Asked:
        def jobs(self):
            os.kill(os.getpid(), signal.SIGINT)
            return {"jobs": [listed_job("j-1", "", 0, 100)]}

        def workers(self):
            return {"workers": []}

    class NoWorkers:
        version = "an engine"

        def workers(self):
            return []

        def start(self, count):
            raise AssertionError("workers are started")

    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        settings = loop.Settings(Limits(farm="f", most_workers=1, threads=1), Budgets(), tmp_path / "report.json")
        loop.FarmUp(Asked(), NoWorkers(), settings).run(loop.Pause())
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
