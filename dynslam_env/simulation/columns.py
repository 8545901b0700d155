"""Columns of `Bodies.parts`: what does not change of the bodies of a world."""

# of the robot and of people: 1/kg, 1/(kg m^2), N s and N m s in a physics step, m
INVERSE_MASS, INVERSE_INERTIA, MAX_PULL, MAX_TURN, RADIUS = 0, 1, 2, 3, 4
# of leaves, whose INVERSE_INERTIA is in the same column: rad, rad, N m s, m, m, m
MIN_ANGLE, MAX_ANGLE, MAX_MOTOR, WIDTH, SIDE, MARGIN = 2, 3, 4, 5, 6, 7
COUNT = 8
