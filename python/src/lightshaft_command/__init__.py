"""The parts of the command `lightshaft` that are written in Python. They use only Python's standard library.

The program `lightshaft` (cli/) runs this folder as a program. In a wheel (deploy/wheel.sh) the command `lightshaft`
begins here instead, and starts the programs that the wheel contains.
"""
