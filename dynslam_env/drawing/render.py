"""Viewer: renders a scene to an array or to a window.

pygame is imported on first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from dynslam_env.drawing.canvas import SUPERSAMPLING
from dynslam_env.drawing.picture import Painter
from dynslam_env.drawing.scene import Belief, Scene
from dynslam_env.drawing.view import View

if TYPE_CHECKING:
    import pygame

WINDOW_SUPERSAMPLING = SUPERSAMPLING // 2  # lower, for speed


class Viewer:
    """Renders scenes to arrays, or to a window if `window`, with at most `fps` per second."""

    def __init__(self, window: bool, fps: int):
        self._window, self._fps = window, fps
        self._painter = Painter(WINDOW_SUPERSAMPLING if window else SUPERSAMPLING)
        self._screen: pygame.Surface | None = None
        self._clock: Any = None

    def __getstate__(self) -> dict[str, Any]:
        """A copy has no window before its first picture."""
        return self.__dict__ | {"_screen": None, "_clock": None}

    def draw(
        self, scene: Scene, belief: Belief | None = None, view: View | None = None
    ) -> NDArray[np.uint8] | None:
        """The picture (rows, columns, 3), or None if it was shown in the window."""
        picture = self._painter.picture(scene, belief, view or View())
        if self._window:
            self._show(picture)
            return None
        return pixels(picture)

    def close(self) -> None:
        """Close the window, if any."""
        if self._screen is not None:
            import pygame

            pygame.display.quit()
            self._screen = None

    def _show(self, picture: pygame.Surface) -> None:
        import pygame

        if self._screen is None or self._screen.get_size() != picture.get_size():
            pygame.display.init()
            pygame.display.set_caption("dynslam")
            self._screen = pygame.display.set_mode(picture.get_size())
            self._clock = pygame.time.Clock()
        self._screen.blit(picture, (0, 0))
        pygame.event.pump()
        pygame.display.flip()
        self._clock.tick(self._fps)


def pixels(picture: pygame.Surface) -> NDArray[np.uint8]:
    """A copy (rows, columns, 3), in half the time of `surfarray.array3d`."""
    import pygame

    width, height = picture.get_size()
    data = pygame.image.tobytes(picture, "RGB")
    return np.frombuffer(data, dtype=np.uint8).reshape(height, width, 3).copy()
