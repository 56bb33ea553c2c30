"""The Python package. Environment: PHOTO, a photograph; LGD_LIBRARY and LGD_MODEL, or an installed package."""

import copy
import ctypes
import math
import os
import pathlib
import pickle
import re
import signal
import tempfile
import threading
import unittest
import warnings

import lgd
import numpy as np
from lgd import _library

PHOTO = os.environ["PHOTO"]
ROOT = pathlib.Path(__file__).resolve().parents[2]
PHONE = ROOT / "models" / "phone.safetensors"
SIZE = 32
RNG = np.random.default_rng(1)


def bump(width=40, height=30):
    """A picture's levels, brighter in the middle."""
    y, x = np.mgrid[0:height, 0:width]
    grey = 200 - 120 * ((x / width - 0.5) ** 2 + (y / height - 0.5) ** 2)
    return np.stack([grey, 0.9 * grey, 0.7 * grey], 2).astype(np.uint8)


def quick(image, **options):
    return lgd.estimate(image, **{"size": SIZE, "iterations": 1, "threads": 1, **options})


class Structs(unittest.TestCase):
    def test_fields_are_those_of_the_header(self):
        header = re.sub(r"/\*.*?\*/", "", (ROOT / "infer" / "lgd.h").read_text(), flags=re.S)
        for struct, name in [
            (_library.Failure, "lgd_error"),
            (_library.PhotoStruct, "lgd_photo"),
            (_library.Options, "lgd_options"),
            (_library.ReadOptions, "lgd_read_options"),
            (_library.FactsStruct, "lgd_facts"),
            (_library.WriteOptions, "lgd_write_options"),
        ]:
            body = re.search(r"struct %s \{(.*?)\n?\}" % name, header, re.S)[1]
            fields = []
            for line in body.split(";"):
                called = re.search(r"\(\*(\w+)\)\(", line)
                names = re.findall(r"(\w+)(?:\[\w+\])?\s*(?:,|$)", line.strip())
                fields += [called[1]] if called else names
            self.assertEqual([f[0] for f in struct._fields_], fields, name)

    def test_the_library_has_options_of_that_size(self):
        options, size = _library.Options(), ctypes.sizeof(_library.Options)
        library = _library.load()
        library.lgd_options_init(options, size)
        self.assertEqual((options.size, options.iterations, options.orientations), (size, -1, 0))

    def test_constants_are_those_of_the_header(self):
        header = (ROOT / "infer" / "lgd.h").read_text()
        self.assertIn("LGD_AUTO = %d, LGD_AUTO_MOST = %d" % (_library.AUTO, _library.AUTO_MOST), header)
        self.assertIn("#define LGD_FOV_OF_PHOTO (%.1f)" % _library.OF_PHOTO, header)
        self.assertIn("#define LGD_FOV_UNKNOWN %.1f" % _library.UNKNOWN, header)
        self.assertIn("enum { LGD_SRGB8, LGD_SRGB16, LGD_LINEAR }", header)
        self.assertIn("enum { LGD_EXR_AUTO, LGD_EXR_HALF, LGD_EXR_FLOAT }", header)
        self.assertIn("enum { LGD_F32, LGD_BF16 }", header)


