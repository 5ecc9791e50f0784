"""The page of the hours of chaos, made of the record of a run and of nothing else."""

import collections
import json
import statistics

from soak import growth

SETTLES = 20.0  # seconds after its end in which a fault still costs time: workers come back, leases pass
LOCALITY = 5.0  # seconds of the whole farm's time that a job may have above its share for its loaded world (docs/design/scheduling.md)
LEASE = 2.0  # seconds of work in a lease, or one unit
# At most, of the last third against the middle one, or of the end against the beginning: gRPC keeps more threads while a machine is busy.
MORE_MEMORY, MORE_FILES, MORE_THREADS = 1.15, 12, 6
UNKNOWN = "not looked at: the run did not come so far"
LOST = ("worker lost", "deadline passed", "failed", "returned", "replaced by a newer stream", "worker quarantined")
SECOND = ("equal", "differing", "unwanted")
# Faults that can make a coordinator lose what it has done of a job: taken over, damaged, or discarded since a worker lied.
OF_JOBS = ("coordinator", "redis", "disk of", "clock of", "a worker lies")
# Faults that cost no unit: they delay uploads, takeovers, events, or nothing.
HARMLESS = ("s3", "receiver", "strangers")
# the columns of a job in a sample, as hours.py writes them
ID, OWNER, STATE, DONE, TOTAL, CORE, QUEUED, PRIORITY, SPP = range(9)


class Run:
    """A record, sorted."""

    def __init__(self, path):
        self.lines = [json.loads(line) for line in open(path, encoding="utf-8")]
        self.by = collections.defaultdict(list)
        watched = {line["job"] for line in self.lines if line["kind"] == "liar"}
        for line in self.lines:
            if line["kind"] == "wrong" and line.get("job") in watched and "no third one agrees" in (line.get("error") or ""):
                continue  # it is right to fail: hours_users.py, RIGHT_TO_FAIL
            self.by[line["kind"]].append(line)
        self.begin = self.by["begin"][0] if self.by["begin"] else None
        self.end = self.by["end"][0] if self.by["end"] else None
        self.samples = self.by["sample"]
        self.submitted = {line["job"]: line for line in self.by["submitted"]}
        self.faults = self._faults()

    def _faults(self):
        """(name, begin, end, what is told of it) of each."""
        ends = {line["number"]: line["t"] for line in self.by["fault ends"]}
        last = self.lines[-1]["t"]
        return [(line["name"], line["t"], ends.get(line["number"], last), line) for line in self.by["fault begins"]]

    def under_way(self, begin, end):
        return [(name, told.get("coordinator")) for name, from_, to, told in self.faults if from_ < end and to + SETTLES > begin]


def could(fault, cause, at):
    """Whether this fault can have cost units for this cause at this coordinator."""
    name, coordinator = fault
    if name.startswith(HARMLESS):
        return False
    if cause == "lost with its coordinator":
        return any(word in name for word in OF_JOBS) and coordinator in (None, at)
    return coordinator in (None, at)


def counted(sample, name, label, value):
    return sample["counted"].get(f'lightshaft_{name}{{{label}="{value}"}}', 0) if sample["answers"] else None


def workers_of(coordinator):
    return counted(coordinator, "workers", "state", "connected") or 0


def grown(before, after):
    """Of a counter that begins at 0 when its coordinator is started again."""
    return after - before if after >= before else after


