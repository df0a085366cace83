"""Collision tests compiled with numba: one call checks a configuration or a whole edge. How two solids are kept apart
is told in `apart`.

Robot and scene travel packed in one array, because a compiled call pays half a microsecond for every array it is
handed. For placements see `chain`.
"""

import numpy as np
from numba import njit

from planner.motion.apart import (
    bounds_apart,
    out_of_bounds,
    point_distance,
    point_near,
    solid_hits,
)
from planner.motion.sweep import part_within, room_for, speed, write_bends, write_relative, write_twists
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
    RIDERS,
    UPPER,
    ArmArrays,
    SceneArrays,
)

_part = njit(inline="always")
"""Written into its callers."""

_ONE_EACH = np.arange(9.0)

ROOM = 0.1
"""Metres of room beyond which nobody looks."""


@_part
def place_links(q, base, joints, links):
    """Write the placements of links 0 to 7 in W, links (8,12), at q (7,)."""
    for i in range(12):
        links[0, i] = base[i]
    for k in range(7):
        c, s = np.cos(q[k]), np.sin(q[k])
        # Read before anything is written: the compiler can't know that `links` isn't `joints`.
        a0, a1, a2, b0, b1, b2 = joints[k, 0], joints[k, 3], joints[k, 6], joints[k, 1], joints[k, 4], joints[k, 7]
        c0, c1, c2, p0, p1, p2 = joints[k, 2], joints[k, 5], joints[k, 8], joints[k, 9], joints[k, 10], joints[k, 11]
        for r in range(3):
            x, y, z, o = links[k, 3 * r], links[k, 3 * r + 1], links[k, 3 * r + 2], links[k, 9 + r]
            along, across = x * a0 + y * a1 + z * a2, x * b0 + y * b1 + z * b2
            links[k + 1, 3 * r] = c * along + s * across
            links[k + 1, 3 * r + 1] = c * across - s * along
            links[k + 1, 3 * r + 2] = x * c0 + y * c1 + z * c2
            links[k + 1, 9 + r] = o + x * p0 + y * p1 + z * p2


@njit(cache=True)
def place_all_links(q, base, joints):
    """Placements (n,8,12) of links 0 to 7 in W at q (n,7)."""
    links = np.empty((q.shape[0], 8, 12))
    for k in range(q.shape[0]):
        place_links(q[k], base, joints, links[k])
    return links


@_part
def _place_points(links, row, points, placed):
    """Write `placed`: the points (n,≥3), given in the frame of links[row], in W."""
    for i in range(points.shape[0]):
        for r in range(3):
            turned = links[row, 3 * r] * points[i, 0] + links[row, 3 * r + 1] * points[i, 1]
            placed[i, r] = links[row, 9 + r] + turned + links[row, 3 * r + 2] * points[i, 2]


@_part
def _place_spheres(links, spheres, first, placed):
    """Write `placed`: the spheres (n,4), those from first[k] on given in the frame of links[k], in W."""
    for k in range(links.shape[0]):
        # Read before anything is written, as above.
        a0, a1, a2, b0, b1, b2 = links[k, 0], links[k, 1], links[k, 2], links[k, 3], links[k, 4], links[k, 5]
        c0, c1, c2, p0, p1, p2 = links[k, 6], links[k, 7], links[k, 8], links[k, 9], links[k, 10], links[k, 11]
        for i in range(int(first[k]), int(first[k + 1])):
            x, y, z, radius = spheres[i, 0], spheres[i, 1], spheres[i, 2], spheres[i, 3]
            placed[i, 0] = p0 + (a0 * x + a1 * y) + a2 * z
            placed[i, 1] = p1 + (b0 * x + b1 * y) + b2 * z
            placed[i, 2] = p2 + (c0 * x + c1 * y) + c2 * z
            placed[i, 3] = radius


@_part
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


