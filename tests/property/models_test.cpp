// Promises that must hold on real models, from seeded random directions.
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <random>

#include "porthole/base/tone.h"
#include "porthole/hole/distance.h"
#include "porthole/io/image_file.h"
#include "porthole/io/load.h"
#include "porthole/plan.h"
#include "porthole/reveal.h"
#include "porthole/scene/camera.h"
#include "porthole/scene/select.h"
#include "porthole/viewpoint.h"
#include "support/direction.h"
#include "support/shapes.h"
#include "support/shared.h"

namespace porthole {
namespace {

struct Model {
    const char* file;
    std::vector<std::string> targets; ///< many at once, thin ones among them
};

std::ostream& operator<<(std::ostream& out, const Model& model) { return out << model.file; }

const Model kModels[] = {
    {"assembly/2CylinderEngine.glb", {"rod_123-699*", "Spring_Link*", "body_11", "Piston*"}},
    {"assembly/ReciprocatingSaw.glb", {"body_6*", "body_7*", "body_21"}},
    {"assembly/MosquitoInAmber.glb", {"2_mosquito*", "6_eclats*"}},
    {"medical/head_brain_mri.glb", {"Hippocampus_*", "Amygdala_*", "Thalamus_*"}},
    {"assembly/vh_male_body.glb", {"VH_M_heart_left_ventricle", "VH_M_mitral_valve", "VH_M_renal_pyramid_L_*"}},
    {"assembly/FZK_Haus.glb", {"IfcMappedItem_node_7", "IfcMappedItem_node_8", "*Wand-Int-ERDG-1_*"}},
    {"assembly/virtual_worm.glb", {"avar", "aval", "hsnl", "int5l", "pm5d", "oocyte_ant_1"}},
};

// Under a sanitizer a tenth of the directions is as much as time allows, and the dearest model, the
// last one, is left out.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int kDirections = 3;
constexpr std::size_t kTried = std::size(kModels) - 1;
#else
constexpr int kDirections = 32;
constexpr std::size_t kTried = std::size(kModels);
#endif

std::vector<Vec3f> random_directions(int count, std::uint32_t seed) {
    std::mt19937 random(seed);
    std::normal_distribution<float> normal;
    std::vector<Vec3f> directions;
    for (int i = 0; i < count; ++i)
        directions.push_back(normalize(Vec3f{normal(random), normal(random), normal(random)}));
    return directions;
}

std::vector<std::byte> png_of(const Frame& frame) { return encode_png(to_srgb8(frame.color, {1, 1, 1}, false), 3); }

/// The opened picture as a plan's cut makes it.
Frame drawn(const Subject& subject, const ViewPlan& plan, const RenderParams& look, const Control& control = {}) {
    Frame plain = render(subject.whole, nullptr, plan.view, look, nullptr, nullptr, control);
    if (plan.cut.empty()) return plain;
    const Bvh opened = build_bvh(*subject.meshes, all_parts(subject.scene()), plan.cut.role);
    const Bvh targets = build_bvh(*subject.meshes, plan.opened);
    return render(opened, &targets, plan.view, look, &plan.cut, &plain, control);
}

/// Contour pixels that OpenCV's border following finds, on a mask padded so that the window's
/// edge makes no border.
Mask opencv_contour(const Image<PartId>& ids) {
    const Rect w = ids.window();
    cv::Mat mask(w.height() + 2, w.width() + 2, CV_8U, cv::Scalar(0));
    for (int y = -1; y <= w.height(); ++y)
        for (int x = -1; x <= w.width(); ++x) {
            const int cx = std::clamp(x, 0, w.width() - 1), cy = std::clamp(y, 0, w.height() - 1);
            mask.at<std::uint8_t>(y + 1, x + 1) = ids(w.x0 + cx, w.y0 + cy) != kNoPart ? 255 : 0;
        }
    std::vector<std::vector<cv::Point>> chains;
    cv::findContours(mask, chains, cv::RETR_LIST, cv::CHAIN_APPROX_NONE);
    Mask contour(w, 0);
    for (const auto& chain : chains)
        for (const cv::Point p : chain)
            if (contour.contains(w.x0 + p.x - 1, w.y0 + p.y - 1)) contour(w.x0 + p.x - 1, w.y0 + p.y - 1) = 1;
    return contour;
}

class Models : public testing::TestWithParam<Model> {};

TEST_P(Models, ExactEqualsFullFromRandomDirections) {
    PORTHOLE_NEEDS_SHARED(shared);
    const Scene scene = load_scene((shared / "models" / GetParam().file).string());
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    const std::vector<PartId> targets = select_parts(scene, GetParam().targets);
    const Subject subject = make_subject(meshes, targets);
    const FrameSubject framing = frame_subject(scene, targets);
    const RenderParams look{.samples = 2, .ao_samples = 1};

    int opened = 0, thin = 0;
    for (const Vec3f direction : random_directions(kDirections, 20261122)) {
        const View view = view_from_direction(framing, direction, {}, 240, 135);
        const ViewPlan exact = plan_view(subject, view);
        const ViewPlan full = plan_view(subject, view, {.contours = ContourMethod::full});
        ASSERT_EQ(exact.target_ids, full.target_ids);
        ASSERT_EQ(exact.contours.size(), full.contours.size());
        for (std::size_t i = 0; i < exact.contours.size(); ++i)
            ASSERT_EQ(exact.contours[i].pixels, full.contours[i].pixels);
        ASSERT_EQ(exact.hole.mask, full.hole.mask);
        ASSERT_EQ(exact.hole.distance, full.hole.distance);
        ASSERT_EQ(exact.cut.levels, full.cut.levels);
        ASSERT_EQ(exact.cut.loose_depth, full.cut.loose_depth);
        ASSERT_EQ(drawn(subject, exact, look).color, drawn(subject, full, look).color);
        opened += !exact.cut.empty();
        for (const TargetView& t : exact.targets) thin += t.thin && !t.absent;

        if (exact.opened.empty()) continue;
        Mask ours(exact.window, 0);
        for (const Vec2i p : contour_pixels(exact.contours)) ours(p.x, p.y) = 1;
        // On the window's own edge the padding decides; inside it both must agree.
        const Mask theirs = opencv_contour(exact.target_ids.id);
        const Rect inner = exact.window.grown(-1);
        for (int y = inner.y0; y < inner.y1; ++y)
            for (int x = inner.x0; x < inner.x1; ++x) ASSERT_EQ(ours(x, y), theirs(x, y)) << x << ',' << y;
    }
    RecordProperty("opened", opened);
    RecordProperty("thin", thin);
    EXPECT_GT(opened, 0);
}

TEST_P(Models, FastContoursAreAlmostRight) {
    PORTHOLE_NEEDS_SHARED(shared);
    const Scene scene = load_scene((shared / "models" / GetParam().file).string());
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    const std::vector<PartId> targets = select_parts(scene, GetParam().targets);
    const Subject subject = make_subject(meshes, targets);
    const FrameSubject framing = frame_subject(scene, targets);
    const auto pixels = [&](const View& view, ContourMethod method, int threads, std::int64_t& rays) {
        const TargetContours found = find_target_contours(subject, view, method, test::with_threads(threads));
        rays += found.rays;
        return contour_pixels(found.contours);
    };
    const auto before = [](Vec2i a, Vec2i b) { return a.y != b.y ? a.y < b.y : a.x < b.x; };

    std::int64_t all = 0, missed = 0, added = 0, full_rays = 0, exact_rays = 0, fast_rays = 0, ignored = 0;
    int k = 0;
    for (const Vec3f direction : random_directions(kDirections, 20261123)) {
        const View view = view_from_direction(framing, direction, {}, 640, 360);
        const std::vector<Vec2i> full = pixels(view, ContourMethod::full, 2, full_rays);
        ASSERT_EQ(pixels(view, ContourMethod::exact, 1 + k % 3, exact_rays), full);
        const std::vector<Vec2i> fast = pixels(view, ContourMethod::fast, 1 + k++ % 3, fast_rays);
        ASSERT_EQ(pixels(view, ContourMethod::fast, 7, ignored), fast);
        std::vector<Vec2i> right;
        std::set_intersection(fast.begin(), fast.end(), full.begin(), full.end(), std::back_inserter(right), before);
        all += std::int64_t(full.size()), missed += std::int64_t(full.size() - right.size());
        added += std::int64_t(fast.size() - right.size());

        // In a plan every id comes from a ray: what is there is right, what is missed is nothing.
        if (k > 4) continue;
        const IdBuffer exact_ids = plan_view(subject, view).target_ids;
        const IdBuffer fast_ids = plan_view(subject, view, {.contours = ContourMethod::fast}).target_ids;
        ASSERT_EQ(exact_ids.window(), fast_ids.window());
        for (std::size_t i = 0; i < fast_ids.id.pixels().size(); ++i)
            if (fast_ids.id.pixels()[i] != kNoPart) {
                ASSERT_EQ(fast_ids.id.pixels()[i], exact_ids.id.pixels()[i]);
                ASSERT_EQ(fast_ids.depth.pixels()[i], exact_ids.depth.pixels()[i]);
            }
    }
    RecordProperty("contour_pixels", int(all));
    RecordProperty("missed", int(missed));
    RecordProperty("added", int(added));
    RecordProperty("rays_full_exact_fast",
                   std::to_string(full_rays) + ' ' + std::to_string(exact_rays) + ' ' + std::to_string(fast_rays));
    EXPECT_LE(fast_rays, exact_rays);
    EXPECT_LT(exact_rays, full_rays / 4);
    EXPECT_LE(double(missed + added), 0.001 * double(all));
}

TEST_P(Models, ClearanceAgreesWithOpenCv) {
    PORTHOLE_NEEDS_SHARED(shared);
    const Scene scene = load_scene((shared / "models" / GetParam().file).string());
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    const std::vector<PartId> targets = select_parts(scene, GetParam().targets);
    const Subject subject = make_subject(meshes, targets);
    const View view = view_from_direction(frame_subject(scene, targets), {1.0f, 0.8f, 1.0f}, {}, 480, 270);
    const ViewPlan plan = plan_view(subject, view, {.tight = Tight::open});
    ASSERT_FALSE(plan.hole.empty());

    const Rect w = plan.enclosing.window();
    cv::Mat inside(w.height(), w.width(), CV_8U), distance;
    bool any_outside = false;
    for (int y = 0; y < w.height(); ++y)
        for (int x = 0; x < w.width(); ++x) {
            const bool e = plan.enclosing(w.x0 + x, w.y0 + y) != 0;
            inside.at<std::uint8_t>(y, x) = e ? 255 : 0;
            any_outside |= !e;
        }
    cv::distanceTransform(inside, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
    for (const BandPixel& c : plan.hole.band) {
        if (!any_outside) {
            ASSERT_EQ(c.clearance_px, kInfinity);
            continue;
        }
        const float theirs = distance.at<float>(c.pixel.y - w.y0, c.pixel.x - w.x0);
        ASSERT_NEAR(c.clearance_px, theirs, 1e-3f * std::max(1.0f, theirs));
    }
}

TEST_P(Models, ThePapersRefinementComesCloseAndMeasuresTracedIdsAlone) {
    PORTHOLE_NEEDS_SHARED(shared);
    const Scene scene = load_scene((shared / "models" / GetParam().file).string());
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    RevealParams params;
    params.targets = select_parts(scene, GetParam().targets);
    params.camera.name = "iso";
    params.width = 480, params.height = 270;
    params.plan.tight = Tight::open;
    const auto refined = [&](Refine refine) {
        params.render.refine = refine;
        params.compare_full = refine != Refine::full;
        return reveal(meshes, params);
    };
    const Revealed full = refined(Refine::full);
    for (const Refine refine : {Refine::paper1, Refine::paper2, Refine::expansion}) {
        const Revealed found = refined(refine);
        const Refinement& figures = found.report.refinement->figures;
        EXPECT_GT(figures.psnr_db(), 20);
        EXPECT_LT(figures.wrong_ids, figures.pixels / 50);
        EXPECT_LT(figures.traced, figures.pixels);
        EXPECT_LE(figures.rays.primary, figures.full_rays.primary);
        // Whatever was inferred, the report says what full tracing finds.
        for (std::size_t i = 0; i < full.frame.ids.id.pixels().size(); ++i) {
            const float depth = full.frame.ids.depth.pixels()[i];
            if (found.frame.ids.id.pixels()[i] != full.frame.ids.id.pixels()[i]) // two surfaces at one depth
                ASSERT_NEAR(found.frame.ids.depth.pixels()[i], depth, 1e-5f * depth);
            else
                ASSERT_TRUE(found.frame.ids.depth.pixels()[i] == depth ||
                            std::abs(found.frame.ids.depth.pixels()[i] - depth) < 1e-5f * depth);
        }
        EXPECT_TRUE(found.frame.inferred.empty());
        for (std::size_t i = 0; i < full.report.targets.size(); ++i) {
            EXPECT_EQ(found.report.targets[i].visible_before, full.report.targets[i].visible_before);
            EXPECT_EQ(found.report.targets[i].visible_after, full.report.targets[i].visible_after);
            EXPECT_EQ(found.report.targets[i].ring_mean, full.report.targets[i].ring_mean);
        }
        EXPECT_EQ(found.report.picture.outline_iou, full.report.picture.outline_iou);
        EXPECT_EQ(found.report.picture.context_removed, full.report.picture.context_removed);
        EXPECT_EQ(found.report.picture.wall_visible, full.report.picture.wall_visible);
        EXPECT_EQ(found.report.picture.parts_lost, full.report.picture.parts_lost);
    }
}

TEST_P(Models, SamePictureForAnyThreadsOrderOfPartsAndDuplicates) {
    PORTHOLE_NEEDS_SHARED(shared);
    const std::string file = (shared / "models" / GetParam().file).string();
    Scene scene = load_scene(file);
    const auto picture = [&](const Scene& s, int threads) {
        const Control control = test::with_threads(threads);
        const MeshBvhs meshes = build_mesh_bvhs(s, {}, control);
        RevealParams params;
        params.targets = select_parts(s, GetParam().targets);
        params.camera.name = "iso";
        params.width = 320, params.height = 180;
        params.plan.tight = Tight::open;
        const Revealed revealed = reveal(meshes, params, control);
        return png_of(revealed.frame);
    };
    const std::vector<std::byte> first = picture(scene, 2);
    for (const int threads : {1, 2, 7}) EXPECT_EQ(first, picture(scene, threads)) << threads << " threads";

    // The part that hides most, once more in the same place.
    Scene twice = load_scene(file);
    twice.parts.push_back(twice.parts[0]);
    twice.parts.back().path += "[copy]";
    twice.parts.back().name += "[copy]";
    EXPECT_EQ(first, picture(twice, 2)) << "a part duplicated in place";

    Scene shuffled = load_scene(file);
    std::mt19937 random(5);
    std::shuffle(shuffled.parts.begin(), shuffled.parts.end(), random);
    EXPECT_EQ(first, picture(shuffled, 2)) << "parts in another order";
}

TEST_P(Models, AutomaticCameraIsThatOfWeighingEveryCandidate) {
    PORTHOLE_NEEDS_SHARED(shared);
    const Scene scene = load_scene(shared / "models" / GetParam().file);
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    const std::vector<std::string>& selectors = GetParam().targets;
    for (const std::size_t n : {std::size_t{1}, selectors.size()}) {
        const std::vector<PartId> targets = select_parts(scene, std::span(selectors).first(n));
        const Subject subject = make_subject(meshes, targets);
        const FrameSubject frame = frame_subject(scene, targets);
        EXPECT_EQ(best_direction(subject, frame, {}, 1280, 720, {}),
                  test::weighed_direction(subject, frame, {}, 1280, 720, {}))
            << n << " selectors";
    }
}

INSTANTIATE_TEST_SUITE_P(Real, Models, testing::ValuesIn(kModels, kModels + kTried), [](const auto& param) {
    std::string name = std::filesystem::path(param.param.file).stem().string();
    for (char& c : name)
        if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
    return name;
});

TEST(Textures, FilteredOnesAreNearerToManySamplesOfTheImage) {
    PORTHOLE_NEEDS_SHARED(shared);
    const Scene filtered = load_scene((shared / "models" / "gltf/CesiumMilkTruck.glb").string());
    ASSERT_FALSE(filtered.mips.empty());
    Scene plain = load_scene((shared / "models" / "gltf/CesiumMilkTruck.glb").string());
    plain.mips.clear();
    const View view = view_from_direction(frame_subject(filtered, {}), {1.0f, 0.4f, 1.0f}, {}, 120, 68);
    const auto draw = [&](const Scene& scene, int samples) {
        const MeshBvhs meshes = build_mesh_bvhs(scene);
        return render(build_bvh(meshes, all_parts(scene)), nullptr, view, {.samples = samples, .uniform = true},
                      nullptr, nullptr);
    };
    const Frame truth = draw(plain, 128), point = draw(plain, 1), smooth = draw(filtered, 1);
    EXPECT_EQ(point.ids, smooth.ids);
    // Inside the outline of parts, where only textures and creases differ.
    double before = 0, after = 0;
    for (int y = 1; y < view.height - 1; ++y)
        for (int x = 1; x < view.width - 1; ++x) {
            bool inside = truth.ids.id(x, y) != kNoPart;
            for (int d = 0; d < 9; ++d) inside &= truth.ids.id(x, y) == truth.ids.id(x + d % 3 - 1, y + d / 3 - 1);
            if (!inside) continue;
            const auto squared = [&](const Frame& f) {
                const Vec4f d = f.color(x, y) - truth.color(x, y);
                return double(d.x * d.x + d.y * d.y + d.z * d.z);
            };
            before += squared(point), after += squared(smooth);
        }
    EXPECT_LT(after, 0.8 * before);
    RecordProperty("error_ratio", std::to_string(after / before));
}

} // namespace
} // namespace porthole
