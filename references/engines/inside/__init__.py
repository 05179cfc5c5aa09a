"""What runs in the environments of engines: a file for each, which imports NumPy and the engine, and nothing of ours.

`prepare(given)` builds the engine's model from the plain numbers that `conservative.references.environments.plain_numbers`
describes, and from the settings; it returns a run. A run starts afresh each time it is called and returns attitudes, `q`
(n, 4), scalar first, or `R` (n, 3, 3), of the principal axes F, and rates, `w` (n, 3) in F or `w_W` in the world, rad/s, at
`given.steps`.
A function `renew` of the run, where it has one, is called before each timed call, and is in no time.
`NotImplementedError` with a reason says that this version of the engine does not have what is asked for.
"""
