"""Map layers: static, changing, free and unknown cells, and the doors among the changing ones."""

from slam.layers.layers import Layers, layers

__all__ = ["Layers", "layers"]
