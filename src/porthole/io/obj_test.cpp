#include "porthole/io/obj.h"

#include <cmath>

#include <gtest/gtest.h>

#include "porthole/io/image_file.h"
#include "support/reading.h"
#include "support/temporary_folder.h"

namespace porthole {
namespace {

using test::codes;
using test::TemporaryFolder;

Scene read(std::string text, const std::filesystem::path& path = "model.obj") {
    return read_obj(FileBytes(std::move(text)), path, {}, {});
}
std::string code_of(std::string text) {
    return test::code_of([&] { (void)read(std::move(text)); });
}
std::vector<std::string> paths(const Scene& scene) {
    std::vector<std::string> out;
    for (const Part& part : scene.parts) out.push_back(part.path);
    return out;
}

const std::string kQuad = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
const std::string kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

TEST(Obj, AFileWithoutNamesIsOnePart) {
    const Scene scene = read(kQuad + "f 1 2 3 4\n", "folder/plate.obj");
    ASSERT_EQ(scene.parts.size(), 1u);
    EXPECT_EQ(scene.parts[0].path, "plate");
    EXPECT_EQ(scene.meshes[0].positions.size(), 4u);
    EXPECT_EQ(scene.meshes[0].triangles.size(), 2u);
    EXPECT_TRUE(scene.meshes[0].normals.empty());
    EXPECT_TRUE(scene.warnings.empty());
    EXPECT_EQ(scene.format, "OBJ");
}

TEST(Obj, ObjectsAndGroupsBecomeParts) {
    const std::string face = "f 1 2 3\n";
    EXPECT_EQ(paths(read(kQuad + "o a\n" + face + "o b\n" + face)), (std::vector<std::string>{"a", "b"}));
    EXPECT_EQ(paths(read(kQuad + "g a\n" + face + "g b c\n" + face + "g a\n" + face)),
              (std::vector<std::string>{"a", "b c"}));
    EXPECT_EQ(paths(read(kQuad + "o top\ng a\n" + face + "g b\n" + face + "o other\n" + face)),
              (std::vector<std::string>{"top/a", "top/b", "other"}));
    EXPECT_EQ(paths(read(kQuad + "o same\n" + face + "o same\n" + face)),
              (std::vector<std::string>{"same[0]", "same[1]"}));
    EXPECT_EQ(paths(read(kQuad + "o same\ng x\n" + face + "o same\ng x\n" + face)),
              (std::vector<std::string>{"same[0]/x", "same[1]/x"}));
    EXPECT_EQ(paths(read(kQuad + "o unused\no used\n" + face)), (std::vector<std::string>{"used"}));
    EXPECT_EQ(paths(read(kQuad + "o caf\xE9\n" + face)), (std::vector<std::string>{"caf\xEF\xBF\xBD"}));
}

TEST(Obj, EqualCornersShareAVertexWithinAPart) {
    const Scene scene = read(kQuad + "vt 0 0\nvt 1 0\nvn 0 0 1\nvn 0 0 2\n"
                                     "o a\nf 1/1/1 2/1/1 3/1/1\nf 1/1/1 3/1/1 4/1/1\n"
                                     "o b\nf 1/1/1 2/1/1 3/1/1\nf 1/2/1 3/1/1 4/1/2\n");
    ASSERT_EQ(scene.meshes.size(), 2u);
    EXPECT_EQ(scene.meshes[0].positions.size(), 4u);
    EXPECT_EQ(scene.meshes[1].positions.size(), 5u);
    EXPECT_EQ(scene.meshes[1].normals.back(), (Vec3f{0, 0, 1})) << "normals are made unit length";
}

TEST(Obj, TextureCoordinatesRunDownwards) {
    const Scene scene = read(kTriangle.substr(0, 24) + "vt 0.25 0.25\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n");
    EXPECT_EQ(scene.meshes[0].uv[0][0], (Vec2f{0.25f, 0.75f}));
    EXPECT_EQ(scene.meshes[0].uv[0][1], (Vec2f{1, 1}));
}

TEST(Obj, IndicesMayBeNegativeOrComeFirst) {
    const Scene relative = read("v 9 9 9\n" + kQuad + "f -4 -3 -2 -1\n");
    EXPECT_EQ(relative.meshes[0].positions[0], (Vec3f{0, 0, 0}));
    EXPECT_EQ(relative.meshes[0].positions[3], (Vec3f{0, 1, 0}));
    const Scene early = read("f 1 2 3\n" + kQuad);
    EXPECT_EQ(triangle_count(early), 1u);
    EXPECT_TRUE(early.warnings.empty());
}

TEST(Obj, BadFacesAreLeftOutAndNamed) {
    for (const char* bad : {"f 1 2 9", "f 1 2 0", "f 1 2 -9", "f 1 2 99999999999999999999", "f 1 2 4294967297", "f 1 2",
                            "f", "f 1 2 x", "f 1 2 3x", "f 1 2 3.5", "f 1 2 3/1/1/1", "f 1,2,3"}) {
        std::string model = kQuad + "f 1 2 3\n";
        model += bad;
        const Scene scene = read(std::move(model));
        EXPECT_EQ(triangle_count(scene), 1u) << bad;
        ASSERT_EQ(codes(scene), std::vector<std::string>{"W0402"}) << bad;
        EXPECT_EQ(scene.warnings[0].where, "model.obj:6") << bad;
    }
    EXPECT_EQ(code_of(kQuad + "f 1 2 9\n"), "E0403 model.obj:5");
}

TEST(Obj, BadTextureAndNormalIndicesCostOnlyThemselves) {
    const Scene scene = read(kQuad + "vt 0 0\nf 1 2 3\nf 1/1 2/7 3/0 4/x\n");
    EXPECT_EQ(codes(scene), (std::vector<std::string>{"W0402", "W0403"})); // x is no index at all
    const Scene kept = read(kQuad + "vt 0 0\nf 1/1 2/7 3/0 4/-5\n");
    EXPECT_EQ(triangle_count(kept), 2u);
    EXPECT_EQ(codes(kept), std::vector<std::string>{"W0403"});
}

TEST(Obj, UnreadableVerticesCostTheirFaces) {
    for (const std::string bad : {"v 1,0 2,0 3,0", "v nan 1 1", "v 1e400 1 1", "v inf 0 0", "v 1 2", "v", "v 1 2 x"}) {
        const Scene scene = read(kQuad + bad + "\nf 1 2 3\nf 1 2 5\n");
        EXPECT_EQ(triangle_count(scene), 1u) << bad;
        EXPECT_EQ(codes(scene), (std::vector<std::string>{"W0401", "W0404"})) << bad;
        EXPECT_EQ(scene.warnings[0].where, "model.obj:5") << bad;
    }
}

TEST(Obj, RealWorldSyntax) {
    const Scene crlf = read("\xEF\xBB\xBF# c\r\nv 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n");
    EXPECT_EQ(triangle_count(crlf), 1u);
    EXPECT_TRUE(crlf.warnings.empty());
    EXPECT_EQ(triangle_count(read("v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r")), 1u);
    EXPECT_EQ(triangle_count(read("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 \\\n 2 \\\r\n 3")), 1u);
    EXPECT_EQ(triangle_count(read("\tv 0 0 0 # o\n v 1 0 0 1.0\nv\t0\t1\t0\nf 1 2 3 # end")), 1u);
    // A comment that ends with a backslash does not swallow the next line.
    EXPECT_EQ(triangle_count(read("# C:\\models\\\n" + kTriangle)), 1u);
    EXPECT_EQ(triangle_count(read("s off\nmg 0\nlod 1\n" + kTriangle)), 1u);
}

TEST(Obj, WhatIsNotDrawnIsSaid) {
    EXPECT_EQ(codes(read(kTriangle + "l 1 2\np 1\n")), std::vector<std::string>{"W0405"});
    EXPECT_EQ(codes(read("csh -touch pwned\n" + kTriangle + "call other.obj\n")), std::vector<std::string>{"W0407"});
    EXPECT_EQ(codes(read(kTriangle + "frobnicate 1\n")), std::vector<std::string>{"W0408"});
    EXPECT_EQ(codes(read(kTriangle + "f 1 2 2\n")), std::vector<std::string>{"W0404"}); // no area
}

TEST(Obj, AHugePolygonIsDrawnWithAWarning) {
    std::string model, face = "f";
    for (int i = 0; i < 20000; ++i) {
        const double a = 2 * double(kPi) * i / 20000;
        model += "v " + std::to_string(std::cos(a)) + " " + std::to_string(std::sin(a)) + " 0\n";
        face += " " + std::to_string(i + 1);
    }
    const Scene scene = read(model + face);
    EXPECT_EQ(codes(scene), std::vector<std::string>{"W0406"});
    double area = 0;
    const Mesh& mesh = scene.meshes[0];
    for (const Vec3u t : mesh.triangles)
        area +=
            double(cross(mesh.positions[t.y] - mesh.positions[t.x], mesh.positions[t.z] - mesh.positions[t.x]).z) / 2;
    EXPECT_NEAR(area, double(kPi), 1e-3);
}

TEST(Obj, OtherFilesAreRefused) {
    EXPECT_EQ(code_of("This is a letter,\nnot a model.\n"), "E0401 model.obj:1");
    EXPECT_EQ(code_of(std::string("v 1\0 2", 6)), "E0402 model.obj:byte 3");
    EXPECT_EQ(code_of(std::string("\xFE\xFF\0v", 4)), "E0402 model.obj");
    EXPECT_TRUE(read("# only a comment\n").parts.empty());
    EXPECT_TRUE(read(kQuad).parts.empty());
}

TEST(Obj, OnlyFacesWithoutAreaLeaveAnEmptyPart) {
    const Scene scene = read("v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n");
    EXPECT_EQ(scene.parts.size(), 1u);
    EXPECT_EQ(triangle_count(scene), 0u);
    EXPECT_EQ(codes(scene), std::vector<std::string>{"W0404"});
}

TEST(Obj, VertexColoursAreLinear) {
    const Scene scene = read("v 0 0 0\nv 1 0 0 1 0.5 0\nv 0 1 0\nf 1 2 3\n");
    const std::vector<Vec4f>& colors = scene.meshes[0].colors;
    ASSERT_EQ(colors.size(), 3u);
    EXPECT_EQ(colors[0], (Vec4f{1, 1, 1, 1}));
    EXPECT_NEAR(colors[1].y, 0.2140f, 1e-4);
    EXPECT_EQ(colors[2], (Vec4f{1, 1, 1, 1}));
    const Scene bytes = read("v 0 0 0 255 128 0\nv 1 0 0 255 0 0\nv 0 1 0 0 0 0\nf 1 2 3\n");
    EXPECT_NEAR(bytes.meshes[0].colors[0].y, 0.2159f, 1e-4);
}

TEST(Obj, MissingNormalsAmongOthersAreFilled) {
    const Scene scene = read(kQuad + "vn 0 1 0\nvn nan 0 0\nf 1//1 2 3//2 4//9\n");
    const std::vector<Vec3f>& normals = scene.meshes[0].normals;
    ASSERT_EQ(normals.size(), 4u);
    EXPECT_EQ(normals[0], (Vec3f{0, 1, 0}));
    for (std::size_t i = 1; i < 4; ++i) EXPECT_EQ(normals[i], (Vec3f{0, 0, 1}));
}

TEST(Obj, MaterialsBecomeSubmeshes) {
    const TemporaryFolder folder;
    folder.write("my parts.mtl", "newmtl red\nKd 1 0 0\nd 0.5\nNs 250\nillum 2\n"
                                 "newmtl steel\nKd 0.5 0.5 0.5\nPm 1\nPr 0.25\nKe 2 0 0\nNi 2.5\n"
                                 "newmtl unused\nmap_Kd absent.png\n");
    const Scene scene =
        read("mtllib my parts.mtl\n" + kQuad + "usemtl red\nf 1 2 3\nusemtl steel\nf 1 3 4\nusemtl red\nf 2 3 4\n",
             folder.path() / "model.obj");
    EXPECT_TRUE(scene.warnings.empty()) << scene.warnings[0].reason;
    ASSERT_EQ(scene.materials.size(), 2u);
    const Material& red = scene.materials[0];
    EXPECT_EQ(red.name, "red");
    EXPECT_EQ(red.base_color, (Vec4f{1, 0, 0, 0.5f}));
    EXPECT_EQ(red.alpha_mode, AlphaMode::blend);
    EXPECT_EQ(red.metallic, 0);
    EXPECT_FLOAT_EQ(red.roughness, 0.5f);
    const Material& steel = scene.materials[1];
    EXPECT_NEAR(steel.base_color.x, 0.2140f, 1e-4);
    EXPECT_EQ(steel.metallic, 1);
    EXPECT_EQ(steel.roughness, 0.25f);
    EXPECT_EQ(steel.emissive, (Vec3f{2, 0, 0}));
    EXPECT_EQ(steel.ior, 2.5f);
    const Mesh& mesh = scene.meshes[0];
    ASSERT_EQ(mesh.submeshes.size(), 2u);
    EXPECT_EQ(mesh.submeshes[0].triangle_count, 2u);
    EXPECT_EQ(mesh.material_of(0), 0u);
    EXPECT_EQ(mesh.material_of(2), 1u);
    EXPECT_EQ(mesh.positions.size(), 4u) << "submeshes share vertices";
}

TEST(Obj, LibrariesThatCannotBeReadAreWarnings) {
    const TemporaryFolder outer;
    outer.write("secret.mtl", "newmtl m\n");
    outer.write("in/real.mtl", "newmtl m\nKd 0 1 0\n");
    const std::string model = "mtllib absent.mtl real.mtl\nmtllib ../secret.mtl\nmtllib model.obj\nmtllib /dev/zero\n" +
                              kTriangle.substr(0, 24) + "usemtl m\nf 1 2 3\nusemtl other\nf 1 3 2\n";
    const Scene scene = read(model, outer.write("in/model.obj", model));
    EXPECT_EQ(codes(scene), (std::vector<std::string>{"W0410", "W0410", "W0410", "W0410", "W0411"}));
    EXPECT_EQ(scene.materials[0].base_color, (Vec4f{0, 1, 0, 1}));
    EXPECT_EQ(scene.materials[1].name, "");
}

TEST(Obj, TexturesAreReadAndCombined) {
    const TemporaryFolder folder;
    const auto png = [&](const char* name, Rgba8 left, Rgba8 right) {
        Image<Rgba8> image(2, 1);
        image(0, 0) = left;
        image(1, 0) = right;
        const std::vector<std::byte> bytes = encode_png(image, 4);
        folder.write(name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    };
    png("colour.png", {10, 20, 30, 7}, {40, 50, 60, 7});
    png("mask.png", {255, 255, 255, 255}, {0, 0, 0, 255});
    png("rough.png", {100, 100, 100, 255}, {200, 200, 200, 255});
    png("metal.png", {255, 255, 255, 255}, {0, 0, 0, 255});
    folder.write("broken.png", "\x89PNG\r\n\x1a\nnothing");
    folder.write("m.mtl", "newmtl a\nKd 0 0 0\nmap_Kd -s 2 3 1 -o 0.5 0.25 -clamp on colour.png\n"
                          "newmtl b\nmap_Kd colour.png\nmap_d mask.png\nnorm colour.png\n"
                          "newmtl c\nmap_Pr rough.png\nmap_Pm metal.png\nmap_Bump -bm 0.5 colour.png\n"
                          "newmtl d\nmap_Kd broken.png\nmap_Ke ../colour.png\n");
    const Scene scene = read("mtllib m.mtl\n" + kQuad +
                                 "vt 0 0\nusemtl a\nf 1/1 2/1 3/1\nusemtl b\nf 1/1 2/1 4/1\n"
                                 "usemtl c\nf 1/1 3/1 4/1\nusemtl d\nf 2/1 3/1 4/1\n",
                             folder.path() / "model.obj");
    const auto image = [&](const TextureRef& ref) -> const Image<Rgba8>& {
        return scene.images[std::size_t(scene.textures[std::size_t(ref.texture)].image)];
    };
    const TextureRef& a = scene.materials[0].base_color_texture;
    EXPECT_EQ(scene.materials[0].base_color, (Vec4f{1, 1, 1, 1})) << "a black Kd does not black out its texture";
    EXPECT_EQ(a.scale, (Vec2f{2, 3}));
    EXPECT_EQ(a.offset, (Vec2f{0.5f, 1 - 3 - 0.25f}));
    EXPECT_EQ(scene.textures[std::size_t(a.texture)].wrap_u, Wrap::clamp);
    EXPECT_EQ(image(a)(0, 0), (Rgba8{10, 20, 30, 255})) << "alpha counts only through map_d";
    const Material& b = scene.materials[1];
    EXPECT_EQ(b.alpha_mode, AlphaMode::mask);
    EXPECT_EQ(image(b.base_color_texture)(0, 0), (Rgba8{10, 20, 30, 255}));
    EXPECT_EQ(image(b.base_color_texture)(1, 0), (Rgba8{40, 50, 60, 0}));
    EXPECT_NE(b.normal_texture.texture, kNone);
    const Material& c = scene.materials[2];
    EXPECT_EQ(image(c.metallic_roughness_texture)(0, 0), (Rgba8{255, 100, 255, 255}));
    EXPECT_EQ(image(c.metallic_roughness_texture)(1, 0), (Rgba8{255, 200, 0, 255}));
    EXPECT_EQ(c.metallic, 1);
    EXPECT_EQ(scene.materials[3].base_color_texture.texture, kNone);
    EXPECT_EQ(codes(scene), (std::vector<std::string>{"W0412", "W0701", "W0702"}));
}

TEST(Obj, ManyFaultsAreToldOnce) {
    std::string model = kTriangle;
    for (int i = 0; i < 1000; ++i)
        model += "mtllib absent" + std::to_string(i) + ".mtl\nf 1 2 77\nwhat " + std::to_string(i) + "\n";
    const Scene scene = read(std::move(model));
    EXPECT_LE(scene.warnings.size(), 24u);
    EXPECT_NE(scene.warnings.back().reason.find("984 more"), std::string::npos) << scene.warnings.back().reason;
}

TEST(Obj, ManyCornersOnOneVertexStayLinear) {
    // Every corner of the hub differs in its texture coordinate.
    std::string model = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    const int n = 200000;
    for (int i = 0; i < n; ++i) model += "vt 0." + std::to_string(i) + " 0\n";
    for (int i = 1; i <= n; ++i) model += "f 1/" + std::to_string(i) + " 2/1 3/1\n";
    EXPECT_EQ(triangle_count(read(std::move(model))), std::uint64_t(n));
}

TEST(Obj, MemoryLimit) {
    LoadParams params;
    params.max_bytes = 1000;
    std::string model;
    for (int i = 0; i < 100; ++i) model += kQuad;
    try {
        (void)read_obj(FileBytes(std::move(model)), "m.obj", params, {});
        FAIL() << "no error";
    } catch (const Error& error) {
        EXPECT_EQ(error.code, "E0902");
        EXPECT_EQ(error.kind, ErrorKind::limit);
    }
}

TEST(Obj, StopIsObeyed) {
    std::stop_source source;
    source.request_stop();
    Control control;
    control.stop = source.get_token();
    EXPECT_THROW((void)read_obj(FileBytes(std::string(kTriangle)), "m.obj", {}, control), Cancelled);
}

TEST(Obj, EveryTruncationIsSafe) {
    const std::string model =
        "mtllib a.mtl\no part\nv 0 0 0 1 1 1\nv 1.5e0 0 0\nv +1 -1. .5\nv 0 1 0\nvt 0 0\nvn 0 0 1\n"
        "usemtl m\ns 1\nf 1/1/1 2//1 \\\n 3/1 -1\nf -1 -2 -3\n";
    for (std::size_t n = 1; n <= model.size(); ++n) {
        try {
            const Scene scene = read(model.substr(0, n));
            for (const Mesh& mesh : scene.meshes)
                for (const Vec3u t : mesh.triangles) EXPECT_LT(std::max({t.x, t.y, t.z}), mesh.positions.size());
        } catch (const Error& error) {
            EXPECT_EQ(error.kind, ErrorKind::input);
        }
    }
}

} // namespace
} // namespace porthole
