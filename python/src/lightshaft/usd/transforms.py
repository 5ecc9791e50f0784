"""Transforms as 4 x 4 matrices that stand before a column: USD's stand after a row."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

Matrix = npt.NDArray[np.float64]
EXACT = 1e-6  # shares by which the columns of a matrix of single-precision numbers may differ


def column_matrix(row_matrix: Any) -> Matrix:
    return np.array(row_matrix, dtype=np.float64).T


def translation(x: float, y: float, z: float) -> Matrix:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def scale(x: float, y: float, z: float) -> Matrix:
    return np.diag([x, y, z, 1.0])


def is_similarity(matrix: Matrix) -> bool:
    """Whether it turns, moves, mirrors, and scales alike in all directions."""
    product = matrix[:3, :3].T @ matrix[:3, :3]
    return bool(np.allclose(product, np.eye(3) * product[0, 0], atol=EXACT * product[0, 0], rtol=0))


def mean_scale(matrix: Matrix) -> float:
    return math.cbrt(abs(np.linalg.det(matrix[:3, :3])))


def mirrors(matrix: Matrix) -> bool:
    return bool(np.linalg.det(matrix[:3, :3]) < 0)


def unscaled(matrix: Matrix) -> Matrix:
    """For what looks or shines along its axis z, with y upright: without size and shear. z and the plane of z and
    y stay, and it mirrors if `matrix` does."""
    z, y = matrix[:3, 2], matrix[:3, 1]
    z = z / np.linalg.norm(z)
    x = np.cross(y, z)
    x = x / np.linalg.norm(x)
    result = np.eye(4)
    result[:3, :3] = np.stack([-x if mirrors(matrix) else x, np.cross(z, x), z], axis=1)
    result[:3, 3] = matrix[:3, 3]
    return result


def is_usable(matrix: Matrix) -> bool:
    return bool(np.isfinite(matrix).all() and abs(np.linalg.det(matrix[:3, :3])) > 1e-30)
