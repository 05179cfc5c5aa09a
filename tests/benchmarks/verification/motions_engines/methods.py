"""Runge-Kutta methods of the engines here: stages, A by rows, and b; and the order to declare."""

ROOT = 3**0.5 / 6
METHODS = {
    "explicit Euler": (1, (1, 0, 1)),
    "implicit Euler": (1, (1, 1, 1)),
    "explicit midpoint": (2, (2, 0, 0, 0.5, 0, 0, 1)),
    "Ralston": (2, (2, 0, 0, 2 / 3, 0, 0.25, 0.75)),
    "implicit midpoint": (2, (1, 0.5, 1)),
    "Lobatto IIIA": (2, (2, 0, 0, 0.5, 0.5, 0.5, 0.5)),
    "Kutta 3": (2, (3, 0, 0, 0, 0.5, 0, 0, -1, 2, 0, 1 / 6, 2 / 3, 1 / 6)),
    "Radau IIA": (2, (2, 5 / 12, -1 / 12, 0.75, 0.25, 0.75, 0.25)),
    "RK4": (4, (4, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1, 0, 1 / 6, 1 / 3, 1 / 3, 1 / 6)),
    "RK 3/8": (4, (4, 0, 0, 0, 0, 1 / 3, 0, 0, 0, -1 / 3, 1, 0, 0, 1, -1, 1, 0, 0.125, 0.375, 0.375, 0.125)),
    "Gauss 4": (4, (2, 0.25, 0.25 - ROOT, 0.25 + ROOT, 0.25, 0.5, 0.5)),
}
