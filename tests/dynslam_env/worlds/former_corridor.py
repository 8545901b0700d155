"""What the corridor's generator drew before all worlds came from floor plans (version 0.1)."""

import math

# seed -> doors: hinge x (m, exact), hinge y, closed (rad), swing; total length of walls, m
DOORS = {
    0: [("0x1.233df80bb81abp+1", 1.12, math.pi, -1), ("0x1.192f8ad08da8ep+2", 1.12, 0.0, 1),
        ("0x1.d64122497a7acp+2", 1.12, math.pi, -1), ("0x1.494593591c3c6p+3", 1.12, 0.0, 1),
        ("0x1.adee2923e8f50p+0", -1.12, math.pi, 1), ("0x1.a0d21117a29ddp+1", -1.12, 0.0, -1),
        ("0x1.f69a55488e85bp+2", -1.12, math.pi, 1), ("0x1.59285b2c625f1p+3", -1.12, math.pi, 1)],
    1: [("0x1.38acc857c5e27p+1", 1.12, math.pi, -1), ("0x1.47c972588001ap+2", 1.12, math.pi, -1),
        ("0x1.e0061e4afcb09p+2", 1.12, 0.0, 1), ("0x1.4e11f44fc18d5p+3", 1.12, math.pi, -1),
        ("0x1.eb0bdd40a4c10p+0", -1.12, math.pi, 1), ("0x1.1fe48bd591b98p+2", -1.12, math.pi, 1),
        ("0x1.9ebbe2dfa84b2p+2", -1.12, math.pi, 1), ("0x1.0439b9104c834p+3", -1.12, 0.0, -1)],
    2: [("0x1.19ff56579a3f3p+1", 1.12, math.pi, -1), ("0x1.ad4c4a3c27e66p+1", 1.12, 0.0, 1),
        ("0x1.e7d01c33b30ccp+2", 1.12, 0.0, 1), ("0x1.53f45df0f84a8p+3", 1.12, math.pi, -1),
        ("0x1.83a965e8f4098p+0", -1.12, 0.0, -1), ("0x1.4a342d4c12cdcp+2", -1.12, math.pi, 1),
        ("0x1.aa133a2a0a74cp+2", -1.12, 0.0, -1), ("0x1.52ee6a6e6de6bp+3", -1.12, math.pi, 1)],
}  # fmt: skip
LENGTH = 111.6


def side_walls(corridor, side, starts):
    """The walls of one side, m, for openings that begin at `starts`."""
    inner = side * corridor.width / 2
    outer = inner + side * corridor.wall_thickness
    far = outer + side * corridor.room_depth
    stops = [start + corridor.door_width for start in starts]
    middles = [(a + b) / 2 for a, b in zip(stops, starts[1:], strict=False)]
    lefts = [0.0, *(m + corridor.partition / 2 for m in middles)]
    rights = [*(m - corridor.partition / 2 for m in middles), corridor.length]
    begins, ends = [0.0, *stops], [*starts, corridor.length]
    walls = [(a, inner, b, inner) for a, b in zip(begins, ends, strict=True)]
    for start, stop, left, right in zip(starts, stops, lefts, rights, strict=False):
        walls += [(start, inner, start, outer), (stop, inner, stop, outer)]
        walls += [(left, outer, start, outer), (stop, outer, right, outer)]
        walls += [(left, outer, left, far), (right, outer, right, far), (left, far, right, far)]
    return walls
