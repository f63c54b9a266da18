// What a user of the installed library writes: reads a model and looks at a part inside it.
#include <cstdio>
#include <string>
#include <vector>

#include "porthole/io/load.h"
#include "porthole/reveal.h"
#include "porthole/scene/select.h"

int main(int argc, char** argv) {
    using namespace porthole;
    if (argc != 2) return 2;

    const Scene scene = load_scene(argv[1]);
    const MeshBvhs meshes = build_mesh_bvhs(scene);

    RevealParams params;
    params.targets = select_parts(scene, std::vector<std::string>{"sun_gear"});
    params.camera.name = "iso";
    params.width = 160, params.height = 90;
    const Revealed revealed = reveal(meshes, params);

    const double visible = revealed.report.targets.at(0).visible_after.value_or(0);
    std::printf("%zu parts, %.0f %% of the sun gear is seen\n", scene.parts.size(), 100 * visible);
    return visible > 0.9 ? 0 : 1;
}