@_part
def _write_gaps(x0, y0, z0, x1, y1, z1, bounds, margins, part, gaps):
    """Write gaps (n,): how far world bounds (lowest, highest) and those of the obstacles, bounds (6,n), are apart along
    the axis where that is most, less the part's margins."""
    # No branch, one column after the other: this becomes vector instructions.
    lx, ly, lz, hx, hy, hz = bounds[0], bounds[1], bounds[2], bounds[3], bounds[4], bounds[5]
    margin = margins[part]
    for k in range(gaps.shape[0]):
        x, y, z = max(lx[k] - x1, x0 - hx[k]), max(ly[k] - y1, y0 - hy[k]), max(lz[k] - z1, z0 - hz[k])
        gaps[k] = max(x, max(y, z)) - margin[k]


@_part
def _solid_room(solids, s, own, scene, gaps, room):
    """Metres, at most `room`, that placed solid s may move before it comes too near to an obstacle; −1: it is."""
    # The loop over the obstacles is in here: every call counts references to every array.
    part = int(solids[s, PART])
    x0, y0, z0 = solids[s, LOWER], solids[s, LOWER + 1], solids[s, LOWER + 2]
    x1, y1, z1 = solids[s, UPPER], solids[s, UPPER + 1], solids[s, UPPER + 2]
    _write_gaps(x0, y0, z0, x1, y1, z1, scene.bounds, scene.margins, part, gaps)
    for k in range(gaps.shape[0]):
        if gaps[k] < 0.0:
            if solid_hits(solids, s, own, scene.obstacles, k, scene.corners, scene.margins[part, k]):
                return -1.0
            room = 0.0
        room = min(room, gaps[k])
    return max(room, 0.0)


@njit(cache=True)
def hand_contacts(links, solids, own, obstacles, corners, margins):
    """Which obstacles do the solids, riding on a link placed at links[0] (1,12), come too near to? (n,) of bool.

    own, corners: the corners of the solids and of the obstacles.
    """
    placed = np.empty((solids.shape[0], OBSTACLE_COLUMNS))
    _place_solids(links, 0, solids, placed)
    hits = np.zeros(obstacles.shape[0], dtype=np.bool_)
    for k in range(obstacles.shape[0]):
        for s in range(solids.shape[0]):
            margin = margins[int(solids[s, PART]), k]
            if margin == -np.inf or bounds_apart(placed, s, obstacles, k, margin):
                continue
            if solid_hits(placed, s, own, obstacles, k, corners, margin):
                hits[k] = True
                break
    return hits


@_part
def _link_room(covers, spheres, first, link, scene, gaps, room):
    """The same for the placed spheres of a link."""
    x, y, z, cover = covers[link, 0], covers[link, 1], covers[link, 2], covers[link, 3]
    _write_gaps(
        x - cover, y - cover, z - cover, x + cover, y + cover, z + cover, scene.bounds, scene.margins, link, gaps
    )
    obstacles = scene.obstacles
    for k in range(gaps.shape[0]):
        if gaps[k] > room or (gaps[k] > 0.0 and room == 0.0):
            continue
        margin = scene.margins[link, k]
        for s in range(int(first[link]), int(first[link + 1])):
            x, y, z, reach = spheres[s, 0], spheres[s, 1], spheres[s, 2], spheres[s, 3] + margin
            if out_of_bounds(x, y, z, reach + room, obstacles, k):
                continue
            gap = point_distance(x, y, z, obstacles, k) - reach
            if gap < 0.0 and point_near(x, y, z, reach, obstacles, k, scene.corners):
                return -1.0
            room = min(room, max(gap, 0.0))
    return room


@_part
def _spheres_beyond(spheres, s, others, t, gap):
    dx, dy, dz = spheres[s, 0] - others[t, 0], spheres[s, 1] - others[t, 1], spheres[s, 2] - others[t, 2]
    reach = spheres[s, 3] + others[t, 3] + gap
    return dx * dx + dy * dy + dz * dz >= reach * reach