class Ledger:
    """Where the workers' time went, between two looks each."""

    def __init__(self, run):
        self.run = run
        self.rows = []  # (begin, end, units accepted, audits, {(why, coordinator): units again}, predicted seconds of work that waited)
        last = [None] * 3  # the last look at which each coordinator answered
        most, place = {}, {}  # units done of each job; the coordinator that had it
        before = None
        for sample in run.samples:
            again, work, audits = collections.Counter(), 0.0, 0.0
            for at, now in enumerate(sample["coordinators"]):
                if not now["answers"]:
                    continue
                if last[at]:
                    def delta(name, label, value, old=last[at], new=now):
                        return grown(counted(old, name, label, value), counted(new, name, label, value))
                    for cause in LOST:
                        again[cause, at] += delta("units_freed_total", "cause", cause)
                    audited = delta("audits_total", "verdict", "equal") + delta("audits_total", "verdict", "differ")
                    again["second result", at] += max(0, sum(delta("results_total", "verdict", v) for v in SECOND) - audited)
                    audits += audited
                    work += delta("results_total", "verdict", "accepted")
                last[at] = now
                for job in now["jobs"]:
                    name, done = job[ID], job[DONE]
                    if done < most.get(name, 0) and (place[name] != at or sample["coordinators"][place[name]] is now):
                        again["lost with its coordinator", place[name]] += most[name] - done
                    if name not in most or place[name] != at or done != most[name]:
                        most[name], place[name] = done, at
            if before is not None:
                queued = sum(job[QUEUED] for c in sample["coordinators"] if c["answers"] for job in c["jobs"] if job[STATE] in ("running", "queued"))
                self.rows.append((before["t"], sample["t"], work, audits, again, queued))
            before = sample
        units = sum(line["units"] for line in run.by["ended"] if line["state"] == "done")
        self.unit = sum(line["core_seconds"] for line in run.by["ended"] if line["state"] == "done") / max(1, units)

    def waits(self, row):
        """Whether there was work for all workers."""
        return row[5] > self.run.begin["workers"] * self.unit

    def by_fault(self):
        """{fault, or None: [workers' seconds while work waited, of them lost, units again]}; what several faults can have cost is shared out evenly."""
        table = collections.defaultdict(lambda: [0.0, 0.0, 0.0])
        for row in self.rows:
            begin, end, work, audits, again, _ = row
            faults = self.run.under_way(begin, end)
            if self.waits(row):
                had = (end - begin) * self.run.begin["workers"]
                guilty = [f for f in faults if not f[0].startswith(HARMLESS)] or [(None, None)]
                for name, _ in guilty:
                    table[name][0] += had / len(guilty)
                    table[name][1] += (had - (work + audits) * self.unit) / len(guilty)
            for (cause, at), units in again.items():
                guilty = [f for f in faults if could(f, cause, at)] or [(None, None)]
                for name, _ in guilty:
                    table[name][2] += units / len(guilty)
        return table

    def causes(self):
        total = collections.Counter()
        for row in self.rows:
            for (cause, _), units in row[4].items():
                total[cause] += units
        return total


# ---- fairness ----

def contending(coordinator, run, least):
    """{user: core seconds given} of users who have work for all workers of this coordinator."""
    given, waiting = collections.Counter(), collections.Counter()
    for job in coordinator["jobs"]:
        told = run.submitted.get(job[ID])
        if not told or told["what"] not in ("plain", "bundle", "blobs"):
            continue
        width, height = map(int, told["size"].split("x"))
        total = width * height * job[SPP] * run.begin["unit"]
        begun = job[CORE] > 0
        given[job[OWNER]] += total - job[QUEUED] if begun and job[STATE] in ("running", "paused") else job[CORE]
        if job[STATE] in ("running", "queued") and job[PRIORITY] == 0:
            waiting[job[OWNER]] += job[QUEUED]
    return {user: given[user] for user in waiting if waiting[user] > least}


def fairness(run):
    """[(seconds that two users had work for all workers of a coordinator, difference of what they were given a worker)]: of every two users
    and every time in which that coordinator was not started again and no job of theirs came, went or moved."""
    found, open_ = [], {}  # (coordinator, users): [begin, last, difference at the begin, least, most, workers, jobs]
    unit = run.begin["largest"]

    def close(key):
        begin, last, _, least, most, workers, _ = open_.pop(key)
        if last - begin >= 20:
            found.append((last - begin, max(abs(least), abs(most)) / max(1, workers)))

    for sample in run.samples:
        for at, now in enumerate(sample["coordinators"]):
            users = contending(now, run, workers_of(now) * 2 * unit) if now["answers"] and workers_of(now) > 10 else {}
            jobs = {user: frozenset(job[ID] for job in now["jobs"] if job[OWNER] == user) for user in users} if users else {}
            pairs = {(at, a, b) for a in users for b in users if a < b}
            for key in [k for k in open_ if k[0] == at and (k not in pairs or open_[k][6] != (jobs[k[1]], jobs[k[2]]))]:
                close(key)
            for key in pairs:
                difference = users[key[1]] - users[key[2]]
                if key not in open_:
                    open_[key] = [sample["t"], sample["t"], difference, 0, 0, workers_of(now), (jobs[key[1]], jobs[key[2]])]
                row = open_[key]
                row[1], row[5] = sample["t"], max(row[5], workers_of(now))
                row[3], row[4] = min(row[3], difference - row[2]), max(row[4], difference - row[2])
    for key in list(open_):
        close(key)
    return found


