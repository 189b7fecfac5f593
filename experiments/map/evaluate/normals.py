"""Normals and curvatures against those of analytic bodies: of noisy samples, and of a map made of noisy images."""

from collections.abc import Callable
from functools import cache

import jax
import jax.numpy as jnp
import numpy as np

from hrcjax.field import FieldParams, fit, surface_normal
from hrcjax.geom.cloud import Cloud
from hrcjax.geom.shape import capsule_point_distance, plane_distance, sphere_distance
from hrcjax.map import Level, fit_surface, map_surface
from hrcjax.map.nearest import POINTS
from hrcjax.map.surface import RATIO

from .accuracy import Measures
from .families import Case
from .queries import times_seen, truth
from .solids import World, torus_distance
from .survey import LAYOUT, Survey, map_points

NOISE = 0.002
"""Standard deviation of each coordinate of a sample [m]."""
ASKED = 256
"""Query points of each body."""
DRAWN = 400_000
PLACES = 4096
ROUND = 2.0
"""Least principal curvature of a surface that counts as round [1/m]."""


def _vector(*values: float) -> jax.Array:
    return jnp.asarray(values, jnp.float32)


def _torus(ring: float, tube: float) -> Callable[[jax.Array], jax.Array]:
    def distance(x: jax.Array) -> jax.Array:
        return torus_distance(x, _vector(0, 0, 0), _vector(0, 0, 1), jnp.float32(ring), jnp.float32(tube))

    return distance


BODIES: dict[str, Callable[[jax.Array], jax.Array]] = {
    "plane": lambda x: plane_distance(x, _vector(0, 0, 1), 0.0),
    "sphere_100": lambda x: sphere_distance(x, _vector(0, 0, 0), 0.1),
    "sphere_200": lambda x: sphere_distance(x, _vector(0, 0, 0), 0.2),
    "sphere_300": lambda x: sphere_distance(x, _vector(0, 0, 0), 0.3),
    "cylinder_100": lambda x: capsule_point_distance(x, _vector(0, 0, -2), _vector(0, 0, 2), 0.1),
    "cylinder_200": lambda x: capsule_point_distance(x, _vector(0, 0, -2), _vector(0, 0, 2), 0.2),
    "torus_200_100": _torus(0.2, 0.1),
    "torus_250_120": _torus(0.25, 0.12),
}
"""Signed distance of each body; radii in millimetres in its name."""


