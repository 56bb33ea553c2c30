#!/bin/sh
# The peers of lgd-bench: these versions of PyTorch (with torch.compile) and of OpenVINO from PyPI into build/venv, else
# the system's python3-torch. PyPI's PyTorch is for GPUs too where there is one, 5 GB, and computes on the CPU all the
# same; an index of CPU wheels, named to pip by PIP_EXTRA_INDEX_URL, goes before it. Each is optional: lgd-bench names
# what is not there.
torch=2.15.0 openvino=2026.4.1
venv=${BUILD:-build}/venv
has() { "$1" -c 'import torch; print("bench-deps: PyTorch", torch.__version__)' 2>/dev/null; }
also() { "$1" -c 'import openvino; print("bench-deps: OpenVINO", openvino.__version__)' 2>/dev/null; }
is() { "$venv/bin/python3" -c "import importlib.metadata as m; raise SystemExit(not m.version('$1').startswith('$2'))" \
    2>/dev/null; }
if [ -d "$venv" ] || python3 -m venv "$venv"; then
    is torch $torch || "$venv/bin/pip" install --quiet --no-input "torch==$torch" numpy
    is openvino $openvino || "$venv/bin/pip" install --quiet --no-input "openvino==$openvino" ||
        echo "bench-deps: no openvino $openvino from PyPI; lgd-bench goes on without" >&2
    command -v "${CXX:-g++}" >/dev/null ||
        echo "bench-deps: torch.compile needs a C++ compiler, g++; lgd-bench goes on without" >&2
    if has "$venv/bin/python3"; then
        also "$venv/bin/python3"
        exit 0
    fi
fi
rm -rf "$venv"
has /usr/bin/python3 && exit 0
if command -v apt-get >/dev/null && [ "$(id -u)" -eq 0 ] &&
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends python3-torch >&2; then
    has /usr/bin/python3 && exit 0
fi
echo "bench-deps: neither torch $torch from PyPI nor Debian's python3-torch could be had; lgd-bench goes on without" >&2
exit 1
