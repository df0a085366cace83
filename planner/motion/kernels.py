"""Collision tests compiled with numba: one call checks a configuration or a whole edge.

Solids are boxes, cylinders, spheres and hulls with half extents about their centre. A sphere against
anything is exact. Two solids that aren't spheres are held apart by a separating axis: among the
axes tried, one along which both are further apart than the margin. For two boxes these are the
classic fifteen (Gottschalk, Lin, Manocha: OBBTree, 1996), exact at margin zero; with a margin, two corners
facing each other may be rejected that are apart by a little more. A cylinder against a box or a
cylinder may be rejected half a millimetre too early on average, rarely a centimetre, where its rim faces an
edge. Hulls are tested by `gjk`, exactly but for margins below zero. Never is a pair accepted that is nearer than
its margin.

Everything travels in few, flat tables, because a compiled call pays for every array it is handed. For
placements see `chain`.
"""

import numpy as np
from numba import njit

from planner.motion.gjk import surely_apart
from planner.motion.tables import (
    BOUND,
    COUNT,
    CYLINDER,
    FACES,
    FIRST,
    HALF,
    HULL,
    KIND,
    LOWER,
    OBSTACLE_COLUMNS,
    PART,
    PLACE,
    SPHERE,
    UPPER,
    ArmArrays,
    SceneArrays,
)


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
def _place_spheres(links, row, spheres, start, stop, placed):
    """Write `placed`: the spheres (n,4) from start to stop, given in the frame of links[row], in W."""
    for i in range(start, stop):
        for r in range(3):
            turned = links[row, 3 * r] * spheres[i, 0] + links[row, 3 * r + 1] * spheres[i, 1]
            placed[i, r] = links[row, 9 + r] + turned + links[row, 3 * r + 2] * spheres[i, 2]
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
def _distance(dx, dy, dz, solids, k):
    """Distance from solid k of a point that is d away from its centre (0 inside)."""
    R = PLACE
    x = solids[k, R] * dx + solids[k, R + 3] * dy + solids[k, R + 6] * dz
    y = solids[k, R + 1] * dx + solids[k, R + 4] * dy + solids[k, R + 7] * dz
    z = solids[k, R + 2] * dx + solids[k, R + 5] * dy + solids[k, R + 8] * dz
    if solids[k, KIND] == SPHERE:
        return max(0.0, np.sqrt(x * x + y * y + z * z) - solids[k, HALF])
    z = max(0.0, abs(z) - solids[k, HALF + 2])
    if solids[k, KIND] == CYLINDER:
        x, y = max(0.0, np.sqrt(x * x + y * y) - solids[k, HALF]), 0.0
    else:
        x, y = max(0.0, abs(x) - solids[k, HALF]), max(0.0, abs(y) - solids[k, HALF + 1])
    return np.sqrt(x * x + y * y + z * z)


@njit(cache=True)
def _out_of_bounds(x, y, z, reach, obstacles, k):
    """Is the cube of half side `reach` about the point clear of the obstacle's world bounds?"""
    return (
        x + reach < obstacles[k, LOWER]
        or x - reach > obstacles[k, UPPER]
        or y + reach < obstacles[k, LOWER + 1]
        or y - reach > obstacles[k, UPPER + 1]
        or z + reach < obstacles[k, LOWER + 2]
        or z - reach > obstacles[k, UPPER + 2]
    )


@njit(cache=True)
def _bounds_apart(solids, s, obstacles, k, margin):
    """Are the world bounds of placed solid s and of obstacle k further apart than the margin?"""
    for i in range(3):
        if solids[s, LOWER + i] - margin > obstacles[k, UPPER + i]:
            return True
        if solids[s, UPPER + i] + margin < obstacles[k, LOWER + i]:
            return True
    return False


@njit(cache=True)
def _point_near(x, y, z, reach, solids, k, corners):
    """Does the point come nearer than `reach` to placed solid k?"""
    p = PLACE + 9
    dx, dy, dz = x - solids[k, p], y - solids[k, p + 1], z - solids[k, p + 2]
    if solids[k, KIND] != HULL:
        return _distance(dx, dy, dz, solids, k) < reach
    if dx * dx + dy * dy + dz * dz >= (reach + solids[k, BOUND]) ** 2:
        return False
    point = np.zeros((1, OBSTACLE_COLUMNS))
    point[0, KIND], point[0, p], point[0, p + 1], point[0, p + 2] = SPHERE, x, y, z
    return not surely_apart(point, 0, corners, solids, k, corners, reach)


