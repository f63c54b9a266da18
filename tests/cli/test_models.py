"""The command line on the real models of $PORTHOLE_SHARED (default: ../shared beside the checkout); skipped without them."""

import json
import os
import sys

from harness import Case, main, run

BESIDE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "..", "shared")
SHARED = os.path.join(os.environ.get("PORTHOLE_SHARED") or BESIDE, "models")

# From the models' own README: parts, and triangles before those without area are left out.
MODELS = {
    "assembly/2CylinderEngine.glb": (67, 121496),
    "assembly/ReciprocatingSaw.glb": (113, 198470),
    "assembly/MosquitoInAmber.glb": (3, 14349),
    "assembly/FZK_Haus.glb": (110, 35906),
    "assembly/vh_male_body.glb": (294, 1162492),
    "assembly/virtual_worm.glb": (631, 2499916),
    "medical/head_brain_mri.glb": (24, 962732),
    "classic/stanford-bunny.obj": (1, 69451),
    "classic/bunny.ply": (1, 16301),
    "classic/suzanne_binary.stl": (1, 4012),
    "gltf/BoxMeshopt.glb": (1, 12),
    "gltf/BoxDraco/BoxDraco.gltf": (1, 12),
}


class Models(Case):
    def test_parts(self):
        for name, (parts, triangles) in MODELS.items():
            with self.subTest(model=name):
                done = self.expect(run("parts", os.path.join(SHARED, name), "--json"), 0)
                report = self.json_of(done)
                self.assertEqual(len(report["parts"]), parts)
                self.assertEqual(report["model"]["parts"], parts)
                # Triangles are only ever left out with a warning.
                found = report["model"]["triangles"]
                self.assertEqual(sum(p["triangles"] for p in report["parts"]), found)
                if found != triangles:
                    self.assertGreater(found, 0.9 * triangles)
                    self.assertLess(found, triangles)
                    self.assertTrue(report["warnings"])
                self.assertEqual(len({p["path"] for p in report["parts"]}), parts)

    def test_selectors(self):
        engine = os.path.join(SHARED, "assembly/2CylinderEngine.glb")
        done = self.expect(run("reveal", engine, "--target", "rod_123-699*", "--json", "--size", "160x90"), 0, "2 parts")
        report = self.json_of(done)
        self.assertEqual(len(report["targets"]), 2)
        for target in report["targets"]:
            self.assertGreater(target["visible_after"], 0.99)
        self.expect(run("reveal", engine, "--target", "rod_123"), 2, "rod_123-699_0_Parts_1")

    def test_a_picture_of_each_kind(self):
        for name in ("gltf/CesiumMilkTruck.glb", "classic/spot.obj", "classic/bunny.ply", "classic/suzanne_binary.stl"):
            with self.subTest(model=name):
                out = self.path("o.png")
                self.expect(run("render", os.path.join(SHARED, name), "-o", out, "--report", self.path("r.json"), "--size",
                                "200x150"), 0)
                self.assertEqual(json.loads(self.read("r.json"))["size"], [200, 150])
                self.assertGreater(len(self.read("o.png")), 3000)


if __name__ == "__main__":
    if not os.path.isdir(SHARED):
        print("skipped: the models are not at $PORTHOLE_SHARED/models")
        sys.exit(77)
    main()
