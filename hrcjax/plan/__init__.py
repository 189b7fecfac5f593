"""The planner: the improved artificial potential field, and paths optimised for length and bending energy, of a point and of
a whole arm."""

from hrcjax.plan.arm_params import ArmPathParams, ArmPlanSizes
from hrcjax.plan.arm_path import ArmPath
from hrcjax.plan.arm_plan import plan_arm
from hrcjax.plan.arm_potential import arm_force, arm_potential, repulsion_ratio
from hrcjax.plan.baseline import GradientDescentParams, gradient_descent_path
from hrcjax.plan.body import PlanBody, arm_body, point_body
from hrcjax.plan.curve import PathCurve, equally_spaced, path_curve
from hrcjax.plan.descent import PotentialPath, StepFn, damped_step, potential_path, time_to_goal, unit_step
from hrcjax.plan.motion_law import law_speed
from hrcjax.plan.multi_start import best_path, optimise_best, plan_multi_start, plan_with_slack, straightest_path
from hrcjax.plan.optimise import optimise_path
from hrcjax.plan.params import PathParams, PlanParams, PlanSizes, PotentialParams
from hrcjax.plan.path_result import PathResult, judge, required_distance
from hrcjax.plan.path_score import path_scores
from hrcjax.plan.plan import plan
from hrcjax.plan.potential import DistancesFn, d_factor, force, potential

__all__ = [
    "ArmPath", "ArmPathParams", "ArmPlanSizes", "DistancesFn", "GradientDescentParams", "PathCurve", "PathParams", "PathResult", "PlanBody", "PlanParams", "PlanSizes",
    "PotentialParams", "PotentialPath", "StepFn", "arm_body", "arm_force", "arm_potential", "best_path", "d_factor", "damped_step", "equally_spaced", "force", "gradient_descent_path",
    "judge", "law_speed", "optimise_best", "optimise_path", "path_curve", "path_scores", "plan", "plan_arm", "plan_multi_start", "plan_with_slack", "point_body", "potential", "potential_path",
    "repulsion_ratio", "required_distance", "straightest_path", "time_to_goal", "unit_step",
]  # fmt: skip
