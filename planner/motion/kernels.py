"""Collision tests compiled with numba: one call checks a configuration or a whole edge. How two solids are kept apart
is told in `apart`.

Robot and scene travel packed in one array, because a compiled call pays half a microsecond for every array it is
handed. For placements see `chain`.
"""

import numpy as np
from numba import njit

from planner.motion.apart import bounds_apart, out_of_bounds, point_near, solid_hits, sphere_hits
from planner.motion.tables import (
    BOUND,
    COUNT,
    FACES,
    FIRST,
    HALF,
    LOWER,
    OBSTACLE_COLUMNS,
    PART,
    PLACE,
    UPPER,
    ArmArrays,
    SceneArrays,
)

_ONE_EACH = np.arange(9.0)


@njit(cache=True)
def place_links(q, base, joints, links):
    """Write the placements of links 0 to 7 in W, links (8,12), at q (7,)."""
    for i in range(12):
        links[0, i] = base[i]
    for k in range(7):
        c, s = np.cos(q[k]), np.sin(q[k])
        for r in range(3):
            x, y, z = links[k, 3 * r], links[k, 3 * r + 1], links[k, 3 * r + 2]
            along = x * joints[k, 0] + y * joints[k, 3] + z * joints[k, 6]
            across = x * joints[k, 1] + y * joints[k, 4] + z * joints[k, 7]
            links[k + 1, 3 * r] = c * along + s * across
            links[k + 1, 3 * r + 1] = c * across - s * along
            links[k + 1, 3 * r + 2] = x * joints[k, 2] + y * joints[k, 5] + z * joints[k, 8]
            links[k + 1, 9 + r] = links[k, 9 + r] + x * joints[k, 9] + y * joints[k, 10] + z * joints[k, 11]


@njit(cache=True)
def place_all_links(q, base, joints):
    """Placements (n,8,12) of links 0 to 7 in W at q (n,7)."""
    links = np.empty((q.shape[0], 8, 12))
    for k in range(q.shape[0]):
        place_links(q[k], base, joints, links[k])
    return links


@njit(cache=True)
def _place_points(links, row, points, placed):
    """Write `placed`: the points (n,≥3), given in the frame of links[row], in W."""
    for i in range(points.shape[0]):
        for r in range(3):
            turned = links[row, 3 * r] * points[i, 0] + links[row, 3 * r + 1] * points[i, 1]
            placed[i, r] = links[row, 9 + r] + turned + links[row, 3 * r + 2] * points[i, 2]


@njit(cache=True)
def _place_spheres(links, spheres, first, placed):
    """Write `placed`: the spheres (n,4), those from first[k] on given in the frame of links[k], in W."""
    for k in range(links.shape[0]):
        for i in range(int(first[k]), int(first[k + 1])):
            for r in range(3):
                turned = links[k, 3 * r] * spheres[i, 0] + links[k, 3 * r + 1] * spheres[i, 1]
                placed[i, r] = links[k, 9 + r] + turned + links[k, 3 * r + 2] * spheres[i, 2]
            placed[i, 3] = spheres[i, 3]


@njit(cache=True)
def _place_solids(links, row, solids, placed):
    """Write `placed`: the solids, given in the frame of links[row], in W, with world bounds. Columns: `tables`."""
    for s in range(solids.shape[0]):
        for i in range(PLACE):
            placed[s, i] = solids[s, i]
        placed[s, FIRST], placed[s, COUNT], placed[s, FACES] = solids[s, FIRST], solids[s, COUNT], solids[s, FACES]
        for r in range(3):
            x, y, z = links[row, 3 * r], links[row, 3 * r + 1], links[row, 3 * r + 2]
            reach = 0.0
            for c in range(3):
                entry = x * solids[s, PLACE + c] + y * solids[s, PLACE + 3 + c] + z * solids[s, PLACE + 6 + c]
                placed[s, PLACE + 3 * r + c] = entry
                reach += abs(entry) * solids[s, HALF + c]
            offset = x * solids[s, PLACE + 9] + y * solids[s, PLACE + 10] + z * solids[s, PLACE + 11]
            centre = links[row, 9 + r] + offset
            placed[s, PLACE + 9 + r] = centre
            placed[s, LOWER + r] = centre - reach
            placed[s, UPPER + r] = centre + reach


