"""Builds the wheel, for pip (PEP 517 and 660) and for `make wheel`. It needs Python and make alone.

LGD_WHEEL=system: a wheel of Python files, which uses the liblgd.so of the system. LGD_WHEEL=own: liblgd.so, what it
loads and the weights of `phone` are in the wheel. Without it: own where the system has no liblgd.so.0. The library is
that of the checkout that this folder is in, $LGD_BUILD or build/, which make brings up to date.
"""

import base64
import ctypes
import hashlib
import os
import pathlib
import re
import subprocess
import sysconfig
import tempfile
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent


def _version():
    makefile = ROOT / "Makefile"
    found = re.search(r"^VERSION := (\S+)$", makefile.read_text(), re.M) if makefile.exists() else None
    if not found:
        raise SystemExit(f"{HERE} must lie in a checkout of lgd, whose Makefile has the version")
    return found[1]


def _own():
    mode = os.environ.get("LGD_WHEEL", "")
    if mode not in ("", "own", "system"):
        raise SystemExit(f"LGD_WHEEL={mode}: it must be own or system")
    if mode:
        return mode == "own"
    try:
        ctypes.CDLL("liblgd.so.0")
    except OSError:
        return True
    return False


def _metadata():
    readme = (HERE / "README.md").read_text()
    head = (
        "Metadata-Version: 2.1\nName: lgd\nVersion: {}\n"
        "Summary: The material of a flat surface from one flash photograph\nLicense: Apache-2.0\n"
        "Requires-Python: >=3.9\nRequires-Dist: numpy\nDescription-Content-Type: text/markdown\n\n{}"
    )
    return head.format(_version(), readme)


def _library(folder):
    """The library as make install would have it, stripped: pairs of a file and its place in the package."""
    build = pathlib.Path(os.environ.get("LGD_BUILD", ROOT / "build")).resolve()
    subprocess.run(["make", "-C", str(ROOT), "--no-print-directory", f"BUILD={build}", "library"], check=True)
    files = [
        (build / "liblgd.so.0", "lib/liblgd.so.0"),
        (build / "lib/lgd/liblgd_image.so", "lib/lgd/liblgd_image.so"),
    ]
    made = []
    for source, place in files:
        stripped = pathlib.Path(folder) / source.name
        strip = [os.environ.get("STRIP", "strip"), "--strip-unneeded", "-o", str(stripped), str(source)]
        subprocess.run(strip, check=True)
        made.append((stripped, place))
    return made + [(ROOT / "models" / "phone.safetensors", "share/lgd/phone.safetensors")]


def _own_tag():
    return "py3-none-" + re.sub(r"[^A-Za-z0-9]", "_", sysconfig.get_platform())


def _wheel_name(tag):
    return f"lgd-{_version()}-{tag}.whl"


def _write(directory, tag, files, texts):
    """files: pairs of a file and its name in the wheel; texts: pairs of a name and what is in it."""
    info = f"lgd-{_version()}.dist-info"
    name = _wheel_name(tag)
    wheel = f"Wheel-Version: 1.0\nGenerator: lgd\nRoot-Is-Purelib: {str(tag.endswith('any')).lower()}\nTag: {tag}\n"
    texts = texts + [(f"{info}/METADATA", _metadata()), (f"{info}/WHEEL", wheel)]
    content = [(place, source.read_bytes()) for source, place in files] + [(n, t.encode()) for n, t in texts]
    content += [(f"{info}/{legal}", (ROOT / legal).read_bytes()) for legal in ("LICENSE", "NOTICE")]
    record = ""
    with zipfile.ZipFile(pathlib.Path(directory) / name, "w", zipfile.ZIP_DEFLATED) as z:
        for place, data in content:
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            record += f"{place},sha256={digest},{len(data)}\n"
            z.writestr(zipfile.ZipInfo(place), data, zipfile.ZIP_DEFLATED)
        z.writestr(zipfile.ZipInfo(f"{info}/RECORD"), record + f"{info}/RECORD,,\n")
    return name


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    package = [f for f in sorted((HERE / "lgd").iterdir()) if f.suffix == ".py" or f.name == "py.typed"]
    files = [(f, f"lgd/{f.name}") for f in package]
    if not _own():
        return _write(wheel_directory, "py3-none-any", files, [])
    tag = _own_tag()
    with tempfile.TemporaryDirectory() as folder:
        files += [(source, f"lgd/{place}") for source, place in _library(folder)]
        return _write(wheel_directory, tag, files, [])


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    return _write(wheel_directory, "py3-none-any", [], [("lgd.pth", f"{HERE}\n")])


def build_sdist(sdist_directory, config_settings=None):
    raise SystemExit("there is no source distribution: the library's sources are those of the checkout")


if __name__ == "__main__":
    import sys

    if sys.argv[1:] == ["--name"]:  # of the wheel with a library
        print(_wheel_name(_own_tag()))
    else:
        print(build_wheel(sys.argv[1]))
