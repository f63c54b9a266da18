// What a picture with a hole is asked to be: everything but the model that decides its pixels.
#pragma once

#include <optional>
#include <vector>

#include "porthole/plan.h"
#include "porthole/render/restyle.h"
#include "porthole/render/wireframe.h"
#include "porthole/scene/camera.h"

namespace porthole {

struct RevealParams {
    std::vector<PartId> targets;   ///< parts that must be seen
    std::vector<PartId> keep;      ///< parts that stay whole
    std::vector<PartId> cut_only;  ///< if not empty, only these may be cut
    bool keep_see_through = false; ///< blended and transmissive parts stay whole too
    Rest rest = Rest::keep;        ///< how parts look that are neither targets, kept nor cut
    CameraParams camera;           ///< name "auto": chosen by the plan
    int width = 1920, height = 1080;
    std::optional<View> view{}; ///< instead of camera, width and height: this very view
    PlanParams plan;
    RenderParams render;
    WireParams wire;           ///< of a picture without a hole: edges instead of surfaces
    bool compare_full = false; ///< draw it again with every pixel traced, and report how the two compare
};

} // namespace porthole
