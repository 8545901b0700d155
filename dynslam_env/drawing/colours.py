"""Colours of the pictures: the colour-blind safe palette of Okabe and Ito (2008), and greys."""

Colour = tuple[int, int, int]

PAPER, SOLID, FACE, INK = (255, 255, 255), (214, 218, 224), (60, 64, 72), (40, 42, 48)
FAINT, GREY, UNKNOWN = (168, 173, 182), (110, 116, 126), (190, 200, 213)
BLUE, VERMILION, ORANGE, SKY = (0, 114, 178), (213, 94, 0), (230, 159, 0), (86, 180, 233)
GREEN, PURPLE = (0, 158, 115), (204, 121, 167)
LIT, BEAM = (222, 240, 251), (189, 224, 246)  # lighter shades of SKY
