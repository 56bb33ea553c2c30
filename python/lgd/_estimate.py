"""Models and what they estimate."""

import ctypes
import math
import operator
import os
import signal
import threading
import warnings
from typing import Callable, List, Optional, Sequence, Union

import numpy as np

from . import _library as c
from ._maps import Maps, Path, Photo, check, cut_mask, floats, lib, read_photo, square, text, whole

Image = Union[Path, np.ndarray]
# done: 0 .. 1; rmse: of the linear values, NaN where it is not known. What it raises ends the work.
Progress = Callable[[float, float], None]


class _Calls:
    """The library's calls into Python. What these raise ends the work and is raised again behind it, as does what the
    handler of a signal raises, Ctrl-C's or another's. Python runs handlers where such a call begins, where it would be
    lost: they wait until it is caught."""

    def __init__(self, progress: Optional[Progress], steps: int):
        self.progress, self.steps = progress, steps
        self.raised: Optional[BaseException] = None
        self.caught = False  # whether what a handler raises now is
        self.waiting: List[tuple] = []  # handlers and their arguments
        self.done = 0.0
        self.rmse: List[float] = []
        self.step, self.tile = c.Progress(self._step), c.Tile(self._tile)

    def _tell(self, done: float, rmse: float) -> int:
        try:
            self.caught = True
            self._handle()
            self.done = max(self.done, done)
            if self.progress:
                self.progress(self.done, rmse)
            self.caught = False
        except BaseException as error:  # KeyboardInterrupt too
            self.caught = False
            self.raised = error
        return self.raised is not None

    def _step(self, step: int, rmse: float, user: object) -> int:
        self.rmse = self.rmse[:step] + [rmse]
        return self._tell((step + 1) / (self.steps + 1), rmse)

    def _handle(self) -> None:
        while self.waiting:
            handler, number, frame = self.waiting.pop(0)
            handler(number, frame)

    def _later(self, handler: Callable[[int, object], object]) -> Callable[[int, object], None]:
        def handle(number: int, frame: object) -> None:
            if self.caught:
                handler(number, frame)
            else:
                self.waiting.append((handler, number, frame))

        return handle

    def run(self, call: Callable[[], int]) -> int:
        ours = {}
        if threading.current_thread() is threading.main_thread():  # whose they are
            for number in signal.valid_signals():
                handler = signal.getsignal(number)
                if callable(handler):  # neither ignored nor not Python's
                    ours[number] = handler, self._later(handler)
        try:
            for number, (_, handle) in ours.items():
                signal.signal(number, handle)
            code = call()
        finally:
            self.caught = True  # by the caller: where one raises here, those that are left go on
            for number, (handler, handle) in ours.items():
                if signal.getsignal(number) is handle:  # progress may have set another
                    signal.signal(number, handler)
        try:
            self._handle()
        finally:
            if self.raised:
                raise self.raised
        return code

    def _tile(self, done: float, user: object) -> int:
        return self._tell(done, math.nan)


class Model:
    """Weights: a file, or the name of a model that is installed with lgd ("phone", "single"; the wheel with a library
    of its own has phone alone). Any number of threads may use one model at once."""

    def __init__(self, weights: Optional[Path] = None):
        path, error = ctypes.create_string_buffer(4096), c.Failure()
        name = None if weights is None else text(weights)
        check(lib.lgd_find_weights(name, path, len(path), error), error)
        found = os.fsdecode(path.value)
        self.weights = found if os.path.isabs(found) else os.path.join(os.getcwd(), found)
        self._model = ctypes.c_void_p(lib.lgd_load(path.value, error))
        if not self._model:
            check(error.code, error)

    def __del__(self) -> None:
        if getattr(self, "_model", None):
            lib.lgd_free(ctypes.byref(self._model))

    def __reduce__(self) -> tuple:
        return type(self), (self.weights,)  # a copy reads them again: what is loaded has one owner

    @property
    def iterations(self) -> int:
        """Steps that the model was trained for."""
        return lib.lgd_trained_iterations(self._model)

    @property
    def most_photos(self) -> int:
        return lib.lgd_most_photos(self._model)

    @property
    def published(self) -> bool:
        """Whether these are the weights of the published network."""
        return bool(lib.lgd_published(self._model))


