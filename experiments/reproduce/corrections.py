"""Equations of the Robotica paper that are not used as printed, with the tests that hold each correction."""

from typing import NamedTuple


class Correction(NamedTuple):
    """One equation."""

    equation: str
    printed: str
    used: str
    why: str
    tests: tuple[str, ...]
    """As pytest names them."""


CORRECTIONS = (
    Correction(
        "2c",
        "(K_att / d) (q, q_goal)",
        "K_att (q - q_goal) / d",
        "a pair of points is not a vector; the gradient of 2b is the difference over the distance",
        ("tests/plan/test_corrections.py::test_2c_far_attraction_is_constant_and_points_to_the_goal",
         "tests/plan/test_potential.py::test_force_is_the_papers_corrected"),
    ),
    Correction(
        "2e, far",
        "d* K_att d - K_att / (2 d*^2)",
        "d* K_att d - K_att d*^2 / 2",
        "the printed potential jumps at d = d* unless d* is 1",
        ("tests/plan/test_corrections.py::test_2e_printed_potential_jumps_at_d_star_and_ours_does_not",
         "tests/plan/test_potential.py::test_attraction_value_and_slope_meet_at_d_star"),
    ),
    Correction(
        "3a",
        "|q_start - q_goal|^n",
        "|q - q_goal|^n",
        "the printed factor is a constant: its gradient is 0, and repulsion does not fade at the goal (Ge and Cui 2000)",
        ("tests/plan/test_corrections.py::test_3a_goal_beside_an_obstacle_is_at_rest_with_the_present_configuration_alone",
         "tests/plan/test_potential.py::test_d_factor"),
    ),
    Correction(
        "3c",
        "K_rep (1/zeta - 1/rho) / rho^2 grad rho",
        "the same times d_factor",
        "3b has the factor, so its gradient has it",
        ("tests/plan/test_corrections.py::test_3c_first_part_carries_the_factor",
         "tests/plan/test_potential.py::test_force_is_the_papers_corrected"),
    ),
    Correction(
        "3f",
        "-(n/2) K_rep (1/rho - 1/zeta)^2 n d^(n-1), a number",
        "(n/2) K_rep (1/rho - 1/zeta)^2 d^(n-1) towards the goal",
        "3e has the n of the derivative already, so the printed force is n times too large; and a force has a direction",
        ("tests/plan/test_corrections.py::test_3f_second_part_is_n_times_smaller_than_printed_and_points_to_the_goal",
         "tests/plan/test_potential.py::test_force_is_the_papers_corrected"),
    ),
    Correction(
        "6c, red",
        "d_closest >= d_yellow",
        "d_closest <= d_yellow",
        "as printed green and yellow are red too, and nothing is red near a person",
        ("tests/safety/test_zones.py::test_zones_divide_the_distances_as_eq_6c_corrected",
         "tests/safety/test_zones.py::test_order_of_the_zones"),
    ),
)  # fmt: skip
