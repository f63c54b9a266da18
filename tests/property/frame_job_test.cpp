// Pictures in steps, on real models: each step a whole picture, the last one render()'s.
#include "porthole/render/frame_job.h"

#include <gtest/gtest.h>

#include <thread>

#include "porthole/io/load.h"
#include "porthole/plan.h"
#include "porthole/scene/camera.h"
#include "porthole/scene/select.h"
#include "support/shared.h"

namespace porthole {
namespace {

struct Model {
    const char* file;
    std::vector<std::string> targets;
};

std::ostream& operator<<(std::ostream& out, const Model& model) { return out << model.file; }

const Model kModels[] = {
    {"assembly/2CylinderEngine.glb", {"rod_123-699*", "Piston*"}},
    {"medical/head_brain_mri.glb", {"Hippocampus_*", "Amygdala_*", "Thalamus_*"}},
};

/// A model with a hole, and everything that draws it.
struct Opened {
    Scene scene;
    MeshBvhs meshes;
    std::vector<PartId> targets;
    Subject subject;
    View view;
    ViewPlan plan;
    Bvh opened, shown;

    Opened(const std::filesystem::path& file, const std::vector<std::string>& names, int width, int height)
        : scene(load_scene(file.string())), meshes(build_mesh_bvhs(scene)), targets(select_parts(scene, names)),
          subject(make_subject(meshes, targets)),
          view(view_from_direction(frame_subject(scene, targets), {0.4f, 0.5f, 1}, {}, width, height)),
          plan(plan_view(subject, view)), opened(build_bvh(meshes, all_parts(scene), plan.cut.role)),
          shown(build_bvh(meshes, plan.opened)) {}

