"""A reading of a map that changes no more, without the map."""

from __future__ import annotations

from slam.packed import PackedLayer
from slam.perception.endpoint import Endpoint


class Settled:
    """What an `Endpoint` reads of a map as it is now, kept small.

    nbytes  that are kept
    """

    def __init__(self, reading: Endpoint):
        self._parameters = reading.beta, reading.sigma, reading.z_hit, reading.z_rand
        self._field = PackedLayer(reading.tiles, reading.field())
        self.nbytes = self._field.nbytes

    def reading(self) -> Endpoint:
        """One that reads the same, and takes notice of no map."""
        reading = Endpoint(*self._parameters)
        reading.read(*self._field.unpacked())
        return reading
