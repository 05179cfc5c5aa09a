"""Solvers of differential equations as methods: heyoka and SciPy, on the equations of motion themselves."""
