"""Photographs and maps."""

import ctypes
import math
import operator
import os
from dataclasses import dataclass, field
from typing import List, NamedTuple, Optional, Sequence, Union

import numpy as np

from . import _library as c

Path = Union[str, "os.PathLike[str]"]

lib = c.load()


class Error(RuntimeError):
    """What liblgd says: one line that names what is wrong and what to do."""

    def __init__(self, code: int, message: str):
        super().__init__(message)
        self.code = code

    def __reduce__(self) -> tuple:  # the usual one has the message alone
        return type(self), (self.code, str(self))


def check(code: int, error: c.Failure) -> None:
    if code:
        raise Error(code, error.message.decode("utf-8", "surrogateescape"))


def floats(array: np.ndarray) -> "ctypes._Pointer[ctypes.c_float]":
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_float))


def text(words: Union[Path, bytes]) -> bytes:
    """As the library reads it, to a zero byte."""
    encoded = os.fsencode(words)
    if b"\0" in encoded:
        raise ValueError(f"embedded null byte in {words!r}")
    return encoded


def whole(name: str, number: int) -> int:
    """As the library reads it, in 32 bits."""
    if not -(1 << 31) <= operator.index(number) < 1 << 31:
        raise ValueError(f"{name} is {number} and must lie in {-(1 << 31)} .. {(1 << 31) - 1}")
    return operator.index(number)


def version() -> str:
    """The library's."""
    return lib.lgd_version().decode()


def three(name: str, numbers: Sequence[float]) -> "tuple[float, float, float]":
    """A position that the library reads."""
    try:
        x, y, z = (float(v) for v in numbers)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be three numbers, not {numbers!r}") from None
    return x, y, z


@dataclass(eq=False)
class Photo:
    """A photograph of the sample, or None, and where it was taken. (side, side, 3): uint8 and uint16 are sRGB, floats
    linear; image is linear float32 from then on."""

    image: Optional[np.ndarray]
    light: Sequence[float] = ()
    camera: Sequence[float] = ()
    power: Optional[float] = None  # the default light's

    def __post_init__(self) -> None:
        if self.image is not None:
            self.image = linear(np.asarray(self.image))
        flash = lib.lgd_flash_photo(None)
        self.light = three("light", self.light if len(self.light) else flash.light)
        self.camera = three("camera", self.camera if len(self.camera) else flash.camera)
        self.power = flash.power if self.power is None else self.power

    def struct(self) -> c.PhotoStruct:
        if self.image is not None:  # it may be another than at first
            self.image = linear(np.asarray(self.image))
        image = None if self.image is None else floats(self.image)
        return c.PhotoStruct(image, (ctypes.c_float * 3)(*self.light), (ctypes.c_float * 3)(*self.camera), self.power)

    @property
    def fov(self) -> float:
        """Degrees across the square."""
        return math.degrees(2 * math.atan(0.5 / self.camera[2]))


class Facts(NamedTuple):
    """What is known of a photograph beside its pixels."""

    width: int
    height: int
    fov: Optional[float]  # degrees across its largest centred square, from EXIF
    fov_from: str  # where fov is known from, or why it is not
    profile: str  # a colour profile that cannot be used: sRGB was assumed
    transparent: bool = False  # somewhere, where it is taken as black


@dataclass(eq=False)
class Maps:
    """Maps, (size, size, 9) float32 as lgd.h has them: diffuse rgb, normal x y, roughness, specular F0 rgb."""

    array: np.ndarray
    photo: Photo  # light, camera and power as they were taken, and the image that was read
    fov_from: str = "given"
    rmse: List[float] = field(default_factory=list)  # of R_0 and each step from the photograph; NaN: not computed
    ambient: float = 0.0  # radiance of the surroundings that was found with photo's light

    @property
    def size(self) -> int:
        return self.array.shape[0]

    @property
    def diffuse(self) -> np.ndarray:
        return self.array[:, :, 0:3]

    @property
    def normal(self) -> np.ndarray:
        """Unit vectors, y up (OpenGL)."""
        xy = self.array[:, :, 3:5]
        z = np.sqrt(np.maximum(1 - (xy * xy).sum(2, keepdims=True), 0))
        return np.concatenate([xy, z], 2)

    @property
    def roughness(self) -> np.ndarray:
        """Perceptual: alpha = roughness squared."""
        return self.array[:, :, 5]

    @property
    def specular(self) -> np.ndarray:
        """F0, the reflectance straight on."""
        return self.array[:, :, 6:9]

    def _values(self) -> np.ndarray:
        values = np.ascontiguousarray(self.array, dtype=np.float32)
        if values.ndim != 3 or values.shape[0] != values.shape[1] or values.shape[2] != 9:
            raise ValueError(f"maps of shape {values.shape}: they must be (side, side, 9)")
        return values

    def render(
        self,
        light: Optional[Sequence[float]] = None,
        camera: Optional[Sequence[float]] = None,
        power: Optional[float] = None,
    ) -> np.ndarray:
        """(size, size, 3) linear values under a point light; by default as the photograph was taken, with the ambient
        light."""
        as_taken = light is None and camera is None and power is None
        light = three("light", self.photo.light if light is None else light)
        camera = three("camera", self.photo.camera if camera is None else camera)
        values, error = self._values(), c.Failure()
        image = np.empty(values.shape[:2] + (3,), np.float32)
        code = lib.lgd_render(
            floats(values),
            values.shape[0],
            (ctypes.c_float * 3)(*light),
            (ctypes.c_float * 3)(*camera),
            self.photo.power if power is None else power,
            floats(image),
            error,
        )
        check(code, error)
        if as_taken and self.ambient:
            image += np.float32(self.ambient) * (self.specular + (1 - self.specular) * self.diffuse)
        return image

    def save(
        self,
        folder: Path,
        maps: Union[str, Sequence[str], None] = None,
        *,
        directx: bool = False,
        workflow: str = "specular",
        seamless: bool = False,
        exr: str = "auto",
        threads: int = 0,
    ) -> None:
        """Writes the files of lgd-infer and meta.txt into folder, together. maps: names as of lgd-infer --maps."""
        if workflow not in ("specular", "metallic"):
            raise ValueError(f"workflow {workflow!r} is neither 'specular' nor 'metallic'")
        if exr not in c.EXR:
            raise ValueError(f"exr {exr!r} is none of {', '.join(c.EXR)}")
        names = maps if maps is None or isinstance(maps, str) else ",".join(maps)
        values, error, photo = self._values(), c.Failure(), self.photo.struct()
        if self.photo.image is not None and self.photo.image.shape != values.shape[:2] + (3,):
            raise ValueError(f"maps of shape {values.shape} and a photograph of shape {self.photo.image.shape}")
        options = c.WriteOptions(
            ctypes.sizeof(c.WriteOptions),
            None if names is None else text(names),
            bool(directx),
            workflow == "metallic",
            bool(seamless),
            c.EXR[exr],
            whole("threads", threads),
            text(self.fov_from.encode("utf-8", "surrogateescape")),
            False,
            self.ambient,
        )
        path = text(folder)
        made = _make_parents(os.path.abspath(os.fspath(folder)))
        code = lib.lgd_write_maps(path, floats(values), values.shape[0], photo, options, error)
        if code:
            _remove_empty(made)
        check(code, error)


