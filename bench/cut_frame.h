// A picture with a hole, and the same picture of a scene from which the removed geometry is gone.
#pragma once

#include <memory>

#include "porthole/plan.h"
#include "porthole/render/render.h"

namespace porthole::bench {

/// Everything a cutaway of one view needs, planned once.
struct CutFrame {
    const Subject* subject = nullptr;
    View view;
    ViewPlan plan;
    std::unique_ptr<Bvh> targets;

    CutFrame(const Subject& subject, const View& view);

    /// The whole picture: caps found, what is around the hole, the hole.
    [[nodiscard]] Frame draw(bool capped, const RenderParams& params, const Control& control) const;
    /// What the hole alone costs, over `around`.
    [[nodiscard]] Frame draw_hole(bool capped, const RenderParams& params, const Frame& around,
                                  const Control& control) const;
};

/// The scene without the triangles that a cut removes whole, and with its caps as a part: what
/// the cutaway shows, as geometry of its own.
struct AbsentScene {
    Scene scene;
    std::unique_ptr<MeshBvhs> meshes;
    std::unique_ptr<Bvh> bvh;

    explicit AbsentScene(const CutFrame& cut);
};

} // namespace porthole::bench
