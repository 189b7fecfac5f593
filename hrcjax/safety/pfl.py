"""Power and force limiting: how fast a contact with a part of the body may be.

ISO/TS 15066, annex A (tables A.2 and A.3, eq. A.6), as quoted in open literature. Research software, not safety-rated.
"""

import equinox as eqx
import jax.numpy as jnp

from hrcjax.numerics import safe_sqrt, solve_spd
from hrcjax.safety.params import PflParams
from hrcjax.typing import Array, Float, Scalar


class BodyRegion(eqx.Module):
    """Limits of one part of the body."""

    name: str = eqx.field(static=True)
    """The standard's region."""
    force: float
    """Largest quasi-static contact force (table A.2) [N]."""
    transient: float
    """A transient contact may have this multiple of it (table A.2; 1 for skull and face) [1]."""
    stiffness: float
    """Effective spring constant (table A.3) [N/m]."""
    mass: float
    """m_H, effective mass (table A.3) [kg]."""
    energy: float
    """Largest transferred energy (table A.4), printed for a cross-check. Skull and face: printed with a factor of 2
    that their force limit does not have [J]."""


SKULL = BodyRegion("skull, forehead", 130.0, 1.0, 150e3, 4.4, 0.23)
FACE = BodyRegion("face", 65.0, 1.0, 75e3, 4.4, 0.11)
NECK = BodyRegion("neck", 150.0, 2.0, 50e3, 1.2, 0.84)
BACK = BodyRegion("back, shoulders", 210.0, 2.0, 35e3, 40.0, 2.5)
CHEST = BodyRegion("chest", 140.0, 2.0, 25e3, 40.0, 1.6)
ABDOMEN = BodyRegion("abdomen", 110.0, 2.0, 10e3, 40.0, 2.4)
PELVIS = BodyRegion("pelvis", 180.0, 2.0, 25e3, 40.0, 2.6)
UPPER_ARM = BodyRegion("upper arm, elbow", 150.0, 2.0, 30e3, 3.0, 1.5)
FOREARM = BodyRegion("forearm, wrist", 160.0, 2.0, 40e3, 2.0, 1.3)
HAND = BodyRegion("hand, fingers", 140.0, 2.0, 75e3, 0.6, 0.49)
THIGH = BodyRegion("thigh, knee", 220.0, 2.0, 50e3, 75.0, 1.9)
LOWER_LEG = BodyRegion("lower leg", 130.0, 2.0, 60e3, 75.0, 0.52)

BODY_REGIONS = (
    SKULL, FACE, NECK, BACK, CHEST, ABDOMEN, PELVIS, UPPER_ARM, FOREARM, HAND, THIGH, LOWER_LEG,
)  # fmt: skip
"""All regions, head to foot; an index into this tuple names a region inside a program."""


def effective_mass(params: PflParams) -> Float[Array, ""]:
    """m_R = M / 2 + m_L: mass of the robot in a contact, the standard's rule of thumb (eq. A.4) [kg]."""
    return jnp.asarray(params.arm_mass / 2 + params.payload)


def contact_mobility(
    J: Float[Array, "3 joint"], M: Float[Array, "joint joint"], u: Float[Array, "3"]
) -> Float[Array, ""]:
    """u^T J M^-1 J^T u: one over the mass that a push along u feels at a point of the arm [1/kg].

    The better model of 1/m_R (effective mass of Khatib 1995). 0 where the arm can't give way.

    Args:
        J: Jacobian of the point's position [m].
        M: joint-space inertia [kg m^2].
        u: unit direction of the contact [1].

    Not finite if: M is singular.
    """
    force = jnp.sum(J * u[:, None], axis=0)
    return jnp.sum(force * solve_spd(M, force))


def reflected_mass(
    J: Float[Array, "3 joint"], M: Float[Array, "joint joint"], u: Float[Array, "3"]
) -> Float[Array, ""]:
    """1 / (u^T J M^-1 J^T u): mass that a push along u feels [kg].

    Not finite if: the arm can't move along u (singular arm); use `contact_mobility` and `reduced_mass_of_mobility`.
    """
    return 1 / contact_mobility(J, M, u)


def reduced_mass(m_h: Scalar, m_r: Scalar) -> Float[Array, ""]:
    """mu = (1/m_H + 1/m_R)^-1 of the body part and the robot (eq. A.3) [kg]. An infinite m_R gives m_H."""
    return reduced_mass_of_mobility(m_h, 1 / jnp.asarray(m_r))


def reduced_mass_of_mobility(m_h: Scalar, mobility: Scalar) -> Float[Array, ""]:
    """mu from the body part's mass [kg] and the robot's mobility 1/m_R [1/kg], finite for a singular arm too [kg]."""
    return jnp.asarray(m_h / (1 + m_h * mobility))


def pfl_speed(region: BodyRegion, mu: Scalar) -> Float[Array, ""]:
    """v_rel,max = F_max / sqrt(mu k): largest relative speed of a transient contact (eq. A.6) [m/s].

    Args:
        region: the part of the body that is met.
        mu: reduced mass of robot and body part [kg].

    Not finite if: mu is 0.
    """
    return region.force * region.transient / safe_sqrt(jnp.asarray(mu * region.stiffness))


def pfl_speeds(mobility: Scalar) -> Float[Array, "region"]:
    """The largest contact speed for every one of `BODY_REGIONS`, by the robot's mobility 1/m_R [1/kg] [m/s]."""
    return jnp.stack([pfl_speed(region, reduced_mass_of_mobility(region.mass, mobility)) for region in BODY_REGIONS])
