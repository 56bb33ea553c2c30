"""liblgd.so and the functions of lgd.h that the package calls."""

import ctypes
import os
import pathlib
from ctypes import CFUNCTYPE, POINTER, c_char, c_char_p, c_double, c_float, c_int, c_longlong, c_size_t
from ctypes import c_ubyte, c_void_p

OF_PHOTO = -1.0  # LGD_FOV_OF_PHOTO
UNKNOWN = 0.0  # LGD_FOV_UNKNOWN
AUTO = -2  # LGD_AUTO
AUTO_MOST = 24  # LGD_AUTO_MOST
SRGB8, SRGB16, LINEAR = range(3)
PRECISIONS = {"f32": 0, "bf16": 1}
SAMPLES = {"auto": 0, "dielectric": 1, "metal": 2}
EXR = {"auto": 0, "half": 1, "float": 2}

Progress = CFUNCTYPE(c_int, c_int, c_double, c_void_p)
Tile = CFUNCTYPE(c_int, c_double, c_void_p)


class Failure(ctypes.Structure):  # lgd_error
    _fields_ = [("code", c_int), ("message", c_char * 512)]


class PhotoStruct(ctypes.Structure):  # lgd_photo
    _fields_ = [("image", POINTER(c_float)), ("light", c_float * 3), ("camera", c_float * 3), ("power", c_float)]


class Options(ctypes.Structure):  # lgd_options
    _fields_ = [
        ("size", c_size_t),
        ("iterations", c_int),
        ("exact", c_int),
        ("precision", c_int),
        ("orientations", c_int),
        ("threads", c_int),
        ("progress", Progress),
        ("user", c_void_p),
        ("every_rmse", c_int),
        ("mask", POINTER(c_ubyte)),
        ("tolerance", c_double),
        ("tile", Tile),
        ("power", POINTER(c_double)),
        ("fov", c_double),
        ("taken", POINTER(PhotoStruct)),
        ("sample", c_int),
        ("ambient", POINTER(c_double)),
    ]


class ReadOptions(ctypes.Structure):  # lgd_read_options
    _fields_ = [("size", c_size_t), ("published", c_int), ("max_pixels", c_longlong), ("threads", c_int)]


class FactsStruct(ctypes.Structure):  # lgd_facts
    _fields_ = [
        ("size", c_size_t),
        ("width", c_int),
        ("height", c_int),
        ("fov", c_double),
        ("fov_from", c_char * 128),
        ("profile", c_char * 96),
        ("transparent", c_int),
    ]


class WriteOptions(ctypes.Structure):  # lgd_write_options
    _fields_ = [
        ("size", c_size_t),
        ("maps", c_char_p),
        ("directx", c_int),
        ("metallic", c_int),
        ("seamless", c_int),
        ("exr", c_int),
        ("threads", c_int),
        ("fov_from", c_char_p),
        ("fov_unknown", c_int),
        ("ambient", c_double),
    ]


_ERROR = POINTER(Failure)
_FLOATS = POINTER(c_float)
_FUNCTIONS = {
    "lgd_version": (c_char_p, []),
    "lgd_find_weights": (c_int, [c_char_p, c_char_p, c_size_t, _ERROR]),
    "lgd_load": (c_void_p, [c_char_p, _ERROR]),
    "lgd_free": (None, [POINTER(c_void_p)]),
    "lgd_trained_iterations": (c_int, [c_void_p]),
    "lgd_usual_iterations": (c_int, [c_void_p, c_int]),
    "lgd_most_photos": (c_int, [c_void_p]),
    "lgd_published": (c_int, [c_void_p]),
    "lgd_options_init": (None, [POINTER(Options), c_size_t]),
    "lgd_flash_photo": (PhotoStruct, [_FLOATS]),
    "lgd_read_photo": (c_int, [c_char_p, c_int, POINTER(ReadOptions), _FLOATS, POINTER(FactsStruct), _ERROR]),
    "lgd_read_mask": (c_int, [c_char_p, c_int, c_int, c_int, POINTER(ReadOptions), POINTER(c_ubyte), _ERROR]),
    "lgd_square": (c_int, [c_void_p, c_int, c_int, c_int, c_int, _FLOATS, _ERROR]),
    "lgd_estimate_photos": (
        c_int,
        [c_void_p, POINTER(PhotoStruct), c_int, c_int, POINTER(Options), _FLOATS, _ERROR],
    ),
    "lgd_render": (c_int, [_FLOATS, c_int, c_float * 3, c_float * 3, c_float, _FLOATS, _ERROR]),
    "lgd_write_maps": (
        c_int,
        [c_char_p, _FLOATS, c_int, POINTER(PhotoStruct), POINTER(WriteOptions), _ERROR],
    ),
}


def _places():
    """Where the library may be: $LGD_LIBRARY alone, or what the wheel brings, what the system has, what make built."""
    named = os.environ.get("LGD_LIBRARY")
    if named:
        return [named]
    here = pathlib.Path(__file__).resolve().parent
    places = [str(here / "lib" / "liblgd.so.0")]
    if (here.parents[1] / "infer" / "lgd.h").exists():  # a checkout
        places.append(str(here.parents[1] / "build" / "liblgd.so.0"))
    return places + ["liblgd.so.0", "/usr/local/lib/liblgd.so.0"]


def load() -> ctypes.CDLL:
    """The library with the types of its functions; ImportError names what was tried."""
    tried = []
    for place in _places():
        if "/" in place and not os.path.exists(place):
            tried.append(f"{place}: not there")
            continue
        try:
            library = ctypes.CDLL(place)
        except OSError as error:
            tried.append(str(error))
            continue
        for name, (result, arguments) in _FUNCTIONS.items():
            try:
                function = getattr(library, name)
            except AttributeError:
                raise ImportError(f"{place} has no {name}: it is older than this package; install both again") from None
            function.restype, function.argtypes = result, arguments
        return library
    raise ImportError("no liblgd.so: make install, or name the file in LGD_LIBRARY (" + "; ".join(tried) + ")")
