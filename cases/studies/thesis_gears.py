"""The spur gears of S. Shweiki's thesis, chapters 3 and 4, as the gallery has them."""

from nvhchain.gallery.gears import (
    BLANKS,
    CENTRE_DISTANCE,
    CROWNED,
    FRICTION,
    PAIRS_OF_CHAPTER_4,
    SPUR,
    TORQUES,
)

__all__ = ["BLANKS", "CENTRE_DISTANCE", "CROWNED", "FRICTION", "PAIRS_OF_CHAPTER_4", "SPUR", "TORQUES"]