@njit(cache=True)
def _sphere_hits(x, y, z, reach, obstacles, k, corners):
    """Does a sphere of radius `reach` (margin included) touch obstacle k?"""
    return not _out_of_bounds(x, y, z, reach, obstacles, k) and _point_near(x, y, z, reach, obstacles, k, corners)


@njit(cache=True)
def _half_width(nx, ny, nz, solids, k):
    """Half the extent of box or cylinder k along the unit axis n."""
    R = PLACE
    z = abs(nx * solids[k, R + 2] + ny * solids[k, R + 5] + nz * solids[k, R + 8])
    if solids[k, KIND] == CYLINDER:
        return solids[k, HALF] * np.sqrt(max(0.0, 1.0 - z * z)) + solids[k, HALF + 2] * z
    x = abs(nx * solids[k, R] + ny * solids[k, R + 3] + nz * solids[k, R + 6])
    y = abs(nx * solids[k, R + 1] + ny * solids[k, R + 4] + nz * solids[k, R + 7])
    return solids[k, HALF] * x + solids[k, HALF + 1] * y + solids[k, HALF + 2] * z


@njit(cache=True)
def _unit_separates(nx, ny, nz, dx, dy, dz, first, i, second, j, margin):
    """Does the unit axis n keep two solids, d apart from centre to centre, further apart than the margin?"""
    gap = abs(nx * dx + ny * dy + nz * dz) - margin
    return gap > _half_width(nx, ny, nz, first, i) + _half_width(nx, ny, nz, second, j)


@njit(cache=True)
def _separates(nx, ny, nz, dx, dy, dz, first, i, second, j, margin):
    """The same for an axis of any length; one of no length separates nothing."""
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    if length < 1e-6:
        return False
    return _unit_separates(nx / length, ny / length, nz / length, dx, dy, dz, first, i, second, j, margin)


@njit(cache=True)
def _radial_axis_separates(dx, dy, dz, solids, s, first, i, second, j, margin):
    """The axis from centre to centre, square to the axis of cylinder s of `solids`."""
    ax, ay, az = solids[s, PLACE + 2], solids[s, PLACE + 5], solids[s, PLACE + 8]
    along = dx * ax + dy * ay + dz * az
    return _separates(dx - along * ax, dy - along * ay, dz - along * az, dx, dy, dz, first, i, second, j, margin)


@njit(cache=True)
def solids_apart(first, i, second, j, margin):
    """Are two boxes or cylinders surely further apart than `margin`? Conservative, as the module says."""
    p, R = PLACE + 9, PLACE
    dx, dy, dz = second[j, p] - first[i, p], second[j, p + 1] - first[i, p + 1], second[j, p + 2] - first[i, p + 2]
    for c in range(3):
        nx, ny, nz = first[i, R + c], first[i, R + 3 + c], first[i, R + 6 + c]
        if _unit_separates(nx, ny, nz, dx, dy, dz, first, i, second, j, margin):
            return True
        nx, ny, nz = second[j, R + c], second[j, R + 3 + c], second[j, R + 6 + c]
        if _unit_separates(nx, ny, nz, dx, dy, dz, first, i, second, j, margin):
            return True
    for c in range(3):
        ax, ay, az = first[i, R + c], first[i, R + 3 + c], first[i, R + 6 + c]
        for e in range(3):
            bx, by, bz = second[j, R + e], second[j, R + 3 + e], second[j, R + 6 + e]
            nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            if _separates(nx, ny, nz, dx, dy, dz, first, i, second, j, margin):
                return True
    if first[i, KIND] == CYLINDER and _radial_axis_separates(dx, dy, dz, first, i, first, i, second, j, margin):
        return True
    if second[j, KIND] == CYLINDER and _radial_axis_separates(dx, dy, dz, second, j, first, i, second, j, margin):
        return True
    return _separates(dx, dy, dz, dx, dy, dz, first, i, second, j, margin)


@njit(cache=True)
def _solid_hits(solids, s, own, obstacles, k, corners, margin):
    """Does solid s of the hand (corners `own`), placed in W, come nearer to obstacle k than the margin?"""
    p = PLACE + 9
    if solids[s, KIND] == HULL or obstacles[k, KIND] == HULL:
        return not surely_apart(solids, s, own, obstacles, k, corners, margin)
    x, y, z = solids[s, p], solids[s, p + 1], solids[s, p + 2]
    if solids[s, KIND] == SPHERE:
        return _sphere_hits(x, y, z, solids[s, HALF] + margin, obstacles, k, corners)
    if obstacles[k, KIND] == SPHERE:
        dx, dy, dz = obstacles[k, p] - x, obstacles[k, p + 1] - y, obstacles[k, p + 2] - z
        return _distance(dx, dy, dz, solids, s) < obstacles[k, HALF] + margin
    return not solids_apart(solids, s, obstacles, k, margin)


