#include "porthole/render/adaptive.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "porthole/render/closure.h"

#include "porthole/base/tile_loop.h"
#include "porthole/render/preview.h"

namespace porthole {

namespace {

// What may be inferred. Colours are encoded as files have them, so errors are as the eye sees them.
constexpr float kColorError = 0.012f;   ///< estimated, half way between two traced blocks
constexpr float kDepthError = 1.0f;     ///< the same, pixels
constexpr float kSmooth = 0.9f;         ///< cosine between normals of one surface
constexpr float kFlat = 0.98f;          ///< the same, within a block of which corners tell the rest
constexpr float kLeastRoughness = 0.3f; ///< smoother materials may mirror what is around them

/// Whether colours of a material vary with nothing but geometry and light.
bool is_plain(const Material& m) {
    const auto bare = [](const TextureRef& t) { return t.texture < 0; };
    return bare(m.base_color_texture) && bare(m.metallic_roughness_texture) && bare(m.normal_texture) &&
           bare(m.emissive_texture) && bare(m.occlusion_texture) && bare(m.transmission_texture) &&
           m.transmission == 0 && m.alpha_mode == AlphaMode::opaque && m.roughness >= kLeastRoughness;
}

/// Calls body(tile) for every tile of 64x64 pixels.
template <typename Body> void for_tiles(const Picture& picture, const Control& control, Body&& body) {
    parallel_for_tiles(picture.buffer.window(), FilteredTile::kSize, control, body);
}

float encoded(float v) { return std::sqrt(std::max(v, 0.0f)); }

/// Error at the middle of a gap whose ends have values b and c, where the blocks beside it run
/// from a to b and from c to d: a parabola's, by how far its slope turns.
float middle_error(float a, float b, int ab, float c, float d, int cd, int gap) {
    const float slope = (c - b) / float(gap);
    const float before = ab > 0 ? (b - a) / float(ab) : slope, after = cd > 0 ? (d - c) / float(cd) : slope;
    return 0.25f * float(gap) * std::max(std::abs(before - slope), std::abs(after - slope));
}

/// One picture being refined. A loop that is stopped goes on when run again: items it has done
/// either show that or are the same when done again.
class Refinement {
public:
    Refinement(Picture& picture, const Stage& stage, bool everything)
        : picture_(picture), stage_(stage), everything_(everything), map_(picture), lone_(lone_blocks(picture, map_)) {
        for (const Material& m : stage.scene.materials) plain_.push_back(is_plain(m));
    }

