#!/usr/bin/env python3
"""Writes the small PyTorch files of tests/corpus/torch, good and bad ones, and expected.tsv, which says what must come
of each:
   FILE <tab> ok <tab> NAME DTYPE SHAPE VALUES; ...     or     FILE <tab> error <tab> text of the message
Only Python's standard library is used: the pickles are put together by hand, opcode by opcode (pickletools.py), so that
every form can be made. Usage: make_torch_files.py FOLDER"""
import io, struct, sys, zipfile

out = sys.argv[1]
expected = []

# --- pickles --------------------------------------------------------------------------------------
def text(s):
    b = s.encode() if isinstance(s, str) else s
    return b'X' + struct.pack('<I', len(b)) + b

def integer(v):
    if 0 <= v < 256: return b'K' + bytes([v])
    if 0 <= v < 65536: return b'M' + struct.pack('<H', v)
    if -2**31 <= v < 2**31: return b'J' + struct.pack('<i', v)
    b = v.to_bytes((v.bit_length() + 8) // 8, 'little', signed=True)
    return b'\x8a' + bytes([len(b)]) + b

def ints(v): return b'(' + b''.join(map(integer, v)) + b't'
def glob(module, name): return b'c' + module.encode() + b'\n' + name.encode() + b'\n'

ORDERED = glob('collections', 'OrderedDict') + b')R'

def storage(key, kind='Float', numel=6, view=None, module='torch', tag='storage'):
    v = b'' if view is None else view
    return b'(' + text(tag) + glob(module, kind + 'Storage') + text(key) + text('cpu') + integer(numel) + v + b'tQ'

def tensor(store, shape, stride=None, offset=0, f='_rebuild_tensor_v2'):
    if stride is None:
        stride, n = [], 1
        for d in reversed(shape):
            stride.insert(0, n)
            n *= d
    hooks = b'' if f == '_rebuild_tensor' else b'\x89' + ORDERED
    return glob('torch._utils', f) + b'(' + store + integer(offset) + ints(shape) + ints(stride) + hooks + b'tR'

def dictionary(items, ordered=True):
    return (ORDERED if ordered else b'}') + b'(' + b''.join((text(k)
        if isinstance(k, (str, bytes)) else integer(k)) + v for k, v in items) + b'u'

def pickled(body, protocol=2): return b'\x80' + bytes([protocol]) + body + b'.'

# --- containers -----------------------------------------------------------------------------------
def archive(pickle, storages, folder='archive', deflate=False, extra=()):
    f = io.BytesIO()
    z = zipfile.ZipFile(f, 'w', zipfile.ZIP_DEFLATED if deflate else zipfile.ZIP_STORED)
    def put(name, data):
        i = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
        i.compress_type = zipfile.ZIP_DEFLATED if deflate else zipfile.ZIP_STORED
        z.writestr(i, data)
    put(folder + '/data.pkl', pickle)
    for k, v in storages.items(): put(folder + '/data/' + k, v)
    for name, data in extra: put(name, data)
    z.close()
    return f.getvalue()

MAGIC = pickled(b'\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19')
SYSTEM = pickled(b'}(' + text('protocol_version') + integer(1001) + text('little_endian') + b'\x88' +
    text('type_sizes') + b'}u')

def old(pickle, storages, version=1001, tail=b''):
    keys = b'](' + b''.join(text(k) for k in storages) + b'e'
    return MAGIC + pickled(integer(version)) + SYSTEM + pickle + pickled(keys) + b''.join(struct.pack('<q', n) + d
        for n, d in storages.values()) + tail

def wide(data):
    """The same archive with its sizes and places in 64-bit fields alone."""
    end = data.rindex(b'PK\5\6')
    count, size, begin = struct.unpack('<HII', data[end + 10:end + 20])
    at, directory = begin, b''
    for _ in range(count):
        h = bytearray(data[at:at + 46])
        n, x, c = struct.unpack('<HHH', h[28:34])
        packed, full = struct.unpack('<II', h[20:28])
        place, = struct.unpack('<I', h[42:46])
        h[20:28] = b'\xff' * 8
        h[42:46] = b'\xff' * 4
        more = struct.pack('<HHHHQQQ', 0x4246, 0, 1, 24, full, packed, place)
        h[30:32] = struct.pack('<H', len(more))
        directory += bytes(h) + data[at + 46:at + 46 + n] + more
        at += 46 + n + x + c
    end64 = b'PK\6\6' + struct.pack('<QHHIIQQQQ', 44, 45, 45, 0, 0, count, count, len(directory), begin)
    locator = b'PK\6\7' + struct.pack('<IQI', 0, begin + len(directory), 1)
    return data[:begin] + directory + end64 + locator + b'PK\5\6' + struct.pack('<HHHHIIH', 0, 0, 0xffff, 0xffff,
        0xffffffff, 0xffffffff, 0)

def good(name, data, *tensors):
    open(out + '/' + name, 'wb').write(data)
    expected.append((name, 'ok', ';'.join('%s %s %s %s' % (n, d, 'x'.join(map(str, s)) or '-',
        ','.join('%g' % v for v in vs) or '-') for n, d, s, vs in tensors)))

def bad(name, data, why):
    open(out + '/' + name, 'wb').write(data)
    expected.append((name, 'error', why))

SIX = struct.pack('<6f', *range(6))
W = ('w', 'F32', (2, 3), range(6))
one = pickled(dictionary([('w', tensor(storage('0'), (2, 3)))]))
simple = archive(one, {'0': SIX})

# --- good ones ------------------------------------------------------------------------------------
good('stored.pth', simple, W)
good('deflated.pth', archive(one, {'0': SIX}, deflate=True), W)
good('zip64.pth', wide(simple), W)
good('comment.pth', simple[:-2] + b'\5\0hello', W)
good('folder_name.pth', archive(one, {'0': SIX}, folder='my model'), W)
good('little.pth', archive(one, {'0': SIX}, extra=[('archive/byteorder', 'little'), ('archive/version', '3\n')]), W)
good('big.pth', archive(one, {'0': struct.pack('>6f', *range(6))}, extra=[('archive/byteorder', 'big')]), W)
good('transposed.pth', archive(pickled(dictionary([('w', tensor(storage('0'), (3, 2), (1, 3)))])), {'0': SIX}),
    ('w', 'F32', (3, 2), (0, 3, 1, 4, 2, 5)))
good('shared.pth', archive(pickled(dictionary([('a', tensor(storage('0'), (2,), offset=1)),
    ('b', tensor(storage('0'), (2, 2), (3, 1), 1)),
     ('c', tensor(storage('0'), (3,), (0,), 5)), ('d', tensor(storage('0'), ()))])), {'0': SIX}),
     ('a', 'F32', (2,), (1, 2)), ('b', 'F32', (2, 2), (1, 2, 4, 5)), ('c', 'F32', (3,), (5, 5, 5)),
     ('d', 'F32', (), (0,)))
kinds = [('Half', 'F16', 'e'), ('Double', 'F64', 'd'), ('Long', 'I64', 'q'), ('Int', 'I32', 'i'), ('Short', 'I16', 'h'),
    ('Char', 'I8', 'b'), ('Byte', 'U8', 'B'), ('Bool', 'BOOL', '?')]
good('types.pth', archive(pickled(dictionary([(k.lower(), tensor(storage(k, k, 3), (3,))) for k, _,
    _ in kinds] + [('brain', tensor(storage('b', 'BFloat16', 2), (2,)))])),
     dict([(k, struct.pack('<3' + c, 0, 1, 1)) for k, _, c in kinds] + [('b', b'\x80\x3f\x40\xc0')])),
     *[(k.lower(), d, (3,), (0, 1, 1) if d in ('F16', 'F64') else ()) for k, d, _ in kinds],
     ('brain', 'BF16', (2,), (1, -3)))
half = struct.pack('<8e', 0, -0.0, 65504, 6e-8, 6.1e-5, 0.333251953125, -2, 1)
good('half.pth', archive(pickled(dictionary([('w', tensor(storage('0', 'Half', 8), (8,)))])), {'0': half},
    deflate=True), ('w', 'F16', (8,), struct.unpack('<8e', half)))
good('cuda.pth', archive(pickled(dictionary([('w', tensor(storage('0', module='torch.cuda'), (2, 3)))])), {'0': SIX}),
    W)
good('parameter.pth', archive(pickled(dictionary([('w',
    glob('torch._utils', '_rebuild_parameter') + b'(' + tensor(storage('0'), (2, 3)) + b'\x88' + ORDERED + b'tR')])),
    {'0': SIX}), W)
good('version1.pth', archive(pickled(dictionary([('w', tensor(storage('0'), (2, 3), f='_rebuild_tensor'))])),
    {'0': SIX}), W)
untyped = b'(' + text('storage') + glob('torch.storage',
    'UntypedStorage') + text('0') + text('cpu') + integer(24) + b'tQ'
version3 = glob('torch._utils', '_rebuild_tensor_v3') + b'(' + untyped + integer(1) + ints((2,)) + ints((3,
    )) + b'\x89' + ORDERED + glob('torch', 'float32') + b'tR'
good('version3.pth', archive(pickled(dictionary([('w', version3)])), {'0': SIX}), ('w', 'F32', (2,), (1, 4)))
good('lone_tensor.pth', archive(pickled(tensor(storage('0'), (2, 3))), {'0': SIX}), ('tensor',) + W[1:])
good('empty_tensor.pth', archive(pickled(dictionary([('w', tensor(storage('0', numel=0), (0, 3)))])), {'0': b''}),
    ('w', 'F32', (0, 3), ()))
good('state_dict.pth', archive(pickled(dictionary([('epoch', integer(3)), ('lr', b'G' + struct.pack('>d', .1)),
    ('name', text('x')), ('none', b'N'), ('flag', b'\x88'),
     ('state_dict', dictionary([('w', tensor(storage('0'), (2, 3)))]))], False)), {'0': SIX}), W)
good('nested.pth', archive(pickled(dictionary([('g', dictionary([('w', tensor(storage('0'), (2, 3)))])),
    ('h', b'}' + integer(7) + b'](' + b'N' + tensor(storage('0'), (1,)) + b'es')], False)), {'0': SIX}),
     ('g.w',) + W[1:], ('h.7.1', 'F32', (1,), (0,)))
good('attributes.pth', archive(pickled(dictionary([('w', tensor(storage('0'), (2, 3)))]) + b'}' + text('_metadata') +
    dictionary([('', b'}' + text('version') + integer(1) + b's')]) + b'sb'), {'0': SIX}), W)
good('pairs.pth', archive(pickled(glob('collections', 'OrderedDict') + b'](](' + text('w') + tensor(storage('0'),
    (2, 3)) + b'ee\x85R'), {'0': SIX}), W)
body = dictionary([('w', tensor(storage('0'), (2, 3)))])
memo = glob('collections', 'OrderedDict') + b'q\0)Rq\1(X\1\0\0\0wq\2' + glob('torch._utils',
    '_rebuild_tensor_v2') + b'r\3\0\0\0(' + storage('0') + b'K\0' + ints((2, 3)) + ints((3, 1)) + b'\x89h\0)RtRu'
good('memo.pth', archive(pickled(memo), {'0': SIX}), W)
frame = b'\x8c\x0bcollections\x94\x8c\x0bOrderedDict\x94\x93\x94)R\x94(\x8c\x01w\x94' + \
    b'\x8c\x0ctorch._utils\x8c\x12_rebuild_tensor_v2\x93(' + storage('0') + b'K\0K\2K\3\x86K\3K\1\x86\x89h\2)RtRu.'
good('protocol4.pth', archive(b'\x80\4\x95' + struct.pack('<Q', len(frame)) + frame, {'0': SIX}), W)
good('old.pth', old(pickled(dictionary([('w', tensor(storage('94', view=b'N'), (2, 3)))])), {'94': (6, SIX)}), W)
good('old_two.pth', old(pickled(dictionary([('n', tensor(storage('7', 'Long', 1, b'N'), ())),
    ('w', tensor(storage('94', view=b'N'), (2, 3)))])),
     {'7': (1, struct.pack('<q', 9)), '94': (6, SIX)}), ('n', 'I64', (), ()), W)
good('old_view.pth', old(pickled(dictionary([('w',
    tensor(storage('94', view=b'(' + text('95') + integer(2) + integer(4) + b't'), (2,), offset=1))])),
    {'94': (6, SIX)}), ('w', 'F32', (2,), (3, 4)))

# --- bad ones -------------------------------------------------------------------------------------
def zipped(name, body, why, storages={'0': SIX}): bad(name, archive(pickled(body), storages), why)
def w(t): return dictionary([('w', t)])

zipped('evil_system.pth', glob('posix', 'system') + text('echo') + b'\x85R', 'posix.system')
zipped('evil_eval.pth', dictionary([('w', glob('builtins', 'eval') + text('1') + b'\x85R')]), 'builtins.eval')
zipped('evil_stack_global.pth', text('os') + text('system') + b'\x93' + text('echo') + b'\x85R', 'os.system')
zipped('evil_method.pth', glob('torch.storage', '_load_from_bytes') + text('x') + b'\x85R',
    'torch.storage._load_from_bytes')
zipped('evil_getattr.pth', glob('torch._utils', '_rebuild_tensor_v2.__globals__') + b')R', '__globals__')
zipped('evil_module.pth', glob('torch.nn.modules.conv', 'Conv2d') + b')\x81}b', 'torch.nn.modules.conv.Conv2d')
zipped('evil_build.pth', tensor(storage('0'), (2, 3)) + b'}' + text('__class__') + integer(1) + b'sb',
    'attributes of something that is no dictionary')
zipped('evil_escape.pth', glob('\x1b[2J', 'x') + b')R', '?[2J.x')
zipped('evil_long_global.pth', glob('a' * 200, 'b' * 200) + b')R', 'aaaa')
zipped('opcode_inst.pth', b'(iposix\nsystem\n', 'the opcode 0x69')
zipped('opcode_ext.pth', b'\x82\1', 'the opcode 0x82')
zipped('opcode_dup.pth', b'}2', 'the opcode 0x32')
bad('protocol0.pth', archive(b'(dp0\n.', {'0': SIX}), 'no pickle of protocol 2')
bad('empty_pickle.pth', archive(b'', {'0': SIX}), 'no pickle of protocol 2')
for n, cut in enumerate((1, 3, 20, 60, len(one) // 2, len(one) - 2)): bad('pickle_cut%d.pth' % n,
    archive(one[:cut], {'0': SIX}), 'truncated')
zipped('stack_empty.pth', b'a', 'stack')
zipped('stack_mark.pth', b'}(s', 'dictionary')
zipped('stack_no_mark.pth', b'}u', 'mark')
zipped('stack_left.pth', b'}}', 'ends with 2 values')
zipped('stack_mark_left.pth', b'}(', 'ends with')
zipped('stack_below_mark.pth', b'}(R', 'stack')
zipped('odd_items.pth', b'}(' + text('a') + b'u', 'dictionary')
zipped('memo_missing.pth', b'h\7', 'memorised')
zipped('memo_huge.pth', b'}r\xff\xff\xff\x7f', 'memo')
zipped('text_huge.pth', b'X\xff\xff\xff\xff', 'truncated')
zipped('text_huge8.pth', b'\x8c\xff', 'truncated')
zipped('deep.pth', b'}' + text('a') + b'](' * 40 + b'e' * 40 + b's', 'nested')
zipped('cycle.pth', b'}q\0' + text('a') + b'h\0s', 'nested')
laughs = b']q\0'
for i in range(12): laughs += b'](h' + bytes([i]) + (b'h' + bytes([i])) * 15 + b'eq' + bytes([i + 1])
zipped('laughs.pth', b'](' + laughs + b'e', 'all the same ones')
zipped('persistent_text.pth', text('0') + b'Q', 'persistent object')
zipped('persistent_module.pth', w(tensor(storage('0', tag='module'), (1,))), 'persistent object')
zipped('no_storage.pth', w(tensor(text('0'), (1,))), 'without storage')
zipped('not_called.pth', text('a') + b')R', 'no global')
zipped('call_type.pth', glob('torch', 'FloatStorage') + b')R', 'a call of a type')
zipped('storage_missing.pth', w(tensor(storage('1'), (2, 3))), 'storage 1 is missing')
zipped('storage_short.pth', w(tensor(storage('0', numel=7), (7,))), 'storage 0 has 24 bytes')
zipped('storage_path.pth', w(tensor(storage('../data.pkl', 'Byte', 1), (1,))), 'is missing')
zipped('storage_huge.pth', w(tensor(storage('0', numel=2**62), (2**62,))), '24 bytes')
zipped('storage_negative.pth', w(tensor(storage('0', numel=-1), (1,))), 'persistent object')
zipped('beyond.pth', w(tensor(storage('0'), (7,))), 'beyond its storage')
zipped('beyond_offset.pth', w(tensor(storage('0'), (2, 3), offset=1)), 'beyond its storage')
zipped('beyond_stride.pth', w(tensor(storage('0'), (2, 2), (5, 1))), 'beyond its storage')
zipped('overflow_stride.pth', w(tensor(storage('0'), (3, 2), (2**62, 2**62))), 'beyond its storage')
zipped('overflow_sum.pth', w(tensor(storage('0'), (2, 2, 2), (2**62, 2**62, 1))), 'beyond its storage')
zipped('overflow_offset.pth', w(tensor(storage('0'), (2,), (1,), 2**63 - 1)), 'beyond its storage')
zipped('overflow_shape.pth', w(tensor(storage('0'), (2**32, 2**32, 2), (0, 0, 0))), 'impossible shape')
zipped('expanded.pth', w(tensor(storage('0'), (2**40,), (0,))), 'repeats')
zipped('negative_stride.pth', w(tensor(storage('0'), (2,), (-1,), 3)), 'strides')
zipped('negative_shape.pth', w(tensor(storage('0'), (-2,), (1,))), 'shape')
zipped('rank9.pth', w(tensor(storage('0'), (1,) * 9)), 'shape')
zipped('stride_rank.pth', w(tensor(storage('0'), (2, 3), (1,))), 'strides')
zipped('twice.pth', dictionary([('w', tensor(storage('0'), (1,))), ('w', tensor(storage('0'), (1,)))]), 'there twice')
zipped('name_latin.pth', dictionary([(b'caf\xe9', tensor(storage('0'), (1,)))]), 'UTF-8')
zipped('name_zero.pth', dictionary([(b'a\0b', tensor(storage('0'), (1,)))]), 'UTF-8')
zipped('name_long.pth', dictionary([('n' * 2000, tensor(storage('0'), (1,)))]), 'longer than')
zipped('key_tuple.pth', b'}' + ints((1, 2)) + tensor(storage('0'), (1,)) + b's', 'a key that')
zipped('no_tensor.pth', dictionary([('a', integer(1))]), 'no tensor')
zipped('quantised.pth', w(tensor(storage('0', 'QInt8'), (1,))), 'torch.QInt8Storage')

def patched(name, why, find, at, value, data=simple, last=False):
    d = bytearray(data)
    i = (d.rindex if last else d.index)(find) + at
    d[i:i + len(value)] = value
    bad(name, bytes(d), why)
patched('zip_method.pth', 'compression method 12', b'PK\1\2', 10, b'\x0c\0')
patched('zip_encrypted.pth', 'encrypted', b'PK\1\2', 8, b'\1\0')
patched('zip_two_sizes.pth', 'two sizes', b'PK\1\2', 24, b'\1\0\0\0')
patched('zip_size_beyond.pth', 'outside the file', b'PK\1\2', 20, b'\xfe\xff\xff\x7f\xfe\xff\xff\x7f')
patched('zip_header_beyond.pth', 'outside the file', b'PK\1\2', 42, b'\xfe\xff\xff\x7f')
patched('zip_header_wrong.pth', 'outside the file', b'PK\1\2', 42, b'\4\0\0\0')
patched('zip_name_beyond.pth', 'truncated', b'PK\1\2', 28, b'\xff\xff')
patched('zip_count.pth', 'more entries', b'PK\5\6', 10, b'\xfe\xff')
patched('zip_directory_beyond.pth', 'outside the file', b'PK\5\6', 16, b'\xfe\xff\xff\xef')
patched('zip_no_wide.pth', '64-bit directory is missing', b'PK\5\6', 16, b'\xff\xff\xff\xff')
patched('zip_overlap.pth', 'overlap', b'PK\1\2', 42, b'\0\0\0\0', last=True)
patched('zip_wide_sizes.pth', '64-bit sizes', b'PK\1\2', 20, b'\xff\xff\xff\xff\xff\xff\xff\xff')
patched('zip_wide_directory.pth', '64-bit directory is missing', b'PK\6\7', 8, b'\xff' * 8, wide(simple))
patched('zip_wide_count.pth', 'more entries', b'PK\6\6', 32, b'\xff' * 7 + b'\x7f', wide(simple))
patched('zip_wide_begin.pth', 'outside the file', b'PK\6\6', 48, b'\xff' * 8, wide(simple))
bad('zip_twice.pth', archive(one, {'0': SIX, 'x': SIX}).replace(b'archive/data/x', b'archive/data/0'), 'there twice')
bad('zip_no_pickle.pth', archive(one, {'0': SIX}).replace(b'data.pkl', b'data.pkx'), 'without FOLDER/data.pkl')
bad('zip_two_pickles.pth', archive(one, {'0': SIX}, extra=[('b/data.pkl', one)]), 'two folders')
bad('zip_order.pth', archive(one, {'0': SIX}, extra=[('archive/byteorder', 'middle')]), 'byteorder')
deflated = archive(pickled(w(tensor(storage('0', numel=3000), (3000,)))),
    {'0': struct.pack('<3000f', *[i % 7 for i in range(3000)])}, deflate=True)
at = deflated.index(b'archive/data/0') + 30
bad('inflate_damaged.pth', deflated[:at] + bytes([deflated[at] ^ 0x55]) + deflated[at + 1:],
    'compressed entry is damaged')
patched('inflate_checksum.pth', 'compressed entry is damaged', b'PK\1\2', 16, b'\1\2\3\4', deflated, last=True)
patched('inflate_short.pth', 'compressed entry is damaged', b'PK\1\2', 24, struct.pack('<I', 12001), deflated,
    last=True)
patched('inflate_bomb.pth', 'more than its compressed bytes', b'PK\1\2', 24, struct.pack('<I', 0xfffffff0), deflated,
    last=True)
for n, cut in enumerate((4, 30, 100, len(simple) // 2, len(simple) - 30, len(simple) - 1)): bad('zip_cut%d.pth' % n,
    simple[:cut], 'truncated')
bad('junk.pth', b'PK\3\4' + bytes(range(200)), 'no directory')

ow = pickled(w(tensor(storage('9', view=b'N'), (2, 3))))
whole = old(ow, {'9': (6, SIX)})
for n, cut in enumerate((70, 150, whole.rindex(b'.') + 1, len(whole) - 1)): bad('old_cut%d.pth' % n, whole[:cut],
    'truncated')
bad('old_version.pth', old(ow, {'9': (6, SIX)}, 1002), 'protocol version')
bad('old_evil.pth', old(pickled(glob('os', 'system') + text('x') + b'\x85R'), {}), 'os.system')
bad('old_missing.pth', old(ow, {}), 'storage 9 is missing')
bad('old_unused.pth', old(ow, {'9': (6, SIX), '8': (6, SIX)}), 'no tensor uses')
bad('old_twice.pth', old(ow, {'9': (6, SIX)}).replace(b'](X\1\0\0\09e', b'](X\1\0\0\09X\1\0\0\09e') + struct.pack('<q',
    6) + SIX, 'there twice')
bad('old_count.pth', old(ow, {'9': (5, SIX)}), 'fewer numbers')
bad('old_negative.pth', old(ow, {'9': (-1, SIX)}), 'truncated in storage')
bad('old_huge.pth', old(ow, {'9': (2**61, SIX)}), 'truncated in storage')
bad('old_two_types.pth', old(pickled(dictionary([('a', tensor(storage('9', view=b'N'), (1,))),
    ('b', tensor(storage('9', 'Long', 6, b'N'), (1,)))])), {'9': (6, SIX)}), 'two types')
bad('old_view_beyond.pth', old(pickled(w(tensor(storage('9', view=b'(' + text('v') + integer(4) + integer(3) + b't'),
    (2,)))), {'9': (6, SIX)}), 'outside its storage')

with open(out + '/expected.tsv', 'w') as f:
    for line in expected: f.write('\t'.join(line) + '\n')
