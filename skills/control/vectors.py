"""Vectors of three for compiled code: taken as anything that can be indexed, given back as tuples, which cost nothing.

Array expressions and @ would do the same, but each is a call into another library, for nine multiplications.
"""

from numba import njit


@njit(cache=True)
def dot(a, b):
    """The scalar product aᵀ b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def cross(a, b):
    """The cross product a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def turn(A, x):
    """The vector A x with A (3,3)."""
    return dot(A[0], x), dot(A[1], x), dot(A[2], x)


@njit(cache=True)
def turn_back(A, x):
    """The vector Aᵀ x with A (3,3)."""
    return (
        A[0, 0] * x[0] + A[1, 0] * x[1] + A[2, 0] * x[2],
        A[0, 1] * x[0] + A[1, 1] * x[1] + A[2, 1] * x[2],
        A[0, 2] * x[0] + A[1, 2] * x[1] + A[2, 2] * x[2],
    )
