"""Runs `lightshaft up` and `lightshaft join`: python3 FOLDER/lightshaft_command up ..."""

import pathlib
import sys

# Python puts this folder at the head of the path when it runs it; the package lies in the folder above.
if not __package__:
    sys.path[0] = str(pathlib.Path(__file__).resolve().parent.parent)

from lightshaft_command.command import run

sys.exit(run(sys.argv[1:]))
