// What a user of the installed library writes: reads a model and draws a small picture of it.
#include <cstdio>

#include "porthole/io/load.h"
#include "porthole/render/render.h"

int main(int argc, char** argv) {
    using namespace porthole;
    if (argc != 2) return 2;

    const Scene scene = load_scene(argv[1]);
    const MeshBvhs meshes = build_mesh_bvhs(scene);
    const Bvh bvh = build_bvh(meshes, all_parts(scene));

    const Bounds3d box = scene_bounds(scene);
    View view;
    view.width = 64, view.height = 36;
    view.orthographic = true;
    view.half_height = float(box.diagonal()) / 2;
    view.world_from_camera.p = Vec3f(box.center() + Vec3d{0, 0, box.diagonal()});
    const Frame frame = render(bvh, nullptr, view, {}, nullptr, nullptr);

    int hit = 0;
    for (const PartId id : frame.ids.id.pixels()) hit += id != kNoPart;
    std::printf("%zu parts, %d of %zu pixels hit\n", scene.parts.size(), hit, frame.ids.id.pixels().size());
    return hit > 50 && hit < 2000 ? 0 : 1;
}
