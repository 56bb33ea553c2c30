"""Sets of files as slopes.py and evenness.py take them: NAME=FILES[:PANEL]..., FILES being a quoted pattern."""
import glob
import sys

from messages import fail, usage


def sets(text):
    """Yields name, paths and panel ("" where none is given) of each argument; ends with text, the usage, where there is
    none, or with a message where no file is found or there can be no such panel."""
    if len(sys.argv) < 2 or any("=" not in a for a in sys.argv[1:]):
        usage(text)
    for argument in sys.argv[1:]:
        name, files = argument.split("=", 1)
        files, _, panel = files.partition(":")
        if panel not in ("", "q") and not panel.isdecimal():
            fail(f"{argument}: the panel '{panel}' is neither a number nor q", 2)
        paths = sorted(glob.glob(files))
        if not paths:
            fail(f"{files}: no such file")
        yield name, paths, panel


def cut(image, path, panel):
    """Of an image of square panels the one of that number."""
    side = image.shape[0]
    left = int(panel) * side
    if left + side > image.shape[1]:
        fail(f"{path}: has no panel {panel}")
    return image[:, left : left + side]
