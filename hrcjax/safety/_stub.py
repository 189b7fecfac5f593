import jax.numpy as jnp
import jax
from hrcjax.numerics import safe_sqrt
def least_change(qd, A, limit, iterations=16):
    n = jnp.sum(A*A,-1)+1e-9
    lam = jnp.zeros_like(limit)
    u = qd
    for _ in range(iterations):
        v = (A@u - limit)/n
        dl = jnp.maximum(v, -lam)
        score = jnp.abs(dl)*jnp.sqrt(n)
        pick = jax.nn.one_hot(jnp.argmax(score), len(limit), dtype=qd.dtype)
        step = jnp.sum(pick*dl)
        lam = lam + pick*step
        u = u - step*(pick@A)
    a = A@u
    over = a > limit+2e-3
    return u*jnp.min(jnp.where(over,(limit+2e-3)/jnp.where(over,a,1),1.))
def path_speed(t, A, limit):
    a = A@t
    over = a>1e-6
    return jnp.min(jnp.where(over, limit/jnp.where(over,a,1.), 1e3))
def surface_limit(d, brake, margin):
    return safe_sqrt(2*brake*jnp.maximum(d-margin,0))
