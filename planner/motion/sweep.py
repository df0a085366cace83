"""How far a part of the arm moves at most while the arm goes along an edge.

The edge is q(f) = qa + f (qb − qa). A point P of a part moves by at most |P′| δ + ½ A δ² while f changes by δ, for
∂²P/∂q_j∂q_k = z_j × (z_k × (P − o_k)), j ≤ k, is no longer than P's distance from axis k, hence
|P″| ≤ A = Σ_j Σ_k |Δq_j| |Δq_k| r_max(j,k), r_k the largest distance of the part's points from axis k. Seen from link i
it moves by at most δ Σ_{k>i} |Δq_k| r_k.
"""

import numpy as np
from numba import njit

_part = njit(inline="always")
"""Written into its callers."""


@_part
def write_bends(way, turning, bends):
    """Write A of links 0 to 7 and of the riders: bends (9,). way (7,): qb − qa; turning (7,9): r, see `ArmArrays`."""
    for part in range(9):
        bends[part], sum_before, total = 0.0, 0.0, 0.0
        for k in range(min(part, 7)):
            total += abs(way[k])
            bends[part] += turning[k, part] * (total * total - sum_before)
            sum_before = total * total


@_part
def write_relative(way, turning, relative):
    """Write relative (8,9): metres per f by which each part (see `write_bends`) moves at most, seen from each link."""
    for part in range(9):
        last = min(part, 7)
        total = 0.0
        for link in range(last, -1, -1):
            relative[link, part] = total
            if link > 0:
                total += abs(way[link - 1]) * turning[link - 1, part]


@_part
def write_twists(way, links, twists):
    """Write twists (8,6): velocity of the origins of links 0 to 7, placed at links (8,12), and their spin, per f."""
    twists[0] = 0.0
    for k in range(7):
        before, link = twists[k], twists[k + 1]
        x, y, z = links[k + 1, 9] - links[k, 9], links[k + 1, 10] - links[k, 10], links[k + 1, 11] - links[k, 11]
        link[0] = before[0] + before[4] * z - before[5] * y
        link[1] = before[1] + before[5] * x - before[3] * z
        link[2] = before[2] + before[3] * y - before[4] * x
        for r in range(3):
            link[3 + r] = before[3 + r] + way[k] * links[k + 1, 3 * r + 2]


@_part
def speed(x, y, z, radius, link, links, twists):
    """Bound on |P′| within `radius` of the point, which moves with the link."""
    x, y, z = x - links[link, 9], y - links[link, 10], z - links[link, 11]
    a, b, c = twists[link, 3], twists[link, 4], twists[link, 5]
    u, v, w = twists[link, 0] + b * z - c * y, twists[link, 1] + c * x - a * z, twists[link, 2] + a * y - b * x
    return np.sqrt(u * u + v * v + w * w) + radius * np.sqrt(a * a + b * b + c * c)


@_part
def room_for(part, rate, bend):
    """Metres that are needed to go on by `part` of the edge."""
    return rate * part + 0.5 * bend * part * part


@_part
def part_within(room, rate, bend):
    """The largest part of the edge for which the room is enough."""
    return 2.0 * room / (rate + np.sqrt(rate * rate + 2.0 * bend * room) + 1e-12)
