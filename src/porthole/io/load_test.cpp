#include "porthole/io/load.h"

#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace porthole {
namespace {

using test::TemporaryFolder;

std::string failure(const std::string& path, const LoadParams& params = {}) {
    try {
        (void)load_scene(path, params);
    } catch (const Error& error) {
        return error.code + " " + error.what();
    }
    return "none";
}

LoadParams with_format(const char* format) {
    LoadParams params;
    params.format = format;
    return params;
}
LoadParams with_up(char up) {
    LoadParams params;
    params.up = up;
    return params;
}
LoadParams with_unit(double metres) {
    LoadParams params;
    params.metres_per_unit = metres;
    return params;
}

const std::string kObj = "v 0 0 0\nv 2 0 0\nv 0 0 3\nf 1 2 3\n";
const std::string kPly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
const std::string kStl = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
                         "endfacet\nendsolid a\n";

TEST(Load, TheContentDecides) {
    const TemporaryFolder folder;
    const auto format = [&](const char* name, const std::string& content) {
        const Scene scene = load_scene(folder.write(name, content).string());
        EXPECT_EQ(scene.source, (folder.path() / name).string());
        return scene.format + (scene.warnings.empty() ? "" : " " + scene.warnings[0].code);
    };
    EXPECT_EQ(format("a.obj", kObj), "OBJ");
    EXPECT_EQ(format("a.ply", kPly), "PLY");
    EXPECT_EQ(format("a.stl", kStl), "STL");
    EXPECT_EQ(format("noending", kPly), "PLY");
    EXPECT_EQ(format("a.txt", kObj), "OBJ");
    EXPECT_EQ(format("b.stl", kObj), "OBJ W0201");
    EXPECT_EQ(format("b.obj", kStl), "STL W0201");
    EXPECT_EQ(format("b.glb", kPly), "PLY W0201");
    std::string binary(134, '\0');
    binary[80] = 1;
    const float corner[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    std::copy_n(reinterpret_cast<const char*>(corner), 36, binary.begin() + 96);
    EXPECT_EQ(format("c.stl", binary), "STL");
    binary.replace(0, 5, "\x1F\x8Bply"); // whatever the header says
    EXPECT_EQ(format("d.stl", binary), "STL");
}

TEST(Load, OtherFilesAreNamed) {
    const TemporaryFolder folder;
    const auto says = [&](const std::string& content, const char* expected) {
        const std::string reason = failure(folder.write("file.glb", content).string());
        EXPECT_EQ(reason.substr(0, 5), "E0204");
        EXPECT_NE(reason.find(expected), std::string::npos) << reason;
    };
    says("version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "git lfs pull");
    says("\x1F\x8B\x08 and so on", "gzip");
    says("PK\x03\x04 and so on", "ZIP");
    says("\x89PNG\r\n\x1a\n", "PNG");
    says("ISO-10303-21;\nHEADER;", "STEP");
    says("Kaydara FBX Binary  ", "FBX");
    says("#usda 1.0\n", "USD");
    says("PXR-USDC", "USD");
    says("<!DOCTYPE html><html>", "web page");
    says("<?xml version=\"1.0\"?>\n<COLLADA xmlns=\"\">", "COLLADA");
    says("<?xml version=\"1.0\"?>\n<X3D>", "X3D");
    says(std::string(72, ' ') + "S      1\n", "IGES");
    says("\xFF\xFEv\0", "UTF-16");
    EXPECT_EQ(failure(folder.write("file.bin", "something else").string()).substr(0, 5), "E0204");
    EXPECT_EQ(failure(folder.path().string()).substr(0, 5), "E0202");
    EXPECT_EQ(failure((folder.path() / "absent.obj").string()).substr(0, 5), "E0201");
    EXPECT_EQ(failure(folder.write("empty.obj", "").string()).substr(0, 5), "E0203");
}

TEST(Load, UsageIsChecked) {
    const TemporaryFolder folder;
    const std::string file = folder.write("a.obj", kObj).string();
    EXPECT_EQ(failure(file, with_format("fbx")).substr(0, 5), "E0120");
    EXPECT_EQ(failure("-").substr(0, 5), "E0120");
    EXPECT_EQ(failure(file, with_up('x')).substr(0, 5), "E0121");
    EXPECT_EQ(failure(file, with_unit(0)).substr(0, 5), "E0122");
    EXPECT_EQ(failure(file, with_format("ply")).substr(0, 5), "E0501");
    EXPECT_EQ(load_scene(file, with_format("OBJ")).format, "OBJ");
}

TEST(Load, UnitsAndUpAreApplied) {
    const TemporaryFolder folder;
    const std::string file = folder.write("a.obj", kObj).string();
    LoadParams params = with_up('z');
    params.metres_per_unit = 0.001;
    const Scene scene = load_scene(file, params);
    const Bounds3d bounds = scene_bounds(scene);
    EXPECT_NEAR(bounds.upper.x, 0.002, 1e-9);
    EXPECT_NEAR(bounds.upper.y, 0.003, 1e-9) << "z of the file points up";
    EXPECT_NEAR(bounds.lower.z, 0, 1e-9);
    EXPECT_GT(scene.parts[0].world_from_mesh.determinant(), 0);
}

TEST(Load, FarModelsAreMovedNear) {
    const TemporaryFolder folder;
    const Scene scene =
        load_scene(folder.write("a.obj", "v 1000000 0 0\nv 1000002 0 0\nv 1000000 2 0\nf 1 2 3\n").string());
    EXPECT_LT(length(scene_bounds(scene).center()), 10);
    EXPECT_NEAR(scene.origin.x, 1e6, 10);
}

TEST(Load, PartsWithoutATriangleGo) {
    const TemporaryFolder folder;
    const Scene scene = load_scene(folder.write("a.obj", kObj + "o line\nf 1 2 2\no good\nf 3 2 1\n").string());
    ASSERT_EQ(scene.parts.size(), 2u);
    EXPECT_EQ(scene.parts[1].path, "good");
}

} // namespace
} // namespace porthole
