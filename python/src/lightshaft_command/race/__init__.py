"""`lightshaft compare`: races integrators of a scene, error against time. bench/race.py races other programs by the same parts.

An entrant is an integrator (or a program) that takes part. It renders the scene once per seed; each of these runs is a lane. The
lanes of one seed take turns. The program `lightshaft` renders lanes and measures pictures (`lightshaft race-lane` and `race-tool`).
"""
