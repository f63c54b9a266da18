// The statements of a Wavefront OBJ file, read in one pass; obj.cpp makes a scene of them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "porthole/base/parallel.h"
#include "porthole/io/load.h"
#include "porthole/io/reader.h"

namespace porthole {

/// Indices from 0; -1: not given. They may lie beyond the arrays: faces may come first.
struct ObjCorner {
    std::int32_t v = -1, vt = -1, vn = -1;
};

/// Faces from `first_face` to the next run's, all of one part and material.
struct ObjRun {
    std::uint32_t first_face = 0;
    std::uint32_t part = 0;     ///< index into ObjData::parts
    std::uint32_t material = 0; ///< index into ObjData::materials
};

struct ObjPart {
    std::int32_t object = -1; ///< index into ObjData::objects; -1: before any `o`
    std::string group;
};

struct ObjData {
    std::vector<Vec3f> positions; ///< not finite where the line could not be read
    std::vector<Vec4f> colors;    ///< linear; empty, or as many as positions
    std::vector<Vec2f> uvs;       ///< v upwards, as in the file
    std::vector<Vec3f> normals;   ///< of any length
    std::vector<ObjCorner> corners;
    std::vector<std::uint32_t> face_end; ///< per face, the end of its corners
    std::vector<ObjRun> runs;
    std::vector<std::string> objects;   ///< names, raw bytes
    std::vector<ObjPart> parts;         ///< in the order of their first faces
    std::vector<std::string> materials; ///< names that usemtl gave, raw bytes; [0]: none given
    std::vector<std::uint64_t> material_line;
    std::vector<std::pair<std::string, std::uint64_t>> libraries; ///< mtllib's text and line
    std::vector<std::pair<std::uint32_t, std::uint64_t>> early;   ///< faces (and lines) that name vertices yet to come
    std::uint64_t face_statements = 0, known_statements = 0;
    Fault bad_vertices, bad_faces, huge_faces, bad_references, unknown, not_drawn, commands;

    [[nodiscard]] std::uint64_t bytes() const;                     ///< memory held
    [[nodiscard]] std::uint64_t line_of(std::uint32_t face) const; ///< 0 if not among `early`
};

/// @throws Error limit E0902, E0904; Cancelled.
[[nodiscard]] ObjData parse_obj(std::string_view text, const std::string& path, const LoadParams& params,
                                const Control& control);

} // namespace porthole