def shape_at(distance: Callable[[jax.Array], jax.Array], x: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
    """The nearest point of a surface to x [m], its outward normal [1] and principal curvatures there [1/m].

    On the surface the Hessian of a signed distance has the principal curvatures and 0 as eigenvalues.
    """
    d, n = jax.value_and_grad(distance)(x)
    foot = x - d * n
    values = jnp.linalg.eigvalsh(
        jax.hessian(distance)(foot) + 1e4 * n[:, None] * n[None, :]
    )  # the normal's eigenvalue is the last
    return foot, n, values[:2][::-1]


@cache
def _sampled():
    def one(points: jax.Array, mask: jax.Array, x: jax.Array, view: jax.Array, scale: jax.Array):
        r2 = jnp.where(mask, jnp.sum((points - x) ** 2, axis=1), jnp.inf)
        _, best = jax.lax.top_k(-r2, POINTS)
        cloud = Cloud(points[best], mask[best])
        hessian = surface_normal(fit(cloud, FieldParams(scale)), x, view)
        return fit_surface(cloud, x, view, scale), hessian.normal

    return jax.jit(
        lambda points, mask, x, view, scale: jax.lax.map(
            lambda pair: one(points, mask, pair[0], pair[1], scale), (x, view), batch_size=64
        )
    )


def degrees(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angles between unit vectors (n, 3)."""
    return np.degrees(np.arccos(np.clip(np.sum(a * b, axis=1), -1, 1)))


def _sample(name: str, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """One point of a body in each voxel, with normals and curvatures."""
    draw = np.random.default_rng(seed)
    x = draw.uniform(-0.4, 0.4, (DRAWN, 3)).astype(np.float32)
    body = BODIES[name]
    x = x[np.abs(np.asarray(jax.jit(jax.vmap(body))(jnp.asarray(x)))) < 0.01][:60_000]
    foot, n, k = (np.asarray(v) for v in jax.jit(jax.vmap(lambda x: shape_at(body, x)))(jnp.asarray(x)))
    voxel = np.floor((foot + 0.0123) / LAYOUT.spacing).astype(int) @ np.array([1 << 20, 1 << 10, 1])
    _, first = np.unique(voxel, return_index=True)
    return foot[first], n[first], k[first]


def sampled(noise: float, seed: int = 0) -> dict[str, Measures]:
    """Of each body: errors of normals [degrees] and of curvatures, relative to the larger one [1], and the share refused [1]."""
    found = {}
    for number, name in enumerate(BODIES):
        points, n, k = _sample(name, seed + number)
        draw = np.random.default_rng(100 + seed + number)
        points = points + noise * draw.normal(size=points.shape).astype(np.float32)
        inner = np.nonzero(np.max(np.abs(points), axis=1) < 0.36)[0]
        if name == "plane" or name.startswith("cylinder"):
            inner = np.nonzero(np.max(np.abs(points), axis=1) < 0.24)[0]
        index = np.resize(draw.permutation(inner), ASKED)
        full = np.zeros((PLACES, 3), np.float32)
        full[: len(points)] = points
        x, view = points[index], points[index] + 0.5 * n[index]
        arrays = (full, np.arange(PLACES) < len(points), x, view.astype(np.float32))
        scale = jnp.asarray(RATIO * LAYOUT.spacing, jnp.float32)
        got, hessian = jax.tree.map(np.asarray, _sampled()(*(jnp.asarray(v) for v in arrays), scale))
        ok = got.reasons == 0
        found[name] = {"refused": float(1 - np.mean(ok))}
        if not ok.any():
            continue
        for kind, normal in (("normal", got.normal), ("hessian", hessian)):
            off = degrees(normal, n[index])[ok]
            found[name] |= {f"{kind}_median": float(np.median(off)), f"{kind}_p95": float(np.percentile(off, 95))}
        if name != "plane":
            off = np.abs(got.curvatures - k[index])[ok] / np.max(np.abs(k[index]), axis=1)[ok, None]
            found[name] |= {"curvature_median": float(np.median(off)), "curvature_p95": float(np.percentile(off, 95))}
    return found


@cache
def _mapped():
    def program(levels: tuple[Level, ...], x: jax.Array, view: jax.Array):
        return jax.lax.map(lambda pair: map_surface(LAYOUT, levels, pair[0], pair[1]), (x, view), batch_size=64)

    return jax.jit(program)


def world_curvatures(world: World, p: np.ndarray, step: float = 1e-3) -> np.ndarray:
    """Principal curvatures of a world's surface at points on it (point, 3): (point, 2) [1/m], the greater first.

    From differences of the exact gradient over +-`step` [m]: its Jacobian has them and 0 as eigenvalues.
    """
    ends = [truth(world, (p + s * step * np.eye(3)[a]).astype(np.float32))[1] for a in range(3) for s in (1, -1)]
    jacobian = np.stack([(ends[2 * a] - ends[2 * a + 1]) / (2 * step) for a in range(3)], axis=2)
    n = truth(world, p)[1]
    jacobian = (jacobian + np.swapaxes(jacobian, 1, 2)) / 2 + 1e4 * n[:, :, None] * n[:, None, :]
    return np.linalg.eigvalsh(jacobian)[:, 1::-1]


def mapped(case: Case, seen: Survey, seed: int = 0) -> Measures:
    """The same at points of a map of round bodies, from the nearest camera, where the length scale can resolve them.

    The noise is that of the images, averaged by the map. Points close to another body are excluded.
    """
    p = map_points(seen.state)
    d, n = truth(case.world, p)
    p = p[(np.abs(d) < 0.01) & (times_seen(seen.frames, p - d[:, None] * n, n) >= 3)]
    ahead = truth(case.world, p + 0.1 * truth(case.world, p)[1])[0]
    inside = np.all((p > case.lower) & (p < case.upper), axis=1)
    p = p[inside & (np.abs(ahead - 0.1) < 0.02)]
    p = p[np.random.default_rng(seed).permutation(len(p))[:2048]]
    eyes = case.eyes[np.argmin(np.linalg.norm(p[:, None] - case.eyes[None], axis=2), axis=1)]
    n = truth(case.world, p)[1]
    towards = np.where(np.sum((eyes - p) * n, axis=1, keepdims=True) > 0.2, eyes, p + n)  # from where it was observed
    p, towards = np.resize(p, (2048, 3)), np.resize(towards, (2048, 3)).astype(np.float32)
    got = jax.tree.map(np.asarray, _mapped()(seen.state.levels, jnp.asarray(p), jnp.asarray(towards)))
    d, n = truth(case.world, p)
    k = world_curvatures(case.world, p - d[:, None] * n)
    bodies = (np.max(np.abs(k), axis=1) > ROUND) & (p[:, 2] > 0.03)
    bodies &= np.max(np.abs(k), axis=1) * RATIO * LAYOUT.spacing < 3**-0.5
    ok = bodies & (got.reasons == 0)
    off = degrees(got.normal, n)[ok]
    bent = np.abs(got.curvatures - k)[ok] / np.max(np.abs(k), axis=1)[ok, None]
    return {
        "refused": float(1 - np.sum(ok) / np.sum(bodies)),
        "normal_median": float(np.median(off)),
        "normal_p95": float(np.percentile(off, 95)),
        "curvature_median": float(np.median(bent)),
        "curvature_p95": float(np.percentile(bent, 95)),
        "points": int(np.sum(ok)),
    }