class Estimates(unittest.TestCase):
    def test_a_file(self):
        maps = quick(PHOTO)
        self.assertEqual(maps.array.shape, (SIZE, SIZE, 9))
        self.assertEqual(maps.array.dtype, np.float32)
        self.assertEqual((maps.size, maps.diffuse.shape, maps.specular.shape), (SIZE, (SIZE, SIZE, 3), (SIZE, SIZE, 3)))
        self.assertEqual(maps.roughness.shape, (SIZE, SIZE))
        np.testing.assert_allclose((maps.normal**2).sum(2), 1, atol=1e-5)
        for values in (maps.diffuse, maps.specular, maps.roughness):
            self.assertTrue((values >= 0).all() and (values <= 1).all())
        self.assertEqual(len(maps.rmse), 2)
        self.assertTrue(all(math.isfinite(r) for r in (maps.rmse[0], maps.rmse[-1])))

    def test_an_array_is_as_its_file(self):
        levels = bump()
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "p.ppm")
            with open(path, "wb") as f:
                f.write(b"P6\n40 30\n255\n" + levels.tobytes())
            of_file = quick(pathlib.Path(path))
        np.testing.assert_allclose(quick(levels).array, of_file.array, atol=1e-4)
        np.testing.assert_allclose(quick(levels.astype(np.uint16) * 257).array, of_file.array, atol=1e-4)
        v = levels / 255
        linear = np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)
        np.testing.assert_allclose(quick(linear).array, of_file.array, atol=1e-4)
        # strides of its own; grey
        np.testing.assert_array_equal(quick(levels[:, ::-1]).array, quick(levels[:, ::-1].copy()).array)
        np.testing.assert_array_equal(quick(levels[:, :, 0]).array, quick(np.repeat(levels[:, :, :1], 3, 2)).array)

    def test_fov(self):
        levels = bump()
        self.assertAlmostEqual(quick(levels, fov=28).photo.fov, 28, places=3)
        self.assertEqual(quick(levels, fov=28).fov_from, "given")
        self.assertIn("an array has no EXIF", quick(levels).fov_from)
        self.assertFalse(np.array_equal(quick(levels, fov=28).array, quick(levels, fov=70).array))
        for wrong in (0, -1, 180):
            with self.assertRaisesRegex((ValueError, lgd.Error), "fov is"):
                quick(levels, fov=wrong)

    def test_mask(self):
        levels = bump()

        def refined(image, **options):
            return quick(image, iterations=6, **options)

        mask = np.zeros(levels.shape[:2], bool)
        whole = refined(levels, mask=~mask)
        with self.assertWarnsRegex(UserWarning, "nothing is refined"):
            none = refined(levels, mask=mask)
        np.testing.assert_allclose(whole.array, refined(levels).array, atol=1e-4)
        self.assertFalse(np.array_equal(none.array, whole.array))
        with self.assertRaisesRegex(ValueError, r"must be that of the photograph, \(30, 40\)"):
            quick(levels, mask=mask.T)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "m.pgm")
            with open(path, "wb") as f:
                f.write(b"P5\n40 30\n255\n" + bytes(40 * 30))
            with self.assertWarnsRegex(UserWarning, "nothing is refined"):
                np.testing.assert_array_equal(refined(levels, mask=path).array, none.array)

    def test_progress(self):
        seen = []
        quick(PHOTO, iterations=3, progress=lambda done, rmse: seen.append((done, rmse)))
        self.assertEqual([d for d, _ in seen], [0.25, 0.5, 0.75, 1])
        self.assertTrue(math.isfinite(seen[0][1]) and math.isnan(seen[1][1]) and math.isfinite(seen[3][1]))

    def test_what_progress_raises_ends_the_work(self):
        calls = []

        def stop(done, rmse):
            calls.append(done)
            raise KeyboardInterrupt

        for options in ({}, {"mask": np.ones((30, 40), bool)}):
            calls.clear()
            with self.assertRaises(KeyboardInterrupt):
                quick(bump(), iterations=5, progress=stop, **options)
            self.assertEqual(len(calls), 1)

    def test_ctrl_c_ends_the_work(self):
        before = signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored in a shell's background
        self.addCleanup(signal.signal, signal.SIGINT, before)
        for after in (0.05, 0.1, 0.2):
            timer = threading.Timer(after, os.kill, (os.getpid(), signal.SIGINT))
            with self.assertRaises(KeyboardInterrupt):
                timer.start()
                for _ in range(1000):
                    lgd.estimate(PHOTO, size=128, iterations=40)
            timer.join()
        self.assertIs(signal.getsignal(signal.SIGINT), signal.default_int_handler)

    def test_what_a_signals_handler_raises_ends_the_work(self):
        def late(number, frame):
            raise TimeoutError

        def catch(done, rmse):
            with self.assertRaises(TimeoutError):
                signal.raise_signal(signal.SIGALRM)

        self.addCleanup(signal.signal, signal.SIGALRM, signal.signal(signal.SIGALRM, late))
        self.addCleanup(signal.setitimer, signal.ITIMER_REAL, 0)
        for after in (0.05, 0.1, 0.2):
            with self.assertRaises(TimeoutError):
                signal.setitimer(signal.ITIMER_REAL, after)
                for _ in range(100):
                    lgd.estimate(PHOTO, size=128, iterations=40)
        quick(PHOTO, progress=catch)
        self.assertIs(signal.getsignal(signal.SIGALRM), late)

    def test_handlers_that_raise_nothing_change_nothing(self):
        undisturbed, numbers = lgd.estimate(PHOTO, size=128, iterations=10), []
        before = signal.signal(signal.SIGALRM, lambda number, frame: numbers.append(number))
        self.addCleanup(signal.signal, signal.SIGALRM, before)
        self.addCleanup(signal.setitimer, signal.ITIMER_REAL, 0)
        signal.setitimer(signal.ITIMER_REAL, 0.005, 0.005)
        while len(numbers) < 5:
            maps = lgd.estimate(PHOTO, size=128, iterations=10)
            np.testing.assert_array_equal(maps.array, undisturbed.array)

    def test_an_image_that_was_exchanged_is_read_as_it_is(self):
        maps = lgd.estimate(PHOTO, size=64)
        with tempfile.TemporaryDirectory() as folder:
            maps.save(folder + "/a", ["render"])
            maps.photo.image = maps.photo.image[::-1].copy()[::-1].astype(np.float64)
            maps.save(folder + "/b", ["render"])
            files = [pathlib.Path(folder, name, "render.png").read_bytes() for name in "ab"]
            self.assertEqual(files[0], files[1])
            maps.photo.image = np.zeros((32, 32, 3), np.uint8)
            with self.assertRaises(ValueError):
                maps.save(folder + "/c", ["render"])

    def test_several_threads_share_a_model(self):
        model, results = lgd.Model(), [None] * 4

        def work(k):
            results[k] = quick(bump(), model=model).array

        threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
        for t in threads:
            t.start()
        for t in threads:
            t.join()
        for r in results[1:]:
            np.testing.assert_array_equal(r, results[0])

    def test_a_copy_of_a_model_is_its_own(self):
        model = lgd.Model()
        expected = quick(bump(), model=model).array
        made = [copy.copy(model), copy.deepcopy(model), pickle.loads(pickle.dumps(model))]
        self.assertEqual(len({m._model.value for m in made + [model]}), 4)
        del model
        for copied in made:
            np.testing.assert_array_equal(quick(bump(), model=copied).array, expected)
        self.assertTrue(os.path.isabs(lgd.Model(os.path.relpath(made[0].weights)).weights))

    def test_photos_with_known_lights(self):
        model, image = lgd.Model(PHONE), RNG.uniform(0.2, 0.6, (SIZE, SIZE, 3)).astype(np.float32)
        photo = lgd.Photo(image, light=(0.1, 0.2, 1.5), camera=(0, 0, 1.5), power=10)
        maps = lgd.estimate_photos([photo], model=model, iterations=1, light_power=1)
        self.assertEqual(maps.photo.light, tuple(np.float32((0.1, 0.2, 1.5))))
        self.assertAlmostEqual(maps.photo.power, 10, 4)
        found = lgd.estimate_photos([photo], model=model, iterations=1)
        self.assertGreater(abs(found.photo.power - 10), 0.01)

    def test_photos_take_what_one_photograph_does(self):
        model, photo = lgd.Model(PHONE), lgd.Photo(bump(SIZE, SIZE))
        mask = np.zeros((SIZE, SIZE), np.uint8)
        mask[8:24, 8:24] = 1
        whole, first, part = (
            lgd.estimate_photos([photo], model=model, iterations=n, threads=1, mask=m).array
            for n, m in ((2, None), (0, None), (2, mask))
        )
        np.testing.assert_array_equal(part[0], first[0])
        self.assertGreater(np.abs(part - first)[mask != 0].max(), 0)
        for options in ({"tolerance": 0.5}, {"orientations": 2}, {"precision": "bf16"}, {"exact": True}):
            other = lgd.estimate_photos([photo], model=model, iterations=2, threads=1, **options).array
            self.assertEqual(other.shape, whole.shape)
        with self.assertRaisesRegex(ValueError, "a mask of shape"):
            lgd.estimate_photos([photo], model=model, mask=mask[1:])

    def test_what_is_doubtful_is_warned_of(self):
        levels = bump(SIZE, SIZE).astype(np.float32)
        with self.assertWarnsRegex(UserWarning, "most values of this one are above 1"):
            quick(levels)
        with self.assertWarnsRegex(UserWarning, "most values of this one are above 1"):
            lgd.estimate_photos([lgd.Photo(levels)], model=lgd.Model(), iterations=0)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            quick(levels / 255, mask=np.ones((SIZE, SIZE), np.uint8))

    def test_as_many_photos_as_the_model_takes(self):
        model, photo = lgd.Model(), lgd.Photo(bump(SIZE, SIZE))
        too_many = [photo] * (model.most_photos + 1)
        with self.assertRaisesRegex(lgd.Error, "photographs: these weights read"):
            lgd.estimate_photos(too_many, model=model)
        with self.assertRaisesRegex(ValueError, "side, side, 3"):
            lgd.estimate_photos([lgd.Photo(None)], model=model)

    def test_levels_of_a_photograph_are_srgb(self):
        levels, model = bump(SIZE, SIZE), lgd.Model()
        v = levels / 255
        linear = np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)
        for image in (levels, levels.astype(np.uint16) * 257, linear):
            photo = lgd.Photo(image)
            self.assertEqual(photo.image.dtype, np.float32)
            np.testing.assert_allclose(photo.image, linear, atol=1e-5)
        photo.image = levels
        maps = lgd.estimate_photos([photo], model=model, iterations=0)
        np.testing.assert_allclose(maps.photo.image, linear, atol=1e-5)
        for image in (levels[1:], levels.astype(np.int64)):
            with self.assertRaisesRegex(ValueError, "side, side, 3|int64"):
                lgd.Photo(image)

    def test_what_is_wrong_is_said(self):
        for options, kind, text in [
            ({"image": "absent.jpg"}, lgd.Error, "absent.jpg"),
            ({"image": np.zeros((4, 4, 2), np.uint8)}, ValueError, r"shape \(4, 4, 2\)"),
            ({"image": np.zeros((4, 4, 3), np.int32)}, ValueError, "int32"),
            ({"image": bump(), "size": 0}, ValueError, "size is 0"),
            ({"image": bump(), "iterations": "often"}, ValueError, "often"),
            ({"image": bump(), "iterations": 5000}, lgd.Error, "iterations is 5000"),
            ({"image": bump(), "iterations": -1}, ValueError, "iterations is -1"),
            ({"image": bump(), "iterations": 1 << 32}, ValueError, "iterations is 4294967296"),
            ({"image": bump(), "iterations": 1.7}, TypeError, "float"),
            ({"image": bump(), "precision": "f16"}, ValueError, "f16"),
            ({"image": bump(), "light_power": "all"}, ValueError, "all"),
            ({"image": bump(), "orientations": 3}, lgd.Error, "orientations is 3"),
            ({"image": bump(), "orientations": 2.7}, TypeError, "float"),
            ({"image": bump(), "orientations": (1 << 32) + 1}, ValueError, "orientations is 4294967297"),
            ({"image": bump(), "sample": "wood"}, ValueError, "wood"),
            ({"image": bump(), "threads": -1}, lgd.Error, "threads is -1"),
            ({"image": bump(), "threads": (1 << 32) + 1}, ValueError, "threads is 4294967297"),
            ({"image": PHOTO, "threads": (1 << 32) + 1}, ValueError, "threads is 4294967297"),
            ({"image": PHOTO + "\0x"}, ValueError, "embedded null byte"),
            ({"image": bump(), "mask": PHOTO + "\0x"}, ValueError, "embedded null byte"),
            ({"image": bump(), "model": "phone\0x"}, ValueError, "embedded null byte"),
            ({"image": bump(), "model": "absent"}, lgd.Error, "absent"),
            ({"image": bump(), "model": 3}, TypeError, "model must be an lgd.Model, a name or a file .*, not 3"),
        ]:
            with self.subTest(text), self.assertRaisesRegex(kind, text):
                quick(**options)
        with self.assertRaisesRegex(lgd.Error, "absent.safetensors") as raised:
            lgd.Model("absent.safetensors")
        again = pickle.loads(pickle.dumps(raised.exception))  # as from a process of a pool
        self.assertEqual((again.code, str(again)), (raised.exception.code, str(raised.exception)))
        maps = quick(bump())
        for wrong in ((0, 0), (0, 0, 1, 1), 1, "up"):
            for place in ("light", "camera"):
                with self.subTest(place), self.assertRaisesRegex(ValueError, f"{place} must be three numbers"):
                    maps.render(**{place: wrong})
        with self.assertRaisesRegex(ValueError, "light must be three numbers"):
            lgd.Photo(None, light=(0, 1))

    def test_truth_of_numpy(self):
        for exact in (True, False):
            np.testing.assert_array_equal(quick(bump(), exact=np.bool_(exact)).array, quick(bump(), exact=exact).array)

    def test_a_model_by_its_name(self):
        model = lgd.Model()
        for name in (model.weights, pathlib.Path(model.weights)):
            np.testing.assert_array_equal(quick(bump(), model=name).array, quick(bump(), model=model).array)
            photos = [lgd.Photo(bump(SIZE, SIZE))]
            lgd.estimate_photos(photos, model=name, iterations=0)


