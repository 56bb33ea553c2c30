#!/bin/sh
# PyTorch for lgd-bench's peer: this version from PyPI into build/venv (where PyPI's wheel is for GPUs too it is large; it computes on the CPU all the
# same), else the system's python3-torch.
version=2.8.0
venv=${BUILD:-build}/venv
has() { "$1" -c 'import torch; print("bench-deps: PyTorch", torch.__version__)' 2>/dev/null; }
[ -x "$venv/bin/python3" ] && has "$venv/bin/python3" && exit 0
if python3 -m venv "$venv" && "$venv/bin/pip" install --quiet --no-input "torch==$version" numpy && has "$venv/bin/python3"; then exit 0; fi
rm -rf "$venv"
has /usr/bin/python3 && exit 0
if command -v apt-get >/dev/null && [ "$(id -u)" -eq 0 ] && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends python3-torch >&2; then
    has /usr/bin/python3 && exit 0
fi
echo "bench-deps: neither torch $version from PyPI nor Debian's python3-torch could be had; lgd-bench goes on without" >&2
exit 1