def _make_parents(folder: str) -> List[str]:
    """Those that there were not, the innermost first."""
    made, parent = [], os.path.dirname(folder)
    while not os.path.isdir(parent) and parent != os.path.dirname(parent):
        made.append(parent)
        parent = os.path.dirname(parent)
    if made:
        os.makedirs(made[0], exist_ok=True)
    return made


def _remove_empty(folders: List[str]) -> None:
    for folder in folders:
        try:
            os.rmdir(folder)
        except OSError:  # others have put something there
            return


def read_photo(path: Path, size: int = 256, *, published: bool = False, threads: int = 0) -> "tuple[np.ndarray, Facts]":
    """The photograph's largest centred square as (size, size, 3) linear values, and what is known of it."""
    if size < 1:
        raise ValueError(f"size is {size} and must be 1 or more")
    image = np.empty((size, size, 3), np.float32)
    options = c.ReadOptions(ctypes.sizeof(c.ReadOptions), bool(published), 0, whole("threads", threads))
    facts, error = c.FactsStruct(size=ctypes.sizeof(c.FactsStruct)), c.Failure()
    check(lib.lgd_read_photo(text(path), size, options, floats(image), facts, error), error)
    told = lambda t: t.decode("utf-8", "replace")  # noqa: E731
    fov = None if facts.fov == c.UNKNOWN else facts.fov
    where, profile = told(facts.fov_from), told(facts.profile)
    return image, Facts(facts.width, facts.height, fov, where, profile, bool(facts.transparent))


def square(pixels: np.ndarray, size: int) -> np.ndarray:
    """The largest centred square of (height, width, 3) or (height, width): uint8 and uint16 are sRGB, floats linear."""
    if pixels.ndim == 2:
        pixels = np.repeat(pixels[:, :, None], 3, 2)
    if pixels.ndim != 3 or pixels.shape[2] != 3:
        raise ValueError(f"an image of shape {pixels.shape}: it must be (height, width, 3) or (height, width)")
    if pixels.dtype == np.uint8:
        encoding = c.SRGB8
    elif pixels.dtype == np.uint16:
        encoding = c.SRGB16
    elif np.issubdtype(pixels.dtype, np.floating):
        encoding, pixels = c.LINEAR, pixels.astype(np.float32, copy=False)
    else:
        raise ValueError(f"an image of {pixels.dtype}: it must be uint8, uint16 (sRGB) or floats (linear)")
    pixels = np.ascontiguousarray(pixels)
    height, width = pixels.shape[:2]
    image, error = np.empty((size, size, 3), np.float32), c.Failure()
    check(lib.lgd_square(pixels.ctypes.data, encoding, width, height, size, floats(image), error), error)
    return image


def linear(image: np.ndarray) -> np.ndarray:
    """A photograph that covers the sample as linear float32."""
    if np.issubdtype(image.dtype, np.floating) and image.ndim == 3:
        return np.ascontiguousarray(image, np.float32)
    if image.ndim != 3 or image.shape != (image.shape[0], image.shape[0], 3):
        raise ValueError(f"a photograph of shape {image.shape}: all must be (side, side, 3)")
    return square(image, image.shape[0])


def cut_mask(mask: Union[Path, np.ndarray], size: int, width: int, height: int) -> np.ndarray:
    if not isinstance(mask, np.ndarray):
        values, error = np.empty((size, size), np.uint8), c.Failure()
        room = values.ctypes.data_as(ctypes.POINTER(ctypes.c_ubyte))
        check(lib.lgd_read_mask(text(mask), size, width, height, None, room, error), error)
        return values
    if mask.ndim != 2 or mask.shape != (height, width):
        raise ValueError(f"a mask of shape {mask.shape}: it must be that of the photograph, ({height}, {width})")
    return (square((mask != 0).astype(np.float32), size)[:, :, 0] > 0).astype(np.uint8)
