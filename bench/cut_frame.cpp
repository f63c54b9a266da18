#include "cut_frame.h"

namespace porthole::bench {

CutFrame::CutFrame(const Subject& s, const View& v) : subject(&s), view(v), plan(plan_view(s, v)) {
    plan_caps(s, plan);
    targets = std::make_unique<Bvh>(build_bvh(*s.meshes, plan.opened));
}

Frame CutFrame::draw(bool capped, const RenderParams& params, const Control& control) const {
    const Frame around = render_around(subject->whole, view, params, plan.cut, control);
    return draw_hole(capped, params, around, control);
}

Frame CutFrame::draw_hole(bool capped, const RenderParams& params, const Frame& around, const Control& control) const {
    Bvh opened = build_bvh(*subject->meshes, all_parts(subject->scene()), plan.cut.role, plan.cut.level);
    Caps caps;
    if (capped) {
        caps = trace_caps(opened, plan.cut, plan.solids, plan.target_ids.id, control);
        add_caps(opened, caps.mesh);
    }
    return render(opened, targets.get(), view, params, &plan.cut, &around, control, &caps);
}

AbsentScene::AbsentScene(const CutFrame& cut) : scene(cut.subject->scene()) {
    const Cut& c = cut.plan.cut;
    for (std::uint32_t i = 0; i < scene.parts.size(); ++i) {
        if (c.role[i] == CutRole::fixed) continue;
        Part& part = scene.parts[i];
        Mesh mesh = scene.meshes[part.mesh];
        const Affine3f place(part.world_from_mesh);
        std::vector<Submesh> submeshes;
        std::vector<Vec3u> kept;
        for (const Submesh& s : mesh.submeshes) {
            const auto first = std::uint32_t(kept.size());
            for (std::uint32_t t = s.first_triangle; t < s.first_triangle + s.triangle_count; ++t) {
                const Vec3u v = mesh.triangles[t];
                const auto gone = [&](std::uint32_t k) { return c.removes(place.point(mesh.positions[k]), PartId{i}); };
                if (!gone(v.x) || !gone(v.y) || !gone(v.z)) kept.push_back(v);
            }
            submeshes.push_back({first, std::uint32_t(kept.size()) - first, s.material});
        }
        if (kept.size() == mesh.triangles.size()) continue;
        mesh.triangles = std::move(kept);
        mesh.submeshes = std::move(submeshes);
        finish_mesh(mesh);
        part.mesh = std::uint32_t(scene.meshes.size());
        scene.meshes.push_back(std::move(mesh));
    }
    const Bvh opened = build_bvh(*cut.subject->meshes, all_parts(cut.subject->scene()), c.role, c.level);
    const CapMesh caps = trace_caps(opened, c, cut.plan.solids, cut.plan.target_ids.id).mesh;
    Mesh mesh;
    mesh.positions = caps.positions;
    mesh.triangles = caps.triangles;
    mesh.submeshes = {{0, std::uint32_t(mesh.triangles.size()), 0}};
    finish_mesh(mesh);
    scene.meshes.push_back(std::move(mesh));
    scene.parts.push_back({"caps", "caps", std::uint32_t(scene.meshes.size() - 1), {}});
    meshes = std::make_unique<MeshBvhs>(build_mesh_bvhs(scene));
    bvh = std::make_unique<Bvh>(build_bvh(*meshes, all_parts(scene)));
}

} // namespace porthole::bench
