#include "porthole/io/ply.h"

#include <bit>
#include <cstring>

#include <gtest/gtest.h>

#include "porthole/io/image_file.h"
#include "support/reading.h"
#include "support/temporary_folder.h"

namespace porthole {
namespace {

using test::codes;

Scene read(std::string text, const std::filesystem::path& path = "model.ply") {
    return read_ply(FileBytes(std::move(text)), path, {}, {});
}
std::string code_of(std::string text) {
    return test::code_of([&] { (void)read(std::move(text)); });
}

std::string header(const std::string& format, const std::string& vertex, const std::string& rest) {
    return "ply\nformat " + format + " 1.0\ncomment made by hand\nelement vertex 4\n" + vertex + rest + "end_header\n";
}
const std::string kXyz = "property float x\nproperty float y\nproperty float z\n";
const std::string kFaces = "element face 1\nproperty list uchar int vertex_indices\n";
const std::string kSquare = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

/// Bytes of numbers in either byte order.
class Binary {
public:
    explicit Binary(bool big) : big_(big) {}
    template <typename T> Binary& operator<<(T value) {
        char raw[sizeof value];
        std::memcpy(raw, &value, sizeof value);
        if (big_) std::reverse(raw, raw + sizeof value);
        bytes.append(raw, sizeof value);
        return *this;
    }
    std::string bytes;

private:
    bool big_;
};

TEST(Ply, AsciiSquare) {
    const Scene scene = read(header("ascii", kXyz, kFaces) + kSquare + "4 0 1 2 3\n", "folder/square.ply");
    ASSERT_EQ(scene.parts.size(), 1u);
    EXPECT_EQ(scene.parts[0].path, "square");
    EXPECT_EQ(scene.meshes[0].triangles, (std::vector<Vec3u>{{0, 1, 2}, {0, 2, 3}}));
    EXPECT_TRUE(scene.meshes[0].normals.empty());
    EXPECT_TRUE(scene.warnings.empty());
}

TEST(Ply, BothByteOrdersAndEveryType) {
    for (const bool big : {false, true}) {
        Binary data(big);
        for (int i = 0; i < 4; ++i)
            data << double(i & 1) << std::int8_t(i >> 1) << std::int16_t(-3) << std::uint8_t(255) << std::uint8_t(128)
                 << std::uint8_t(0) << std::uint16_t(2) << std::int32_t(7) << std::int32_t(8) << float(0) << float(0)
                 << float(2);
        data << std::uint16_t(0xFFFF) << std::int32_t(3) << std::uint32_t(0) << std::uint32_t(1) << std::uint32_t(3);
        const Scene scene = read(
            header(big ? "binary_big_endian" : "binary_little_endian",
                   "property float64 x\nproperty char y\nproperty short z\nproperty uchar red\nproperty uint8 green\n"
                   "property uchar blue\nproperty list ushort int extra\nproperty float nx\nproperty float ny\n"
                   "property float nz\n",
                   "element face 1\nproperty ushort flags\nproperty list int uint vertex_index\n") +
            data.bytes);
        const Mesh& mesh = scene.meshes.at(0);
        EXPECT_EQ(mesh.positions[1], (Vec3f{1, 0, -3}));
        EXPECT_EQ(mesh.positions[3], (Vec3f{1, 1, -3}));
        EXPECT_EQ(mesh.normals[0], (Vec3f{0, 0, 1}));
        EXPECT_NEAR(mesh.colors[0].y, 0.2159f, 1e-4);
        EXPECT_EQ(mesh.triangles, (std::vector<Vec3u>{{0, 1, 3}}));
        EXPECT_TRUE(scene.warnings.empty()) << scene.warnings[0].reason;
    }
}

TEST(Ply, LineEndsOfTheHeader) {
    const std::string rows = kSquare + "3 0 1 2\n";
    std::string text = header("ascii", kXyz, kFaces);
    for (const std::string end : {"\r\n", "\r"}) {
        std::string other;
        for (const char c : text) other += c == '\n' ? end : std::string(1, c);
        EXPECT_EQ(triangle_count(read(other + rows)), 1u);
    }
    // Binary data that begin with a line feed, after a header of lone returns.
    Binary data(false);
    const std::uint32_t line_feed_first = 0x3F80000Au;
    data << std::bit_cast<float>(line_feed_first) << 0.f << 0.f << 2.f << 0.f << 0.f << 0.f << 1.f << 0.f << 0.f << 0.f
         << 1.f << std::uint8_t(3) << 0 << 1 << 2;
    std::string lone;
    for (const char c : header("binary_little_endian", kXyz, kFaces)) lone += c == '\n' ? '\r' : c;
    const Scene scene = read(lone + data.bytes);
    EXPECT_EQ(scene.meshes.at(0).positions[0].x, std::bit_cast<float>(line_feed_first));
}

TEST(Ply, TriangleStrips) {
    const Scene scene = read(header("ascii", kXyz, "element tristrips 1\nproperty list int int vertex_indices\n") +
                             kSquare + "8 0 1 3 2 -1 1 2 3\n");
    EXPECT_EQ(scene.meshes.at(0).triangles, (std::vector<Vec3u>{{0, 1, 3}, {3, 1, 2}, {1, 2, 3}}));
}

TEST(Ply, TextureOfAComment) {
    const test::TemporaryFolder folder;
    const std::vector<std::byte> png = encode_png(Image<Rgba8>(1, 1, {1, 2, 3, 255}), 3);
    folder.write("t.png", {reinterpret_cast<const char*>(png.data()), png.size()});
    const std::string vertex = kXyz + "property float s\nproperty float t\n";
    std::string text = header("ascii", vertex, kFaces) + "0 0 0 0 0\n1 0 0 1 0.25\n1 1 0 1 1\n0 1 0 0 1\n3 0 1 2\n";
    text.replace(text.find("made by hand"), 12, "");
    text.replace(text.find("comment "), 8, "comment TextureFile t.png");
    const Scene scene = read(text, folder.path() / "model.ply");
    ASSERT_EQ(scene.images.size(), 1u);
    EXPECT_EQ(scene.images[0](0, 0), (Rgba8{1, 2, 3, 255}));
    EXPECT_EQ(scene.materials[0].base_color_texture.texture, 0);
    EXPECT_EQ(scene.meshes[0].uv[0][1], (Vec2f{1, 0.75f}));
    const Scene elsewhere = read(text);
    EXPECT_EQ(codes(elsewhere), std::vector<std::string>{"W0701"});
}

TEST(Ply, BadFacesAreLeftOutAndNamed) {
    const std::string two = "element face 2\nproperty list uchar int vertex_indices\n";
    for (const std::string bad : {"3 0 1 4\n", "3 0 1 -1\n", "3 0 1 1.5\n", "2 0 1\n", "0\n"}) {
        const Scene scene = read(header("ascii", kXyz, two) + kSquare + "3 0 1 2\n" + bad);
        EXPECT_EQ(triangle_count(scene), 1u) << bad;
        ASSERT_EQ(codes(scene), std::vector<std::string>{"W0501"}) << bad;
        EXPECT_NE(scene.warnings[0].reason.find("face 1"), std::string::npos) << bad;
    }
    EXPECT_EQ(code_of(header("ascii", kXyz, kFaces) + kSquare + "3 0 1 4\n"), "E0504 model.ply");
}

TEST(Ply, PointsAreNoModel) {
    const Scene scene = read(header("ascii", kXyz, "") + kSquare);
    EXPECT_TRUE(scene.parts.empty());
    EXPECT_EQ(codes(scene), std::vector<std::string>{"W0503"});
    EXPECT_TRUE(read("ply\nformat ascii 1.0\nend_header\n").parts.empty());
}

TEST(Ply, HeadersThatAreRefused) {
    const auto with = [](const std::string& line) {
        return code_of("ply\nformat ascii 1.0\n" + line + "\nend_header\n");
    };
    EXPECT_EQ(code_of("ply\nformat binary_middle_endian 1.0\nend_header\n"), "E0501 model.ply:2");
    EXPECT_EQ(code_of("ply\nformat ascii 2.0\nend_header\n"), "E0501 model.ply:2");
    EXPECT_EQ(code_of("ply\nelement vertex 1\nend_header\n"), "E0501 model.ply:3");
    EXPECT_EQ(code_of("ply\nformat ascii 1.0\nelement vertex 1\n"), "E0501 model.ply:4");
    EXPECT_EQ(code_of("plywood\n"), "E0501 model.ply:1");
    EXPECT_EQ(with("element vertex -8"), "E0501 model.ply:3");
    EXPECT_EQ(with("element vertex 8x"), "E0501 model.ply:3");
    EXPECT_EQ(with("element vertex"), "E0501 model.ply:3");
    EXPECT_EQ(with("element vertex 99999999999999999999"), "E0501 model.ply:3");
    EXPECT_EQ(with("property float x"), "E0501 model.ply:3");
    EXPECT_EQ(with("element vertex 1\nproperty quad x"), "E0501 model.ply:4");
    EXPECT_EQ(with("element vertex 1\nproperty float x\nproperty float x"), "E0501 model.ply:5");
    EXPECT_EQ(with("element a 1\nelement a 1"), "E0501 model.ply:4");
    EXPECT_EQ(with("element face 1\nproperty list float int vertex_indices"), "E0501 model.ply:4");
    EXPECT_EQ(with("nonsense"), "E0501 model.ply:3");
    EXPECT_EQ(with("element vertex 0\nproperty float x\nproperty float y"), "E0503 model.ply");
}

TEST(Ply, CountsAreComparedWithTheFileFirst) {
    const std::string rows = kSquare;
    EXPECT_EQ(code_of("ply\nformat ascii 1.0\nelement vertex 4000000000\n" + kXyz + "end_header\n" + rows).substr(0, 5),
              "E0502");
    EXPECT_EQ(code_of("ply\nformat binary_little_endian 1.0\nelement vertex 999999999\n" + kXyz + "end_header\n" + rows)
                  .substr(0, 5),
              "E0502");
    EXPECT_EQ(code_of(header("ascii", kXyz, "element face 4000000000\nproperty list uchar int vertex_indices\n") + rows)
                  .substr(0, 5),
              "E0502");
    // Rows of nothing cost nothing, however many.
    EXPECT_TRUE(read("ply\nformat ascii 1.0\nelement nothing 18446744073709551615\nend_header\n").parts.empty());
}

TEST(Ply, ListsThatLie) {
    const std::string head = header("binary_little_endian", kXyz, kFaces);
    Binary square(false);
    for (int i = 0; i < 4; ++i) square << float(i & 1) << float(i >> 1) << 0.f;
    EXPECT_EQ(code_of(head + square.bytes + "\xFF\x01\x02").substr(0, 5), "E0502");
    const std::string negative =
        header("binary_little_endian", kXyz, "element face 1\nproperty list char int vertex_indices\n");
    EXPECT_EQ(code_of(negative + square.bytes + "\xFF" + std::string(12, '\0')).substr(0, 5), "E0502");
}

TEST(Ply, AsciiRowsNameTheirLine) {
    EXPECT_EQ(code_of(header("ascii", kXyz, kFaces) + "0 0 0\n1 0\n1 1 0\n0 1 0\n3 0 1 2\n"), "E0502 model.ply:12");
    EXPECT_EQ(code_of(header("ascii", kXyz, kFaces) + "0 0 0\n1 0 x\n1 1 0\n0 1 0\n3 0 1 2\n"), "E0502 model.ply:12");
    EXPECT_EQ(codes(read(header("ascii", kXyz, kFaces) + "0 0 0 9\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n")),
              std::vector<std::string>{"W0502"});
}

TEST(Ply, NonFiniteVerticesCostTheirFaces) {
    const std::string two = "element face 2\nproperty list uchar int vertex_indices\n";
    const Scene scene = read(header("ascii", kXyz, two) + "0 0 0\n1 0 0\n1 1 0\nnan 1 0\n3 0 1 2\n3 0 2 3\n");
    EXPECT_EQ(triangle_count(scene), 1u);
    EXPECT_EQ(codes(scene), std::vector<std::string>{"W0504"});
}

TEST(Ply, EveryTruncationIsRefused) {
    for (const bool big : {false, true}) {
        Binary data(big);
        for (int i = 0; i < 4; ++i) data << float(i & 1) << float(i >> 1) << 0.f;
        data << std::uint8_t(3) << 0 << 1 << 2;
        const std::string whole = header(big ? "binary_big_endian" : "binary_little_endian", kXyz, kFaces) + data.bytes;
        EXPECT_EQ(triangle_count(read(whole)), 1u);
        for (std::size_t n = 1; n < whole.size(); ++n) EXPECT_NE(code_of(whole.substr(0, n)), "none") << n;
    }
}

} // namespace
} // namespace porthole