class Files(unittest.TestCase):
    def test_read_photo(self):
        image, facts = lgd.read_photo(PHOTO, 16)
        self.assertEqual((image.shape, image.dtype), ((16, 16, 3), np.float32))
        self.assertTrue(facts.width > 0 and facts.height > 0 and facts.fov_from)

    def test_saved_files(self):
        maps = quick(PHOTO)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a", "b", "wall")
            for wrong in ({"maps": ["colour"]}, {"maps": "normal", "threads": -1}):
                with self.assertRaises(lgd.Error):
                    maps.save(path, **wrong)
                self.assertEqual(os.listdir(folder), [])
            maps.save(path)
            self.assertEqual(len(os.listdir(path)), 8)
            maps.save(pathlib.Path(path), ["normal", "glb"], workflow="metallic")
            self.assertLessEqual({"normal.png", "material.glb"}, set(os.listdir(path)))
            half = lgd.Maps(maps.array[::2, ::2], maps.photo)
            with self.assertRaisesRegex(ValueError, "photograph of shape"):
                half.save(path)
            half.photo = lgd.Photo(maps.photo.image[::2, ::2])
            half.save(os.path.join(folder, "half"), "render")
            for options, kind, text in [
                ({"maps": "colour"}, lgd.Error, "'colour' is nothing"),
                ({"workflow": "other"}, ValueError, "other"),
                ({"exr": "double"}, ValueError, "double"),
                ({"threads": (1 << 32) + 1}, ValueError, "threads is 4294967297"),
                ({"maps": "normal\0,colour"}, ValueError, "embedded null byte"),
                ({"folder": path + "\0x"}, ValueError, "embedded null byte"),
            ]:
                with self.subTest(text), self.assertRaisesRegex(kind, text):
                    maps.save(**{"folder": path, **options})
            maps.fov_from = "given\0by hand"
            with self.assertRaisesRegex(ValueError, "embedded null byte"):
                maps.save(path)

    def test_a_rendering_under_the_photographs_light_is_the_photograph(self):
        hazy = (bump(256, 256) // 2 + 60).astype(np.uint8)  # as if there were light beside the flash's
        phone = pathlib.Path(__file__).parents[2] / "models" / "phone.safetensors"
        for image, model in ((hazy, lgd.Model(phone)), (PHOTO, None)):
            maps = quick(image, model=model, iterations=None)
            apart = np.clip(maps.render(), 0, 1) - np.clip(maps.photo.image, 0, 1)
            self.assertAlmostEqual(math.sqrt((apart**2).mean()), maps.rmse[-1], delta=1e-3)
            if image is hazy:
                self.assertGreater(maps.ambient, 0.01)
            with tempfile.TemporaryDirectory() as folder:
                maps.save(folder + "/a", ["render"])
                text = pathlib.Path(folder, "a", "meta.txt").read_text()
                self.assertEqual("ambient light: of radiance" in text, maps.ambient > 0)
        dark = maps.render(light=(0, 0, 1.0), camera=np.array([0, 0, 1.0]), power=0)
        self.assertEqual(dark.max(), 0)


if __name__ == "__main__":
    unittest.main()
