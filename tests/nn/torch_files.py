#!/usr/bin/env python3
"""Real PyTorch against lgd-convert: what torch.save writes in every form is read with the same values, and what
lgd-convert writes is read by torch.load(weights_only=True). Usage: torch_files.py LGD-CONVERT FOLDER (an empty one)"""
import collections, json, struct, subprocess, sys
import torch

convert, folder = sys.argv[1:]
types = {'F32': torch.float32, 'F16': torch.float16, 'BF16': torch.bfloat16, 'F64': torch.float64, 'I64': torch.int64,
    'I32': torch.int32, 'BOOL': torch.bool, 'U8': torch.uint8}

def safetensors(path):
    data = open(path, 'rb').read()
    n, = struct.unpack('<Q', data[:8])
    out = {}
    for name, t in json.loads(data[8:8 + n]).items():
        if name == '__metadata__': continue
        a, b = t['data_offsets']
        raw = bytearray(data[8 + n + a:8 + n + b])
        out[name] = (torch.frombuffer(raw, dtype=types[t['dtype']])
            if raw else torch.empty(0, dtype=types[t['dtype']])).reshape(t['shape'])
    return out

def same(a, b, what):
    assert list(a.keys()) == list(b.keys()) or set(a) == set(b), (what, list(a), list(b))
    for k in a:
        x, y = a[k].detach(), b[k].detach()
        assert x.dtype == y.dtype and x.shape == y.shape and torch.equal(x, y), (what, k)

torch.manual_seed(1)
w, line = torch.randn(4, 3, 5, 5), torch.arange(24, dtype=torch.float32)
sd = collections.OrderedDict([
    ('a.weight', w), ('half', torch.randn(4).half()), ('transposed', torch.randn(5, 6).t()),
    ('view', line[2:8].view(2, 3)), ('every_second', line[10:20:2]),
    ('brain', torch.randn(7).bfloat16()), ('double', torch.randn(3).double()), ('whole', torch.tensor(5)),
    ('expanded', torch.randn(1, 4).expand(3, 4)),
    ('channels_last', w.contiguous(memory_format=torch.channels_last)), ('empty', torch.zeros(0, 3)),
    ('parameter', torch.nn.Parameter(torch.randn(2))),
    ('truth', torch.tensor([True, False])), ('bytes', torch.arange(5, dtype=torch.uint8))])
for zipped in (True, False):
    for protocol in (2, 4):
        path = '%s/in-%d-%d.pth' % (folder, zipped, protocol)
        torch.save(sd, path, _use_new_zipfile_serialization=zipped, pickle_protocol=protocol)
        subprocess.check_call([convert, path, folder + '/out.safetensors'])
        same(sd, safetensors(folder + '/out.safetensors'), path)
        subprocess.check_call([convert, path, folder + '/out.pth'])
        same(sd, torch.load(folder + '/out.pth', weights_only=True), path)
        same(sd, torch.load(folder + '/out.pth'), path)
for name, dtype in (('f32', torch.float32), ('f16', torch.float16), ('bf16', torch.bfloat16)):
    subprocess.check_call([convert, '--dtype', name, path, folder + '/out.pth'])
    # PyTorch rounds a double to bfloat16 or half by way of a float, as lgd-convert does
    same({k: v.detach().float().to(dtype) if v.is_floating_point() else v for k, v in sd.items()},
        torch.load(folder + '/out.pth', weights_only=True), name)
model = torch.nn.Sequential(torch.nn.Conv2d(3, 4, 3), torch.nn.BatchNorm2d(4))
adam = torch.optim.Adam(model.parameters())
model(torch.randn(2, 3, 8, 8)).sum().backward()
adam.step()
torch.save({'state_dict': model.state_dict(), 'epoch': 3, 'lr': .1, 'optimizer': adam.state_dict()},
    folder + '/checkpoint.pth')
subprocess.check_call([convert, folder + '/checkpoint.pth', folder + '/out.pth'])
has = torch.load(folder + '/out.pth', weights_only=True)
same(model.state_dict(), {k: v for k, v in has.items() if not k.startswith('optimizer.')}, 'checkpoint')
assert torch.equal(has['optimizer.state.0.exp_avg'], adam.state_dict()['state'][0]['exp_avg'])
torch.save(model, folder + '/module.pth')
r = subprocess.run([convert, '--list', folder + '/module.pth'], capture_output=True, text=True)
assert r.returncode == 1 and 'torch.nn.modules.container.Sequential' in r.stderr, r.stderr
