"""Transforms as 4 x 4 matrices for column vectors. USD's matrices are for row vectors."""

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
    """Returns True if the matrix only rotates, moves, mirrors, and scales uniformly."""
    product = matrix[:3, :3].T @ matrix[:3, :3]
    return bool(np.allclose(product, np.eye(3) * product[0, 0], atol=EXACT * product[0, 0], rtol=0))


def mean_scale(matrix: Matrix) -> float:
    return math.cbrt(abs(np.linalg.det(matrix[:3, :3])))


def mirrors(matrix: Matrix) -> bool:
    return bool(np.linalg.det(matrix[:3, :3]) < 0)


def unscaled(matrix: Matrix) -> Matrix:
    """Removes scale and shear, for cameras and lights that point along their axis z with y upwards. z, the plane
    of z and y, and a mirroring stay."""
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
