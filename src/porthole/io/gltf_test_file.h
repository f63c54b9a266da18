// Builds glTF files in memory for the reader's tests.
#pragma once

#include <cstring>
#include <string>
#include <vector>

#include "porthole/io/gltf.h"
#include "porthole/io/gltf_json.h"

namespace porthole::gltf {

/// A file with one buffer that grows as accessors are added.
struct TestFile {
    Json root = {{"asset", {{"version", "2.0"}}}};
    Json extra_buffers = Json::array(); ///< after the one that holds `bin`
    std::string bin;

    template <typename T> std::size_t add_view(const std::vector<T>& values) {
        while (bin.size() % 4 != 0) bin += '\0';
        const std::size_t bytes = values.size() * sizeof(T);
        root["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", bin.size()}, {"byteLength", bytes}});
        bin.append(reinterpret_cast<const char*>(values.data()), bytes);
        return root["bufferViews"].size() - 1;
    }
    template <typename T>
    std::size_t add(const std::vector<T>& values, const char* type, int component, std::size_t width) {
        const std::size_t view = add_view(values);
        root["accessors"].push_back(
            {{"bufferView", view}, {"componentType", component}, {"type", type}, {"count", values.size() / width}});
        return root["accessors"].size() - 1;
    }
    std::size_t vec3(const std::vector<float>& values) { return add(values, "VEC3", 5126, 3); }
    std::size_t vec4(const std::vector<float>& values) { return add(values, "VEC4", 5126, 4); }
    std::size_t scalars(const std::vector<float>& values) { return add(values, "SCALAR", 5126, 1); }
    std::size_t indices(const std::vector<std::uint16_t>& values) { return add(values, "SCALAR", 5123, 1); }

    /// A mesh of one primitive with the given attributes, and a node that shows it.
    Json& add_mesh(const Json& attributes) {
        root["meshes"].push_back({{"primitives", {{{"attributes", attributes}}}}});
        root["nodes"].push_back({{"mesh", root["meshes"].size() - 1}});
        return root["meshes"].back()["primitives"][0];
    }
    /// The unit right triangle in the plane z = 0.
    std::size_t triangle() { return vec3({0, 0, 0, 1, 0, 0, 0, 1, 0}); }

    [[nodiscard]] std::string glb() const {
        Json json = root;
        if (!bin.empty()) json["buffers"] = {{{"byteLength", bin.size()}}};
        for (const Json& buffer : extra_buffers) json["buffers"].push_back(buffer);
        std::string text = json.dump(), data = bin;
        while (text.size() % 4 != 0) text += ' ';
        while (data.size() % 4 != 0) data += '\0';
        std::string out = "glTF" + word(2) + word(12 + 8 + text.size() + (data.empty() ? 0 : 8 + data.size()));
        out += word(text.size()) + "JSON" + text;
        if (!data.empty()) out += word(data.size()) + std::string("BIN\0", 4) + data;
        return out;
    }
    [[nodiscard]] Scene read(double time = -1, int threads = 1) const {
        LoadParams params;
        params.time = time;
        Control control;
        control.threads = threads;
        return read_gltf(FileBytes(glb()), "test.glb", params, control);
    }
    static std::string word(std::size_t value) {
        const auto v = static_cast<std::uint32_t>(value);
        return std::string(reinterpret_cast<const char*>(&v), 4);
    }
};

/// The Error that reading throws, or one with code "none".
template <typename F> Error error_of(const F& read) {
    try {
        (void)read();
    } catch (const Error& e) {
        return e;
    }
    return Error(ErrorKind::bug, "none", "", "nothing was thrown");
}

} // namespace porthole::gltf
