"""A person as capsules that move: recorded or made beforehand, read at any time."""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp

from hrcjax.geom.capsules import Capsules
from hrcjax.typing import Array, Bool, Float, Scalar

REGIONS = (
    "pelvis", "chest", "neck", "head", "upper arm", "upper arm", "forearm", "forearm", "hand", "hand",
    "thigh", "thigh", "lower leg", "lower leg",
)  # fmt: skip
"""Body region of each capsule, in the words of the power-and-force table; of two equal ones the left comes first."""

RADII = {
    "pelvis": 0.22, "chest": 0.22, "neck": 0.07, "head": 0.15, "upper arm": 0.10, "forearm": 0.066, "hand": 0.103,
    "thigh": 0.10, "lower leg": 0.07,
}  # fmt: skip
"""Radius by region [m]. Trunk, head and arm as in use for capsule models of people; neck and legs are ours."""


class Person(eqx.Module):
    """Capsules at equal steps of time. `regions` names the body region of each."""

    a: Float[Array, "frame capsule 3"]
    """One end of each axis, in the world [m]."""
    b: Float[Array, "frame capsule 3"]
    """The other end [m]."""
    radius: Float[Array, "capsule"]
    """Radius [m]."""
    rate: Float[Array, ""]
    """Frames a second [Hz]."""
    present: Bool[Array, "frame"]
    """False where nobody is in the cell."""
    regions: tuple[str, ...] = eqx.field(static=True, default=REGIONS)
    """Body region of each capsule."""


def person_at(person: Person, t: Scalar) -> Capsules:
    """The person's capsules at a time [s]: between frames on a straight line, before and after the record held.

    Absent (all radii -1) only where both neighbouring frames are.
    """
    frames = person.a.shape[0]
    place = jnp.clip(jnp.asarray(t, person.a.dtype) * person.rate, 0, frames - 1)
    first = jnp.clip(jnp.floor(place).astype(jnp.int32), 0, max(frames - 2, 0))
    second = jnp.minimum(first + 1, frames - 1)
    weight = place - first.astype(place.dtype)
    present = jnp.where(weight < 1, person.present[first], False) | jnp.where(weight > 0, person.present[second], False)
    return Capsules(
        a=person.a[first] + weight * (person.a[second] - person.a[first]),
        b=person.b[first] + weight * (person.b[second] - person.b[first]),
        radius=jnp.where(present, person.radius, -1),
    )


def together(people: Sequence[Person]) -> Person:
    """Several people as one record. Who is never in the cell keeps its capsules, absent.

    Raises:
        ValueError: nobody, records of different lengths or rates, or somebody who is there for a part of the time.
    """
    if len(people) == 1:
        return people[0]
    if len({person.a.shape[0] for person in people}) != 1:
        raise ValueError(
            f"people with records of {[p.a.shape[0] for p in people]} poses; accepted: records of one length"
        )
    if len({float(person.rate) for person in people}) != 1:
        raise ValueError(f"people with records of {[float(p.rate) for p in people]} Hz; accepted: one rate")
    if any(bool(jnp.any(p.present)) and not bool(jnp.all(p.present)) for p in people):
        raise ValueError(
            "somebody comes or goes during the record; accepted for several people: there all the time or never"
        )
    return Person(
        a=jnp.concatenate([person.a for person in people], axis=1),
        b=jnp.concatenate([person.b for person in people], axis=1),
        radius=jnp.concatenate([jnp.where(jnp.any(p.present), p.radius, -1) for p in people]),
        rate=people[0].rate,
        present=jnp.any(jnp.stack([person.present for person in people]), axis=0),
        regions=tuple(region for person in people for region in person.regions),
    )