_default: Optional[Model] = None
_default_lock = threading.Lock()


def _shipped() -> Model:
    """The shipped model, which is loaded once."""
    global _default
    with _default_lock:
        _default = _default or Model()
        return _default


def _loaded(model: Union[Model, Path, None]) -> Model:
    if model is None:
        return _shipped()
    if isinstance(model, Model):
        return model
    if isinstance(model, (str, os.PathLike)):
        return Model(model)
    raise TypeError(f"model must be an lgd.Model, a name or a file of weights, not {model!r}")


def _run(
    model: Model,
    photos: Sequence[Photo],
    fov: float,
    mask: Optional[np.ndarray],
    iterations: Union[int, str, None],
    light_power: Union[float, str],
    tolerance: Optional[float],
    orientations: Union[int, str],
    exact: bool,
    precision: str,
    sample: str,
    threads: int,
    progress: Optional[Progress],
) -> Maps:
    if sample not in c.SAMPLES:
        raise ValueError(f"sample {sample!r} is none of {', '.join(c.SAMPLES)}")
    if precision not in c.PRECISIONS:
        raise ValueError(f"precision {precision!r} is none of {', '.join(c.PRECISIONS)}")
    if isinstance(iterations, str) and iterations != "auto":
        raise ValueError(f"iterations {iterations!r} is neither a number nor 'auto'")
    if iterations is not None and not isinstance(iterations, str) and not 0 <= operator.index(iterations) < 1 << 31:
        raise ValueError(f"iterations is {iterations} and must be 0 or more")
    if isinstance(light_power, str) and light_power != "auto":
        raise ValueError(f"light_power {light_power!r} is neither a number nor 'auto'")
    if isinstance(orientations, str) and orientations != "auto":
        raise ValueError(f"orientations {orientations!r} is neither a number nor 'auto'")
    given = [Photo(p.image, p.light, p.camera, p.power) for p in photos]
    shapes = [np.shape(p.image) for p in given]
    side = shapes[0][0] if shapes and shapes[0] else 0
    for shape in shapes:
        if shape != (side, side, 3):
            raise ValueError(f"a photograph of shape {shape}: all must be (side, side, 3)")
    usual = lib.lgd_usual_iterations(model._model, len(given))
    steps = usual if iterations is None else c.AUTO_MOST if iterations == "auto" else int(iterations)
    calls, error, options = _Calls(progress, steps), c.Failure(), c.Options()
    structs, taken = (c.PhotoStruct * len(given))(), (c.PhotoStruct * len(given))()
    power = ctypes.c_double(1 if light_power == "auto" else float(light_power))
    for k, p in enumerate(given):
        structs[k] = p.struct()
        structs[k].power *= power.value
    lib.lgd_options_init(options, ctypes.sizeof(options))
    options.iterations = -1 if iterations is None else c.AUTO if iterations == "auto" else steps
    options.exact, options.precision, options.sample = bool(exact), c.PRECISIONS[precision], c.SAMPLES[sample]
    options.orientations = 0 if orientations == "auto" else whole("orientations", orientations)
    options.threads, options.fov = whole("threads", threads), fov
    options.progress, options.tile, options.taken = calls.step, calls.tile, taken
    ambient = ctypes.c_double(0)
    options.ambient = ctypes.pointer(ambient)
    if tolerance is not None:
        options.tolerance = tolerance
    if light_power == "auto":
        options.power = ctypes.pointer(power)
    if mask is not None:
        options.mask = mask.ctypes.data_as(ctypes.POINTER(ctypes.c_ubyte))
    maps = np.empty((side, side, 9), np.float32)
    call = lambda: lib.lgd_estimate_photos(  # noqa: E731
        model._model, structs, len(given), side, options, floats(maps), error
    )
    check(calls.run(call), error)
    first = taken[0]
    photo = Photo(given[0].image, tuple(first.light), tuple(first.camera), first.power)
    return Maps(maps, photo, rmse=calls.rmse, ambient=ambient.value)


def _warn_of(image: np.ndarray) -> None:
    """Levels of 0 to 255 that were made floats would be read as light, nearly all of it burnt out."""
    if np.issubdtype(image.dtype, np.floating) and image.size and np.mean(image > 1) > 0.5:
        warnings.warn(
            "an array of floats is linear, from 0 to 1, and most values of this one are above 1: sRGB levels are given"
            " as uint8 or uint16",
            stacklevel=3,
        )