@_part
def _links_part(covers, spheres, first, pairs, relative, part):
    """The part of the edge, at most `part`, along which no two links of a pair can come too near; −1: they are."""
    for n in range(pairs.shape[0]):
        outer, inner, margin = int(pairs[n, 0]), int(pairs[n, 1]), pairs[n, 2]
        rate = relative[inner, outer]
        if _spheres_beyond(covers, outer, covers, inner, margin + rate * part):
            continue
        for s in range(int(first[outer]), int(first[outer + 1])):
            for t in range(int(first[inner]), int(first[inner + 1])):
                if _spheres_beyond(spheres, s, spheres, t, margin + rate * part):
                    continue
                if not _spheres_beyond(spheres, s, spheres, t, margin):
                    return -1.0
                dx, dy = spheres[s, 0] - spheres[t, 0], spheres[s, 1] - spheres[t, 1]
                dz = spheres[s, 2] - spheres[t, 2]
                gap = np.sqrt(dx * dx + dy * dy + dz * dz) - spheres[s, 3] - spheres[t, 3] - margin
                part = max(0.0, gap) / (rate + 1e-12)
    return part


@_part
def _beyond_bound(spheres, t, solids, s, gap):
    """Is placed sphere t further than the gap from the sphere about placed solid s?"""
    p = PLACE + 9
    dx, dy, dz = spheres[t, 0] - solids[s, p], spheres[t, 1] - solids[s, p + 1], spheres[t, 2] - solids[s, p + 2]
    return dx * dx + dy * dy + dz * dz > (spheres[t, 3] + solids[s, BOUND] + gap) ** 2


@_part
def _hand_part(solids, own, covers, spheres, first, pairs, relative, part):
    """The same for solids on the hand and links."""
    for n in range(pairs.shape[0]):
        s, link, margin = int(pairs[n, 0]), int(pairs[n, 1]), pairs[n, 2]
        rate = relative[link, RIDERS]
        if _beyond_bound(covers, link, solids, s, margin + rate * part):
            continue
        for t in range(int(first[link]), int(first[link + 1])):
            if _beyond_bound(spheres, t, solids, s, margin + rate * part):
                continue
            x, y, z, reach = spheres[t, 0], spheres[t, 1], spheres[t, 2], spheres[t, 3] + margin
            gap = point_distance(x, y, z, solids, s) - reach
            if gap < 0.0 and point_near(x, y, z, reach, solids, s, own):
                return -1.0
            if gap < rate * part:
                part = max(0.0, gap) / (rate + 1e-12)
    return part


@_part
def _free_part(q, way, arm, scene, room, links, spheres, covers, solids, twists, gaps, bends, relative):
    """The part of the edge, either way from q on it, that is surely free; −1: q is not.

    way (7,): from the edge's beginning to its end. room: metres beyond which nobody looks. bends, relative: of the
    edge, see `sweep`. The other arrays are workspaces.
    """
    place_links(q, arm.base, arm.joints, links)
    _place_solids(links, 7, arm.solids, solids)
    write_twists(way, links, twists)
    part, p = 1.0, PLACE + 9
    for s in range(solids.shape[0]):
        radius = np.sqrt(solids[s, HALF] ** 2 + solids[s, HALF + 1] ** 2 + solids[s, HALF + 2] ** 2)
        rate = speed(solids[s, p], solids[s, p + 1], solids[s, p + 2], radius, 7, links, twists)
        needed = min(room, room_for(part, rate, bends[RIDERS]))
        found = _solid_room(solids, s, arm.corners, scene, gaps, needed)
        if found < 0.0:
            return -1.0
        part = min(part, part_within(found, rate, bends[RIDERS]))
    _place_spheres(links, arm.spheres, arm.first, spheres)
    _place_spheres(links, arm.covers, _ONE_EACH, covers)
    for link in range(7, 0, -1):
        rate = speed(covers[link, 0], covers[link, 1], covers[link, 2], covers[link, 3], link, links, twists)
        needed = min(room, room_for(part, rate, bends[link]))
        found = _link_room(covers, spheres, arm.first, link, scene, gaps, needed)
        if found < 0.0:
            return -1.0
        part = min(part, part_within(found, rate, bends[link]))
    part = _links_part(covers, spheres, arm.first, scene.link_pairs, relative, part)
    if part < 0.0:
        return -1.0
    return _hand_part(solids, arm.corners, covers, spheres, arm.first, scene.solid_pairs, relative, part)