def fair_bound(run):
    """Seconds a worker: each of two users may be ahead by a lease and by the preference for loaded worlds, once at the begin and once at the end."""
    return 2 * (LOCALITY + max(LEASE, run.begin["largest"]))


# ---- what may not grow ----

def processes(run):
    """{process: [figures]} of those that lived all the time."""
    series = collections.defaultdict(list)
    for sample in run.samples:
        for name, what in sample["processes"].items():
            series[name].append(what)
    return {name: all_ for name, all_ in series.items() if len({one["pid"] for one in all_}) == 1 and len(all_) >= 9}


def idle_files(sample):
    """(name, open files without connections to users and workers, threads, memory) of each coordinator. A connection of a worker is two
    descriptors: that of its socket, and that by which it is handed to gRPC."""
    def connections(process):
        return process.get("connections", 0) + process.get("worker_connections", process.get("connections", 0))

    return [(name, process["files"] - connections(process), process["threads"], process["memory"])
            for name in "abc" if (process := sample["processes"].get(name))]


def growth_table(run):
    lines, wrong = [], []
    for name, all_ in sorted(processes(run).items()):
        figures = growth([{key: one[key] for key in ("memory", "files", "threads")} for one in all_])
        cells = []
        for key, (before, after) in figures.items():
            scale = 2 ** 20 if key == "memory" else 1
            cells.append(f"{before / scale:.0f} → {after / scale:.0f}")
            # A coordinator's files and threads go with its connections, which its quiet figures tell apart.
            most = {"memory": before * MORE_MEMORY, "files": before + MORE_FILES, "threads": before + MORE_THREADS}[key]
            if after > most and (key == "memory" or name not in "abc"):
                wrong.append(f"{key} of {name} has grown from {before} to {after}")
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return lines, wrong


def quiet_table(run):
    lines, wrong = [], []
    before, after = (idle_files(run.by[kind][0]) if run.by[kind] else [] for kind in ("quiet before", "quiet after"))
    for (name, files, threads, memory), (_, files2, threads2, memory2) in zip(before, after):
        lines.append(f"| {name} | {files:.0f} → {files2:.0f} | {threads} → {threads2} | {memory / 2**20:.0f} → {memory2 / 2**20:.0f} |")
        if files2 > files + MORE_FILES or threads2 > threads + MORE_THREADS:
            wrong.append(f"coordinator {name} has {files2} files and {threads2} threads, and had {files} and {threads}")
    return lines, wrong


# ---- the page ----

def figure(value):
    return f"{value:,.0f}" if abs(value) >= 10 else f"{value:.1f}"


def fault_table(run, ledger):
    count = collections.Counter(name for name, *_ in run.faults)
    lasted = collections.defaultdict(list)
    for name, begin, end, _ in run.faults:
        lasted[name].append(end - begin)
    table = ledger.by_fault()
    had, lost, _ = table.get(None, (0, 0, 0))
    usual = lost / had if had else 0
    lines = []
    for name in sorted(count, key=lambda n: -table[n][2]):
        had, lost, again = table[name]
        seconds = (lost - usual * had) / run.begin["workers"]
        lines.append(f"| {name.replace('redis', 'Redis').replace('s3 ', 'S3 ')} | {count[name]} | {statistics.median(lasted[name]):.0f} | {figure(again)} | {figure(again / count[name])} | {figure(seconds)} |")
    nothing = table.get(None, (0, 0, 0))
    lines.append(f"| *none under way* | - | - | {figure(nothing[2])} | - | {figure(0)} |")
    return lines, usual, table


