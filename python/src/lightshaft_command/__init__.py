"""The parts of the command `lightshaft` that are written in Python: `up` and `join`. They use Python's standard library only.

The program `lightshaft` (cli/) starts this folder as a program. In a wheel (deploy/wheel.sh) it is the other way round: the
command `lightshaft` begins here, and starts the programs that the wheel brings.
"""