@_part
def _between(qa, qb, fraction, q):
    for k in range(7):
        q[k] = qa[k] + (qb[k] - qa[k]) * fraction


@njit(cache=True)
def _edge_steps(qa, qb, arm, links, q, places, joint_step, travel_step):
    """Number of equal steps from qa to qb of at most `joint_step` rad a joint and about `travel_step` metres of
    the hand (its chords over both halves of the edge, a tenth added). places (3,n,3): workspace."""
    widest = 0.0
    for k in range(7):
        widest = max(widest, abs(qb[k] - qa[k]))
    n = arm.probes.shape[0]
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
def _blocked(qa, qb, arm, scene, done, links, q, spheres, covers, solids, twists, gaps, way, bends, relative):
    """Configurations checked on the edge, less than 0 if the last was in collision. done (n+1,): those of its n+1
    configurations that needn't be checked; the arrays after it are workspaces."""
    for k in range(7):
        way[k] = qb[k] - qa[k]
    write_bends(way, arm.turning, bends)
    write_relative(way, arm.turning, relative)
    count = done.shape[0] - 1
    checks, stride = 0, 1
    while stride < count:
        stride *= 2
    first = count
    while stride >= 1:
        for i in range(first, count + 1, 2 * stride):
            if done[i]:
                continue
            checks += 1
            _between(qa, qb, i / count, q)
            part = _free_part(q, way, arm, scene, ROOM, links, spheres, covers, solids, twists, gaps, bends, relative)
            if part < 0.0:
                return -checks
            around = int(count * part)
            for j in range(max(0, i - around), min(count, i + around) + 1):
                done[j] = True
        stride //= 2
        first = stride
    return checks


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
        _table(packed, 9),
    )
    scene = SceneArrays(
        _table(packed, 10),
        _table(packed, 11),
        _table(packed, 12),
        _table(packed, 13),
        _table(packed, 14),
        _table(packed, 15),
    )
    return arm, scene


@njit(cache=True)
def edge_is_free(qa, qb, packed, joint_step, travel_step):
    """Is the straight edge from qa to qb (both (7,)) free, given that qa is? For qb = qa: is qb free?

    `packed`: robot and scene, see `tables.pack`. Returns the answer and the number of configurations
    checked. The end comes first, then the middle, then the quarters: a blocked edge is found
    blocked soon. What is surely free because it is near to one that has room is left out.
    """
    arm, scene = unpack(packed)
    for k in range(7):
        if not (arm.limits[0, k] <= qb[k] <= arm.limits[1, k]):
            return False, 1
    links, q, way, bends = np.empty((8, 12)), np.empty(7), np.empty(7), np.empty(9)
    twists, relative, gaps = np.empty((8, 6)), np.empty((8, 9)), np.empty(scene.obstacles.shape[0])
    spheres, covers = np.empty((arm.spheres.shape[0], 4)), np.empty((8, 4))
    solids, places = np.empty((arm.solids.shape[0], OBSTACLE_COLUMNS)), np.empty((3, arm.probes.shape[0], 3))
    done = np.zeros(1 + _edge_steps(qa, qb, arm, links, q, places, joint_step, travel_step), dtype=np.bool_)
    checks = _blocked(qa, qb, arm, scene, done, links, q, spheres, covers, solids, twists, gaps, way, bends, relative)
    return checks > 0, abs(checks)
