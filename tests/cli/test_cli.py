"""The command line on models made by hand: usage, errors, exit codes, files, interrupts."""

import hashlib
import json
import os
import signal
import struct
import subprocess
import time
import unittest

import harness
from harness import Case, main, nested_boxes, png_pixels, run

SMALL = ("--size", "64x48", "--samples", "1")


class Usage(Case):
    def test_alone_and_help(self):
        alone = run()
        self.assertEqual(alone.returncode, 2)
        self.assertIn("porthole reveal engine.glb", alone.stderr)
        for args in (["--help"], ["reveal", "--help"], ["render", "--help"], ["parts", "--help"]):
            done = self.expect(run(*args), 0)
            self.assertIn(b"Examples:", done.stdout)
        self.assertRegex(run("--version").stdout, rb"^porthole \d+\.\d+\.\d+\n$")

    def test_what_cannot_be_meant(self):
        out = self.path("o.png")
        for code, args in {
            "E0101": [("nothing",), ("reveal", self.model), ("render",), ("render", self.model, "--sise", "3x3"),
                      ("render", self.model, "--samples", "0"), ("render", self.model, "--samples", "many"),
                      ("render", self.model, "extra"), ("render", self.model, "--bits", "12")],
            "E0105": [("render", self.model, "--size", "0x5"), ("render", self.model, "--size", "40000x5"),
                      ("render", self.model, "--size", "-5x5"), ("render", self.model, "--background", "#12345"),
                      ("render", self.model, "--camera-direction", "1,2"), ("render", self.model, "--up", "w"),
                      ("render", self.model, "--units", "-1"), ("render", self.model, "--isa", "sse"),
                      ("render", self.model, "--refine", "paper3"), ("render", self.model, "--guides", "0,0 1"),
                      ("render", self.model, "--surface", "solid"),
                      ("render", self.model, "--mode", "wireframe", "--compare-full"),
                      ("reveal", self.model, "--target", "inner", "--depth", "3furlongs"),
                      ("reveal", self.model, "--target", "inner", "--style", "baroque")],
            "E0106": [("render", self.model, "-o", self.path("o.gif")), ("render", self.model, "-o", self.path("noextension")),
                      ("render", self.model, "-o", self.path("o.jpg"), "--bits", "16"),
                      ("render", self.model, "-o", self.path("o.jpg"), "--no-background")],
            "E0107": [("render", self.model, "-o", "-", "--json"), ("render", self.model, "-o", "-", "--report", "-"),
                      ("render", self.model, "-o", out, "--report", out)],
            "E0112": [("render", self.model, "--camera", "fornt", "-o", out)],
            "E0113": [("render", self.model, "--camera-zoom-factor", "0", "-o", out),
                      ("render", self.model, "--camera-view-angle", "nan", "-o", out),
                      ("render", self.model, "--camera-view-up", "0,0,0", "-o", out)],
            "E0140": [("render", self.model, "--refine", "paper1", "--macro", "12", "-o", out),
                      ("render", self.model, "--refine", "paper1", "--macro", "4", "--threshold", "8", "-o", out),
                      ("render", self.model, "--refine", "paper2", "--guides", "0,0 1,1", "-o", out),
                      ("render", self.model, "--refine", "paper2", "--guides", "0,0 1,0 2,1", "-o", out)],
        }.items():
            for arg in args:
                with self.subTest(arg=arg):
                    self.expect(run(*arg, cwd=self.folder), 2, "error[" + code + "]")
        self.assertEqual(self.files(), ["box.obj"])

    def test_typing_errors_are_met_with_hints(self):
        self.expect(run("render", self.model, "--sise", "3x3"), 2, "did you mean --size")
        self.expect(run("revael", self.model), 2, "did you mean reveal")
        self.expect(run("reveal", self.model, "--target", "iner"), 2, "E0110", 'did you mean "inner"?')
        self.expect(run("reveal", self.model, "--target", "#7"), 2, "E0110", "0 to 1")
        self.expect(run("reveal", self.model, "--target", "re:("), 2, "E0111")
        self.expect(run("reveal", self.model, "--target", "inner", "--keep", "utter"), 2, "--keep utter", '"outer"')

    def test_flags_in_any_order(self):
        pictures = []
        for args in (["--target", "inner", self.model, "-o", "-", *SMALL],
                     [self.model, *SMALL, "-o", "-", "--target", "inner"],
                     [*SMALL, "-o", "-", "--target", "inner", self.model]):
            pictures.append(self.expect(run("reveal", *args), 0).stdout)
        self.assertEqual(len(set(pictures)), 1)

    def test_memory_that_a_size_needs(self):
        self.expect(run("render", self.model, "--size", "30000x30000", "--max-memory", "1G", "-o", self.path("o.png")), 5,
                    "E0901", "--max-memory")


