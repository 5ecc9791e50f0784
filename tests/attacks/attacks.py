#!/usr/bin/env python3
"""Attacks a farm of this machine in every way that a stranger, a user, a worker or a scene could, and says what held.

  tests/attacks/attacks.py                     all groups; exit code 1 if something did not hold
  tests/attacks/attacks.py --group TLS         one, or several; --list names them
  tests/attacks/attacks.py --write docs/measurements/attacks.md
"""

import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import attack_page
from attack_kit import BYSTANDER, Bystander, GROUPS, ROOT, Record, UNHELD

for module in ("framing", "routes", "slow", "users", "limits", "scene_texts", "archives", "assets", "stored_text", "workers", "tls", "scarce", "faults"):
    __import__(module)


def run(names, quick=False):
    """[(group, its record, seconds)]"""
    done = []
    Bystander.limit = UNHELD if quick else BYSTANDER
    for name in names:
        function = GROUPS[name][0]
        record, began = Record(quick), time.monotonic()
        with tempfile.TemporaryDirectory(prefix="lightshaft-attacks-", ignore_cleanup_errors=True) as folder:
            record.row = "the group as a whole"
            with record.expecting("it runs to its end"):
                function(record, pathlib.Path(folder))
        done.append((name, record, time.monotonic() - began))
        print(attack_page.told(*done[-1]), flush=True)
    return done


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--group", action="append", choices=GROUPS, metavar="GROUP")
    parser.add_argument("--quick", action="store_true", help="the selection that is a system test")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--write", metavar="PAGE")
    options = parser.parse_args()
    if options.list:
        print("\n".join(GROUPS))
        return 0
    if options.write and (options.group or options.quick):
        parser.error("a page is of all groups: --write goes without --group and --quick")

    began, load = time.monotonic(), os.getloadavg()
    commit = subprocess.run(["git", "describe", "--always", "--abbrev=8", "--exclude=*", "--dirty"], cwd=ROOT, capture_output=True, text=True).stdout.strip()
    names = options.group or [name for name, (_, quick, whole) in GROUPS.items() if (quick if options.quick else whole)]
    done = run(names, options.quick)
    wrong = sum(len(record.failures()) for _, record, _ in done)
    print(f"{sum(len(r.tries) for _, r, _ in done)} tries and {sum(len(r.faults) for _, r, _ in done)} faults, {wrong} did not hold, {time.monotonic() - began:.0f} s")
    if options.write:
        pathlib.Path(options.write).write_text(attack_page.page(done, commit, time.monotonic() - began, load), encoding="utf-8")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
