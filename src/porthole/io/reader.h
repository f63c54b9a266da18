// What the OBJ, PLY and STL readers share: warnings that do not flood, parts that are put in
// order, textures read beside the model.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "porthole/base/parallel.h"
#include "porthole/io/load.h"
#include "porthole/scene/scene.h"

namespace porthole {

/// "path:line".
[[nodiscard]] std::string at_line(std::string_view path, std::uint64_t line);

/// Linear colour of an sRGB-encoded one; values above 1 stay as they are.
[[nodiscard]] Vec3f linear_color(Vec3f srgb);

/// Name of the file without folder and ending, as valid UTF-8; "model" for standard input.
[[nodiscard]] std::string file_stem(const std::filesystem::path& path);

/// Collects warnings, at most 16 of each code; how many more there were is said at the end.
class WarningLog {
public:
    void add(std::string code, std::string where, std::string reason);
    /// The warnings in the order they came.
    [[nodiscard]] Warnings take(const std::string& path);

private:
    Warnings kept_;
    std::map<std::string, std::uint64_t> count_;
};

/// A kind of fault that may occur in every line of a file: told once, with the first place.
struct Fault {
    std::uint64_t count = 0;
    std::uint64_t first_line = 0;
    std::string first; ///< what was found there

    void note(std::uint64_t line, std::string_view found) {
        if (count++ == 0) {
            first_line = line;
            first = std::string(found);
        }
    }
};

/// Adds `mesh` and a part that shows it to the scene, after finish_mesh and with what that
/// dropped in `dropped`.
void add_part(Scene& scene, Mesh&& mesh, std::string name, MeshRepair& dropped);

/// Gives memory back that grown arrays hold in reserve, where it is much.
void drop_slack(Mesh& mesh);

/// Gives vertices whose normal is (0, 0, 0) the mean of their faces; drops the normals when no
/// vertex has one.
void fill_missing_normals(Mesh& mesh);

/// The material of a file that brings none.
[[nodiscard]] Material plain_material();

/// Says in one warning what finish_mesh dropped over the whole file, if anything.
void report_dropped(const MeshRepair& dropped, const char* code, const std::string& path, WarningLog& log);

/// @throws Error limit E0902 when `bytes` passes params.max_bytes.
void check_memory(std::uint64_t bytes, const LoadParams& params, const std::string& path);

/// Pictures that a model names, each read once.
class TextureFiles {
public:
    TextureFiles(std::filesystem::path model, const LoadParams& params) : model_(std::move(model)), params_(&params) {}

    /// Index of the picture that `reference` names, kNone (and a warning) when there is no
    /// such file beside the model. Nothing is decoded yet.
    [[nodiscard]] std::int32_t find(std::string_view reference, const std::string& where, WarningLog& log);
    /// Decodes every picture found; those that cannot be read are empty, with a warning.
    /// @throws Error limit E0902; Cancelled.
    [[nodiscard]] std::vector<Image<Rgba8>> decode(const Control& control, WarningLog& log) const;

private:
    struct Entry {
        std::filesystem::path file;
        std::string where;
    };
    std::filesystem::path model_;
    const LoadParams* params_;
    std::vector<Entry> entries_;
    std::map<std::string, std::int32_t, std::less<>> by_reference_;
    std::map<std::filesystem::path, std::int32_t> by_file_;
};

} // namespace porthole