class Input(Case):
    def test_models_and_cameras_as_far_as_stars(self):
        for size in (1e11, 1e13, 5e17, 1e30):
            lines = ["o box"] + harness.box((-size,) * 3, (size,) * 3, 1)
            model = self.write("far.obj", "\n".join(lines) + "\n")
            done = run("render", model, "-o", self.path("o.png"), *SMALL)
            self.assertIn(done.returncode, (0, 3), done.stderr)
            self.assertEqual("W" in done.stderr or done.returncode == 3, size > 1e12, done.stderr)
        model = self.write("far.obj", "\n".join(["o box"] + harness.box((-1e9,) * 3, (1e9,) * 3, 1)) + "\n")
        self.expect(run("render", model, "--units", "1e6", "-o", self.path("o.png")), 2, "E0122")
        self.expect(run("render", self.model, "--camera-position", "0,1e20,0", "-o", self.path("o.png")), 2, "E0113")

    def test_missing_empty_folder(self):
        self.expect(run("render", self.path("absent.glb"), "-o", self.path("o.png")), 3, "E0201", "absent.glb")
        self.expect(run("render", self.write("empty.glb", b""), "-o", self.path("o.png")), 3, "error[E02")
        self.expect(run("parts", self.folder), 3, "E0202")
        self.assertEqual(self.files(), ["box.obj", "empty.glb"])

    def test_truncated_file_leaves_the_old_picture(self):
        text = json.dumps({"asset": {"version": "2.0"}}).encode()
        glb = b"glTF" + (2).to_bytes(4, "little") + (4096).to_bytes(4, "little")
        glb += len(text).to_bytes(4, "little") + b"JSON" + text
        self.write("o.png", b"old")
        self.expect(run("render", self.write("cut.glb", glb), "-o", self.path("o.png")), 3, "cut.glb")
        self.assertEqual(self.read("o.png"), b"old")
        self.assertEqual(self.files(), ["box.obj", "cut.glb", "o.png"])

    def test_large_file_cut_short_while_it_is_read(self):
        # Large enough to be mapped; of zeros, so that it takes no room on the disk.
        vertices = 9_000_000
        size = 12 * vertices
        text = json.dumps({
            "asset": {"version": "2.0"}, "buffers": [{"byteLength": size}],
            "bufferViews": [{"buffer": 0, "byteLength": size}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": vertices, "type": "VEC3"}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}], "scene": 0}).encode()
        text += b" " * (-len(text) % 4)
        header = b"glTF" + struct.pack("<II", 2, 28 + len(text) + size)
        header += struct.pack("<I", len(text)) + b"JSON" + text + struct.pack("<I", size) + b"BIN\0"
        for delay in (0.01, 0.03, 0.06):
            path = self.write("large.glb", header)
            os.truncate(path, len(header) + size)
            process = subprocess.Popen([harness.PROGRAM, "parts", path], stdout=subprocess.DEVNULL,
                                       stderr=subprocess.PIPE)
            time.sleep(delay)
            os.truncate(path, 4096)
            said = process.communicate(timeout=60)[1].decode()
            if process.returncode != 0:  # it was not read to its end before
                self.assertEqual(process.returncode, 3, said)
                self.assertIn("error[E0", said)

    def test_standard_input(self):
        model = nested_boxes().encode()
        done = self.expect(run("parts", "-", "--format", "obj", "--json", stdin=model), 0)
        self.assertEqual(self.json_of(done)["model"]["triangles"], 24)

    def test_nothing_to_draw(self):
        done = run("render", self.write("points.obj", "v 0 0 0\nv 1 0 0\n"), "-o", self.path("o.png"))
        self.expect(done, 3)
        self.assertNotIn("o.png", self.files())


class Outputs(Case):
    def test_png_on_standard_output(self):
        done = self.expect(run("render", self.model, "-o", "-", *SMALL), 0)
        width, height, channels, bits, _ = png_pixels(done.stdout)
        self.assertEqual((width, height, channels, bits), (64, 48, 3, 8))

    def test_kinds_of_pictures(self):
        for name, args, expected in (("a.png", ["--no-background"], (4, 8)), ("b.png", ["--bits", "16"], (3, 16)),
                                     ("c.png", ["--bits", "16", "--no-background"], (4, 16))):
            self.expect(run("render", self.model, "-o", self.path(name), *SMALL, *args), 0)
            self.assertEqual(png_pixels(self.read(name))[2:4], expected)
        self.expect(run("render", self.model, "-o", self.path("d.JPG"), *SMALL), 0)
        self.assertEqual(self.read("d.JPG")[:3], b"\xff\xd8\xff")

    def test_background(self):
        done = self.expect(run("render", self.model, "-o", "-", *SMALL, "--background", "#204060"), 0)
        self.assertEqual(png_pixels(done.stdout)[4][0][:3], b"\x20\x40\x60")
        done = self.expect(run("render", self.model, "-o", "-", *SMALL, "--no-background"), 0)
        rows = png_pixels(done.stdout)[4]
        self.assertEqual(rows[0][:4], b"\0\0\0\0")
        self.assertEqual(rows[24][32 * 4 + 3], 255)

    def test_default_name_and_json_alone(self):
        self.expect(run("render", self.model, *SMALL, cwd=self.folder), 0)
        self.assertIn("out.png", self.files())
        os.remove(self.path("out.png"))
        done = self.expect(run("render", self.model, *SMALL, "--json", cwd=self.folder), 0)
        report = self.json_of(done)
        self.assertEqual((report["command"], report["size"]), ("render", [64, 48]))
        self.assertEqual(self.files(), ["box.obj"])

    def test_places_that_cannot_be_written(self):
        self.expect(run("render", self.model, *SMALL, "-o", self.path("no/such/o.png")), 4, "E0801", "no folder")
        os.mkdir(self.path("folder.png"))
        self.expect(run("render", self.model, *SMALL, "-o", self.path("folder.png")), 4, "E0801")
        self.expect(run("render", self.model, *SMALL, "-o", self.path("o.png"), "--report", self.path("no/r.json")), 4)
        self.assertEqual(self.files(), ["box.obj", "folder.png"])

    @unittest.skipIf(not os.path.exists("/dev/full"), "no /dev/full here")
    def test_full_disk_and_closed_pipe(self):
        with open("/dev/full", "wb") as full:
            for args in (["render", self.model, *SMALL, "-o", "-"], ["parts", self.model]):
                done = subprocess.run([harness.PROGRAM, *args], stdout=full, stderr=subprocess.PIPE)
                self.assertEqual(done.returncode, 4, done.stderr)
                self.assertIn(b"E0802", done.stderr)
        reader, writer = os.pipe()
        os.close(reader)
        done = subprocess.run([harness.PROGRAM, "parts", self.model], stdout=writer, stderr=subprocess.PIPE)
        os.close(writer)
        self.assertEqual(done.returncode, 4, done.stderr)

    def test_compares_refinement_with_full(self):
        for refine in ("full", "paper1", "paper2", "expansion", "adaptive"):
            for command in (["render", self.model], ["reveal", self.model, "--target", "inner"]):
                with self.subTest(refine=refine, command=command[0]):
                    args = [*command, "--refine", refine, "--macro", "4", "--size", "160x120", "--json"]
                    self.assertIsNone(json.loads(self.expect(run(*args), 0).stdout)["refinement"])
                    done = self.expect(run(*args, "--compare-full"), 0, refine + " against full")
                    report = json.loads(done.stdout)
                    self.assertEqual(report["options"]["refine"], refine)
                    self.assertEqual(report["options"]["macro_px"], 4)
                    self.assertEqual(report["options"]["compare_full"], True)
                    found = report["refinement"]
                    self.assertLessEqual(found["traced_share"], 1)
                    self.assertLess(found["wrong_ids_share"], 0.05)
                    self.assertEqual(found["missed_parts"], [])
                    self.assertGreater(found["full_rays"]["all"], 160 * 120)
                    self.assertGreaterEqual(report["run"]["refinement_seconds"]["full"]["cpu"], 0)
                    if refine == "full":
                        self.assertIsNone(found["psnr_db"])
                        self.assertEqual(found["rays"], found["full_rays"])
                    elif found["psnr_db"] is not None:
                        self.assertGreater(found["psnr_db"], 20)

    def test_no_clobber(self):
        self.write("o.png", b"old")
        self.expect(run("render", self.model, *SMALL, "-o", self.path("o.png"), "--no-clobber"), 4, "o.png")
        self.assertEqual(self.read("o.png"), b"old")
        self.expect(run("render", self.model, *SMALL, "-o", self.path("o.png")), 0)
        self.assertEqual(self.read("o.png")[:4], b"\x89PNG")

    def test_same_bytes_with_any_threads(self):
        pictures = {self.expect(run("reveal", self.model, "--target", "inner", "-o", "-", *SMALL, "--threads", n), 0).stdout
                    for n in (1, 2, 7)}
        self.assertEqual(len(pictures), 1)


class Reveal(Case):
    def test_opens_and_reports(self):
        done = self.expect(run("reveal", self.model, "--target", "inner", "-o", self.path("o.png"), "--report",
                               self.path("r.json"), "--size", "320x240"), 0, "1 part", "visible 0 % -> 100 %")
        with open(self.path("r.json"), encoding="utf-8") as file:
            report = json.load(file)
        target = report["targets"][0]
        self.assertEqual((target["id"], target["path"]), (1, "inner"))
        self.assertEqual((target["visible_before"], target["visible_after"]), (0, 1))
        self.assertEqual(report["cut_parts"], ["outer"])
        whole = self.read("box.obj")
        self.assertEqual(report["model"], {"path": self.model, "parts": 2, "triangles": 24, "bytes": len(whole),
                                           "sha256": hashlib.sha256(whole).hexdigest(), "format": None, "time": -1,
                                           "up": "y", "metres_per_unit": 1})
        self.assertGreater(report["run"]["peak_bytes"], 1 << 20)
        self.assertEqual(done.stdout, b"")

    def test_outside_the_hole_it_is_the_plain_picture(self):
        view = ("--camera", "front", "-o", "-", "--size", "160x120")
        plain = png_pixels(self.expect(run("render", self.model, "--focus", "inner", *view), 0).stdout)[4]
        opened = png_pixels(self.expect(run("reveal", self.model, "--target", "inner", "--depth", "4px", *view), 0).stdout)[4]
        changed = [(x, y) for y in range(120) for x in range(160) if plain[y][3 * x:3 * x + 3] != opened[y][3 * x:3 * x + 3]]
        self.assertGreater(len(changed), 500)
        # The inner box is in the middle, so the change is too, and it is one block.
        xs, ys = [x for x, _ in changed], [y for _, y in changed]
        self.assertAlmostEqual((min(xs) + max(xs)) / 2, 79.5, delta=1.5)
        self.assertAlmostEqual((min(ys) + max(ys)) / 2, 59.5, delta=1.5)
        self.assertLess(max(xs) - min(xs), 120)
        self.assertLess(max(ys) - min(ys), 110)

    def test_visible_target_gives_a_plain_picture(self):
        done = self.expect(run("reveal", self.model, "--target", "outer", "--json", *SMALL), 0, "there is no hole")
        self.assertTrue(self.json_of(done)["nothing_to_cut"])

    def test_absent_target(self):
        away = ("--camera-position", "0,0,50", "--camera-direction", "0,0,1")
        done = run("reveal", self.model, "--target", "inner", *away, "-o", self.path("o.png"), "--report",
                   self.path("r.json"), *SMALL)
        self.expect(done, 8, "W0104", "E0130")
        self.assertEqual(self.files(), ["box.obj", "r.json"])
        report = json.loads(self.read("r.json"))
        self.assertEqual(report["targets"][0]["refused"], "absent")
        self.assertIn("W0104", [w["code"] for w in report["warnings"]])

    def test_strict_minds_some_absent_targets(self):
        far = nested_boxes().rstrip("\n").splitlines() + ["o far"] + harness.box((99, 0, 0), (100, 1, 1), 17)
        args = ("reveal", self.write("far.obj", "\n".join(far)), "--target", "inner", "--target", "far", "--camera-position",
                "0,0,9", "--camera-direction", "0,0,-1", "-o", self.path("o.png"), "--report", self.path("r.json"), *SMALL)
        self.expect(run(*args), 0, "W0104")
        self.assertEqual(self.read("o.png")[:4], b"\x89PNG")
        self.expect(run(*args, "--strict"), 8, "W0104")
        report = json.loads(self.read("r.json"))
        self.assertEqual([t["refused"] for t in report["targets"]], [None, "absent"])
        self.assertEqual(report["camera"]["name"], "custom")

    def test_kept_parts_hide(self):
        done = self.expect(run("reveal", self.model, "--target", "inner", "--keep", "outer", "--json", *SMALL), 0)
        report = self.json_of(done)
        self.assertEqual(report["targets"][0]["visible_after"], 0)
        self.assertEqual(report["cut_parts"], [])

    def test_debug_pictures(self):
        self.expect(run("reveal", self.model, "--target", "inner", *SMALL, "-o", self.path("o.png"), "--debug-dir",
                        self.path("debug")), 0)
        names = os.listdir(self.path("debug"))
        self.assertGreaterEqual(len(names), 5)
        for name in names:
            self.assertTrue(name.endswith(".png"), name)
            png_pixels(self.read(os.path.join("debug", name)))


class Parts(Case):
    def test_table_and_json(self):
        table = self.expect(run("parts", self.model), 0).stdout.decode()
        self.assertRegex(table, r"(?m)^ +#1 +12 +closed +1\.4 x 1\.4 x 1\.4 m +\S.* inner$")
        report = self.json_of(self.expect(run("parts", self.model, "--json"), 0))
        self.assertEqual([p["name"] for p in report["parts"]], ["outer", "inner"])
        self.assertEqual(report["parts"][0]["size_m"], [2, 2, 2])
        self.assertEqual(report["parts"][0]["edges"], {"all": 18, "open": 0, "odd": 0})
        self.assertEqual(report["model"]["triangles"], 24)

    def test_open_parts(self):
        lines = nested_boxes().splitlines()
        report = self.json_of(self.expect(run("parts", self.write("open.obj", "\n".join(lines[:-1])), "--json"), 0))
        self.assertEqual([p["closed"] for p in report["parts"]], [True, False])
        self.assertEqual([p["by"] for p in report["parts"]], ["edges", None])
        self.assertEqual(report["parts"][0]["components"], {"all": 1, "closed": 1, "flipped": 0})
        self.assertEqual(report["parts"][1]["edges"]["open"], 3)

    def test_units_and_up(self):
        report = self.json_of(self.expect(run("parts", self.model, "--json", "--units", "mm"), 0))
        for size in report["parts"][0]["size_m"]:
            self.assertAlmostEqual(size, 0.002, places=7)
        self.assertIn(b"2 x 2 x 2 mm", self.expect(run("parts", self.model, "--units", "mm"), 0).stdout)

    def test_hostile_names_are_escaped(self):
        names = ("\x1b[31mred\x07", "right\u202eleft", "tab\there", "x" * 5000, "caf\u00e9")
        model = self.write("names.obj", nested_boxes(names))
        table = self.expect(run("parts", model), 0).stdout.decode("utf-8")
        for bad in ("\x1b", "\x07", "\u202e"):
            self.assertNotIn(bad, table)
        self.assertIn("caf\u00e9", table)
        self.assertEqual(len(table.splitlines()), 2 + len(names))
        report = self.json_of(self.expect(run("parts", model, "--json"), 0))
        self.assertEqual(report["parts"][4]["name"], "caf\u00e9")
        done = self.expect(run("reveal", model, "--target", "\x1b[31mrad\x07"), 2, "E0110")
        self.assertNotIn("\x1b", done.stderr)
        self.assertNotIn("\x07", done.stderr)


class Messages(Case):
    def test_quiet_verbose_and_json_lines(self):
        args = ("reveal", self.model, "--target", "inner", "-o", self.path("o.png"), *SMALL)
        self.assertEqual(self.expect(run(*args, "--quiet"), 0).stderr, "")
        plain = self.expect(run(*args), 0).stderr
        self.assertNotIn("\x1b", plain)  # not a terminal: no bars
        self.assertNotIn("\r", plain)
        for stage in ("load", "build", "plan", "render", "write"):
            self.assertRegex(plain, r"(?m)^porthole: %s +\d+\.\d\d s" % stage)
        self.assertGreater(len(self.expect(run(*args, "--verbose"), 0, "#1 inner").stderr), len(plain))
        lines = [json.loads(line) for line in run(*args, "--log", "json").stderr.splitlines()]
        self.assertLessEqual({"stage", "info"}, {line["level"] for line in lines})
        lines = [json.loads(line) for line in run(*args[:3], "nobody", "--log", "json").stderr.splitlines()]
        self.assertEqual((lines[-1]["level"], lines[-1]["code"]), ("error", "E0110"))


class Config(Case):
    def test_config_fills_in_what_the_command_line_leaves_open(self):
        config = self.write("c.json", json.dumps({"size": "50x40", "target": ["inner"], "no-shadows": True, "samples": 1,
                                                  "no-background": False}))
        done = self.expect(run("reveal", self.model, "--config", config, "--json"), 0)
        self.assertEqual(self.json_of(done)["size"], [50, 40])
        done = self.expect(run("--config", config, "reveal", self.model, "--json", "--size", "30x20"), 0)
        self.assertEqual(self.json_of(done)["size"], [30, 20])
        # One file serves all commands: `target` means nothing to render.
        done = self.expect(run("render", self.model, "--config", config, "--json"), 0)
        self.assertEqual(self.json_of(done)["size"], [50, 40])

    def test_bad_configs(self):
        for text in ("{", "[1]", '{"sise": "3x3"}', '{"size": {"x": 1}}', '{"size": null}', "[" * 100000):
            with self.subTest(text=text[:20]):
                self.expect(run("render", self.model, "--config", self.write("c.json", text), *SMALL, "-o",
                                self.path("o.png")), 2, "E0104", "c.json")
        self.expect(run("render", self.model, "--config", self.write("c.json", '{"size": "3"}')), 2, "E0105")
        self.expect(run("render", self.model, "--config", self.path("absent.json")), 2)


class Interrupts(Case):
    def interrupted(self, signals, stage=b"build"):
        """Starts a picture that takes minutes, sends `signals` once `stage` is said; exit code."""
        self.write("o.png", b"old")
        process = subprocess.Popen([harness.PROGRAM, "render", self.model, "--size", "2000x2000", "--samples", "4096",
                                    "--ao-samples", "256", "-o", self.path("o.png")], stderr=subprocess.PIPE)
        said = b""
        while stage not in said:
            piece = os.read(process.stderr.fileno(), 4096)
            self.assertTrue(piece, said)
            said += piece
        time.sleep(0.3)
        start = time.monotonic()
        for number in signals:
            process.send_signal(number)
            time.sleep(0.05)
        process.communicate(timeout=60)
        self.assertLess(time.monotonic() - start, 30)
        self.assertEqual(self.read("o.png"), b"old")
        self.assertEqual(self.files(), ["box.obj", "o.png"])
        return process.returncode

    def test_one_signal_stops_cleanly(self):
        self.assertEqual(self.interrupted([signal.SIGINT]), 130)
        self.assertEqual(self.interrupted([signal.SIGTERM]), 143)

    def test_two_signals_end_it(self):
        self.assertEqual(self.interrupted([signal.SIGINT, signal.SIGINT]), 130)


if __name__ == "__main__":
    main()
