"""The likelihood field of `Endpoint`: kernels that update it and evaluate it.

The field is stored in tiles, and interpolated by a quadratic B-spline: a weighted mean of the nine
samples around a point, continuously differentiable, with a gradient and a curvature everywhere.
"""

from __future__ import annotations

import numpy as np

from slam.kernel import kernel
from slam.maps.tiles import MASK, SHIFT, TILE
from slam.sensor_models.blocks import BLOCK, BLOCKS, cell_at

NO_CENTROID = -128  # of a cell without an echo
H_MIN, H_MAX = 5, 250  # of 255: h is clipped to these, about 0.02 and 0.98
MIN_CENTROID_CHANGE = 12  # 1/256 of a cell; smaller changes of a centroid are ignored
MIN_H_CHANGE = 6  # of 255; smaller changes of h are ignored, except at the limits
NO_CENTROIDS = np.uint64(0x8080808080808080)  # the same of four cells
U_0, U_1, U_2 = np.uint64(0), np.uint64(1), np.uint64(2)  # unsigned: numba need not check the sign
U_MASK, U_SHIFT, U_BLOCK = np.uint64(MASK), np.uint64(SHIFT), np.uint64(BLOCK)
U_TILE = np.uint64(TILE)
NEAR_UNKNOWN = np.float32(0.003)  # nats: the field is tabulated
BESIDE = 0.15  # m, from unknown ground, see `raise_known`
KNOWN, EXPLAINED = 1, 2  # of an echo, see `raise_known`
HALF, ONE, TWO = np.float32(0.5), np.float32(1.0), np.float32(2.0)
PART = 64  # points whose slopes are computed together
U_PART = np.uint64(PART)
ROW = tuple(np.uint64(PART * row) for row in range(13))  # where each row of PART numbers begins


