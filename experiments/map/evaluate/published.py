"""Published results of three systems on the Cow and Lady sequence, for comparison.

Source: the comparison published by the authors of the HRI paper's field, copied, not measured here. The others are FIESTA
(Han et al., IROS 2019) and Voxblox (Oleynikova et al., IROS 2017). Distance RMSE in centimetres and mean cosine of the
gradient by grid resolution.

The protocol differs: a room recorded by a Kinect with a laser scan as its truth, errors of poses included, queries in the
whole observed volume. Ours are generated scenes with exact distance and exact poses, a simulated D435i, queries within
30 cm of observed surfaces. The numbers give the order of magnitude; they are not a ranking.
"""

RESOLUTIONS = (5.0, 7.5, 10.0, 15.0, 20.0, 25.0)
"""Edge of a voxel [cm]."""

COW_AND_LADY: dict[str, tuple[tuple[float, float], ...]] = {
    "authors' field": ((7.2, 0.79), (7.2, 0.80), (7.2, 0.79), (7.2, 0.79), (7.0, 0.75), (7.3, 0.71)),
    "FIESTA": ((4.8, 0.83), (5.0, 0.85), (5.4, 0.78), (6.5, 0.82), (7.3, 0.70), (9.4, 0.80)),
    "Voxblox": ((8.2, 0.76), (9.8, 0.72), (11.4, 0.69), (14.4, 0.67), (18.5, 0.63), (21.9, 0.62)),
}
"""Distance RMSE [cm] and cosine [1] of each system, resolution by resolution."""