def estimate(
    image: Image,
    *,
    model: Union[Model, Path, None] = None,
    fov: Optional[float] = None,
    mask: Optional[Image] = None,
    size: int = 256,
    iterations: Union[int, str, None] = None,
    light_power: Union[float, str] = "auto",
    tolerance: Optional[float] = None,
    orientations: Union[int, str] = "auto",
    exact: bool = False,
    precision: str = "f32",
    sample: str = "auto",
    threads: int = 0,
    progress: Optional[Progress] = None,
) -> Maps:
    """Maps of size x size pixels from one photograph.

    model: by default phone, the shipped one for photographs; a name or a file is loaded at each call, a Model is not.
    image: a file; or an array, (height, width, 3): uint8 and uint16 are sRGB, floats are linear. Its largest centred
    square is used. fov: degrees across that square; None: from the file's EXIF, else what the model assumes or
    estimates. mask: a file, or an array of the photograph's height and width: only where it is not black the maps are
    refined. iterations: None: as usual, or "auto". The rest is as lgd-infer --help says."""
    model = _loaded(model)
    if size < 1:
        raise ValueError(f"size is {size} and must be 1 or more")
    if isinstance(image, np.ndarray):
        _warn_of(image)
        cut, why = square(image, size), "an array has no EXIF"
        height, width, found = image.shape[0], image.shape[1], None
    else:
        cut, facts = read_photo(image, size, published=model.published, threads=threads)
        width, height, found, why = facts.width, facts.height, facts.fov, facts.fov_from
        if facts.profile:
            text = f"{image}: its colour profile ({facts.profile}) cannot be used: sRGB is assumed"
            warnings.warn(text, stacklevel=2)
    wanted = None if mask is None else cut_mask(mask, size, width, height)
    if wanted is not None and not wanted.any():
        warnings.warn("the mask is black all over the photograph's square: nothing is refined", stacklevel=2)
    degrees = found if fov is None else fov
    if fov is not None and fov <= 0:
        raise ValueError(f"fov is {fov} degrees and must be above 0")
    maps = _run(
        model,
        [Photo(cut)],
        c.UNKNOWN if degrees is None else degrees,
        wanted,
        iterations,
        light_power,
        tolerance,
        orientations,
        exact,
        precision,
        sample,
        threads,
        progress,
    )
    if degrees is None:
        how = "assumed" if maps.photo.camera == Photo(None).camera else "estimated"
        maps.fov_from = f"{how}: {why}"
    else:
        maps.fov_from = why if fov is None else "given"
    return maps


def estimate_photos(
    photos: Sequence[Photo],
    *,
    model: Union[Model, Path],
    mask: Optional[np.ndarray] = None,
    iterations: Union[int, str, None] = None,
    light_power: Union[float, str] = "auto",
    tolerance: Optional[float] = None,
    orientations: Union[int, str] = "auto",
    exact: bool = False,
    precision: str = "f32",
    sample: str = "auto",
    threads: int = 0,
    progress: Optional[Progress] = None,
) -> Maps:
    """Maps from 1 .. most_photos photographs whose lights and cameras are where each Photo says. Their images are
    rectified to the sample and of one size. model: as of estimate. mask: an array of that size: only where it is not 0
    the maps are refined. light_power: "auto": how bright each photograph is, is found, as phones need it; a number: by
    which every Photo's power is multiplied, which is then believed: 1 where each Photo has a power that is true."""
    photos = [Photo(p.image, p.light, p.camera, p.power) for p in photos]
    for p in photos:
        if p.image is not None:
            _warn_of(p.image)
    wanted = None
    if mask is not None:
        side = photos[0].image.shape[0] if photos and photos[0].image is not None else 0
        wanted = cut_mask(np.asarray(mask), side, side, side)
    return _run(
        _loaded(model),
        photos,
        c.OF_PHOTO if len(photos) == 1 else c.UNKNOWN,
        wanted,
        iterations,
        light_power,
        tolerance,
        orientations,
        exact,
        precision,
        sample,
        threads,
        progress,
    )
