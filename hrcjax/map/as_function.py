"""A map as a `DistanceFn`: for what follows a distance to a surface and asks there for the direction, such as the tracing of a ray."""

import jax

from hrcjax.map.layout import MapLayout
from hrcjax.map.level import Level
from hrcjax.map.query import map_distance, map_distance_and_gradient
from hrcjax.typing import Array, DistanceFn, Scalar, Vector3


def distance_function(layout: MapLayout, levels: tuple[Level, ...], ratio: Scalar) -> DistanceFn:
    """The distance to the mapped surfaces, `map_distance` [m].

    Its gradient is that of `map_distance_and_gradient`: next to a surface the unit normal on the side of the sensor, as the derivative of a
    field of noisy points fades out there. The gradient counts as constant: second derivatives are 0.

    Args:
        ratio: length scale over spacing [1].
    """

    @jax.custom_jvp
    def distance(x: Vector3) -> Array:
        return map_distance(layout, levels, ratio, x)

    @distance.defjvp
    def _(primals: tuple[Array], tangents: tuple[Array]) -> tuple[Array, Array]:
        d, gradient = map_distance_and_gradient(layout, levels, ratio, primals[0])
        return d, jax.lax.stop_gradient(gradient) @ tangents[0]

    return distance
