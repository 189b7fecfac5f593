"""Reading a chain: what is refused. What is read is tested through kinematics and dynamics."""

import mujoco
import numpy as np
import pytest

from hrcjax.robot import Chain, chain_from_mujoco


def hinge(more: str = "") -> str:
    return f'<joint name="j" axis="0 0 1" {more}/><geom size="0.1"/>'


def model(inner: str, outer: str = "") -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(f"<mujoco>{outer}<worldbody>{inner}</worldbody></mujoco>")


PLAIN = '<joint axis="0 0 1"/><geom size="0.1"/>'
LINK = f"<body>{hinge()}</body>"
REFUSED = {
    "branching": (f"<body>{PLAIN}<body>{PLAIN}</body><body>{PLAIN}</body></body>", "", "tree"),
    "two chains": (f"<body>{PLAIN}</body><body>{PLAIN}</body>", "", "tree"),
    "slide": ('<body><joint type="slide"/><geom size="0.1"/></body>', "", "other than hinges"),
    "free": ('<body><freejoint/><geom size="0.1"/></body>', "", "other than hinges"),
    "no joints": ('<geom size="0.1"/>', "", "no joints"),
    "spring": ("<body>" + hinge('stiffness="1"') + "</body>", "", "springs"),
    "friction": ("<body>" + hinge('frictionloss="1"') + "</body>", "", "dry friction"),
    "gravcomp": (f'<body gravcomp="1">{hinge()}</body>', "", "gravity compensation"),
    "dense": (LINK, '<option density="1"/>', "fluid"),
    "viscous": (LINK, '<option viscosity="1"/>', "fluid"),
    "equality": (LINK, '<equality><joint joint1="j"/></equality>', "equality"),
    "tendon": (LINK, '<tendon><fixed><joint joint="j" coef="1"/></fixed></tendon>', "tendons"),
    "quadratic": ("<body>" + hinge('damping="1 2"') + "</body>", "", "nonlinear"),
}


@pytest.mark.parametrize("fault", REFUSED)
def test_refused(fault):
    inner, outer, words = REFUSED[fault]
    with pytest.raises(ValueError, match=words):
        chain_from_mujoco(model(inner, outer))


def test_gravity_switched_off():
    chain = chain_from_mujoco(model(LINK, '<option><flag gravity="disable"/></option>'))
    assert chain.gravity.tolist() == [0, 0, 0]
    assert chain_from_mujoco(model(LINK)).gravity.tolist() == [0, 0, -9.81]


def test_axis_upside_down_keeps_frames_exact():
    chain = chain_from_mujoco(model('<body><joint axis="0 0 -2"/><geom size="0.1"/></body>'))
    assert chain.rotation.tolist() == [[[1, 0, 0], [0, -1, 0], [0, 0, -1]]]


def test_right_angles_are_exact(arm):
    assert set(np.unique(arm.chain.rotation)) <= {-1.0, 0.0, 1.0}
    assert np.count_nonzero(arm.chain.pos) <= 6


def test_chain_is_compared_by_identity(ur5):
    chain = ur5.chain
    assert isinstance(chain, Chain)
    assert hash(chain) == hash(chain)
    assert chain != chain_from_mujoco(ur5.model)
    with pytest.raises(AttributeError):
        chain.mass = 0  # type: ignore[misc]
    assert chain.size == 6
