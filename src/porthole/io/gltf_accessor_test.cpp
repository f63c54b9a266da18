#include <gtest/gtest.h>

#include <meshoptimizer.h>

#include "porthole/io/gltf_accessor.h"
#include "porthole/io/gltf_test_file.h"

namespace porthole::gltf {
namespace {

// The accessors of a file, with what they point into.
struct Opened {
    std::string bytes;
    Document doc;
    std::vector<Buffer> buffers;
    std::vector<BufferView> views;
    std::vector<Accessor> accessors;

    explicit Opened(const TestFile& file) : bytes(file.glb()), doc("test.glb", file_root(file)) {
        const Container c =
            open_container({reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()}, "test.glb");
        UriReader uris("test.glb");
        buffers = read_buffers(doc, c, uris);
        views = read_buffer_views(doc, buffers, 1 << 30, {});
        accessors = read_accessors(doc, views, bytes.size());
    }
    static Json file_root(const TestFile& file) {
        Json root = file.root;
        root["buffers"] = {{{"byteLength", file.bin.size()}}};
        return root;
    }
    std::vector<float> floats(std::size_t accessor, int width, float fill = 1) const {
        const Accessor& a = accessors[accessor];
        std::vector<float> out(a.count * std::size_t(width));
        read_floats(a, 0, a.count, width, out.data(), fill);
        return out;
    }
};

TEST(GltfAccessor, NormalizedIntegers) {
    TestFile file;
    const auto normalized = [&](std::size_t accessor) {
        file.root["accessors"][accessor]["normalized"] = true;
        return accessor;
    };
    const auto i8 = normalized(file.add<std::int8_t>({-128, -127, 0, 127}, "SCALAR", 5120, 1));
    const auto u8 = normalized(file.add<std::uint8_t>({0, 51, 255}, "SCALAR", 5121, 1));
    const auto i16 = normalized(file.add<std::int16_t>({-32768, -32767, 0, 32767}, "SCALAR", 5122, 1));
    const auto u16 = normalized(file.add<std::uint16_t>({0, 13107, 65535}, "SCALAR", 5123, 1));
    const auto plain = file.add<std::int16_t>({-3, 300}, "SCALAR", 5122, 1);
    const Opened o(file);
    EXPECT_EQ(o.floats(i8, 1), (std::vector<float>{-1, -1, 0, 1}));
    EXPECT_EQ(o.floats(u8, 1), (std::vector<float>{0, 51.0f / 255.0f, 1}));
    EXPECT_EQ(o.floats(i16, 1), (std::vector<float>{-1, -1, 0, 1}));
    EXPECT_EQ(o.floats(u16, 1), (std::vector<float>{0, 13107.0f / 65535.0f, 1}));
    EXPECT_EQ(o.floats(plain, 1), (std::vector<float>{-3, 300}));
}

TEST(GltfAccessor, WidthsAndStride) {
    TestFile file;
    // Interleaved: position and colour of two vertices in one view of stride 16.
    const std::size_t view = file.add_view<float>({1, 2, 3, 0.5f, 4, 5, 6, 0.25f});
    file.root["bufferViews"][view]["byteStride"] = 16;
    file.root["accessors"].push_back({{"bufferView", view}, {"componentType", 5126}, {"type", "VEC3"}, {"count", 2}});
    file.root["accessors"].push_back(
        {{"bufferView", view}, {"byteOffset", 12}, {"componentType", 5126}, {"type", "SCALAR"}, {"count", 2}});
    const Opened o(file);
    EXPECT_EQ(o.floats(0, 3), (std::vector<float>{1, 2, 3, 4, 5, 6}));
    EXPECT_EQ(o.floats(0, 4, 9), (std::vector<float>{1, 2, 3, 9, 4, 5, 6, 9}));
    EXPECT_EQ(o.floats(0, 2), (std::vector<float>{1, 2, 4, 5}));
    EXPECT_EQ(o.floats(1, 1), (std::vector<float>{0.5f, 0.25f}));
    float second[3];
    read_floats(o.accessors[0], 1, 1, 3, second);
    EXPECT_EQ(second[0], 4);
}

TEST(GltfAccessor, SparseReplacesAndStandsAlone) {
    TestFile file;
    const std::size_t base = file.scalars({0, 1, 2, 3, 4});
    const std::size_t at = file.add_view<std::uint8_t>({1, 4});
    const std::size_t values = file.add_view<float>({10, 40});
    const Json sparse = {
        {"count", 2}, {"indices", {{"bufferView", at}, {"componentType", 5121}}}, {"values", {{"bufferView", values}}}};
    file.root["accessors"][base]["sparse"] = sparse;
    file.root["accessors"].push_back({{"componentType", 5126}, {"type", "SCALAR"}, {"count", 5}, {"sparse", sparse}});
    const Opened o(file);
    EXPECT_EQ(o.floats(0, 1), (std::vector<float>{0, 10, 2, 3, 40}));
    EXPECT_EQ(o.floats(1, 1), (std::vector<float>{0, 10, 0, 0, 40}));
    float range[3];
    read_floats(o.accessors[0], 2, 3, 1, range);
    EXPECT_EQ((std::vector<float>(range, range + 3)), (std::vector<float>{2, 3, 40}));
}

TEST(GltfAccessor, BoundsAreChecked) {
    const auto code_with = [](const std::function<void(TestFile&)>& change) {
        TestFile file;
        file.add_mesh({{"POSITION", file.triangle()}});
        file.bin += std::string(64, '\0'); // so that only the view limits the accessor
        change(file);
        const Error e = error_of([&] { return file.read(); });
        return e.code + " " + e.where;
    };
    const auto accessor = [](const char* key, const Json& value) {
        return [=](TestFile& f) { f.root["accessors"][0][key] = value; };
    };
    const auto view = [](const char* key, const Json& value) {
        return [=](TestFile& f) { f.root["bufferViews"][0][key] = value; };
    };
    EXPECT_EQ(code_with([](TestFile&) {}), "none ");
    EXPECT_EQ(code_with(accessor("count", 4)), "E0301 test.glb:/accessors/0/count");
    EXPECT_EQ(code_with(accessor("count", 0)), "E0303 test.glb:/accessors/0/count");
    EXPECT_EQ(code_with(accessor("count", -1)), "E0303 test.glb:/accessors/0/count");
    EXPECT_EQ(code_with(accessor("count", 2.5)), "E0303 test.glb:/accessors/0/count");
    EXPECT_EQ(code_with(accessor("count", 9007199254740992ull)), "E0301 test.glb:/accessors/0/count");
    EXPECT_EQ(code_with(accessor("byteOffset", 4)), "E0301 test.glb:/accessors/0/count");
    EXPECT_EQ(code_with(accessor("byteOffset", 9007199254740992ull)), "E0301 test.glb:/accessors/0/byteOffset");
    EXPECT_EQ(code_with(accessor("componentType", 5124)), "E0303 test.glb:/accessors/0/componentType");
    EXPECT_EQ(code_with(accessor("type", "VEC2")), "E0303 test.glb:/accessors/0/type");
    EXPECT_EQ(code_with(accessor("bufferView", 1)), "E0306 test.glb:/accessors/0/bufferView");
    EXPECT_EQ(code_with(view("byteStride", 8)), "E0303 test.glb:/bufferViews/0/byteStride");
    EXPECT_EQ(code_with(view("byteStride", 16)), "E0301 test.glb:/bufferViews/0/byteStride");
    EXPECT_EQ(code_with(view("byteLength", 1000)), "E0301 test.glb:/bufferViews/0/byteLength");
    EXPECT_EQ(code_with(view("byteOffset", 1000)), "E0301 test.glb:/bufferViews/0/byteOffset");
    EXPECT_EQ(code_with(view("buffer", 1)), "E0306 test.glb:/bufferViews/0/buffer");
}

TEST(GltfAccessor, ZerosWithoutBytesAreBounded) {
    TestFile file;
    file.root["accessors"] = {{{"componentType", 5126}, {"type", "VEC3"}, {"count", 4000000000u}}};
    file.add_mesh({{"POSITION", 0}});
    EXPECT_EQ(error_of([&] { return file.read(); }).kind, ErrorKind::limit);
}

TEST(GltfAccessor, SparseIndicesMustIncreaseInBounds) {
    for (const std::vector<std::uint16_t>& indices : {std::vector<std::uint16_t>{1, 1}, {2, 1}, {1, 3}}) {
        TestFile file;
        file.add_mesh({{"POSITION", file.triangle()}});
        const std::size_t at = file.add_view(indices);
        const std::size_t values = file.add_view(std::vector<float>(6, 1));
        file.root["accessors"][0]["sparse"] = {{"count", 2},
                                               {"indices", {{"bufferView", at}, {"componentType", 5123}}},
                                               {"values", {{"bufferView", values}}}};
        EXPECT_EQ(error_of([&] { return file.read(); }).code, "E0303") << indices[1];
    }
}

// meshoptimizer encodes what the reader must give back.
TEST(GltfAccessor, Meshopt) {
    const std::vector<float> positions = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
    const std::vector<std::uint32_t> triangles = {0, 1, 2, 2, 1, 3};
    std::vector<unsigned char> vertex_data(meshopt_encodeVertexBufferBound(4, 12));
    vertex_data.resize(meshopt_encodeVertexBuffer(vertex_data.data(), vertex_data.size(), positions.data(), 4, 12));
    std::vector<unsigned char> index_data(meshopt_encodeIndexBufferBound(6, 4));
    index_data.resize(meshopt_encodeIndexBuffer(index_data.data(), index_data.size(), triangles.data(), 6));

    const auto build = [&](const char* extension) {
        TestFile file;
        const auto compressed = [&](const std::vector<unsigned char>& data, std::size_t stride, std::size_t count,
                                    const char* mode) {
            const std::size_t view = file.add_view(data);
            Json& json = file.root["bufferViews"][view];
            const Json range = json;
            json = {{"buffer", 1}, {"byteLength", stride * count}}; // the fallback buffer has no bytes
            json["extensions"][extension] = {{"buffer", 0},
                                             {"byteOffset", range["byteOffset"]},
                                             {"byteLength", range["byteLength"]},
                                             {"byteStride", stride},
                                             {"count", count},
                                             {"mode", mode}};
            return view;
        };
        const std::size_t v = compressed(vertex_data, 12, 4, "ATTRIBUTES"),
                          i = compressed(index_data, 4, 6, "TRIANGLES");
        file.root["accessors"] = {{{"bufferView", v}, {"componentType", 5126}, {"type", "VEC3"}, {"count", 4}},
                                  {{"bufferView", i}, {"componentType", 5125}, {"type", "SCALAR"}, {"count", 6}}};
        file.add_mesh({{"POSITION", 0}})["indices"] = 1;
        return file;
    };
    for (const char* extension : {"EXT_meshopt_compression", "KHR_meshopt_compression"}) {
        TestFile file = build(extension);
        file.extra_buffers = {{{"byteLength", 72}, {"extensions", {{extension, {{"fallback", true}}}}}}};
        const auto read = [&] { return file.read(); };
        const Scene scene = read();
        ASSERT_EQ(scene.parts.size(), 1u);
        ASSERT_EQ(scene.meshes[0].positions.size(), 4u);
        EXPECT_EQ(scene.meshes[0].positions[3], (Vec3f{1, 1, 0}));
        EXPECT_EQ(scene.meshes[0].triangles.size(), 2u);
        EXPECT_TRUE(scene.warnings.empty());
        file.bin[0] = '\x11'; // no codec has this header
        EXPECT_EQ(error_of(read).code, "E0308");
        file.root["bufferViews"][0]["extensions"][extension]["count"] = 1u << 30; // claims 12 GB
        EXPECT_EQ(error_of(read).code, "E0308");
    }
}

} // namespace
} // namespace porthole::gltf
