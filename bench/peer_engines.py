"""What computes the peer's networks (bench/peer_torch.py): PyTorch as it stands, what torch.compile makes of it, and
OpenVINO.

network() takes the whole network for inference, module() a part of one, function() a training loss; each gives back
what does the same work. """
import importlib.util
import os
import shutil

import torch
from torch import nn

LAYOUTS = (torch.channels_last, torch.contiguous_format)


class Absent(Exception):
    """The engine, or this work in it, is not to be had here; says why."""


class Eager:
    """Operation by operation, in the better of both memory formats."""
    layouts = LAYOUTS
    edge = "replicate"  # of convolutions that are trained, as F.pad calls it

    def __init__(self, threads, rounded):
        self.threads, self.rounded = threads, rounded

    @staticmethod
    def name():
        return f"PyTorch {torch.__version__.split('+')[0]}, eager"

    def autocast(self):
        return torch.autocast("cpu", dtype=torch.bfloat16, enabled=self.rounded)

    def network(self, net, functional, side):
        """For inference, at side x side pixels; functional: the renderer's gradient for those that compile it."""
        return net

    def function(self, f):
        return f

    def module(self, module, examples):
        return module


class Compiled(Eager):
    """torch.compile, the weights frozen where nothing is trained, channels last; the renderer's gradient by its own
    differentiation of functions, which it compiles too."""
    layouts = LAYOUTS[:1]
    edge = "constant"  # zeros, in less time: it fails at the gradient of a repeated border

    def __init__(self, threads, rounded):
        super().__init__(threads, rounded)
        if not shutil.which(os.environ.get("CXX", "g++")):
            raise Absent("no C++ compiler")
        import torch._inductor.config as config
        config.freezing = True  # takes effect without gradients alone

    @staticmethod
    def name():
        return f"torch.compile {torch.__version__.split('+')[0]}"

    def network(self, net, functional, side):
        net.descent = functional
        return torch.compile(net, dynamic=False)

    def function(self, f):
        return torch.compile(f, dynamic=False)

    def module(self, module, examples):
        return torch.compile(module, dynamic=False)


class Flat(nn.Module):
    """A refiner whose arguments and results are tensors alone; those that nothing reads are none."""
    def __init__(self, h):
        super().__init__()
        self.h = h

    def forward(self, x, *state):
        delta, state = self.h(x, state)
        return (delta, *state) if self.h.recurrent else (delta,)


class OpenVINO(Eager):
    """OpenVINO's networks; the renderer's gradient, which it cannot differentiate, and what lies between the networks
    are torch's, the gradient compiled."""
    layouts = LAYOUTS[1:]  # it chooses its own inside

    def __init__(self, threads, rounded):
        super().__init__(threads, rounded)
        if importlib.util.find_spec("openvino") is None:
            raise Absent("not installed")

    @staticmethod
    def name():
        import openvino
        return f"OpenVINO {openvino.__version__.split('-')[0]}"

    def autocast(self):
        return torch.autocast("cpu", enabled=False)

    def network(self, net, functional, side):
        a, parts = net.a, (net.g, net.h, net.coarse)
        del net.g, net.h, net.coarse
        small = min(a["c_size"], side)
        g = self.module(parts[0], [torch.zeros(1, 3, a["g_size"], a["g_size"])])
        net.g = lambda x: g(x)[0]
        net.h = self.refiner(parts[1], a, a["h_gru"], side)
        net.coarse = self.refiner(parts[2], a, a["c_gru"], small)
        net.descent = torch.compile(functional, dynamic=False)
        return net

    def refiner(self, h, a, gru, side):
        if h is None:
            return None
        x, state = (torch.zeros(1, 2 * a["channels"], side, side),
            [torch.zeros(1, gru, side, side)] * (2 if a["recurrent"] else 0))
        run = self.module(Flat(h), [x, *state])

        def step(x, state):
            delta, *state = run(x, *(state if a["recurrent"] else []))
            return delta, state
        return step

    def function(self, f):
        raise Absent("does not train")

    def module(self, module, examples):
        import openvino
        model = openvino.convert_model(module, example_input=examples, input=[list(e.shape) for e in examples])
        hint = {"PERFORMANCE_HINT": "LATENCY", "INFERENCE_NUM_THREADS": self.threads,
            "INFERENCE_PRECISION_HINT": "bf16" if self.rounded else "f32"}
        request = openvino.Core().compile_model(model, "CPU", hint).create_infer_request()

        def run(*inputs):
            out = request.infer([x.detach().contiguous().numpy() for x in inputs], share_inputs=True,
                share_outputs=False)
            return tuple(torch.from_numpy(out[i]) for i in range(len(out)))
        return run


ENGINES = {"eager": Eager, "compile": Compiled, "openvino": OpenVINO}
