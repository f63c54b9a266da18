"""Running the program, and small models made by hand. Standard library only."""

import json
import os
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

PROGRAM = None  # path of the executable, set by main()


def run(*args, stdin=None, cwd=None, timeout=120, env=None):
    """Runs the program; returns the completed process with bytes in stdout and text in stderr."""
    done = subprocess.run([PROGRAM, *map(str, args)], input=stdin, capture_output=True, cwd=cwd, timeout=timeout,
                          env=env)
    done.stderr = done.stderr.decode("utf-8")  # strict: what it says is valid UTF-8
    return done


def box(low, high, first):
    """Corners and triangles (outward, counted from `first`) of a box, as OBJ lines."""
    corners = [(high[0] if i & 1 else low[0], high[1] if i & 2 else low[1], high[2] if i & 4 else low[2])
               for i in range(8)]
    faces = [(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4),
             (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5)]
    lines = ["v %g %g %g" % c for c in corners]
    lines += ["f %d %d %d" % tuple(first + i for i in face) for face in faces]
    return lines


def nested_boxes(names=("outer", "inner")):
    """An OBJ: box within box, one object for each name, the first the outermost."""
    lines = []
    for i, name in enumerate(names):
        size = 1.0 - 0.6 * i / len(names)
        lines += ["o " + name] + box((-size, -size, -size), (size, size, size), 1 + 8 * i)
    return "\n".join(lines) + "\n"


def png_pixels(data):
    """Decodes a PNG without interlace: (width, height, channels, bits, rows of bytes)."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n", data[:8]
    at, compressed, header = 8, b"", None
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        assert struct.unpack(">I", data[at + 8 + length:at + 12 + length])[0] == zlib.crc32(kind + body)
        if kind == b"IHDR":
            header = struct.unpack(">IIBBBBB", body)
        if kind == b"IDAT":
            compressed += body
        at += 12 + length
    width, height, bits, colour, _, _, interlace = header
    assert interlace == 0
    channels = {0: 1, 2: 3, 6: 4}[colour]
    step, stride = channels * bits // 8, width * channels * bits // 8
    raw, rows, above = zlib.decompress(compressed), [], bytes(stride)
    for y in range(height):
        line = bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        kind = raw[y * (stride + 1)]
        for x in range(stride):
            left = line[x - step] if x >= step else 0
            up, corner = above[x], above[x - step] if x >= step else 0
            if kind == 1:
                line[x] = (line[x] + left) & 255
            elif kind == 2:
                line[x] = (line[x] + up) & 255
            elif kind == 3:
                line[x] = (line[x] + (left + up) // 2) & 255
            elif kind == 4:
                p = left + up - corner
                near = min((abs(p - left), 0, left), (abs(p - up), 1, up), (abs(p - corner), 2, corner))
                line[x] = (line[x] + near[2]) & 255
        rows.append(bytes(line))
        above = rows[-1]
    return width, height, channels, bits, rows


class Case(unittest.TestCase):
    """A test with a folder of its own that holds box.obj, a box within a box."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="porthole-cli-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.model = self.write("box.obj", nested_boxes())

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, content):
        with open(self.path(name), "wb") as file:
            file.write(content if isinstance(content, bytes) else content.encode("utf-8"))
        return self.path(name)

    def read(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()

    def files(self):
        return sorted(os.listdir(self.folder))

    def expect(self, done, code, *said):
        """Exit code and texts that standard error must hold."""
        self.assertEqual(done.returncode, code, done.stderr)
        for text in said:
            self.assertIn(text, done.stderr)
        if code not in (0, 8):
            errors = [line for line in done.stderr.splitlines() if line.startswith("porthole: error[E")]
            self.assertEqual(len(errors), 1, done.stderr)
        return done

    def json_of(self, done):
        return json.loads(done.stdout.decode("utf-8"))


def main():
    global PROGRAM
    # Tests import this file as a module of its own: set the name there.
    import harness
    harness.PROGRAM = os.path.abspath(sys.argv.pop(1))
    unittest.main(module="__main__", verbosity=1)