PAGE = """# Hours of chaos

> Shown with fake workers (the real worker program, whose renderer makes pixels up) beside two that render, and at most 8 open jobs of a user at a time. Workers that render alone, and thousands of jobs open at once: [open-jobs.md](open-jobs.md).

`/usr/bin/python3 tests/chaos/hours.py --seed {seed} --minutes {minutes:g} --workers {workers} --write PAGE` made this page, commit {commit}, on {cores} cores, with other work on the machine (load average {load:.0f} in the mean, at most {most_load:.0f}).{broken} Faults of every kind came at once on one farm: three coordinators with TLS that share a real Redis and an S3 store (`tests/support/s3_server.py`), {workers} fake workers and two that render, {jobs} jobs of five users in waves of {waves:.0f} minutes, {audits} % of the results audited. {faults} faults began, {at_once:.1f} were under way on average, at most {most}. Jobs, what users do to them, and the faults with their order follow from the seed; when something happens does not.

## What must hold

| what | held |
|---|---|
| a finished job has the image of one worker to which nothing happens; where pixels are rendered, that of `lightshaft render` | {hashes} |
| every job comes to the end that its user wanted | {ends} |
| a change that a coordinator acknowledged (cancel, extension, priority, removal) is still so after every fault | {kept} |
| no token opens what it must not | {tokens} |
| a worker that lies is found, an honest one never | {liars} |
| nothing of a removed job is left in lists, folders, Redis; every object of the store is what its name says | {left} |
| a webhook tells of every end, with a right signature | {webhooks} |
| no process ends by itself; memory, files and threads do not grow | {processes} |
| two users who both have work for all workers of a coordinator get the same, within a lease for each worker and the preference for loaded worlds | {fair} |

{violations}
Users handed in {kinds}{less}; they {acts}. Beside that: {notes}.

## Time lost

*Units again*: units that a worker had in hand when it was lost, drained, too slow or failed, second results, and what was done of jobs that another coordinator took over, or whose partials were damaged; audits are not in it. *Seconds*: of the whole farm while work waited, beyond the {usual:.0%} that it loses with no fault under way (workers without work at one coordinator while another has some, the ends of jobs). A fault counts as under way until {settles:.0f} s after its end. What several that are under way can have cost is shared out evenly between them, so rows of rare faults have much of their neighbours in them; faults of the store, of receivers and of strangers cost no units and count for nothing.

| fault | times | lasted (s) | units again | a time | seconds |
|---|---|---|---|---|---|
{fault_table}

{units:,} units were wanted and {again:,} rendered again or freed ({share:.1%}): {causes}. {explained:.1%} of the latter while a fault was under way. A unit takes {unit:.2f} s on average. Work waited {waited:.0f} of {minutes_run:.0f} minutes.

## Growth

Medians of the middle and of the last third of the time, of the processes that nobody kills (memory in MiB). The first coordinator is frozen, cut off and flooded like the others, but never killed.

| process | memory | files | threads |
|---|---|---|---|
{growth_table}

Before the first and after the last job (files without those of connections to users and workers):

| coordinator | files | threads | memory |
|---|---|---|---|
{quiet_table}

## What was not there

{left_out}
"""


def spans(run):
    """(mean, most) number of faults under way."""
    edges = sorted([(begin, 1) for _, begin, _, _ in run.faults] + [(end, -1) for _, _, end, _ in run.faults])
    if not edges:
        return 0, 0
    most = now = 0
    for _, step in edges:
        now += step
        most = max(most, now)
    return sum(end - begin for _, begin, end, _ in run.faults) / max(1, edges[-1][0] - edges[0][0]), most


def listed(counter):
    return ", ".join(f"{count} {what}" for what, count in counter.most_common()) or "none"


