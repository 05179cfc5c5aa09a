"""Recordings with a planted mistake, or none, whose answers are decided before `conservative verify` reads them.

Nothing here comes from the package or its verification: `motion.py` has its own equations, exact solution and integrators,
`worlds.py` the scenes, `mistakes.py` what programs and recorders do instead, `layouts.py` the files, and `decide.py` the
answers. `run.py` asks the command, and `tables.py` counts.
"""
