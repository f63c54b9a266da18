#include "porthole/io/stl.h"

#include <cstring>

#include <gtest/gtest.h>

#include "support/reading.h"

namespace porthole {
namespace {

using test::codes;

Scene read(std::string text, const std::filesystem::path& path = "model.stl") {
    return read_stl(FileBytes(std::move(text)), path, {}, {});
}
std::string code_of(std::string text) {
    return test::code_of([&] { (void)read(std::move(text)); });
}

std::string binary(const std::vector<Vec3f>& corners, std::uint32_t count, std::string header = "made by hand") {
    header.resize(80, ' ');
    header.append(reinterpret_cast<const char*>(&count), 4);
    for (std::size_t i = 0; i < corners.size(); i += 3) {
        header.append(12, '\0');
        header.append(reinterpret_cast<const char*>(&corners[i]), 36);
        header.append(2, '\0');
    }
    return header;
}
const std::vector<Vec3f> kTwo{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, -0.0f}, {1, 1, 0}, {0, 1, 0}};

std::string facet(const std::string& vertices) {
    return "facet normal 0 0 1\nouter loop\n" + vertices + "endloop\nendfacet\n";
}
const std::string kFacet = facet("vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n");

TEST(Stl, BinaryIsWelded) {
    const Scene scene = read(binary(kTwo, 2), "folder/plate.stl");
    ASSERT_EQ(scene.parts.size(), 1u);
    EXPECT_EQ(scene.parts[0].path, "plate");
    EXPECT_EQ(scene.meshes[0].positions.size(), 4u) << "-0 and 0 are one place";
    EXPECT_EQ(scene.meshes[0].triangles, (std::vector<Vec3u>{{0, 1, 2}, {1, 3, 2}}));
    EXPECT_TRUE(scene.meshes[0].normals.empty());
    EXPECT_TRUE(scene.warnings.empty());
}

TEST(Stl, ManyDistinctCornersAreKeptApart) {
    std::vector<Vec3f> corners;
    for (int i = 0; i < 3000; ++i) {
        const float x = float(i) * 1e-7f;
        corners.insert(corners.end(), {{x, 0, 0}, {x, 1, float(i)}, {x, 0, 1}});
    }
    const Scene scene = read(binary(corners, 3000));
    EXPECT_EQ(scene.meshes[0].positions.size(), 9000u);
}

TEST(Stl, BinaryWhoseHeaderSaysSolid) { EXPECT_EQ(triangle_count(read(binary(kTwo, 2, "solid cube"))), 2u); }

TEST(Stl, BinaryCountsAreCheckedAgainstTheSize) {
    EXPECT_EQ(code_of(binary(kTwo, 3)), "E0602 model.stl:byte 80");
    EXPECT_EQ(code_of(binary(kTwo, 0xFFFFFFFFu)), "E0602 model.stl:byte 80");
    const Scene fewer = read(binary(kTwo, 1));
    EXPECT_EQ(triangle_count(fewer), 1u);
    EXPECT_EQ(codes(fewer), std::vector<std::string>{"W0602"});
    EXPECT_TRUE(read(binary({}, 0)).parts.empty());
    EXPECT_EQ(code_of("short"), "E0601 model.stl");
}

TEST(Stl, UnusableTrianglesAreCounted) {
    std::vector<Vec3f> corners = kTwo;
    corners[0].x = kInfinity;
    const Scene scene = read(binary(corners, 2));
    EXPECT_EQ(triangle_count(scene), 1u);
    EXPECT_EQ(codes(scene), std::vector<std::string>{"W0604"});
}

TEST(Stl, AsciiSolidsArePartsOfTheirNames) {
    const Scene scene =
        read("solid left arm\n" + kFacet + kFacet + "endsolid left arm\nsolid\nendsolid\nsolid\n" + kFacet, "two.stl");
    ASSERT_EQ(scene.parts.size(), 2u);
    EXPECT_EQ(scene.parts[0].path, "left arm");
    EXPECT_EQ(scene.parts[1].path, "two");
    EXPECT_EQ(scene.meshes[0].positions.size(), 3u);
    EXPECT_EQ(scene.meshes[0].triangles.size(), 2u);
    EXPECT_TRUE(scene.warnings.empty()) << scene.warnings[0].reason;
}

TEST(Stl, AsciiCapitalsAndReturns) {
    const Scene scene = read("SOLID PART\r\nFACET\tNORMAL 0 0 0\r\nOUTER LOOP\r\nVERTEX 0 0 0\r\nVERTEX 1 0 0\r\n"
                             "VERTEX 0 1 0\r\nENDLOOP\r\nENDFACET\r\nENDSOLID\r\n");
    EXPECT_EQ(triangle_count(scene), 1u);
    EXPECT_EQ(scene.parts[0].name, "PART");
    EXPECT_EQ(codes(scene), std::vector<std::string>{"W0605"});
}

TEST(Stl, BadFacetsAreLeftOutAndNamed) {
    for (const std::string& bad :
         {facet("vertex 0 0 0\nvertex 1 0 0\n"), facet("vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nvertex 1 1 0\n"),
          facet("vertex 1.0.0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"), facet("vertex 0 0\nvertex 1 0 0\nvertex 0 1 0\n")}) {
        const Scene scene = read("solid a\n" + kFacet + bad + "endsolid\n");
        EXPECT_EQ(triangle_count(scene), 1u) << bad;
        EXPECT_EQ(codes(scene), std::vector<std::string>{"W0601"}) << bad;
        EXPECT_EQ(code_of("solid a\n" + bad).substr(0, 5), "E0603") << bad;
    }
    EXPECT_EQ(codes(read("solid a\n" + kFacet + "nonsense\n")), std::vector<std::string>{"W0603"});
    EXPECT_EQ(code_of("solid ground is what this letter is about\nDear Sir,\n"), "E0601 model.stl:2");
}

TEST(Stl, EveryTruncationIsSafe) {
    const std::string ascii = "solid a\n" + kFacet + kFacet + "endsolid a\n";
    for (std::size_t n = 1; n < ascii.size(); ++n) {
        try {
            const Scene scene = read(ascii.substr(0, n));
            // Cut inside a facet, the text says so.
            const std::string cut = ascii.substr(0, n);
            if (cut.rfind("facet normal") > cut.rfind("endfacet")) {
                EXPECT_FALSE(scene.warnings.empty()) << n;
            }
        } catch (const Error& error) {
            EXPECT_EQ(error.kind, ErrorKind::input);
        }
    }
    const std::string whole = binary(kTwo, 2);
    for (std::size_t n = 1; n < whole.size(); ++n) EXPECT_NE(code_of(whole.substr(0, n)), "none") << n;
}

} // namespace
} // namespace porthole
