#!/usr/bin/env python3
"""badinputs_test.py PORTHOLE [--shared DIR] [--sanitized] [--jobs N] [--verbose]
badinputs_test.py --self-check

Renders every broken, hostile or odd model of the shared corpus and compares what the program
did with the verdict in its manifest. Prints the files that fail and one line of counts; exit 1
unless all are ok, 77 (skipped) when the corpus is not there.

The corpus is DIR/badinputs; DIR is $PORTHOLE_SHARED or "shared" beside the checkout.

  REFUSE  exit 3 or 5              EITHER  exit 3 or 5, or 0 with a warning
  WARN    exit 0 with a warning    OK      exit 0
  EMPTY   exit 3                   ANY     exit 0, 3 or 5

Whatever the verdict: no crash, 10 s, 1 GB, a 64x64 picture if and only if the exit code is 0,
messages in UTF-8 without control characters. Pictures (tex/) are tried as the texture of a quad.
"""
import argparse
import collections
import concurrent.futures
import csv
import json
import os
import pathlib
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
import threading
import time

KINDS = {'gltf', 'obj', 'ply', 'stl', 'names', 'wrongtype', 'geometry', 'tex'}
SECONDS = 10
PEAK_BYTES = 1 << 30
ADDRESS_BYTES = 4 << 30
OUTCOMES = ['ok', 'crashed', 'hung', 'silent', 'refused-legal', 'over-memory', 'untidy']

# Rows whose verdict is wrong, with the reason; drawing them is right, and they are counted apart.
DISPUTED = {
    'gltf/misc/tinygltf_zero-sized-bin-chunk-issue-440.glb':
        'a legal file: its BIN chunk is not empty but has the 44 bytes that its buffer asks for',
}

# What the program did with one file.
Run = collections.namedtuple('Run', 'code seconds peak_bytes stderr picture', defaults=(0.1, 1 << 20, b'', None))


def judge(verdict, run, memory_counts=True):
    """One of OUTCOMES, and why."""
    if run.seconds >= SECONDS:
        return 'hung', f'{run.seconds:.1f} s'
    if run.code not in (0, 3, 5):
        return 'crashed', f'exit {run.code}'
    if memory_counts and run.peak_bytes > PEAK_BYTES:
        return 'over-memory', f'{run.peak_bytes >> 20} MB'
    try:
        text = run.stderr.decode('utf-8')
    except UnicodeDecodeError as fault:
        return 'untidy', f'messages are not UTF-8: {fault}'
    control = [c for c in text if (ord(c) < 32 and c != '\n') or 127 <= ord(c) < 160 or c in '\u202a\u202b\u202c\u202d\u202e']
    if control:
        return 'untidy', f'control characters in messages: {control[:3]!r}'
    warned = any('warning[W' in line for line in text.splitlines())
    errors = sum('error[E' in line for line in text.splitlines())
    if run.code == 0 and run.picture != (64, 64):
        return 'untidy', f'exit 0 with the picture {run.picture}'
    if run.code != 0 and run.picture is not None:
        return 'untidy', f'exit {run.code} and yet a picture'
    if run.code != 0 and errors != 1:
        return 'untidy', f'exit {run.code} with {errors} error lines'
    refused = run.code in (3, 5)
    if verdict == 'REFUSE':
        return ('ok', '') if refused else ('silent', 'should be refused')
    if verdict == 'EITHER':
        return ('ok', '') if refused or warned else ('silent', 'neither refused nor warned of')
    if verdict == 'WARN':
        if refused:
            return 'refused-legal', 'should be drawn with a warning'
        return ('ok', '') if warned else ('silent', 'should be warned of')
    if verdict == 'OK':
        return ('ok', '') if not refused else ('refused-legal', 'should be drawn')
    if verdict == 'EMPTY':
        return ('ok', '') if run.code == 3 else ('silent', 'there is nothing to draw')
    if verdict == 'ANY':
        return 'ok', ''
    return 'untidy', f'the manifest says {verdict}'


def self_check():
    drawn = Run(0, picture=(64, 64))
    warned = drawn._replace(stderr=b'porthole: warning[W0401]: a.obj:1: left out\n')
    refused = Run(3, stderr=b'porthole: error[E0401]: a.obj:1: no faces\n')
    expected = {
        'REFUSE': ('silent', 'silent', 'ok'), 'EITHER': ('silent', 'ok', 'ok'),
        'WARN': ('silent', 'ok', 'refused-legal'), 'OK': ('ok', 'ok', 'refused-legal'),
        'EMPTY': ('silent', 'silent', 'ok'), 'ANY': ('ok', 'ok', 'ok'),
    }
    for verdict, outcomes in expected.items():
        for run, outcome in zip((drawn, warned, refused), outcomes):
            assert judge(verdict, run)[0] == outcome, (verdict, run)
    for run, outcome in [
            (drawn._replace(code=-11), 'crashed'), (drawn._replace(code=1), 'crashed'),
            (drawn._replace(code=2), 'crashed'), (drawn._replace(seconds=11), 'hung'),
            (drawn._replace(peak_bytes=PEAK_BYTES + 1), 'over-memory'), (Run(0), 'untidy'),
            (drawn._replace(picture=(1, 1)), 'untidy'), (refused._replace(picture=(64, 64)), 'untidy'),
            (refused._replace(stderr=b''), 'untidy'), (drawn._replace(stderr=b'\x1b[31m'), 'untidy'),
            (drawn._replace(stderr=b'\xff'), 'untidy'), (drawn._replace(stderr='\u202e'.encode()), 'untidy')]:
        assert judge('ANY', run)[0] == outcome, run
    print('badinputs: the judge is sound')