@kernel
def mark_stale(
    changed, occupied, offset, count, h_level, centroid, stale, places, corner, index, radius
):
    """Copy h and centroids of the changed cells; returns the blocks that they affect, each once.

    A cell without an echo counts as free if its h is below the prior, which h_level[0] holds.

    h_level   (cells,) uint8, h in 1/255, quantised; written
    centroid  (cells, 2) int8, the centroid in 1/256 of a cell; written
    stale     (slots, BLOCKS^2) bool, whether a block is in the result; written
    places    (slots, 2) rows and columns of the tiles in the lattice; `corner` of `index`'s first
    radius    cells, up to which an echo affects the field
    """
    unknown = np.float32(h_level[0] - 0.5) / np.float32(255.0)
    blocks = np.empty((max(len(changed), 64), 2), np.int32)
    n = 0
    for k in range(len(changed)):
        margin, cell = 0, np.uint64(changed[k])
        if count[cell]:
            h = min(max(np.int64(occupied[cell] * np.float32(255.0) + HALF), H_MIN), H_MAX)
            dx, dy = max(offset[cell, 0] >> 8, -127), max(offset[cell, 1] >> 8, -127)
            if (
                (
                    abs(h - h_level[cell]) < MIN_H_CHANGE
                    and (H_MIN < h < H_MAX or h == h_level[cell])
                )
                and abs(dx - centroid[cell, 0]) < MIN_CENTROID_CHANGE
                and abs(dy - centroid[cell, 1]) < MIN_CENTROID_CHANGE
            ):
                continue
            h_level[cell], centroid[cell, 0], centroid[cell, 1] = h, dx, dy
            margin = radius
        else:
            h = H_MIN if occupied[cell] < unknown else np.int64(h_level[0])
            if h == h_level[cell]:
                continue
            h_level[cell] = h
        slot, i, j = changed[k] >> (2 * SHIFT), (changed[k] >> SHIFT) & MASK, changed[k] & MASK
        if margin == 0 and stale[slot, (i // BLOCK) * BLOCKS + j // BLOCK]:
            continue  # as most cells that beams crossed
        row = ((places[slot, 0] - corner[0]) << SHIFT) + i
        col = ((places[slot, 1] - corner[1]) << SHIFT) + j
        for r in range((row - margin) // BLOCK, (row + margin) // BLOCK + 1):
            for c in range((col - margin) // BLOCK, (col + margin) // BLOCK + 1):
                tile = index[r // BLOCKS, c // BLOCKS]
                block = (r % BLOCKS) * BLOCKS + c % BLOCKS
                if tile and not stale[tile, block]:
                    stale[tile, block] = True
                    if n == len(blocks):
                        more = np.empty((2 * n, 2), np.int32)
                        more[:n] = blocks
                        blocks = more
                    blocks[n, 0], blocks[n, 1] = r, c
                    n += 1
    return blocks[:n]


@kernel
def refresh(blocks, stale, index, h_level, centroid, field, falloff, log_h, table):
    """Compute log(z_hit F + z_rand) at the centres of the cells of the blocks.

    A cell with an echo is occupied at the centroid of its echoes only, and free elsewhere.

    falloff  1 / (2 sigma^2) per cell^2
    log_h    (256,) log h by its quantised level
    table    (n,) log(z_hit F + z_rand), evenly spaced in log F from its maximum to its minimum
    """
    best, aside = np.empty(BLOCK * BLOCK, np.float32), np.empty(BLOCK, np.float32)
    top, steps = log_h[255], np.float32((len(table) - 1) / (log_h[255] - log_h[0]))
    reach = np.sqrt((top - log_h[0]) / falloff)  # cells, beyond which no echo counts
    radius = np.int64(reach + HALF)  # the same, from the cell of the echo
    sources = np.empty(((BLOCK + 2 * radius) ** 2, 3), np.float32)
    words = centroid.reshape(-1).view(np.uint64)
    for k in range(len(blocks)):
        row, col = blocks[k, 0] * BLOCK, blocks[k, 1] * BLOCK
        stale[index[row >> SHIFT, col >> SHIFT],
              ((row & MASK) // BLOCK) * BLOCKS + (col & MASK) // BLOCK] = False  # fmt: skip
        n, border = 0, (((col - radius) >> SHIFT) + 1) << SHIFT
        for r in range(row - radius, row + BLOCK + radius):
            left = cell_at(index, r, col - radius) - (col - radius)
            right = cell_at(index, r, col + BLOCK - 1 + radius) - (col + BLOCK - 1 + radius)
            for group in range((col - radius) // 4, (col + BLOCK - 1 + radius) // 4 + 1):
                begin = 4 * group
                cell = np.uint64((left if begin < border else right) + begin)
                if words[cell >> U_2] == NO_CENTROIDS:
                    continue
                for c in range(begin, begin + 4):
                    inside = col - radius <= c < col + BLOCK + radius
                    if inside and centroid[cell, U_0] != NO_CENTROID:
                        sources[n, 0] = log_h[h_level[cell]]
                        sources[n, 1] = c - col + centroid[cell, U_0] / np.float32(256.0)
                        sources[n, 2] = r - row + centroid[cell, U_1] / np.float32(256.0)
                        n += -reach < sources[n, 1] < BLOCK - 1 + reach
                    cell += U_1
        first = np.uint64(cell_at(index, row, col))
        for r in range(U_BLOCK):
            for c in range(U_BLOCK):
                cell = first + r * U_TILE + c
                free = centroid[cell, U_0] == NO_CENTROID
                best[r * U_BLOCK + c] = log_h[h_level[cell] if free else np.uint8(0)]
        for m in range(n):
            for c in range(BLOCK):
                dx = sources[m, 1] - np.float32(c)
                aside[c] = sources[m, 0] - falloff * (dx * dx)
            _raise(best, aside, sources[m, 2], falloff, reach)
        for r in range(U_BLOCK):
            for c in range(U_BLOCK):
                place = np.int64((top - best[r * U_BLOCK + c]) * steps + HALF)
                field[first + r * U_TILE + c] = table[np.uint64(place)]


@kernel
def _raise(best, aside, y, falloff, reach):
    """Raise log F in the cells (BLOCK^2,) of a block to that by an echo at row y, which has the
    values `aside` in its own row."""
    for r in range(max(int(np.ceil(y - reach)), 0), min(int(np.floor(y + reach)) + 1, BLOCK)):
        dy = y - np.float32(r)
        down = falloff * (dy * dy)
        for c in range(U_BLOCK):
            value, cell = aside[c] - down, np.uint64(r) * U_BLOCK + c
            best[cell] = value if value > best[cell] else best[cell]


@kernel
def sums(poses, points, index, field, origin, resolution, unknown, floor, top):
    """(n,) sum over the points, given in the robot's frame, of the field, for each pose (n, 3).

    `unknown` counts for points outside of the field. -inf if the sum is below `floor`, as soon as
    that is certain; `top` is the maximum of the field.
    """
    result = np.empty(len(poses))
    for n in range(len(poses)):
        result[n] = pose_sum(poses[n, 0], poses[n, 1], poses[n, 2], points, index, field, origin,
                             resolution, unknown, floor, top)  # fmt: skip
    return result


@kernel
def pose_sum(
    robot_x, robot_y, theta, points, index, field, origin, resolution, unknown, floor, top
):
    """The sum of `sums` for one pose."""
    scale = 1.0 / resolution
    rows, cols = (index.shape[0] << SHIFT) - 1.0, (index.shape[1] << SHIFT) - 1.0
    c, s = np.cos(theta) * scale, np.sin(theta) * scale
    x0, y0 = (robot_x - origin[0]) * scale, (robot_y - origin[1]) * scale
    total = 0.0
    for k in range(len(points)):
        x = x0 + c * points[k, 0] - s * points[k, 1]
        y = y0 + s * points[k, 0] + c * points[k, 1]
        if total + (len(points) - k) * top < floor:
            return -np.inf
        if not (x >= 1.0 and y >= 1.0 and x < cols and y < rows):
            total += unknown
            continue
        r, q = np.int64(y), np.int64(x)
        fy, fx = np.float32(y - r), np.float32(x - q)
        i, j = np.uint64(r), np.uint64(q)
        u2, v2 = HALF * fx * fx, HALF * fy * fy
        u0, v0 = HALF - fx + u2, HALF - fy + v2
        u1, v1 = ONE - u0 - u2, ONE - v0 - v2
        row, col = i & U_MASK, j & U_MASK
        if U_0 < row < U_MASK and U_0 < col < U_MASK:
            a = (np.uint64(index[i >> U_SHIFT, j >> U_SHIFT]) << (U_SHIFT + U_SHIFT)) + (
                (row << U_SHIFT) + col
            )
            b, c_ = a - U_TILE, a + U_TILE
            total += (
                v0 * (u0 * field[b - U_1] + u1 * field[b] + u2 * field[b + U_1])
                + v1 * (u0 * field[a - U_1] + u1 * field[a] + u2 * field[a + U_1])
                + v2 * (u0 * field[c_ - U_1] + u1 * field[c_] + u2 * field[c_ + U_1])
            )
        else:
            total += (
                v0 * _row(index, field, r - 1, q, u0, u1, u2)
                + v1 * _row(index, field, r, q, u0, u1, u2)
                + v2 * _row(index, field, r + 1, q, u0, u1, u2)
            )
    return total


@kernel
def _row(index, field, i, j, u0, u1, u2):
    return (u0 * field[cell_at(index, i, j - 1)] + u1 * field[cell_at(index, i, j)]
            + u2 * field[cell_at(index, i, j + 1)])  # fmt: skip


@kernel
def counts(x, y, theta, points, index, field, origin, resolution, low, high):
    """Numbers of points, given in the robot's frame, where the field is above `high`, and below
    `low`."""
    c, s = np.cos(theta), np.sin(theta)
    above = below = 0
    for k in range(len(points)):
        px, py = x + c * points[k, 0] - s * points[k, 1], y + s * points[k, 0] + c * points[k, 1]
        value = _value(px, py, index, field, origin, resolution)
        above += value > high
        below += value < low
    return above, below


@kernel
def raise_known(known, pose, points, index, field, origin, resolution, low, high):
    """Raise `known` (n,) uint8 to 1 for points, given in the frame of a robot at `pose`, where the
    field is not unknown (KNOWN), and to 2 where it is above `high` (EXPLAINED). Free ground beside
    unknown ground counts as unknown: a wall along which the robot looked may not be drawn yet."""
    x, y, c, s = pose[0], pose[1], np.cos(pose[2]), np.sin(pose[2])
    for k in range(len(points)):
        px, py = x + c * points[k, 0] - s * points[k, 1], y + s * points[k, 0] + c * points[k, 1]
        value = _value(px, py, index, field, origin, resolution)
        if value > high:
            known[k] = EXPLAINED
        elif (
            known[k] < KNOWN
            and abs(value - field[0]) >= NEAR_UNKNOWN
            and (value >= low or not _beside_unknown(px, py, index, field, origin, resolution, low))
        ):
            known[k] = KNOWN


@kernel
def _beside_unknown(x, y, index, field, origin, resolution, low):
    """Whether unknown ground, and no wall, is nearest to a free point, within about BESIDE."""
    reach = max(round(BESIDE / resolution), 1)
    unknown = wall = reach + 1  # cells to the nearest
    col, row = int((x - origin[0]) / resolution), int((y - origin[1]) / resolution)
    rows, cols = index.shape[0] << SHIFT, index.shape[1] << SHIFT
    for i in range(row - reach, row + reach + 1):
        for j in range(col - reach, col + reach + 1):
            inside = 0 <= i < rows and 0 <= j < cols
            value = field[cell_at(index, i, j) if inside else 0]
            if abs(value - field[0]) < NEAR_UNKNOWN:
                unknown = min(unknown, max(abs(i - row), abs(j - col)))
            elif value >= low:
                wall = min(wall, max(abs(i - row), abs(j - col)))
    return unknown < wall


@kernel
def behind(pose, points, views, index, field, origin, resolution, low, high):
    """The number of points, given in the frame of a robot at `pose` (x, y, theta), where the field
    is above `high`, and by `views` (n, 2), m, beyond them below `low`, but not before them."""
    x, y, c, s = pose[0], pose[1], np.cos(pose[2]), np.sin(pose[2])
    number = 0
    for k in range(len(points)):
        px, py = x + c * points[k, 0] - s * points[k, 1], y + s * points[k, 0] + c * points[k, 1]
        if _value(px, py, index, field, origin, resolution) > high:
            vx, vy = c * views[k, 0] - s * views[k, 1], s * views[k, 0] + c * views[k, 1]
            if _value(px + vx, py + vy, index, field, origin, resolution) < low:
                number += _value(px - vx, py - vy, index, field, origin, resolution) >= low
    return number


@kernel
def _value(x, y, index, field, origin, resolution):
    """The field of the cell at (x, y), m."""
    col, row = (x - origin[0]) / resolution, (y - origin[1]) / resolution
    rows, cols = index.shape[0] << SHIFT, index.shape[1] << SHIFT
    if 0.0 <= col < cols and 0.0 <= row < rows:
        return field[cell_at(index, int(row), int(col))]
    return field[0]


@kernel(error_model="numpy")
def slope(robot_x, robot_y, theta, points, index, field, origin, resolution, level, beta):
    """Value, gradient (3,) and curvature (3, 3) by the pose of the sum of a field, times `beta`.

    Each point adds the negative semi-definite part of its Hessian, so that a Newton step is an
    ascent direction everywhere, as in the Gauss-Newton method.

    field  (slots, cells) of `level`: cells 1 << level times as wide as the map's
    """
    scale, c, s = 1.0 / (resolution * (1 << level)), np.cos(theta), np.sin(theta)
    x0, y0 = (robot_x - origin[0]) * scale, (robot_y - origin[1]) * scale
    value = gx = gy = gt = xx = xy = yy = xt = yt = tt = 0.0
    samples, terms = np.empty(12 * PART, np.float32), np.empty(13 * PART)
    for begin in range(0, len(points), PART):
        end = np.uint64(min(PART, len(points) - begin))
        for k in range(end):
            x, y = points[np.uint64(begin) + k, U_0], points[np.uint64(begin) + k, U_1]
            wx, wy = c * x - s * y, s * x + c * y
            terms[ROW[9] + k], terms[ROW[10] + k] = wx, wy
            terms[ROW[11] + k], terms[ROW[12] + k] = x0 + wx * scale, y0 + wy * scale
        missing = _sample(samples, terms, end, index, field, SHIFT - level)
        _expand(samples, terms, end, scale)
        for k in missing:
            samples[ROW[11] + k] = field[0, 0]
            for row in range(9):
                terms[np.uint64(row) * U_PART + k] = 0.0
        for k in range(end):
            value += samples[ROW[11] + k]
            gx, gy, gt = gx + terms[k], gy + terms[ROW[1] + k], gt + terms[ROW[2] + k]
            xx, xy, yy = xx + terms[ROW[3] + k], xy + terms[ROW[4] + k], yy + terms[ROW[5] + k]
            xt, yt, tt = xt + terms[ROW[6] + k], yt + terms[ROW[7] + k], tt + terms[ROW[8] + k]
    g = np.array([beta * gx, beta * gy, beta * gt])
    H = np.array([[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]])
    return beta * value, g, beta * H


@kernel
def _sample(samples, terms, end, index, field, shift):
    """Write the nine samples around each of `end` points to the rows of `samples`, and then where
    between them the point lies; returns the numbers of points without samples.

    terms  rows 11 and 12: x and y in cells
    shift  log2 of the cells along the side of a tile
    """
    mask, side = (1 << shift) - 1, np.uint64(1 << shift)
    rows, cols = (index.shape[0] << shift) - 1.0, (index.shape[1] << shift) - 1.0
    cells, missing, n = field.ravel(), np.empty(PART, np.uint64), 0
    for k in range(end):
        x, y = terms[ROW[11] + k], terms[ROW[12] + k]
        if not (x >= 1.0 and y >= 1.0 and x < cols and y < rows):
            missing[n] = k
            n += 1
            continue
        i, j = np.int64(y), np.int64(x)
        samples[ROW[9] + k], samples[ROW[10] + k] = np.float32(x - j), np.float32(y - i)
        row, col = i & mask, j & mask
        if 0 < row < mask and 0 < col < mask:
            slot = np.uint64(index[np.uint64(i >> shift), np.uint64(j >> shift)])
            a = (slot * side + np.uint64(row)) * side + np.uint64(col)
            b, c = a - side, a + side
            samples[k], samples[ROW[1] + k], samples[ROW[2] + k] = (
                cells[b - U_1], cells[b], cells[b + U_1])  # fmt: skip
            samples[ROW[3] + k], samples[ROW[4] + k], samples[ROW[5] + k] = (
                cells[a - U_1], cells[a], cells[a + U_1])  # fmt: skip
            samples[ROW[6] + k], samples[ROW[7] + k], samples[ROW[8] + k] = (
                cells[c - U_1], cells[c], cells[c + U_1])  # fmt: skip
        else:
            for m in range(9):
                r, q = i + m // 3 - 1, j + m % 3 - 1
                slot = index[r >> shift, q >> shift]
                samples[np.uint64(m) * U_PART + k] = field[slot, ((r & mask) << shift) + (q & mask)]
    return missing[:n]


@kernel(error_model="numpy")
def _expand(samples, terms, end, scale):
    """Write value (row 11 of `samples`), gradient and curvature (rows 0 to 8 of `terms`: x, y, t,
    xx, xy, yy, xt, yt, tt) of each of `end` points. No branches: the compiler makes vectors of it.

    terms  rows 9 and 10: the vector from the robot to the point, m, world
    scale  cells by m
    """
    square = scale * scale
    for k in range(end):
        t00, t01, t02 = samples[k], samples[ROW[1] + k], samples[ROW[2] + k]
        t10, t11, t12 = samples[ROW[3] + k], samples[ROW[4] + k], samples[ROW[5] + k]
        t20, t21, t22 = samples[ROW[6] + k], samples[ROW[7] + k], samples[ROW[8] + k]
        fx, fy = samples[ROW[9] + k], samples[ROW[10] + k]
        u2, v2 = HALF * fx * fx, HALF * fy * fy
        u0, v0 = HALF - fx + u2, HALF - fy + v2
        u1, v1 = ONE - u0 - u2, ONE - v0 - v2
        p0, p1, p2 = fx - ONE, ONE - TWO * fx, fx
        q0, q1, q2 = fy - ONE, ONE - TWO * fy, fy
        m0 = u0 * t00 + u1 * t01 + u2 * t02
        m1 = u0 * t10 + u1 * t11 + u2 * t12
        m2 = u0 * t20 + u1 * t21 + u2 * t22
        d0 = p0 * t00 + p1 * t01 + p2 * t02
        d1 = p0 * t10 + p1 * t11 + p2 * t12
        d2 = p0 * t20 + p1 * t21 + p2 * t22
        samples[ROW[11] + k] = v0 * m0 + v1 * m1 + v2 * m2
        dx, dy = (v0 * d0 + v1 * d1 + v2 * d2) * scale, (q0 * m0 + q1 * m1 + q2 * m2) * scale
        dxx = (
            v0 * (t00 - TWO * t01 + t02)
            + v1 * (t10 - TWO * t11 + t12)
            + v2 * (t20 - TWO * t21 + t22)
        ) * square
        dyy = (m0 - TWO * m1 + m2) * square
        dxy = (q0 * d0 + q1 * d1 + q2 * d2) * square
        # the positive eigenvalue of the curvature is set to zero, or both are
        mean, apart = 0.5 * (dxx + dyy), np.sqrt(0.25 * (dxx - dyy) ** 2 + dxy * dxy)
        high, low = mean + apart, mean - apart
        share = 0.0 if low >= 0.0 else low / (low - high)  # times A - high: what `low` spans
        negative = high <= 0.0
        xx, xy, yy = share * (dxx - high), share * dxy, share * (dyy - high)
        xx, xy, yy = dxx if negative else xx, dxy if negative else xy, dyy if negative else yy
        wx, wy = terms[ROW[9] + k], terms[ROW[10] + k]
        terms[k], terms[ROW[1] + k], terms[ROW[2] + k] = dx, dy, wx * dy - wy * dx
        terms[ROW[3] + k], terms[ROW[4] + k], terms[ROW[5] + k] = xx, xy, yy
        terms[ROW[6] + k], terms[ROW[7] + k] = wx * xy - wy * xx, wx * yy - wy * xy
        terms[ROW[8] + k] = wx * wx * yy - 2.0 * wx * wy * xy + wy * wy * xx
