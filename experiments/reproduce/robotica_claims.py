"""The claims of the Robotica paper."""

from .claim import OPEN, PROGRAM, REFUTED, REPRODUCED, TESTS, UNDECIDABLE, Claim, Rows, of, said, value
from .printed import LEADS


def _leads(rows: Rows, which: int) -> str:
    """Said and by the printed table: over gradient descent (0) or RRT* (1)."""
    name = ("gda", "rrt")[which]
    return "; ".join(
        f"table {table} {value(rows, f'{table}_lead_{name}', 1)} % (said: {lead[1 + which]:g})"
        for table, lead in LEADS.items()
    )


ROBOTICA = (
    Claim("abstract, 6", "system performance improves by 83.87 % over the ideal case", REFUTED,
          of("the number is the score with zones in percent of the score without zones and without a person: {X_relative:4} %, a loss of 16.13 %"), PROGRAM),
    Claim("5", "score of 83.87 % relative to the system without zones", REPRODUCED, of("{X_relative:4} % from table X and the printed weights"), PROGRAM),
    Claim("5", "safety 61 %, efficiency 55 % with zones", REPRODUCED, of("{X_safety_with:3} and {X_efficiency_with:3} % from table X"), PROGRAM),
    Claim("table X", "the measures of the runs themselves", UNDECIDABLE,
          of("measured on a robot beside a person. Our tool beside a simulated hand: task time 100 without and {episode_task_time_with:1} with zones (printed 100 and 67.66), safe navigation {episode_safe_navigation_without:1} and {episode_safe_navigation_with:1} (printed 100, with nobody there, and 73.51)"), PROGRAM),
    Claim("5", "the metric is objective and maps to safety and efficiency", REFUTED,
          said("more power scores higher, trajectory smoothness cannot rank runs, a failed run can score above a successful one (`hrcjax/metrics/score.py`, [sweep-analysis.md](sweep-analysis.md))"), TESTS + "tests/metrics/test_score.py tests/metrics/test_sound_score.py"),
    Claim("5", "weights found by refinement and sensitivity analysis", UNDECIDABLE, said("the paper shows no such analysis"), "-"),
    Claim("3.1, table I", "4.70 s whatever the number of obstacles", REPRODUCED, of("worst difference {I_iapf_worst_spheres} % (spheres)"), PROGRAM),
    Claim("3.2, table II", "4.68 to 4.72 s whatever their size", REPRODUCED, of("{II_1_iapf_spheres:3} to {II_4_iapf_spheres:3} s, worst difference {II_iapf_worst_spheres} % (spheres)"), PROGRAM),
    Claim("3.3, table III", "4.68 to 4.72 s for mixed sizes", REPRODUCED, of("worst difference {III_iapf_worst_spheres} % (spheres)"), PROGRAM),
    Claim("3.4, table IV", "4.70 s whatever the height", UNDECIDABLE,
          of("no reading gives both: spheres {IV_1_iapf_spheres}, {IV_2_iapf_spheres}, {IV_3_iapf_spheres}, {IV_4_iapf_spheres} s depend on it; columns do not, at {IV_1_iapf_columns} s. What a height changes is not said"), PROGRAM),
    Claim("3.5, table V", "a larger K_att arrives sooner: 4.70, 3.51, 2.79 s", REPRODUCED, of("{V_1_iapf_spheres:3}, {V_2_iapf_spheres:3}, {V_3_iapf_spheres:3} s"), PROGRAM),
    Claim("3.5, table VI", "a larger K_rep hardly delays: 3.51, 3.51, 3.52 s", REPRODUCED, of("{VI_1_iapf_spheres:3}, {VI_2_iapf_spheres:3}, {VI_3_iapf_spheres:3} s"), PROGRAM),
    Claim("3.6, table VII", "a larger safety factor costs time: 4.70, 4.72, 4.74 s", REPRODUCED,
          of("the times within {VII_iapf_worst_spheres} %, but the growth only where obstacles are in the way: columns {VII_1_iapf_columns}, {VII_2_iapf_columns}, {VII_3_iapf_columns} s; spheres {VII_1_iapf_spheres:3}, {VII_2_iapf_spheres:3}, {VII_3_iapf_spheres:3} s"), PROGRAM),
    Claim("3.1 to 3.4", "leads over gradient descent of 37, 35, 39, 37 %", REPRODUCED, lambda rows: _leads(rows, 0) + ". Case 2 is not", PROGRAM),
    Claim("3.1 to 3.4", "leads over RRT* of 9, 10, 4, 21 %", REFUTED, lambda rows: _leads(rows, 1) + ": its own tables", PROGRAM),
    Claim("3.3", "RRT* takes 6.14 to 6.29 s in case 3", REFUTED, said("table III: 5.77 to 6.29 s"), PROGRAM),
    Claim("3", "the improved field is a third faster than gradient descent", REFUTED,
          of("the printed times are steps of {printed_step_iapf_min} to {printed_step_iapf_max} cm against {printed_step_gda_min} to {printed_step_gda_max} cm each 1/30 s. At one speed, spheres: {fair_iapf_time_spheres} and {fair_gda_time_spheres} s; columns, where O1 blocks the line: {fair_iapf_time_columns} and {fair_gda_time_columns} s; clearance: {fair_iapf_time_clearance} and {fair_gda_time_clearance} s. So its path is the shorter one where an obstacle is in the way, by 7 to 12 %"), PROGRAM),
    Claim("3", "the improved field is faster than RRT*", REFUTED,
          of("at one speed, columns: improved field {fair_iapf_time_columns} s, RRT* {rrt_time_10000_columns} s after 10,000 iterations. The printed times of RRT* are at that speed those of paths of {printed_rrt_length_min:0} to {printed_rrt_length_max:0} cm: of a tree stopped after some 200 to 2,000 iterations"), PROGRAM),
    Claim("3.5", "gradient descent takes 7.48 to 7.56 s by its constants", UNDECIDABLE,
          of("its steps are not stated. Unit steps each 1/30 s take {V_1_gda_spheres:1}, {V_2_gda_spheres:1}, {V_3_gda_spheres:1} s: 13 % apart, as with any other time of a step, where the printed times are 1 % apart; and one setting, four obstacles of 3 cm, is printed as 7.61, 7.62 and 7.70 s"), PROGRAM),
    Claim("2.3", "suitable for real-time applications", REPRODUCED, of("a plan of a point takes {plan_ms_columns:1} ms, compiled, on one processor that is shared; an image comes every 33 ms"), PROGRAM),
    Claim("2.3", "local minima are mitigated by recalibrating the forces", REFUTED,
          said("no equation does so; the descent stays in a U-shaped trap. Several guesses side by side leave it"), TESTS + "tests/plan/test_arm_plan.py -k trap"),
    Claim("2.3", "d_factor adapts the repulsion and lets the robot reach a goal beside an obstacle", REPRODUCED,
          said("with the present configuration in eq. 3a; as printed it is a constant and does not"), TESTS + "tests/plan/test_corrections.py"),
    Claim("2.3", "the forces are the gradients of the potential", REFUTED, said("eqs. 2c, 3c and 3f as printed are not, and the potential of 2e jumps; corrected they are ([reproduce.md](reproduce.md))"), TESTS + "tests/plan/test_corrections.py"),
    Claim("2.4", "bending energy in the objective makes paths smooth", REPRODUCED,
          of("columns: {fair_iapf_bending_columns} /cm of the descent, {fair_planned_bending_columns:4} /cm planned, {fair_iapf_length_columns:1} and {fair_planned_length_columns:1} cm long"), PROGRAM),
    Claim("table VIII", "the optimal path has the least score: 0.5, 0.54, 0.12", REPRODUCED,
          of("{VIII_1_score}, {VIII_2_score}, {VIII_3_score} by the printed lengths and energies. Not both 0.54 and 0.12: whatever they are rounded from, one of these two paths has the least energy, and the largest difference is at least {VIII_worst:3}"), PROGRAM),
    Claim("2.3", "faster to compute than, and as good as, control barrier functions or learned policies", OPEN, said("needs the comparison of the field with a control barrier function in the same scenes"), "-"),
    Claim("1, 4", "the path's geometry is never changed; only its timing is", REPRODUCED, said("a path clock under any limits: less than 1e-9 m off; joints of the whole arm within 1e-3 rad"), TESTS + "tests/safety/test_clock.py tests/sim/test_guide.py"),
    Claim("2.5, 4", "safety zones slow the robot near a person", REPRODUCED,
          of("thresholds are ours, the paper has none. Columns, a hand that reaches in: {episode_time_without} s without, {episode_time_with} s with zones"), PROGRAM),
    Claim("abstract, 1", "safe collaboration as ISO/TS 15066 asks", REFUTED,
          said("red only slows, without a stop; the distance is the tool's alone, and an elbow can be nearer. The whole arm and a stop are the default here"), TESTS + "tests/safety/test_governor.py -k elbow"),
    Claim("2.6", "performance recovers swiftly once it is safe", REPRODUCED, said("after a stop the speed returns within the bounds of acceleration and jerk, without a jump"), TESTS + "tests/safety/test_clock.py -k resumes"),
    Claim("1", "productivity is kept while safety is ensured", OPEN, said("needs the comparison of zones on and off over many recorded people, with productivity lost in each zone"), "-"),
    Claim("1, 6", "no replanning is needed", UNDECIDABLE,
          said("true of what the paper shows. While a hand stays in the way, leaving the path saved no time either: ratio {avoidance.md:time_ratio} ([avoidance.md](avoidance.md))"), "python -m experiments.avoidance"),
    Claim("1", "energy-efficient motion", UNDECIDABLE, said("the paper gives no energy; its power score rises with power"), "-"),
    Claim("4", "distance to the person in real time, 30 images a second", REPRODUCED,
          said("median {sensing.md:image_ms_p50} ms an image, without detection of people by a network, which is not part of this project; 95th percentile {sensing.md:image_ms_p95} ms"), "python -m experiments.sensing"),
    Claim("2.1", "gestures by Mediapipe and YOLOv7 reduce response times and errors", UNDECIDABLE, said("no images, weights or times are published"), "-"),
    Claim("2.2", "mapping with a finger reduces the search space", UNDECIDABLE, said("no measure is given"), "-"),
    Claim("2", "applicable to various paths and robots", REPRODUCED, said("any serial arm from a MuJoCo model ([own-parts.md](own-parts.md)); in simulation alone"), TESTS + "tests/cells/test_own_parts.py"),
)  # fmt: skip
