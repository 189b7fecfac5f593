"""The closed loop in plain NumPy, SciPy and C MuJoCo, one episode after another: baseline of speed, oracle of tests.

The algorithm, its numbers and its rates are those of `hrcjax.sim`; no JAX runs in it. Double precision throughout.
"""
