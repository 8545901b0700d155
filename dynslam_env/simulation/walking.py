"""Walking of people as kernels: next waypoint, direction and speed of each person in turn."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.kernel import kernel

WAYPOINT_RADIUS = 0.15  # m, distance at which a waypoint counts as reached
BESIDE_WAYPOINT = 0.25  # m, beyond contact: counts as reached if another person stands on it
AVOIDANCE_DISTANCE = 0.5  # m between two outlines, at which people start to give way
STOP_DISTANCE = 0.08  # m between two outlines, at which they stand still
LATERAL_CLEARANCE = 0.1  # m, lateral gap at which two paths do not collide
LOOKAHEAD = 0.5  # m, of the point that people walk to, on the line between waypoints
MIN_BEND_SHARE = 0.3  # of the speed, kept in sharp bends


class Routes(NamedTuple):
    """The routes of p people.

    waypoints  (p, k, 2) m, of which `lengths` (p,) count
    gates      (p, k - 1) the door that each leg leads through, -1 for none
    """

    waypoints: Array
    lengths: np.ndarray
    gates: np.ndarray


class WalkState(NamedTuple):
    """The state of p people, changed in place.

    state  (p, 3) int, previous and next waypoint, whether walking
    clock  (p, 2) s: end of the pause (inf: to be drawn), and time since which it is blocked
    ways   (p, 2) unit vectors of the directions of walking, zero while standing
    """

    state: np.ndarray
    clock: Array
    ways: Array


@kernel
def steer(time, dt, bodies, robot, opened, people_routes: Routes, walk: WalkState, settings, out):
    """Set desired velocities; returns the number of people who reached an end of their route.

    bodies   (p, 6) x, y, angle, vx, vy, ... m, rad, s; robot x, y, radius
    opened   (d,) whether each door can be passed
    settings radius m, speed m/s, patience s, braking m/s^2
    out      (p, 2) m/s, desired velocities; written
    """
    radius, speed, patience, brake = settings
    routes, lengths, gates = people_routes
    state, clock, ways = walk
    arrived = 0
    for i in range(len(bodies)):
        out[i] = 0.0
        if not state[i, 2] and time >= clock[i, 0] and _may_go(i, opened, gates, state):
            state[i, 2] = 1
        if state[i, 2] and _there(i, radius, bodies, robot, routes, state):
            arrived += _arrive(i, lengths, gates, state, clock)
        ways[i] = 0.0
        if state[i, 2]:
            far = _aim(i, bodies, routes, state, ways)
            last = speed * _share_at_end(i, opened, routes, lengths, gates, state)
            v = min(speed, far / dt, math.sqrt(last**2 + 2.0 * brake * far))
            _go(i, v, radius, bodies, robot, ways, out)
            _lose_patience(i, dt, speed, patience, bodies, ways, state, clock)
        elif _step_aside(i, speed, radius, bodies, ways, out):
            continue
        elif not _there(i, radius, bodies, robot, routes, state):  # was pushed, or stepped aside
            far = _back(i, bodies, routes, state, ways)
            _go(i, min(0.5 * speed, far / dt), radius, bodies, robot, ways, out)
            ways[i] = 0.0
    return arrived


@kernel
def _gate(i, gates, state):
    """Index of the door on the current leg of person `i`; -1 for none."""
    return gates[i, min(state[i, 0], state[i, 1])]


@kernel
def _may_go(i, opened, gates, state):
    """Whether the leg can start: its door is open, and nobody passes through it."""
    gate = _gate(i, gates, state)
    if gate < 0:
        return True
    for k in range(len(state)):
        if k != i and state[k, 2] and _gate(k, gates, state) == gate:
            return False
    return opened[gate]


@kernel
def _there(i, radius, bodies, robot, routes, state):
    """Whether person `i` is at its waypoint, or beside it if another stands on it."""
    goal = state[i, 1] if state[i, 2] else state[i, 0]
    gx, gy = routes[i, goal]
    far = math.hypot(gx - bodies[i, 0], gy - bodies[i, 1])
    if far < WAYPOINT_RADIUS:
        return True
    for k in range(-1, len(bodies)):
        if k != i:
            ox, oy, reach = _other(k, radius, bodies, robot)
            beside = radius + reach
            if far < beside + BESIDE_WAYPOINT and math.hypot(gx - ox, gy - oy) < beside:
                return True
    return False


@kernel
def _other(k, radius, bodies, robot):
    """x, y and radius of person `k`, or of the robot for -1."""
    if k < 0:
        return robot[0], robot[1], robot[2]
    return bodies[k, 0], bodies[k, 1], radius


@kernel
def _arrive(i, lengths, gates, state, clock):
    """Person `i` at a waypoint continues, waits at a door, or pauses at an end (returns 1)."""
    at, to = state[i, 1], 2 * state[i, 1] - state[i, 0]
    end = to < 0 or to >= lengths[i]
    if end:
        to = state[i, 0]
        clock[i, 0] = np.inf  # a pause, whose end is to be drawn
    state[i, 0], state[i, 1] = at, to
    state[i, 2] = 0 if end or _gate(i, gates, state) >= 0 else 1
    clock[i, 1] = 0.0
    return 1 if end else 0


@kernel
def _share_at_end(i, opened, routes, lengths, gates, state):
    """Share of the speed at the end of the leg: 0 if the person must stop, less in a bend."""
    at, to = state[i, 0], state[i, 1]
    onward = 2 * to - at
    if onward < 0 or onward >= lengths[i]:
        return 0.0
    gate = gates[i, min(to, onward)]
    if gate >= 0 and not opened[gate]:
        return 0.0
    ax, ay = routes[i, to, 0] - routes[i, at, 0], routes[i, to, 1] - routes[i, at, 1]
    bx, by = routes[i, onward, 0] - routes[i, to, 0], routes[i, onward, 1] - routes[i, to, 1]
    return max((ax * bx + ay * by) / (math.hypot(ax, ay) * math.hypot(bx, by)), MIN_BEND_SHARE)


@kernel
def _aim(i, bodies, routes, state, ways):
    """Set the direction to the line between the waypoints and along it; returns m left to go."""
    ax, ay = routes[i, state[i, 0]]
    bx, by = routes[i, state[i, 1]]
    length = math.hypot(bx - ax, by - ay)
    dx, dy = (bx - ax) / length, (by - ay) / length
    along = (bodies[i, 0] - ax) * dx + (bodies[i, 1] - ay) * dy
    along = min(max(along, 0.0) + LOOKAHEAD, length)
    return _towards(i, ax + along * dx, ay + along * dy, bx, by, bodies, ways)


@kernel
def _back(i, bodies, routes, state, ways):
    """Set the direction back to the waypoint of person `i`; returns m left to go."""
    x, y = routes[i, state[i, 0]]
    return _towards(i, x, y, x, y, bodies, ways)


@kernel
def _towards(i, x, y, goal_x, goal_y, bodies, ways):
    dx, dy = x - bodies[i, 0], y - bodies[i, 1]
    far = math.hypot(dx, dy)
    if far > 0.0:
        ways[i, 0], ways[i, 1] = dx / far, dy / far
    return math.hypot(goal_x - bodies[i, 0], goal_y - bodies[i, 1])


@kernel
def _go(i, v, radius, bodies, robot, ways, out):
    """Walk at `v` m/s, slower and to the side of the nearest obstacle ahead."""
    ux, uy = ways[i]
    nearest, side = 0.0, 1.0
    for k in range(-1, len(bodies)):
        if k == i:
            continue
        ox, oy, reach = _other(k, radius, bodies, robot)
        dx, dy = ox - bodies[i, 0], oy - bodies[i, 1]
        gap = math.hypot(dx, dy) - radius - reach
        left = ux * dy - uy * dx
        if (
            gap < AVOIDANCE_DISTANCE
            and ux * dx + uy * dy > 0.0
            and abs(left) < radius + reach + LATERAL_CLEARANCE
        ):
            nearness = min((AVOIDANCE_DISTANCE - gap) / (AVOIDANCE_DISTANCE - STOP_DISTANCE), 1.0)
            if nearness > nearest:
                nearest, side = nearness, 1.0 if left > -LATERAL_CLEARANCE else -1.0
    out[i, 0] = v * ((1.0 - nearest) * ux + 0.5 * nearest * side * uy)  # right: (uy, -ux)
    out[i, 1] = v * ((1.0 - nearest) * uy - 0.5 * nearest * side * ux)


@kernel
def _step_aside(i, speed, radius, bodies, ways, out):
    """Let a standing person give way to a walking one; returns whether there is one."""
    for k in range(len(bodies)):
        dx, dy = bodies[i, 0] - bodies[k, 0], bodies[i, 1] - bodies[k, 1]
        gap = math.hypot(dx, dy) - 2.0 * radius
        left = ways[k, 0] * dy - ways[k, 1] * dx
        ahead = ways[k, 0] * dx + ways[k, 1] * dy
        if (
            k != i
            and gap < AVOIDANCE_DISTANCE
            and ahead > 0.0
            and abs(left) < 2.0 * radius + LATERAL_CLEARANCE
        ):
            side = (
                0.5 * speed if left > -LATERAL_CLEARANCE else -0.5 * speed
            )  # k passes on the other side
            out[i, 0], out[i, 1] = -side * ways[k, 1], side * ways[k, 0]
            return True
    return False


@kernel
def _lose_patience(i, dt, speed, patience, bodies, ways, state, clock):
    """Turn a person around who has been blocked for longer than its patience."""
    along = bodies[i, 3] * ways[i, 0] + bodies[i, 4] * ways[i, 1]
    clock[i, 1] = clock[i, 1] + dt if along < 0.2 * speed else 0.0
    if clock[i, 1] > patience * (1.0 + 0.25 * (i % 4)):
        state[i, 0], state[i, 1] = state[i, 1], state[i, 0]
        clock[i, 1] = 0.0