    [[nodiscard]] Shot shot(const RenderParams& look, bool cut) const {
        Shot shot{.whole = &subject.whole, .view = view, .params = look};
        if (cut) shot.targets = &shown, shot.cut = &plan.cut, shot.opened = &opened;
        return shot;
    }
    [[nodiscard]] Frame rendered(const RenderParams& look, bool cut) const {
        if (!cut) return render(subject.whole, nullptr, view, look, nullptr, nullptr);
        const Frame around = render_around(subject.whole, view, look, plan.cut);
        Frame frame = render(opened, &shown, view, look, &plan.cut, &around);
        frame.rays += around.rays;
        return frame;
    }
};

void expect_same(const Frame& a, const Frame& b) {
    EXPECT_EQ(a.color, b.color);
    EXPECT_EQ(a.ids, b.ids);
    EXPECT_EQ(a.inside, b.inside);
    EXPECT_EQ(a.inferred, b.inferred);
    EXPECT_EQ(a.rays.primary, b.rays.primary);
    EXPECT_EQ(a.rays.shadow, b.rays.shadow);
    EXPECT_EQ(a.rays.ambient, b.rays.ambient);
    EXPECT_EQ(a.rays.reflection, b.rays.reflection);
    EXPECT_EQ(a.rays.refraction, b.rays.refraction);
}

/// Every pixel that is not marked as inferred has the id that all pixels traced give it.
void expect_traced_ids(const Frame& frame, const Frame& full) {
    const Rect w = full.color.window();
    ASSERT_EQ(frame.color.window(), w);
    ASSERT_EQ(frame.ids.window(), w);
    int wrong = 0;
    for (int y = w.y0; y < w.y1; ++y)
        for (int x = w.x0; x < w.x1; ++x)
            if (frame.inferred.at_or(x, y, 0) == 0)
                wrong += frame.ids.id(x, y) != full.ids.id(x, y) || frame.ids.depth(x, y) != full.ids.depth(x, y);
    EXPECT_EQ(wrong, 0);
}

/// A sample a pixel only, for the paper's ways.
RenderParams by(Refine refine) {
    RenderParams look{.samples = is_selective(refine) ? 1 : 4, .ao_samples = 2};
    look.refine = refine;
    return look;
}

class FrameJobs : public testing::TestWithParam<Model> {};

TEST_P(FrameJobs, EndWithTheBitsOfRender) {
    PORTHOLE_NEEDS_SHARED(shared);
    const Opened o(shared / "models" / GetParam().file, GetParam().targets, 480, 270);
    ASSERT_FALSE(o.plan.cut.empty());
    for (const bool cut : {false, true})
        for (const Refine refine : {Refine::adaptive, Refine::full, Refine::paper1}) {
            SCOPED_TRACE(testing::Message() << "cut " << cut << " refine " << int(refine));
            const RenderParams look = by(refine);
            const Frame whole = o.rendered(look, cut);
            for (const int threads : {1, 3}) {
                Control control;
                control.threads = threads;
                FrameJob job(o.shot(look, cut));
                while (job.step(control)) {
                }
                expect_same(job.frame(), whole);
                expect_same(std::move(job).frame(), whole);
            }
        }
}

TEST_P(FrameJobs, ShowAWholePictureAtEveryStep) {
    PORTHOLE_NEEDS_SHARED(shared);
    const Opened o(shared / "models" / GetParam().file, GetParam().targets, 960, 540);
    for (const bool cut : {false, true}) {
        const Frame full = o.rendered(by(Refine::full), cut);
        for (const Refine refine : {Refine::adaptive, Refine::full}) {
            SCOPED_TRACE(testing::Message() << "cut " << cut << " refine " << int(refine));
            FrameJob job(o.shot(by(refine), cut));
            std::vector<FrameStep> steps;
            while (job.step()) {
                const Frame frame = job.frame();
                steps.push_back(job.stamp().step);
                expect_traced_ids(frame, full);
                if (steps.size() > 1) continue;
                EXPECT_LT(frame.rays.all(), full.rays.all() / 10);
                const std::span<const std::uint8_t> inferred = frame.inferred.pixels();
                EXPECT_GT(std::count(inferred.begin(), inferred.end(), 1), std::ptrdiff_t(inferred.size()) * 9 / 10);
                // It is the picture that follows, blurred: most pixels already see the part they will.
                int right = 0, in_hole = 0, right_in_hole = 0;
                const Rect w = full.color.window();
                for (int y = w.y0; y < w.y1; ++y)
                    for (int x = w.x0; x < w.x1; ++x) {
                        const bool same = frame.ids.id(x, y) == full.ids.id(x, y);
                        right += same;
                        if (!cut || o.plan.cut.distance.at_or(x, y, 1.0f) > 0) continue;
                        ++in_hole;
                        right_in_hole += same;
                    }
                EXPECT_GT(right, w.width() * w.height() * 85 / 100);
                if (cut) {
                    EXPECT_GT(right_in_hole, in_hole * 60 / 100);
                }
            }
            std::vector<FrameStep> expected{FrameStep::preview, FrameStep::refined, FrameStep::complete};
            if (cut) expected.insert(expected.end() - 1, FrameStep::antialiased);
            EXPECT_EQ(steps, expected);
        }
    }
}

TEST_P(FrameJobs, GoOnWhereTheyWereStopped) {
    PORTHOLE_NEEDS_SHARED(shared);
    const Opened o(shared / "models" / GetParam().file, GetParam().targets, 480, 270);
    for (const Refine refine : {Refine::adaptive, Refine::full, Refine::paper1}) {
        SCOPED_TRACE(testing::Message() << "refine " << int(refine));
        const RenderParams look = by(refine);
        const Frame whole = o.rendered(look, true);
        FrameJob job(o.shot(look, true));
        // Stopped after one report of progress, then after two, and so on, somewhere in every pass.
        int stops = 0, pictures = 0;
        for (int patience = 1; job.stamp().step != FrameStep::complete; ++patience) {
            std::stop_source source;
            std::atomic<int> reports{0};
            Control control;
            control.threads = 2;
            control.stop = source.get_token();
            control.progress = [&](std::string_view, double share) {
                EXPECT_GE(share, 0.0);
                EXPECT_LE(share, 1.0 + 1e-9);
                if (++reports >= patience) source.request_stop();
            };
            const FrameStamp before = job.stamp();
            try {
                EXPECT_TRUE(job.step(control));
                EXPECT_GT(job.stamp(), before);
                ++pictures;
            } catch (const Cancelled&) {
                ++stops;
                EXPECT_EQ(job.stamp(), before);
                EXPECT_EQ(job.frame().color.empty(), before.step == FrameStep::none);
            }
        }
        EXPECT_GT(stops, 3);
        EXPECT_GE(pictures, 2);
        EXPECT_FALSE(job.step());
        expect_same(std::move(job).frame(), whole);
    }
}

TEST_P(FrameJobs, GoOnWheneverTheyWereStopped) {
    PORTHOLE_NEEDS_SHARED(shared);
    const Opened o(shared / "models" / GetParam().file, GetParam().targets, 480, 270);
    for (const Refine refine : {Refine::adaptive, Refine::full}) {
        SCOPED_TRACE(testing::Message() << "refine " << int(refine));
        FrameJob job(o.shot(by(refine), true));
        // Wherever the loops are by then, which is another place every time.
        for (int patience = 0; job.stamp().step != FrameStep::complete; ++patience) {
            std::stop_source source;
            Control control;
            control.threads = 2;
            control.stop = source.get_token();
            std::jthread impatient([&] {
                std::this_thread::sleep_for(patience * std::chrono::microseconds(300));
                source.request_stop();
            });
            try {
                (void)job.step(control);
            } catch (const Cancelled&) {
            }
        }
        expect_same(std::move(job).frame(), o.rendered(by(refine), true));
    }
}

INSTANTIATE_TEST_SUITE_P(Shared, FrameJobs, testing::ValuesIn(kModels),
                         [](const auto& model) { return std::to_string(model.index); });

TEST(FrameJob, IsStoppedFromAnotherThreadAndThrownAway) {
    PORTHOLE_NEEDS_SHARED(shared);
    const Opened o(shared / "models" / kModels[0].file, kModels[0].targets, 960, 540);
    const RenderParams look = by(Refine::adaptive);
    std::stop_source source;
    std::atomic<bool> started{false};
    Control control;
    control.stop = source.get_token();
    control.progress = [&](std::string_view, double) {
        started = true;
        started.notify_one();
        // The request comes before this tile ends, so that the step cannot be over first.
        while (!source.stop_requested()) std::this_thread::yield();
    };
    std::jthread newer_camera([&] {
        started.wait(false);
        source.request_stop();
    });
    FrameStamp shown;
    {
        FrameJob older(o.shot(look, true), 1);
        EXPECT_THROW((void)older.step(control), Cancelled);
        EXPECT_EQ(older.stamp(), (FrameStamp{1, FrameStep::none}));
        EXPECT_TRUE(older.frame().color.empty());
    }
    FrameJob newer(o.shot(look, true), 2);
    while (newer.step()) {
        EXPECT_GT(newer.stamp(), shown);
        shown = newer.stamp();
    }
    expect_same(newer.frame(), o.rendered(look, true));
    FrameJob late(o.shot(look, false), 1);
    while (late.step()) EXPECT_LT(late.stamp(), shown);
}

} // namespace
} // namespace porthole
