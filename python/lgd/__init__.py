"""The material of a flat surface from one flash photograph.

    import lgd
    maps = lgd.estimate("photo.jpg")
    maps.save("out/photo")          # the files of lgd-infer
    maps.roughness                  # numpy, (256, 256)

Arrays have the top row first. Colours are linear. Positions are in sides of the square that the maps cover, from its
centre: x to the right, y up, z towards the camera.
"""

from ._estimate import Image, Model, Progress, estimate, estimate_photos
from ._maps import Error, Facts, Maps, Photo, read_photo, version

__all__ = [
    "Error",
    "Facts",
    "Image",
    "Maps",
    "Model",
    "Photo",
    "Progress",
    "estimate",
    "estimate_photos",
    "read_photo",
    "version",
]
__version__ = version()
