#include "porthole/plan.h"

namespace porthole {

void plan_caps(const Subject& subject, ViewPlan& plan, const CapOverrides& overrides, const Control& control) {
    if (plan.cut.empty()) return;
    const MeshBvhs& meshes = *subject.meshes;
    plan.solids = find_solids(meshes.scene(), meshes_of(meshes.scene(), plan.cut_set), control);
    const std::vector<std::uint8_t> holders = find_holders(meshes, plan.solids, plan.cut_set, plan.opened, control);
    plan.caps = classify(meshes, plan.solids, plan.cut_set, holders, plan.view, overrides);
    plan.cut.cap = plan.caps.rule;
    index_ranges(plan.cut);
}

} // namespace porthole
