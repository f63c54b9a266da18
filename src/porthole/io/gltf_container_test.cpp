#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "porthole/io/gltf_container.h"
#include "porthole/io/gltf_test_file.h"

namespace porthole::gltf {
namespace {

std::span<const std::byte> bytes_of(const std::string& text) {
    return {reinterpret_cast<const std::byte*>(text.data()), text.size()};
}
std::string text_of(std::span<const std::byte> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST(GltfContainer, Base64) {
    const auto decoded = [](std::string_view text) { return text_of(decode_base64(text).value()); };
    EXPECT_EQ(decoded(""), "");
    EXPECT_EQ(decoded("Zg=="), "f");
    EXPECT_EQ(decoded("Zg"), "f");
    EXPECT_EQ(decoded("Zm8="), "fo");
    EXPECT_EQ(decoded("Zm9v"), "foo");
    EXPECT_EQ(decoded("Zm9vYmFy"), "foobar");
    EXPECT_EQ(decoded("+/+/"), "\xFB\xFF\xBF");
    for (const char* bad : {"Z", "Zm9v!", "Zm 9v", "Z===", "=m9v", "Zm9\xFF"}) EXPECT_FALSE(decode_base64(bad)) << bad;
}

TEST(GltfContainer, EveryTruncationIsRefusedWithThePlace) {
    TestFile file;
    file.add_mesh({{"POSITION", file.triangle()}});
    const std::string whole = file.glb();
    ASSERT_EQ(file.read().parts.size(), 1u);
    for (std::size_t n = 4; n < whole.size(); ++n) {
        const Error e = error_of([&] { return read_gltf(FileBytes(whole.substr(0, n)), "cut.glb", {}, {}); });
        EXPECT_EQ(e.code, "E0301") << n;
        EXPECT_EQ(e.kind, ErrorKind::input);
        EXPECT_EQ(e.where.rfind("cut.glb:byte ", 0), 0u) << e.where;
    }
}

TEST(GltfContainer, NoByteOfAGlbMayCrash) {
    TestFile file;
    Json& primitive = file.add_mesh({{"POSITION", file.triangle()}});
    primitive["indices"] = file.indices({0, 1, 2});
    const std::string whole = file.glb();
    int refused = 0;
    for (std::size_t i = 0; i < whole.size(); ++i)
        for (const char byte : {'\0', '\x7F', '\xFF', '9', '"', '['}) {
            std::string broken = whole;
            broken[i] = byte;
            try {
                const Scene scene = read_gltf(FileBytes(broken), "x.glb", {}, {});
                for (const Mesh& mesh : scene.meshes)
                    for (const Vec3u& t : mesh.triangles) ASSERT_LT(std::max({t.x, t.y, t.z}), mesh.positions.size());
            } catch (const Error&) {
                ++refused;
            }
        }
    EXPECT_GT(refused, 500);
}

TEST(GltfContainer, Chunks) {
    const std::string json = R"({"asset":{"version":"2.0"}} )";
    const auto chunk = [](const std::string& data, const std::string& type) {
        return TestFile::word(data.size()) + type + data;
    };
    const auto glb = [](const std::string& chunks) {
        return "glTF" + TestFile::word(2) + TestFile::word(12 + chunks.size()) + chunks;
    };
    const std::string bin_type("BIN\0", 4);
    const auto code = [&](const std::string& file) {
        return error_of([&] { return open_container(bytes_of(file), "x"); }).code;
    };
    const std::string good = glb(chunk(json, "JSON") + chunk("1234", bin_type) + chunk("", "XTRA"));
    const Container c = open_container(bytes_of(good), "x");
    EXPECT_EQ(text_of(c.bin), "1234");
    EXPECT_EQ(c.json, json);
    EXPECT_EQ(c.json_offset, 20u);
    EXPECT_EQ(code(glb(chunk("1234", bin_type) + chunk(json, "JSON"))), "E0310");
    EXPECT_EQ(code(glb(chunk(json, "JSON") + chunk(json, "JSON"))), "E0310");
    EXPECT_EQ(code(glb(chunk(json, "JSON") + chunk("", "XTRA") + chunk("1234", bin_type))), "E0310");
    EXPECT_EQ(code(glb(chunk("", "JSON"))), "E0310");
    EXPECT_EQ(code(glb("")), "E0310");
    EXPECT_EQ(code(glb(TestFile::word(0xFFFFFFFF) + "JSON" + json)), "E0301");
    EXPECT_TRUE(open_container(bytes_of(good + "junk"), "x").trailing_bytes);
}

TEST(GltfContainer, UrisStayInTheFolder) {
    namespace fs = std::filesystem;
    const fs::path folder = fs::path(testing::TempDir()) / "porthole_gltf_uri";
    fs::create_directories(folder / "inner");
    std::ofstream(folder / "secret.bin") << std::string(64, 'x');
    std::ofstream(folder / "inner" / "own data.bin") << std::string(36, '\0');
    const auto read_with = [&](const std::string& uri) {
        TestFile file;
        file.root["buffers"] = {{{"byteLength", 36}, {"uri", uri}}};
        file.root["bufferViews"] = {{{"buffer", 0}, {"byteLength", 36}}};
        const fs::path path = folder / "inner" / "model.gltf";
        std::ofstream(path) << file.root.dump();
        return read_gltf(FileBytes(path), path, {}, {});
    };
    EXPECT_NO_THROW((void)read_with("own%20data.bin"));
    for (const std::string uri : {"../secret.bin", "/etc/passwd", "file:///etc/passwd", "http://localhost/x.bin",
                                  "missing.bin", "model.gltf", "data:;base64,A", "data:nothing"})
        EXPECT_EQ(error_of([&] { return read_with(uri); }).kind, ErrorKind::input) << uri;
    TestFile file;
    file.root["buffers"] = {{{"byteLength", 36}, {"uri", "inner/own data.bin"}}};
    EXPECT_EQ(error_of([&] { return read_gltf(FileBytes(file.root.dump()), "-", {}, {}); }).code, "E0307");
    fs::remove_all(folder);
}

TEST(GltfJson, DepthAndSyntax) {
    const auto parse = [](const std::string& text) {
        return error_of([&] { return parse_json(text, "f", 20, 1 << 20); });
    };
    EXPECT_EQ(parse(std::string(100000, '[')).code, "E0302");
    EXPECT_EQ(parse(std::string(400000, '[') + std::string(400000, ']')).code, "E0302");
    const Error e = parse(R"({"a": nul})");
    EXPECT_EQ(e.code, "E0302");
    EXPECT_EQ(e.where, "f:byte 29"); // the brace, after an offset of 20
    EXPECT_EQ(parse("\xEF\xBB\xBF{}").code, "E0302");
    EXPECT_EQ(parse(R"({"a": 1e999})").code, "E0302");
    EXPECT_EQ(parse("[" + std::string(100000, ' ') + "1]").code, "none");
    std::string many = "[0";
    for (int i = 0; i < 40000; ++i) many += ",0";
    EXPECT_EQ(parse(many + "]").kind, ErrorKind::limit);
}

TEST(GltfJson, ErrorsNameThePointer) {
    Document doc("f.gltf", Json::parse(R"({"nodes":[{"mesh":0},{"a/b~":{"mesh":-1}}]})"));
    const Json& inner = doc.root()["nodes"][1]["a/b~"];
    EXPECT_EQ(doc.where(inner, "mesh"), "f.gltf:/nodes/1/a~1b~0/mesh");
    const Error e = error_of([&] { return doc.need_index(inner, "mesh", 3, "mesh"); });
    EXPECT_EQ(e.code, "E0303");
    EXPECT_EQ(e.where, "f.gltf:/nodes/1/a~1b~0/mesh");
    EXPECT_EQ(error_of([&] { return doc.need_index(doc.root()["nodes"][0], "mesh", 0, "mesh"); }).code, "E0306");
    EXPECT_EQ(Document::as_uint(Json(7.0)), 7u);
    EXPECT_FALSE(Document::as_uint(Json(7.5)));
    EXPECT_FALSE(Document::as_uint(Json(1e300)));
    for (int i = 0; i < 100; ++i) doc.warn("W0301", inner, {}, "again");
    const Warnings warnings = doc.take_warnings();
    ASSERT_EQ(warnings.size(), 21u);
    EXPECT_NE(warnings.back().reason.find("80 more"), std::string::npos);
}

} // namespace
} // namespace porthole::gltf
