"""What a run of the attacks says: on the terminal, and as docs/measurements/attacks.md."""

import os

from attack_kit import BYSTANDER

PAGE = """# Attacks

`/usr/bin/python3 tests/attacks/attacks.py --write docs/measurements/attacks.md` wrote this page at commit {commit}, in {minutes:.0f} minutes on {cores} cores, while other work ran on the machine (load average {before:.1f} at the start, {after:.1f} at the end): times are upper bounds.

Every attack is against a farm of its own on this machine: real coordinators and workers, real sockets. A try holds if the answer is what it should be (refused with a status below 500, or read as the one thing it says), if it comes within the limits of [SECURITY.md](../../SECURITY.md), and if others are served meanwhile and afterwards. "Another user waits no longer than a second" is judged as {bystander:.1f} s in this run, for that load. {tries} tries, {held} held.

| group | what was tried | tries | held |
|---|---|---|---|
{table}
{wrong}
## Faults that were once found

A review of commit 54967dbd found nineteen faults. *Before* is its figure, *today* what the same attack comes to now. Where a test of the repository makes the same attack, it is named.

| | attack | before | today |
|---|---|---|---|
{faults}

{left_out}"""


def told(name, record, seconds):
    lines = [f"== {name}: {sum(t.held for t in record.tries)} of {len(record.tries)} tries held, {seconds:.0f} s"]
    lines += [f"   NOT HELD: {t.row}: {t.label}: {t.detail}" for t in record.tries if not t.held]
    lines += [f"   {'' if held else 'NOT HELD: '}{number} {what}: before {before}; today {today}" for number, what, before, today, held in record.faults]
    lines += [f"   left out: {what}" for what in record.left_out]
    return "\n".join(lines)


def cell(text):
    return text.replace("|", "\\|").replace("\n", " ")


def page(done, commit, seconds, load):
    table, wrong, faults, left_out = [], [], [], []
    for name, record, _ in done:
        table += [f"| {name} | {cell(row)} | {tries} | {held} |" for row, tries, held in record.rows()]
        wrong += [f"- {name}, {cell(t.row)}: {cell(t.label)}: {cell(t.detail)}" for t in record.tries if not t.held]
        faults += [f"| {number} | {cell(what)} | {cell(before)} | {cell(today)}{'' if held else ' **did not hold**'} |" for number, what, before, today, held in record.faults]
        left_out += [f"- {name}: {what}" for what in record.left_out]
    tries = [t for _, record, _ in done for t in record.tries]
    return PAGE.format(commit=commit, minutes=seconds / 60, cores=os.cpu_count(), before=load[0], after=os.getloadavg()[0], bystander=BYSTANDER, tries=f"{len(tries):,}",
                       held=f"{sum(t.held for t in tries):,}", table="\n".join(table), faults="\n".join(faults),
                       wrong="\nDid not hold:\n\n" + "\n".join(wrong) + "\n" if wrong else "",
                       left_out="Left out on that machine:\n\n" + "\n".join(left_out) + "\n" if left_out else "")