@njit(cache=True)
def _hand_hits(solids, own, obstacles, corners, margins):
    """Does any of the placed solids come too near to an obstacle?"""
    # The loop over the obstacles is in here: every call counts references to every array.
    for k in range(obstacles.shape[0]):
        for s in range(solids.shape[0]):
            margin = margins[int(solids[s, PART]), k]
            if margin == -np.inf or bounds_apart(solids, s, obstacles, k, margin):
                continue
            if solid_hits(solids, s, own, obstacles, k, corners, margin):
                return True
    return False


@njit(cache=True)
def hand_contacts(links, solids, own, obstacles, corners, margins):
    """Which obstacles do the solids, riding on a link placed at links[0] (1,12), come too near to? (n,) of bool.

    own, corners: the corners of the solids and of the obstacles.
    """
    placed = np.empty((solids.shape[0], OBSTACLE_COLUMNS))
    _place_solids(links, 0, solids, placed)
    hits = np.empty(obstacles.shape[0], dtype=np.bool_)
    for k in range(obstacles.shape[0]):
        hits[k] = _hand_hits(placed, own, obstacles[k : k + 1], corners, margins[:, k : k + 1])
    return hits


@njit(cache=True)
def _links_hit(covers, spheres, first, obstacles, corners, margins):
    """Do the placed spheres of links 1 to 7 come too near to something?"""
    for link in range(1, 8):
        x, y, z, cover = covers[link, 0], covers[link, 1], covers[link, 2], covers[link, 3]
        for k in range(obstacles.shape[0]):
            margin = margins[link, k]
            if margin == -np.inf or out_of_bounds(x, y, z, cover + margin, obstacles, k):
                continue
            for s in range(int(first[link]), int(first[link + 1])):
                reach = spheres[s, 3] + margin
                if sphere_hits(spheres[s, 0], spheres[s, 1], spheres[s, 2], reach, obstacles, k, corners):
                    return True
    return False


@njit(cache=True)
def _spheres_meet(spheres, s, others, t, margin):
    dx, dy, dz = spheres[s, 0] - others[t, 0], spheres[s, 1] - others[t, 1], spheres[s, 2] - others[t, 2]
    reach = spheres[s, 3] + others[t, 3] + margin
    return dx * dx + dy * dy + dz * dz < reach * reach


@njit(cache=True)
def _links_meet(covers, spheres, first, pairs):
    for n in range(pairs.shape[0]):
        a, b, margin = int(pairs[n, 0]), int(pairs[n, 1]), pairs[n, 2]
        if not _spheres_meet(covers, a, covers, b, margin):
            continue
        for s in range(int(first[a]), int(first[a + 1])):
            for t in range(int(first[b]), int(first[b + 1])):
                if _spheres_meet(spheres, s, spheres, t, margin):
                    return True
    return False


@njit(cache=True)
def _beyond_bound(spheres, t, solids, s, margin):
    """Is placed sphere t further than the margin from the sphere about placed solid s?"""
    p = PLACE + 9
    dx, dy, dz = spheres[t, 0] - solids[s, p], spheres[t, 1] - solids[s, p + 1], spheres[t, 2] - solids[s, p + 2]
    return dx * dx + dy * dy + dz * dz > (spheres[t, 3] + solids[s, BOUND] + margin) ** 2


@njit(cache=True)
def _hand_meets_arm(solids, own, covers, spheres, first, pairs):
    for n in range(pairs.shape[0]):
        s, link = int(pairs[n, 0]), int(pairs[n, 1])
        if _beyond_bound(covers, link, solids, s, pairs[n, 2]):
            continue
        for t in range(int(first[link]), int(first[link + 1])):
            if _beyond_bound(spheres, t, solids, s, pairs[n, 2]):
                continue
            reach = spheres[t, 3] + pairs[n, 2]
            if point_near(spheres[t, 0], spheres[t, 1], spheres[t, 2], reach, solids, s, own):
                return True
    return False