def page(path):
    run = Run(path)
    if not run.begin or len(run.samples) < 2:
        return "The run did not come far.\n", [str(line) for line in run.by["wrong"]] or ["it did not begin"]
    ledger = Ledger(run)
    table, usual, shares = fault_table(run, ledger)
    grown_lines, grown_wrong = growth_table(run)
    quiet_lines, quiet_wrong = quiet_table(run)
    windows, bound = fairness(run), fair_bound(run)
    unfair = [f"two users differed by {difference:.1f} s a worker in {seconds:.0f} s" for seconds, difference in windows if difference > bound]
    wrong = [f"{line['what']}: " + json.dumps({k: v for k, v in line.items() if k not in ('kind', 'what')}) for line in run.by["wrong"]]
    derived = grown_wrong + quiet_wrong + unfair + ([] if run.end else ["the run did not come to its end"])

    def held(*words):
        return not any(line["what"].startswith(words) for line in run.by["wrong"])

    hashes = collections.Counter((line["what"], line["equal"]) for line in run.by["hash"])
    ended = collections.Counter(line["state"] for line in run.by["ended"])
    strangers = run.by["strangers"][0] if run.by["strangers"] else {"tried": {}, "redirects": 0}
    liars = run.by["liar"]
    again = ledger.causes()
    all_again = sum(again.values())
    none = shares.get(None, (0, 0, 0))[2]
    units = sum(line["units"] for line in run.by["ended"])
    at_once, most = spans(run)
    waited = sum(row[1] - row[0] for row in ledger.rows if ledger.waits(row))
    notes = collections.Counter(line["what"] for line in run.by["note"])
    strays = collections.Counter("job whose taking was not answered" for line in run.by["stray"])
    taken = run.by["webhooks"][0] if run.by["webhooks"] else {"taken": 0, "jobs": 0}
    text = PAGE.format(
        **{key: run.begin[key] for key in ("seed", "minutes", "workers", "commit", "cores", "jobs", "audits")}, waves=run.begin["waves"] / 60,
        load=statistics.mean(line["load"] for line in run.samples), most_load=max(line["load"] for line in run.samples),
        broken="" if run.end else " It did not come to its end.", faults=len(run.faults), at_once=at_once, most=most,
        hashes=f"{sum(n for (_, equal), n in hashes.items() if equal)} of {sum(hashes.values())} ({listed(collections.Counter({kind: n for (kind, equal), n in hashes.items() if equal}))})",
        ends=f"{sum(ended.values())} ended: {listed(ended)}" + ("" if held("a job", "nobody") else "; **not all as wanted**"),
        tokens=f"{sum(strangers['tried'].values()):,} tries, none did ({listed(collections.Counter(strangers['tried']))}; {strangers['redirects']} of the first were sent on by a coordinator "
               "that does not have the job to the one that refused it)" if held("a token") and run.end else "**some did**" if run.end else UNKNOWN,
        liars=f"{sum(line['found'] for line in liars)} of {len(liars)} found, {sum(not line['found'] and line['ended'] == 'failed' for line in liars)} told of with the evidence where no third "
              f"worker could decide; honest ones quarantined: {sum(line['what'].startswith('an honest') for line in run.by['wrong'])}",
        kept=("yes" if held("acknowledged and forgotten") else "**not all**") if run.end else UNKNOWN,
        left=("yes" if held("jobs are left", "folders", "Redis has", "the store", "uploads") else "**no**") if run.end else UNKNOWN,
        webhooks=f"{taken['taken']:,} events of {taken['jobs']} jobs" + ("" if held("a webhook", "no webhook", "events") else "; **not all**") if run.end else UNKNOWN,
        processes="yes" if held("a worker ended", "a coordinator") and not grown_wrong + quiet_wrong else "**no**",
        fair=(f"{len(windows)} times of two users, {sum(s for s, _ in windows) / 60:.0f} minutes together: they differed by {statistics.median(d for _, d in windows):.1f} s a worker "
              f"(median; most {max(d for _, d in windows):.1f}, bound {bound:.1f})" if windows else "no two users had work for all workers of a coordinator for 20 s"),
        violations="".join(f"- {what}\n" for what in [*wrong, *derived]) or "Nothing that must hold was found not to hold.\n",
        less=(f" ({count} fewer than planned: a user has at most eight jobs under way)" if (count := sum(line["jobs"] for line in run.by["not handed in"])) else ""),
        kinds=listed(collections.Counter(line["what"] for line in run.submitted.values())), acts=listed(collections.Counter(line["what"] for line in run.by["act"])),
        notes=listed(notes + strays), usual=usual, settles=SETTLES, fault_table="\n".join(table), units=units, again=round(all_again),
        share=all_again / max(1, units), causes=listed(collections.Counter({k: round(v) for k, v in again.items() if v})),
        explained=1 - none / all_again if all_again else 1, unit=ledger.unit, waited=waited / 60, minutes_run=run.lines[-1]["t"] / 60,
        growth_table="\n".join(grown_lines), quiet_table="\n".join(quiet_lines),
        left_out="\n".join(f"- {why}" for why in run.begin["left_out"]) or "Nothing was left out: every fault could be made on this machine.")
    return text, wrong + derived
