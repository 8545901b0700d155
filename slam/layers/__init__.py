"""The map in layers: what always stands, what changes, what is unknown."""

from slam.layers.layers import Layers, layers

__all__ = ["Layers", "layers"]
