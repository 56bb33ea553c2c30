"""Sets of files as slopes.py and evenness.py take them: NAME=FILES[:PANEL]..., FILES being a quoted pattern."""
import glob
import sys


def sets(script, usage):
    """Yields name, paths and panel ("" where none is given) of each argument; ends with usage where there is none, or
    with a message where no file is found."""
    if len(sys.argv) < 2 or any("=" not in a for a in sys.argv[1:]):
        sys.exit(usage)
    for argument in sys.argv[1:]:
        name, files = argument.split("=", 1)
        files, _, panel = files.partition(":")
        paths = sorted(glob.glob(files))
        if not paths:
            sys.exit(f"{script}: {files}: no such file")
        yield name, paths, panel