    /// Goes on up to what a preview needs: the lattice of kPreviewLevel.
    void run_to_preview(const Control& control) { run(3 * kPreviewLevel + 2, control); }
    void run_to_end(const Control& control) { run(kSteps, control); }
    [[nodiscard]] const BlockMap& map() const { return map_; }

private:
    void run(int end, const Control& control);
    void take_step();
    void trace(std::span<const Vec2i> blocks, bool corners);
    void summarise(int bx, int by, bool corners);
    void color_corners(int bx, int by);
    void assume_level(int level);
    void trace_level(int level);
    [[nodiscard]] bool is_lone(int level, int bx, int by) const;
    [[nodiscard]] bool is_open(int level, int bx, int by) const;
    void trace_differing();
    void assume(int bx, int by, int level);
    void decide_cells(int level);
    [[nodiscard]] BlockMap::Cell agreement(int level, Vec2i a, Vec2i b) const;
    [[nodiscard]] bool is_straight(Vec2i a, Vec2i b) const;
    void settle_cells();
    void trace_blocks(std::span<const Vec2i> blocks);
    void follow();
    [[nodiscard]] std::vector<Vec2i> traced_blocks() const;
    void take_light();
    bool light_fits(int bx, int by);
    void settle();
    void infer_surface(int bx, int by, bool light);
    void infer_normal(const Surrounding& around, int x, int y);
    Picture& picture_;
    const Stage& stage_;
    bool everything_;
    Control control_;
    BlockMap map_;
    Mask lone_;                       ///< lone_blocks()
    std::vector<std::uint8_t> plain_; ///< by material
    static constexpr int kSteps = 3 * LatticeAxis::kLevels + 8;
    int next_ = 0;             ///< step
    std::vector<Vec2i> front_; ///< from where it is followed on
    TileLoop loop_;
};

void Refinement::run(int end, const Control& control) {
    control_ = control;
    for (; next_ < end; ++next_) take_step();
    control_ = {};
}

void Refinement::take_step() {
    if (const int level = next_ / 3; level < LatticeAxis::kLevels) {
        if (next_ % 3 == 0) return assume_level(level);
        return next_ % 3 == 1 ? trace_level(level) : decide_cells(level);
    }
    switch (next_ - 3 * LatticeAxis::kLevels) {
    case 0: return settle_cells();
    case 1: return trace_differing();
    case 2: front_ = seed_blocks(picture_, stage_, map_, control_); return;
    case 3: return trace_blocks(front_);
    case 4: front_ = traced_blocks(); return;
    case 5: return follow();
    case 6: return take_light();
    default: return settle();
    }
}

void Refinement::trace(std::span<const Vec2i> blocks, bool corners) {
    if (blocks.empty()) return;
    gather_blocks(picture_, stage_.occlusion, stage_.placements, blocks, true);
    for (const Vec2i b : blocks) {
        map_.state(b.x, b.y) = BlockMap::traced;
        summarise(b.x, b.y, corners);
    }
}

void Refinement::summarise(int bx, int by, bool corners) {
    const GBuffer& buffer = picture_.buffer;
    const Rect r = map_.pixels(bx, by);
    BlockSummary s;
    s.key = buffer.key(r.x0, r.y0);
    s.uniform = s.evenly_lit = true;
    const Pixel& first = buffer.pixels(r.x0, r.y0);
    const auto material = [&](int x, int y) {
        return stage_.scene.mesh_of(buffer.ids.id(x, y)).material_of(buffer.pixels(x, y).triangle);
    };
    float open = 0, all = 0, lamps[3] = {};
    for (int y = r.y0; y < r.y1; ++y)
        for (int x = r.x0; x < r.x1; ++x) {
            const Pixel& p = buffer.pixels(x, y);
            s.uniform = s.uniform && p.has(Pixel::traced) && buffer.key(x, y) == s.key;
            if (!s.uniform) break;
            open += float(p.ambient_open), all += float(p.ambient_all);
            for (int c = 0; c < 3; ++c) {
                lamps[c] += float(p.lamps[c]);
                s.evenly_lit = s.evenly_lit && p.lamps[c] == first.lamps[c];
            }
        }
    if (s.uniform && s.key != GBuffer::kNoKey) {
        const float n = float(r.width() * r.height());
        s.open = open / n, s.all = all / n;
        for (int c = 0; c < 3; ++c) s.lamps[c] = lamps[c] / n;
        s.material = material(r.x0, r.y0);
        const Vec3f normal = unpack_normal(first.normal);
        for (int y = r.y0; y < r.y1; ++y)
            for (int x = r.x0; x < r.x1; ++x)
                s.uniform = s.uniform && material(x, y) == s.material &&
                            dot(unpack_normal(buffer.pixels(x, y).normal), normal) >= kSmooth;
        s.interpolable =
            everything_ && plain_[s.material] != 0 && stage_.scene.mesh_of(buffer.ids.id(r.x0, r.y0)).colors.empty();
    }
    map_.summary(bx, by) = s;
    if (corners && s.uniform && s.interpolable) color_corners(bx, by);
}

/// What the corners of an evenly lit block will look like, near enough to decide by.
void Refinement::color_corners(int bx, int by) {
    const BlockSummary& s = map_.summary(bx, by);
    const Rect r = map_.pixels(bx, by);
    const Reach reach{{s.lamps[0] / 255.0f, s.lamps[1] / 255.0f, s.lamps[2] / 255.0f}, s.ambient()};
    for (const int y : {r.y0, r.y1 - 1})
        for (const int x : {r.x0, r.x1 - 1}) {
            const Hit hit = picture_.buffer.hit(x, y);
            const Vec3f direction = picture_.view.ray(float(x) + 0.5f, float(y) + 0.5f).direction;
            const SurfacePoint point = picture_.camera.surface(stage_.placements, hit, float(x) + 0.5f, float(y) + 0.5f,
                                                               picture_.buffer.ids.depth(x, y), direction);
            const Substance substance = porthole::substance(stage_.scene, stage_.placements[index(hit.part)], hit);
            Radiance radiance;
            if (picture_.params.shading == Shading::flat) {
                radiance.shown = shade_flat(substance, point.normal, -direction);
            } else {
                const Shaded shaded = shade(stage_.lighting, point, point.normal, -direction, substance, reach, true);
                radiance.light = shaded.light, radiance.shown = shaded.shown;
            }
            picture_.color(x, y) = display_color(radiance, picture_.params.background);
        }
    const Vec3f normal = unpack_normal(picture_.buffer.pixels(r.x0, r.y0).normal);
    bool flat = true;
    for (int y = r.y0; y < r.y1; ++y)
        for (int x = r.x0; x < r.x1; ++x)
            flat = flat && dot(unpack_normal(picture_.buffer.pixels(x, y).normal), normal) >= kFlat;
    map_.summary(bx, by).has_corners = flat;
}

/// Calls body(bx, by) for the blocks of a tile.
template <typename Body> void for_blocks(Rect tile, Body&& body) {
    const Rect blocks = blocks_of(tile);
    for (int by = blocks.y0; by < blocks.y1; ++by)
        for (int bx = blocks.x0; bx < blocks.x1; ++bx) body(bx, by);
}

/// Blocks between two of the coarser lattice that agree join this one without being traced.
void Refinement::assume_level(int level) {
    if (level == 0) return;
    // Before any is traced: of the two that agree one may have been assumed, and be traced now.
    for_tiles(picture_, control_, [&](Rect tile) {
        for_blocks(tile, [&](int bx, int by) {
            if (map_.state(bx, by) != BlockMap::wanted || is_lone(level, bx, by)) return;
            if (is_open(level, bx, by) && map_.between_two(level - 1, bx, by) == BlockMap::one_color)
                assume(bx, by, level - 1);
        });
    });
}

void Refinement::trace_level(int level) {
    for_tiles(picture_, control_, [&](Rect tile) {
        std::vector<Vec2i> todo;
        for_blocks(tile, [&](int bx, int by) {
            if (map_.state(bx, by) != BlockMap::wanted) return;
            const bool assumed = level > 0 && map_.between_two(level - 1, bx, by) == BlockMap::one_color;
            if (is_lone(level, bx, by) || (is_open(level, bx, by) && !assumed)) todo.push_back({bx, by});
        });
        trace(todo, true);
    });
}

bool Refinement::is_lone(int level, int bx, int by) const { return level == kPreviewLevel && lone_(bx, by); }

/// Whether a block is of a lattice and not settled by the coarser one.
bool Refinement::is_open(int level, int bx, int by) const {
    return map_.columns.on_lattice(level, bx) && map_.rows.on_lattice(level, by) &&
           (level == 0 || map_.allowed(level - 1, bx, by) == BlockMap::differs);
}

void Refinement::trace_differing() {
    for_tiles(picture_, control_, [&](Rect tile) {
        std::vector<Vec2i> todo;
        for_blocks(tile, [&](int bx, int by) {
            if (map_.state(bx, by) == BlockMap::wanted && map_.allows(bx, by) == BlockMap::differs)
                todo.push_back({bx, by});
        });
        trace(todo, false);
    });
}

void Refinement::assume(int bx, int by, int level) {
    map_.level(bx, by) = std::uint8_t(level);
    map_.allows(bx, by) = BlockMap::one_color;
    const Surrounding around(map_, bx, by);
    const Rect r = map_.pixels(bx, by);
    BlockSummary s = map_.summary(around.block[0].x, around.block[0].y);
    const auto mix = [&](auto&& value) { return around.mix_blocks(map_, r.x0, r.y0, value); };
    s.open = mix([](const BlockSummary& b) { return b.open; });
    s.all = mix([](const BlockSummary& b) { return b.all; });
    for (int c = 0; c < 3; ++c) s.lamps[c] = mix([c](const BlockSummary& b) { return b.lamps[c]; });
    map_.summary(bx, by) = s;
    if (s.key == GBuffer::kNoKey) return;
    infer_surface(bx, by, false);
    for (const int y : {r.y0, r.y1 - 1})
        for (const int x : {r.x0, r.x1 - 1}) {
            infer_normal(around, x, y);
            picture_.color(x, y) = around.mix(x, y, [&](int cx, int cy) { return picture_.color(cx, cy); });
        }
}

void Refinement::decide_cells(int level) {
    const LatticeAxis &columns = map_.columns, &rows = map_.rows;
    Mask &across = map_.across[level], &down = map_.down[level], &cells = map_.cells[level];
    parallel_for(std::size_t(rows.blocks(level)), control_, [&](std::size_t k) {
        const int row = int(k), by = rows.block(level, row);
        for (int cx = 0; cx < across.width(); ++cx) {
            const auto [left, right] = columns.cell(level, cx);
            across(cx, row) = agreement(level, {left, by}, {right, by});
        }
        if (row >= rows.cells(level)) return;
        const auto [top, bottom] = rows.cell(level, row);
        for (int column = 0; column < down.width(); ++column) {
            const int bx = columns.block(level, column);
            down(column, row) = agreement(level, {bx, top}, {bx, bottom});
        }
    });
    parallel_for(std::size_t(cells.height()), control_, [&](std::size_t k) {
        const int cy = int(k), below = std::min(cy + 1, across.height() - 1);
        for (int cx = 0; cx < cells.width(); ++cx) {
            const int right = std::min(cx + 1, down.width() - 1);
            const std::uint8_t parent = level > 0
                                            ? map_.cells[level - 1](columns.parent(level, cx), rows.parent(level, cy))
                                            : std::uint8_t(BlockMap::differs);
            cells(cx, cy) = parent != BlockMap::differs
                                ? parent
                                : std::min({across(cx, cy), across(cx, below), down(cx, cy), down(right, cy)});
        }
    });
}

/// Which lattice the blocks that are not traced yet follow from, and how far.
void Refinement::settle_cells() {
    const Rect area = map_.area();
    parallel_for(std::size_t(area.height()), control_, [&](std::size_t row) {
        const int by = area.y0 + int(row);
        for (int bx = area.x0; bx < area.x1; ++bx) {
            if (map_.state(bx, by) != BlockMap::wanted || map_.allows(bx, by) != BlockMap::differs) continue;
            for (int level = 0; level < LatticeAxis::kLevels; ++level) {
                const BlockMap::Cell cell = map_.allowed(level, bx, by);
                if (cell == BlockMap::differs) continue;
                map_.level(bx, by) = std::uint8_t(level);
                map_.allows(bx, by) = cell;
                break;
            }
        }
    });
}

BlockMap::Cell Refinement::agreement(int level, Vec2i a, Vec2i b) const {
    const BlockSummary &sa = map_.summary(a.x, a.y), &sb = map_.summary(b.x, b.y);
    if (!sa.uniform || !sb.uniform || sa.key != sb.key || sa.material != sb.material) return BlockMap::differs;
    if (sa.key == GBuffer::kNoKey) return everything_ ? BlockMap::one_color : BlockMap::one_light;
    if (!sa.evenly_lit || !sb.evenly_lit || std::abs(sa.ambient() - sb.ambient()) > kAmbientStep)
        return BlockMap::differs;
    for (int c = 0; c < 3; ++c)
        if (std::abs(sa.lamps[c] - sb.lamps[c]) > 255.0f * kLampStep) return BlockMap::differs;
    if (!sa.interpolable) return BlockMap::one_light;
    if (is_straight(a, b)) return BlockMap::one_color;
    // Nearer blocks may be straight.
    return level == LatticeAxis::kFinest ? BlockMap::one_light : BlockMap::differs;
}

/// Whether colour and depth run so straight from block to block that what lies between can be
/// interpolated.
bool Refinement::is_straight(Vec2i a, Vec2i b) const {
    const Rect ra = map_.pixels(a.x, a.y), rb = map_.pixels(b.x, b.y);
    const bool across = a.y == b.y;
    const int gap = across ? rb.x0 - (ra.x1 - 1) : rb.y0 - (ra.y1 - 1);
    if (gap <= 1) return true;
    const auto line = [&](int i) -> std::array<Vec2i, 4> {
        if (across) {
            const int y = i == 0 ? ra.y0 : ra.y1 - 1;
            return {Vec2i{ra.x0, y}, {ra.x1 - 1, y}, {rb.x0, y}, {rb.x1 - 1, y}};
        }
        const int x = i == 0 ? ra.x0 : ra.x1 - 1;
        return {Vec2i{x, ra.y0}, {x, ra.y1 - 1}, {x, rb.y0}, {x, rb.y1 - 1}};
    };
    const int in_a = across ? ra.width() - 1 : ra.height() - 1, in_b = across ? rb.width() - 1 : rb.height() - 1;
    const IdBuffer& ids = picture_.buffer.ids;
    const bool parallel = picture_.view.orthographic;
    for (const int i : {0, 1}) {
        const std::array<Vec2i, 4> p = line(i);
        const Vec3f na = unpack_normal(picture_.buffer.pixels(p[1].x, p[1].y).normal);
        const Vec3f nb = unpack_normal(picture_.buffer.pixels(p[2].x, p[2].y).normal);
        if (dot(na, nb) < kSmooth) return false;
        const auto error = [&](auto&& value) {
            return middle_error(value(p[0]), value(p[1]), in_a, value(p[2]), value(p[3]), in_b, gap);
        };
        // On a plane it is the reciprocal that runs straight, but for parallel rays.
        const float z = ids.depth(p[1].x, p[1].y);
        const float bend = error([&](Vec2i q) { return parallel ? ids.depth(q.x, q.y) : z / ids.depth(q.x, q.y); });
        if (!(bend * (parallel ? 1.0f : z) <= kDepthError * picture_.view.pixel_size(z))) return false;
        const auto color = [&](Vec2i q) { return picture_.color(q.x, q.y); };
        if (!(error([&](Vec2i q) { return encoded(color(q).x); }) <= kColorError)) return false;
        if (!(error([&](Vec2i q) { return encoded(color(q).y); }) <= kColorError)) return false;
        if (!(error([&](Vec2i q) { return encoded(color(q).z); }) <= kColorError)) return false;
    }
    return true;
}

/// Each once, in an order in which neighbours lie close.
void Refinement::trace_blocks(std::span<const Vec2i> blocks) {
    constexpr std::size_t kRun = 64;
    parallel_for((blocks.size() + kRun - 1) / kRun, control_, [&](std::size_t run) {
        const auto part = blocks.subspan(run * kRun, std::min(kRun, blocks.size() - run * kRun));
        // Runs are traced as a whole; only the one that traces a block writes its state.
        if (map_.state(part[0].x, part[0].y) == BlockMap::wanted) trace(part, false);
    });
}

/// Round by round: what a block shows of another may change as those it follows from are traced.
void Refinement::follow() {
    while (!front_.empty()) {
        trace_blocks(front_);
        front_ = contradicted_by(picture_, map_, front_, control_);
    }
}

std::vector<Vec2i> Refinement::traced_blocks() const {
    std::vector<Vec2i> blocks;
    const Rect area = map_.area();
    for (int by = area.y0; by < area.y1; ++by)
        for (int bx = area.x0; bx < area.x1; ++bx)
            if (map_.state(bx, by) == BlockMap::traced) blocks.push_back({bx, by});
    return blocks;
}

/// Camera rays of the blocks whose light alone is inferred; light too where it does not fit.
void Refinement::take_light() {
    loop_.run(map_.window, FilteredTile::kSize, control_, [&](Rect tile) {
        std::vector<Vec2i> todo, misfits;
        const Rect area = blocks_of(tile);
        for (int by = area.y0; by < area.y1; ++by)
            for (int bx = area.x0; bx < area.x1; ++bx)
                if (map_.state(bx, by) == BlockMap::wanted && map_.allows(bx, by) == BlockMap::one_light)
                    todo.push_back({bx, by});
        gather_blocks(picture_, stage_.occlusion, stage_.placements, todo, false);
        for (const Vec2i b : todo)
            if (!light_fits(b.x, b.y)) misfits.push_back(b);
        // State and summary of blocks are not written here: other tiles still look at them.
        gather_blocks(picture_, stage_.occlusion, stage_.placements, misfits, true);
    });
}

/// Whether the pixels of a block see the surface that the lattice's corners see; if so they
/// take their light.
bool Refinement::light_fits(int bx, int by) {
    GBuffer& buffer = picture_.buffer;
    const Rect r = map_.pixels(bx, by);
    const Surrounding around(map_, bx, by);
    for (int y = r.y0; y < r.y1; ++y)
        for (int x = r.x0; x < r.x1; ++x) {
            const int left = around.left_of(x), right = around.right_of(x);
            const int top = around.top_of(y), bottom = around.bottom_of(y);
            const std::uint32_t key = buffer.key(left, top);
            const Pixel& p = buffer.pixels(x, y);
            if (!p.has(Pixel::traced) || buffer.key(x, y) != key) return false;
            if (key == GBuffer::kNoKey) continue;
            const Vec3f normal = unpack_normal(p.normal);
            const auto off = [&](int cx, int cy) {
                return dot(unpack_normal(buffer.pixels(cx, cy).normal), normal) < kSmooth;
            };
            if (off(left, top) || off(right, top) || off(left, bottom) || off(right, bottom)) return false;
        }
    for (int y = r.y0; y < r.y1; ++y)
        for (int x = r.x0; x < r.x1; ++x) buffer.pixels(x, y).flags |= Pixel::inferred;
    infer_surface(bx, by, true);
    return true;
}

void Refinement::infer_normal(const Surrounding& around, int x, int y) {
    SparseImage<Pixel>& pixels = picture_.buffer.pixels;
    const auto normal = [&](int cx, int cy) { return unpack_normal(pixels(cx, cy).normal); };
    pixels(x, y).normal = pack_normal(normalize(around.mix(x, y, normal), normal(around.left_of(x), around.top_of(y))));
}

/// What pixels of a block take from the lattice: their surface unless it is traced, and their light.
void Refinement::infer_surface(int bx, int by, bool light) {
    GBuffer& buffer = picture_.buffer;
    const Rect r = map_.pixels(bx, by);
    const Surrounding around(map_, bx, by);
    const PartId id = buffer.ids.id(around.left_of(r.x0), around.top_of(r.y0));
    if (id == kNoPart) return; // as the buffer is
    const bool surface = map_.allows(bx, by) == BlockMap::one_color;
    const bool parallel = picture_.view.orthographic;
    if (surface)
        around.mix_all(
            r, [&](int x, int y) { return parallel ? buffer.ids.depth(x, y) : 1.0f / buffer.ids.depth(x, y); },
            [&](int x, int y, float d) {
                buffer.ids.id(x, y) = id;
                buffer.ids.depth(x, y) = parallel ? d : 1.0f / d;
            });
    if (!light) return;
    for (int y = r.y0; y < r.y1; ++y)
        for (int x = r.x0; x < r.x1; ++x) {
            Pixel& p = buffer.pixels(x, y);
            if (surface) infer_normal(around, x, y);
            const auto rounded = [&](auto&& value) { return std::lround(around.mix_blocks(map_, x, y, value)); };
            p.ambient_open = std::uint16_t(rounded([](const BlockSummary& s) { return s.open; }));
            p.ambient_all = std::uint16_t(rounded([](const BlockSummary& s) { return s.all; }));
            for (int c = 0; c < 3; ++c)
                p.lamps[c] = std::uint8_t(rounded([c](const BlockSummary& s) { return s.lamps[c]; }));
            buffer.light(x, y) = PixelLight(p.reach());
        }
}

/// Traced blocks that stand alone on a smooth surface take the mean of their own light, so that
/// it has no grain; blocks that are inferred get their surface, and light if anyone looks for it.
void Refinement::settle() {
    const Rect area = map_.area();
    const auto any_around = [&](int bx, int by, auto&& is) {
        for (int y = std::max(by - 1, area.y0); y < std::min(by + 2, area.y1); ++y)
            for (int x = std::max(bx - 1, area.x0); x < std::min(bx + 2, area.x1); ++x)
                if (is(x, y)) return true;
        return false;
    };
    const auto for_all = [&](auto&& body) {
        for_tiles(picture_, control_, [&](Rect tile) { for_blocks(tile, body); });
    };
    Mask alone(area);
    for_all([&](int bx, int by) {
        if (!map_.is_traced(bx, by)) return;
        const BlockSummary& s = map_.summary(bx, by);
        if (!s.uniform || !s.evenly_lit) return;
        if (!any_around(bx, by, [&](int x, int y) { return map_.state(x, y) == BlockMap::wanted; })) return;
        alone(bx, by) = 1;
        const Rect r = map_.pixels(bx, by);
        for (int y = r.y0; y < r.y1; ++y)
            for (int x = r.x0; x < r.x1; ++x) {
                Pixel& p = picture_.buffer.pixels(x, y);
                p.flags |= Pixel::inferred;
                p.ambient_open = std::uint16_t(std::lround(s.open));
                p.ambient_all = std::uint16_t(std::lround(s.all));
            }
    });
    for_all([&](int bx, int by) {
        if (alone(bx, by)) map_.state(bx, by) = BlockMap::settled;
    });
    // What follows from the finer lattices may follow from what follows from the coarser ones.
    for (int level = 0; level < LatticeAxis::kLevels; ++level)
        for_all([&](int bx, int by) {
            if (!map_.is_inferred(bx, by) || map_.level(bx, by) != level) return;
            infer_surface(bx, by, any_around(bx, by, [&](int x, int y) {
                              return map_.state(x, y) == BlockMap::traced ||
                                     (map_.state(x, y) == BlockMap::wanted && !map_.is_inferred(x, y));
                          }));
        });
}

} // namespace

struct AdaptiveGather::Work {
    Refinement refinement;
};

AdaptiveGather::AdaptiveGather(Picture& picture, const Stage& stage, bool everything)
    : work_(new Work{Refinement(picture, stage, everything)}) {}
AdaptiveGather::~AdaptiveGather() = default;
void AdaptiveGather::trace_lattice(const Control& control) { work_->refinement.run_to_preview(control); }
void AdaptiveGather::trace_rest(const Control& control) { work_->refinement.run_to_end(control); }
const BlockMap& AdaptiveGather::map() const { return work_->refinement.map(); }

} // namespace porthole
