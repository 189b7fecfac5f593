"""The closed loop in NumPy, SciPy and C MuJoCo, one episode after another: speed baseline and test oracle.

Algorithm, parameters and rates are those of `hrcjax.sim`; without JAX, in double precision.
"""
