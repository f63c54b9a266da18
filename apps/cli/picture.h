// Pictures and reports on their way to files.
#pragma once

#include "options.h"

namespace porthole::cli {

/// Whether a file of this name is written as JPEG.
[[nodiscard]] bool is_jpeg(const std::string& path);

/// @throws Error limit E0901 when a picture of this size does not fit into the memory allowed.
void check_size(Vec2i size, std::uint64_t max_memory, const std::string& where);

/// Whether anybody is going to read the report.
[[nodiscard]] bool asks_for_report(const PictureOptions& options);

/// Finds out before the work whether its results can be written: extensions, folders,
/// --no-clobber, and whether two of them share standard output or a file.
/// @throws Error usage E0106, E0107; output E0801, E0804; limit E0901 when the picture's size
///         does not fit into the memory allowed.
void check_outputs(const PictureOptions& options, std::uint64_t max_memory);

/// `frame` as the bytes of a file whose kind the output's extension says.
[[nodiscard]] std::vector<std::byte> encode_picture(const Frame& frame, const PictureOptions& options,
                                                    const Control& control);

/// Writes `frame` and says in `report` what was written where.
/// @throws Error output E08xx.
void write_picture(const Frame& frame, const PictureOptions& options, PictureReport& report, const Control& control);

/// One line on how a refined picture compares with the full one.
[[nodiscard]] std::string summary(const RefinementReport& report, Refine refine);

/// The report to --report and --json, whichever were asked for. @throws Error output E08xx.
void write_report(const Report& report, const PictureOptions& options);

} // namespace porthole::cli
