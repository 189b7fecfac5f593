"""Lifts objects by grasps chosen from noisy depth: normals by the Hessian, by a plane through neighbours, by the nearest point."""
