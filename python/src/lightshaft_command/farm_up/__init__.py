"""`lightshaft farm up`: runs as many workers as a farm's jobs need, until the user stops it.

An engine (Slurm, ssh, Docker or Kubernetes) starts and ends the workers. All runs under the same --name, earlier ones and the
current one, form one farm-up. To drain a worker is to ask it to deliver its results and end.
"""
