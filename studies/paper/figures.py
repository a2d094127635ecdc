"""The simulated figures of the paper, by number; figures 12 to 14 show the experiment."""

from .drawing import PaperFigure
from .motion_figures import colliding_and_free, definitions, exponents
from .response_figures import clearance, continuous, damping, levels
from .similarity_figures import cubic, extreme_orders, forces, orders

FIGURES: dict[int, PaperFigure] = {
    1: forces,
    2: definitions,
    3: levels,
    4: colliding_and_free,
    5: damping,
    6: continuous,
    7: cubic,
    8: orders,
    9: extreme_orders,
    10: exponents,
    11: clearance,
}