@njit(cache=True)
def _hand_hits(solids, own, obstacles, k, corners, margins):
    """Does any of the placed solids come too near to obstacle k?"""
    for s in range(solids.shape[0]):
        margin = margins[int(solids[s, PART]), k]
        if margin == -np.inf or _bounds_apart(solids, s, obstacles, k, margin):
            continue
        if _solid_hits(solids, s, own, obstacles, k, corners, margin):
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
        hits[k] = _hand_hits(placed, own, obstacles, k, corners, margins)
    return hits


@njit(cache=True)
def _links_hit(covers, spheres, first, obstacles, corners, margins):
    """Do the placed spheres of links 1 to 7 come too near to something?"""
    for link in range(1, 8):
        x, y, z, cover = covers[link, 0], covers[link, 1], covers[link, 2], covers[link, 3]
        for k in range(obstacles.shape[0]):
            margin = margins[link, k]
            if margin == -np.inf or _out_of_bounds(x, y, z, cover + margin, obstacles, k):
                continue
            for s in range(first[link], first[link + 1]):
                reach = spheres[s, 3] + margin
                if _sphere_hits(spheres[s, 0], spheres[s, 1], spheres[s, 2], reach, obstacles, k, corners):
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
        for s in range(first[a], first[a + 1]):
            for t in range(first[b], first[b + 1]):
                if _spheres_meet(spheres, s, spheres, t, margin):
                    return True
    return False


@njit(cache=True)
def _hand_meets_arm(solids, own, spheres, first, pairs):
    p = PLACE + 9
    for n in range(pairs.shape[0]):
        s, link = int(pairs[n, 0]), int(pairs[n, 1])
        for t in range(first[link], first[link + 1]):
            reach = spheres[t, 3] + pairs[n, 2]
            dx, dy = spheres[t, 0] - solids[s, p], spheres[t, 1] - solids[s, p + 1]
            dz = spheres[t, 2] - solids[s, p + 2]
            if dx * dx + dy * dy + dz * dz > (reach + solids[s, BOUND]) ** 2:
                continue
            if _point_near(spheres[t, 0], spheres[t, 1], spheres[t, 2], reach, solids, s, own):
                return True
    return False


@njit(cache=True)
def _is_free(q, arm, scene, links, spheres, covers, solids):
    """The check itself; the last four are workspaces."""
    place_links(q, arm.base, arm.joints, links)
    _place_solids(links, 7, arm.solids, solids)
    for k in range(scene.obstacles.shape[0]):
        if _hand_hits(solids, arm.corners, scene.obstacles, k, scene.corners, scene.margins):
            return False
    for link in range(8):
        _place_spheres(links, link, arm.spheres, arm.first[link], arm.first[link + 1], spheres)
        _place_spheres(links, link, arm.covers, link, link + 1, covers)
    if _links_hit(covers, spheres, arm.first, scene.obstacles, scene.corners, scene.margins):
        return False
    if _links_meet(covers, spheres, arm.first, scene.link_pairs):
        return False
    return not _hand_meets_arm(solids, arm.corners, spheres, arm.first, scene.solid_pairs)


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
    places = np.empty((3, n, 4))
    for half in range(3):
        _between(qa, qb, half / 2, q)
        place_links(q, arm.base, arm.joints, links)
        _place_spheres(links, 7, arm.probes, 0, n, places[half])
    travel = 0.0
    for half in range(2):
        for m in range(n):
            square = 0.0
            for i in range(3):
                square += (places[half + 1, m, i] - places[half, m, i]) ** 2
            travel = max(travel, 2.2 * np.sqrt(square))
    return max(1, int(np.ceil(widest / joint_step)), int(np.ceil(travel / travel_step)))


@njit(cache=True)
def edge_is_free(qa, qb, joint_step, travel_step, *tables):
    """Is the straight edge from qa to qb (both (7,)) free, given that qa is? For qb = qa: is qb free?

    `tables` are those of ArmArrays, then those of SceneArrays (a call with plain arrays costs a
    third of one with tuples of arrays). Returns the answer and the number of configurations
    checked. The end comes first, then the middle, then the quarters: a blocked edge is found
    blocked soon.
    """
    arm, scene = ArmArrays(*tables[:9]), SceneArrays(*tables[9:])
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
