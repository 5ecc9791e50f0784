"""The file in which a farm-up keeps what it has cost, and from which the next run continues."""

import json
import pathlib
from typing import Any

from lightshaft_command.farm_up import fields
from lightshaft_command.farm_up.costs import Ledger, Spending
from lightshaft_command.farm_up.engine import Unreadable
from lightshaft_command.files import write_file
from lightshaft_command.programs import Usage


def show(report: dict[str, Any]) -> str:
    return json.dumps(report, indent=2, sort_keys=True, ensure_ascii=False)


def write(file: pathlib.Path, report: dict[str, Any]) -> None:
    write_file(file, show(report) + "\n")


def go_on_from(file: pathlib.Path, farm: str, spending: Spending) -> Ledger:
    """Loads the costs in the report of an earlier run; those in `spending` are kept if there is none."""
    try:
        text = file.read_text(errors="replace")
    except OSError:
        return Ledger()
    try:
        kept = json.loads(text)
    except (ValueError, RecursionError):
        kept = None
    if not isinstance(kept, dict):
        raise Usage(f"{file} is no report of `farm up`: give another --report")
    name = fields.text(kept, "name")
    if name != farm:
        raise Usage(f"{file} is the report of '{name}': give another --report or this --name")
    try:
        ledger = Ledger.from_json(kept.get("ledger"))
        if "spending" in kept:
            spending.go_on_from(kept["spending"])
    except Unreadable as problem:
        raise Usage(f"{file}: {problem}") from None
    return ledger
