// What the command line says, as plain structs, and how its values are written.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "porthole/io/load.h"
#include "porthole/render/wireframe.h"
#include "porthole/reveal.h"

namespace porthole::cli {

/// Every subcommand has these.
struct CommonOptions {
    std::string model; ///< path, or "-" for standard input
    LoadParams load;
    int threads = 0; ///< 0: one per processor
    bool quiet = false, verbose = false;
    std::string log = "text";     ///< or "json": messages as JSON lines
    std::uint64_t max_memory = 0; ///< bytes; 0: as much as load.max_bytes says
};

/// Subcommands that make a picture.
struct PictureOptions {
    std::string output;      ///< .png, .jpg, .jpeg, or "-": PNG on standard output; may be empty
    std::string report_path; ///< JSON report, "-": standard output; may be empty
    bool json = false;       ///< the report on standard output
    Vec2i size{1920, 1080};
    int bits = 8; ///< per channel of a PNG: 8 or 16
    bool no_background = false;
    bool no_clobber = false;
    std::string isa = "avx2";
    CameraParams camera;
    RenderParams render; ///< its background too, linear
    bool compare_full = false;
};

struct RevealOptions {
    CommonOptions common;
    PictureOptions picture;
    std::vector<std::string> target, keep, cut_only, solid, shell; ///< selectors
    PlanParams plan;
    bool keep_see_through = false;
    Rest rest = Rest::keep;
    bool strict = false;
    std::string debug_dir; ///< empty: none
};

struct RenderOptions {
    enum class Mode : std::uint8_t { raytraced, flat, wireframe };

    CommonOptions common;
    PictureOptions picture;
    Mode mode = Mode::raytraced;
    WireParams wire{.wire = Wire::automatic}; ///< of mode wireframe
    std::vector<std::string> focus;           ///< selectors of parts that the picture is framed on
};

struct PartsOptions {
    CommonOptions common;
    bool json = false;
};

struct CheckOptions {
    CommonOptions common; ///< its model may be empty: the one that the report names
    std::string report;   ///< path, or "-"
    std::string picture;  ///< empty: the one that the report names
    bool json = false;
};

/// Readers of single values. `option` is named by the error.
/// @throws Error usage E0105.
[[nodiscard]] Vec2i parse_size(const std::string& text, const std::string& option); ///< "1920x1080", 1..32768 each
[[nodiscard]] Vec3f parse_color(const std::string& text,
                                const std::string& option); ///< "#rrggbb", white, black; linear
[[nodiscard]] Length parse_length(const std::string& text, const std::string& option,
                                  bool zero = false); ///< "54", "54px", "5%", "3mm"; above 0, or from 0
[[nodiscard]] double parse_units(const std::string& text, const std::string& option); ///< "mm", "in", "0.01": metres
[[nodiscard]] std::uint64_t parse_bytes(const std::string& text, const std::string& option); ///< "512M", "4G"
[[nodiscard]] Vec3d parse_vector(const std::string& text, const std::string& option);        ///< "1,2,3"
[[nodiscard]] std::vector<Vec2f> parse_guides(const std::string& text,
                                              const std::string& option);        ///< "0,0 1,0 0.5,1"
[[nodiscard]] char parse_up(const std::string& text, const std::string& option); ///< "y", "+Z"

} // namespace porthole::cli