@njit(cache=True)
def _is_free(q, arm, scene, links, spheres, covers, solids):
    """The check itself; the last four are workspaces."""
    place_links(q, arm.base, arm.joints, links)
    _place_solids(links, 7, arm.solids, solids)
    if _hand_hits(solids, arm.corners, scene.obstacles, scene.corners, scene.margins):
        return False
    _place_spheres(links, arm.spheres, arm.first, spheres)
    _place_spheres(links, arm.covers, _ONE_EACH, covers)
    if _links_hit(covers, spheres, arm.first, scene.obstacles, scene.corners, scene.margins):
        return False
    if _links_meet(covers, spheres, arm.first, scene.link_pairs):
        return False
    return not _hand_meets_arm(solids, arm.corners, covers, spheres, arm.first, scene.solid_pairs)


@njit(cache=True)
def _between(qa, qb, fraction, q):
    for k in range(7):
        q[k] = qa[k] + (qb[k] - qa[k]) * fraction


@njit(cache=True)
def _edge_steps(qa, qb, arm, links, q, joint_step, travel_step):
    """Number of equal steps from qa to qb of at most `joint_step` rad a joint and about `travel_step` metres of
    the hand (its chords over both halves of the edge, a tenth added)."""
    widest = 0.0
    for k in range(7):
        widest = max(widest, abs(qb[k] - qa[k]))
    n = arm.probes.shape[0]
    places = np.empty((3, n, 3))
    for half in range(3):
        _between(qa, qb, half / 2, q)
        place_links(q, arm.base, arm.joints, links)
        _place_points(links, 7, arm.probes, places[half])
    travel = 0.0
    for half in range(2):
        for m in range(n):
            square = 0.0
            for i in range(3):
                square += (places[half + 1, m, i] - places[half, m, i]) ** 2
            travel = max(travel, 2.2 * np.sqrt(square))
    return max(1, int(np.ceil(widest / joint_step)), int(np.ceil(travel / travel_step)))


@njit(cache=True)
def _table(packed, n):
    """Table number n of what `tables.pack` packed."""
    start, rows, columns = int(packed[3 * n]), int(packed[3 * n + 1]), int(packed[3 * n + 2])
    return packed[start : start + rows * columns].reshape(rows, columns)


@njit(cache=True)
def unpack(packed):
    """The tables of robot and scene, as views of what `tables.pack` packed."""
    arm = ArmArrays(
        _table(packed, 0),
        _table(packed, 1)[0],
        _table(packed, 2),
        _table(packed, 3),
        _table(packed, 4)[0],
        _table(packed, 5),
        _table(packed, 6),
        _table(packed, 7),
        _table(packed, 8),
    )
    scene = SceneArrays(
        _table(packed, 9), _table(packed, 10), _table(packed, 11), _table(packed, 12), _table(packed, 13)
    )
    return arm, scene


@njit(cache=True)
def edge_is_free(qa, qb, packed, joint_step, travel_step):
    """Is the straight edge from qa to qb (both (7,)) free, given that qa is? For qb = qa: is qb free?

    `packed`: robot and scene, see `tables.pack`. Returns the answer and the number of configurations
    checked. The end comes first, then the middle, then the quarters: a blocked edge is found
    blocked soon.
    """
    arm, scene = unpack(packed)
    for k in range(7):
        if not (arm.limits[0, k] <= qb[k] <= arm.limits[1, k]):
            return False, 1
    links, q = np.empty((8, 12)), np.empty(7)
    spheres, covers = np.empty((arm.spheres.shape[0], 4)), np.empty((8, 4))
    solids = np.empty((arm.solids.shape[0], OBSTACLE_COLUMNS))
    count = _edge_steps(qa, qb, arm, links, q, joint_step, travel_step)
    if not _is_free(qb, arm, scene, links, spheres, covers, solids):
        return False, 1
    checks = 1
    stride = 1
    while 2 * stride < count:
        stride *= 2
    while stride >= 1:
        for i in range(stride, count, 2 * stride):
            checks += 1
            _between(qa, qb, i / count, q)
            if not _is_free(q, arm, scene, links, spheres, covers, solids):
                return False, checks
        stride //= 2
    return True, checks
