"""porthole check: reports of real runs, and what becomes of altered and hostile ones."""

import json
import os
import shutil
import unittest
import zlib

from harness import Case, main, png_pixels, run

VIEW = ("--size", "96x72", "--samples", "2", "--camera", "iso")


def png_with(data, x, y):
    """The 8- or 16-bit PNG `data` with the least bit of one pixel's first channel flipped."""
    width, height, channels, bits, rows = png_pixels(data)
    rows = [bytearray(row) for row in rows]
    step = channels * bits // 8
    rows[y][x * step + bits // 8 - 1] ^= 1
    raw = b"".join(b"\0" + bytes(row) for row in rows)

    def chunk(kind, body):
        return len(body).to_bytes(4, "big") + kind + body + zlib.crc32(kind + body).to_bytes(4, "big")
    return data[:33] + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b"")


def one_less(runs):
    """Runs without their first pixel."""
    zeros, ones, rest = runs.split(" ", 2)
    return "%d %d %s" % (int(zeros) + 1, int(ones) - 1, rest)


class Check(Case):
    def reveal(self, *args, output="o.png", code=0):
        self.expect(run("reveal", self.model, "--target", "inner", *VIEW, "-o", self.path(output),
                        "--report", self.path("o.json"), *args), code)
        return json.loads(self.read("o.json"))

    def check(self, *args, code=0, said=()):
        done = run("check", self.path("o.json"), *args)
        self.assertEqual(done.returncode, code, done.stderr + done.stdout.decode())
        lines = done.stdout.decode("utf-8").splitlines()
        if code == 9:
            self.assertIn("the report is not true", done.stderr)
            self.assertTrue(lines)
        for text in said:
            self.assertTrue(any(text in line for line in lines), lines)
        return lines

    def alter(self, change):
        report = json.loads(self.read("o.json"))
        change(report)
        self.write("o.json", json.dumps(report))

    def test_true_reports(self):
        for args, output in [((), "o.png"), (("--style", "hole"), "o.png"), (("--style", "paper"), "o.png"),
                             (("--bits", "16"), "o.png"), (("--no-background",), "o.png"),
                             (("--bits", "16", "--no-background"), "o.png"), ((), "o.jpg"),
                             (("--background", "#204060", "--depth", "3px", "--no-shadows"), "o.png"),
                             (("--camera-orthographic", "--camera-azimuth-angle", "17"), "o.png"),
                             (("--units", "mm", "--up", "z", "--depth", "0.05mm"), "o.png"),
                             (("--keep", "outer"), "o.png")]:
            with self.subTest(args=args, output=output):
                self.reveal(*args, output=output)
                self.assertEqual(self.check(), [])

    def test_plain_pictures(self):
        self.expect(run("render", self.model, *VIEW, "-o", self.path("o.png"), "--report", self.path("o.json")), 0)
        self.check()
        self.write("o.png", png_with(self.read("o.png"), 3, 4))
        self.check(code=9, said=["picture outside: pixel 3,4: "])

    def test_reports_without_a_picture(self):
        done = self.expect(run("reveal", self.model, "--target", "inner", *VIEW, "--json"), 0)
        self.write("o.json", done.stdout)
        self.assertIn("no picture", run("check", self.path("o.json")).stderr)
        self.check()
        done = run("reveal", self.model, "--target", "inner", *VIEW, "-o", "-", "--report", self.path("o.json"))
        self.write("elsewhere.png", done.stdout)
        self.check("--picture", self.path("elsewhere.png"))

    def test_altered_pictures(self):
        for bits in ("8", "16"):
            report = self.reveal("--bits", bits)
            whole = self.read("o.png")
            window = report["picture"]["mask"]["window"]
            middle = ((window[0] + window[2]) // 2, (window[1] + window[3]) // 2)
            self.write("o.png", png_with(whole, *middle))
            self.check(code=9, said=["picture inside: pixel %d,%d: " % middle])
            self.write("o.png", png_with(whole, 1, 2))
            self.check(code=9, said=["picture outside: pixel 1,2: "])
            # The same pixels in another file.
            twice = png_with(png_with(whole, 1, 2), 1, 2)
            self.assertNotEqual(twice, whole)
            self.write("o.png", twice)
            done = run("check", self.path("o.json"))
            self.expect(done, 0, "warning[W0107]")
        self.write("o.png", b"not a picture")
        self.expect(run("check", self.path("o.json")), 3, "o.png")
        self.reveal(output="o.jpg")
        self.write("o.jpg", self.read("o.jpg")[:-300] + bytes(298) + b"\xff\xd9")
        self.assertIn(run("check", self.path("o.json")).returncode, (3, 9))

    def test_altered_reports(self):
        changes = {
            "hole: pixel ": lambda r: r["picture"]["mask"].update(runs=one_less(r["picture"]["mask"]["runs"])),
            "target pixels: pixel ": lambda r: r["targets"][0]["mask"].update(runs=""),
            "figure: /targets/0/pixels_alone": lambda r: r["targets"][0].update(pixels_alone=7),
            "figure: /picture/outline_iou": lambda r: r["picture"].update(outline_iou=0.5),
            "targets: /targets/0": lambda r: r["targets"][0].update(path="else"),
            "targets: /options": lambda r: r["options"]["targets"][0].update(id=0),
            "picture outside: pixel ": lambda r: r["camera"].update(tan_half_fov_y=0.4),
            "picture inside: ": lambda r: r.update(size=[95, 72]),
            "model: ": lambda r: r["model"].update(sha256="0" * 64),
            "figure: /model/parts": lambda r: r["model"].update(parts=3),
        }
        for what, change in changes.items():
            with self.subTest(what=what):
                self.reveal()
                self.alter(change)
                self.check(code=9, said=[what])

    def test_changed_model(self):
        self.reveal()
        with open(self.model, "a") as file:
            file.write("# one comment more\n")
        lines = self.check(code=9, said=["model: "])
        self.assertEqual(len(lines), 1)  # its pixels are the same

    def test_moved_files(self):
        self.reveal()
        os.mkdir(self.path("moved"))
        for name in ("o.json", "o.png", "box.obj"):
            shutil.move(self.path(name), self.path(os.path.join("moved", name)))
        report = self.path("moved/o.json")
        self.expect(run("check", report), 0)
        self.expect(run("check", "o.json", cwd=self.path("moved")), 0)
        os.rename(self.path("moved/box.obj"), self.path("moved/crate.obj"))
        self.expect(run("check", report), 3, "E0201", "--model")
        self.expect(run("check", report, "--model", self.path("moved/crate.obj")), 0)
        os.rename(self.path("moved/o.png"), self.path("moved/p.png"))
        self.expect(run("check", report, "--model", self.path("moved/crate.obj")), 3, "E0201", "--picture")
        self.expect(run("check", report, "--model", self.path("moved/crate.obj"), "--picture",
                        self.path("moved/p.png")), 0)

    def test_standard_input(self):
        self.reveal()
        self.expect(run("check", "-", stdin=self.read("o.json"), cwd=self.folder), 0)
        done = run("reveal", "-", "--format", "obj", "--target", "inner", *VIEW, "-o", self.path("o.png"), "--report",
                   self.path("o.json"), stdin=self.read("box.obj"))
        self.expect(done, 0)
        self.expect(run("check", self.path("o.json")), 2, "E0108", "--model")
        self.check("--model", self.model)

    def test_as_json(self):
        self.reveal()
        found = self.json_of(self.expect(run("check", self.path("o.json"), "--json"), 0))
        self.assertTrue(found["good"])
        self.assertEqual(found["inside_pixels"] + found["outside_pixels"], 96 * 72)
        self.alter(lambda r: r["picture"].update(hole_pixels=1))
        done = run("check", self.path("o.json"), "--json")
        self.assertEqual(done.returncode, 9)
        self.assertEqual(self.json_of(done)["differences"][0]["where"], "/picture/hole_pixels")

    def test_hostile_reports(self):
        self.reveal()
        whole = self.read("o.json")
        for content in (b"", b"{}", b"[" * 200000, b'{"a":' * 200000, whole[:-40], whole[:300], b"\0" * 100, b"\xff\xfe" + whole,
                        whole.replace(b'"iso"', b'7'), whole.replace(b'"picture": {', b'"picture": null, "p": {'),
                        whole.replace(b'"runs"', b'"walks"'), whole.replace(b'"samples": 2', b'"samples": 1e99')):
            with self.subTest(content=content[:40]):
                self.write("o.json", content)
                self.expect(run("check", self.path("o.json")), 3, "o.json")
        for change, code in ((lambda r: r["options"].update(samples=5000), 2),
                             (lambda r: r["options"].update(depth=[1e9, "px"]), 2),
                             (lambda r: r["options"].update(depth=[4096, "px"]), 5),
                             (lambda r: r.update(size=[32768, 32768]), 5),
                             (lambda r: r["model"].update(path="/dev/zero"), 3),
                             (lambda r: r["model"].update(path="/etc/passwd\n\x1b[31m"), 3),
                             (lambda r: r["picture"].update(file="../../../../../../../dev/random"), 3)):
            self.write("o.json", whole)
            self.alter(change)
            done = run("check", self.path("o.json"), "--max-memory", "2G")
            self.expect(done, code)
            self.assertNotIn("\x1b", done.stderr)
        self.expect(run("check", self.path("absent.json")), 3, "E0201")
        self.expect(run("check", self.folder), 3, "E0202")
        self.expect(run("check"), 2, "E0101")


if __name__ == "__main__":
    main()