def picture_size(path):
    """Width and height of a PNG, (0, 0) of anything else, None if there is no file."""
    try:
        head = path.read_bytes()[:24]
    except FileNotFoundError:
        return None
    return struct.unpack('>II', head[16:24]) if head[:8] == b'\x89PNG\r\n\x1a\n' and len(head) == 24 else (0, 0)


def run_once(program, model, folder):
    """Renders `model` with everything it writes in `folder`."""
    output = folder / 'out.png'
    with open(folder / 'stderr', 'w+b') as stderr:
        started = time.monotonic()
        process = subprocess.Popen([program, 'render', str(model), '-o', str(output), '--size', '64x64'],
                                   stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=stderr)
        killer = threading.Timer(SECONDS, process.kill)
        killer.start()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        killer.cancel()
        seconds = time.monotonic() - started
        stderr.seek(0)
        return Run(process.returncode, seconds, usage.ru_maxrss * 1024, stderr.read(), picture_size(output))


def textured_quad(picture, folder):
    """A glTF quad with `picture` as its base colour."""
    shutil.copyfile(picture, folder / picture.name)
    corners = [-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0]
    data = struct.pack('<12f8f6H', *corners, 0, 1, 1, 1, 1, 0, 0, 0, 0, 1, 2, 0, 2, 3)
    (folder / 'quad.bin').write_bytes(data)
    model = {
        'asset': {'version': '2.0'}, 'scene': 0, 'scenes': [{'nodes': [0]}], 'nodes': [{'mesh': 0}],
        'meshes': [{'primitives': [{'attributes': {'POSITION': 0, 'TEXCOORD_0': 1}, 'indices': 2, 'material': 0}]}],
        'materials': [{'pbrMetallicRoughness': {'baseColorTexture': {'index': 0}}}],
        'textures': [{'source': 0}], 'images': [{'uri': picture.name}],
        'buffers': [{'uri': 'quad.bin', 'byteLength': len(data)}],
        'bufferViews': [{'buffer': 0, 'byteOffset': 0, 'byteLength': 48}, {'buffer': 0, 'byteOffset': 48, 'byteLength': 32},
                        {'buffer': 0, 'byteOffset': 80, 'byteLength': 12}],
        'accessors': [{'bufferView': 0, 'componentType': 5126, 'count': 4, 'type': 'VEC3', 'min': [-1, -1, 0], 'max': [1, 1, 0]},
                      {'bufferView': 1, 'componentType': 5126, 'count': 4, 'type': 'VEC2'},
                      {'bufferView': 2, 'componentType': 5123, 'count': 6, 'type': 'SCALAR'}],
    }
    path = folder / 'quad.gltf'
    path.write_text(json.dumps(model))
    return path


def run_row(program, corpus, row):
    with tempfile.TemporaryDirectory(prefix='porthole-badinputs-') as name:
        folder = pathlib.Path(name)
        model = corpus / row['path']
        if row['path'].startswith('tex/'):
            model = textured_quad(model, folder)
        return run_once(program, model, folder)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('program', nargs='?')
    parser.add_argument('--self-check', action='store_true')
    parser.add_argument('--shared', default=os.environ.get('PORTHOLE_SHARED') or
                        pathlib.Path(__file__).resolve().parents[2] / 'shared')
    parser.add_argument('--sanitized', action='store_true', help='no memory limits: sanitizers need much')
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('--verbose', action='store_true', help='print every file and its messages')
    options = parser.parse_args()
    if options.self_check:
        return self_check()
    if not options.program:
        parser.error('the porthole program is missing')

    corpus = pathlib.Path(options.shared) / 'badinputs'
    if not (corpus / 'manifest.tsv').is_file():
        print(f'badinputs: SKIPPED, no corpus at {corpus}; set PORTHOLE_SHARED')
        sys.exit(1 if os.environ.get('CI') else 77)
    with open(corpus / 'manifest.tsv', encoding='utf-8', newline='') as table:
        rows = [row for row in csv.DictReader(table, delimiter='\t', quoting=csv.QUOTE_NONE)
                if row['path'].split('/')[0] in KINDS]
    if not rows:
        sys.exit('badinputs: the manifest names no files')
    if not options.sanitized:
        # Inherited by every program started from here.
        resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_BYTES, ADDRESS_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    tally = collections.Counter()
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        runs = pool.map(lambda row: run_row(options.program, corpus, row), rows)
        for row, run in zip(rows, runs):
            verdict = 'OK' if row['path'] in DISPUTED else row['verdict']
            outcome, why = judge(verdict, run, not options.sanitized)
            tally[outcome] += 1
            if outcome != 'ok' or options.verbose:
                last = run.stderr.decode('utf-8', 'replace').strip().splitlines()[-1:] or ['']
                print(f'{outcome}: {row["path"]} ({row["verdict"]}): {why}: {last[0][:200]!r}')
    disputed = sum(row['path'] in DISPUTED for row in rows)
    print(f'badinputs: {len(rows)} files: ' + ', '.join(f'{tally[o]} {o}' for o in OUTCOMES) +
          f' ({disputed} with a verdict held wrong)')
    sys.exit(0 if tally['ok'] == len(rows) else 1)


if __name__ == '__main__':
    main()
