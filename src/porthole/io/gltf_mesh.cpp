#include "porthole/io/gltf_mesh.h"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <unordered_map>

#include "porthole/io/gltf_draco.h"

namespace porthole::gltf {
namespace {

constexpr std::size_t kMostCompared = 64;            // earlier primitives, for a shared vertex array
constexpr std::size_t kChunk = std::size_t(1) << 16; // vertices or triangles per job

// A glTF mesh that is used, with what was decoded for it.
struct Shape {
    std::vector<Primitive> primitives;
};

struct Placed {
    const Primitive* primitive = nullptr;
    std::uint32_t first_vertex = 0, first_triangle = 0;
    bool fills_vertices = true; // false: an earlier primitive of the mesh has the same
};

// Where the primitives of one request go in its Mesh.
struct Layout {
    std::vector<Placed> placed;
    std::uint64_t vertices = 0, triangles = 0, flat_corners = 0;
    bool normals = false, tangents = false, uv[2] = {}, colors = false;
};

struct Job {
    std::size_t request = 0, placed = 0, first = 0, count = 0;
    bool triangles = false;
    BadIndices bad;
    VertexFaults faults;
};

// One decoding, for all primitives that name the same data: exporters keep equal geometry once.
struct DracoJob {
    struct User {
        Primitive* primitive = nullptr;
        std::vector<const Accessor**> slots; // of its attributes, as `wanted`
    };
    std::span<const std::byte> bytes;
    std::vector<DracoAttribute> wanted;
    std::vector<User> users;
    DracoMesh result;
};

// The Draco identifiers of a primitive's attributes, and where their accessors will be put.
DracoJob plan_draco(const Document& doc, const MeshSource& source, const Json& extension, Primitive& p) {
    DracoJob job;
    DracoJob::User user{&p, {}};
    const BufferView& view = source.views[doc.need_index(extension, "bufferView", source.views.size(), "buffer view")];
    job.bytes = view.bytes.data;
    const Json* ids = doc.object(extension, "attributes");
    if (!ids) doc.fail("E0303", extension, {}, "has no \"attributes\", which Draco compression requires");
    const auto want = [&](const std::string& name, const Accessor*& slot) {
        const auto id = doc.uint(*ids, name);
        if (!id || !slot) return; // not compressed, or not declared: stays as it is
        job.wanted.push_back({static_cast<std::uint32_t>(*id), slot->normalized});
        user.slots.push_back(&slot);
    };
    Attributes& a = p.attributes;
    want("POSITION", a.position);
    want("NORMAL", a.normal);
    want("TANGENT", a.tangent);
    want("TEXCOORD_0", a.uv[0]);
    want("TEXCOORD_1", a.uv[1]);
    want("COLOR_0", a.color);
    for (std::size_t n = 0; n < a.joints.size(); ++n) {
        want("JOINTS_" + std::to_string(n), a.joints[n]);
        want("WEIGHTS_" + std::to_string(n), a.weights[n]);
    }
    job.users.push_back(std::move(user));
    return job;
}

std::vector<std::unique_ptr<DracoJob>> decode_draco_primitives(const Document& doc, const MeshSource& source,
                                                               std::map<std::uint32_t, Shape>& shapes,
                                                               const LoadParams& params, const Control& control) {
    std::vector<std::unique_ptr<DracoJob>> jobs;
    std::map<std::pair<const std::byte*, std::vector<DracoAttribute>>, DracoJob*> known;
    std::uint64_t total = 0;
    for (auto& [mesh, shape] : shapes)
        for (Primitive& p : shape.primitives) {
            const Json* extension = doc.extension(*p.json, "KHR_draco_mesh_compression");
            if (!extension || p.topology == Topology::none) continue;
            DracoJob job = plan_draco(doc, source, *extension, p);
            DracoJob*& same = known[{job.bytes.data(), job.wanted}];
            if (same && same->bytes.size() == job.bytes.size()) {
                same->users.push_back(std::move(job.users[0]));
                continue;
            }
            total += job.bytes.size();
            if (total > params.max_bytes / 8)
                doc.fail_limit(*extension, {}, "the Draco data is used more often than its size allows");
            jobs.push_back(std::make_unique<DracoJob>(std::move(job)));
            same = jobs.back().get();
        }
    parallel_in_order(jobs.size(), control, [&](std::size_t i) {
        DracoJob& job = *jobs[i];
        job.result = decode_draco(job.bytes, job.wanted);
        if (!job.result.error.empty())
            doc.fail("E0308", *job.users[0].primitive->json, "extensions/KHR_draco_mesh_compression",
                     "the Draco data " + job.result.error + "; the file is damaged?");
        for (const DracoJob::User& user : job.users) {
            for (std::size_t k = 0; k < user.slots.size(); ++k) *user.slots[k] = &job.result.attributes[k];
            user.primitive->indices = &job.result.indices;
            user.primitive->topology = Topology::triangles; // Draco has stored strips as triangles
        }
    });
    return jobs;
}

Layout lay_out(const Document& doc, const Shape& shape, const Json& mesh_json) {
    Layout layout;
    std::unordered_map<const Accessor*, std::vector<std::size_t>> by_position;
    for (const Primitive& p : shape.primitives) {
        if (p.topology == Topology::none || p.triangles == 0) continue;
        Placed placed{&p, static_cast<std::uint32_t>(layout.vertices), static_cast<std::uint32_t>(layout.triangles),
                      true};
        // Many exporters cut one vertex array into primitives by material: keep it one array.
        std::vector<std::size_t>& candidates = by_position[p.attributes.position];
        for (std::size_t back = 1; back <= std::min(candidates.size(), kMostCompared); ++back) {
            const Placed& other = layout.placed[candidates[candidates.size() - back]];
            if (other.primitive->attributes == p.attributes && other.primitive->targets == p.targets) {
                placed.first_vertex = other.first_vertex;
                placed.fills_vertices = false;
                break;
            }
        }
        if (placed.fills_vertices) {
            candidates.push_back(layout.placed.size());
            layout.vertices += p.vertices;
        }
        layout.triangles += p.triangles;
        if (layout.vertices > 0xFFFFFFF0u || layout.triangles > 0xFFFFFFF0u)
            doc.fail_limit(mesh_json, {}, "has over 2^32 vertices or triangles, more than one mesh can hold");
        layout.normals |= p.attributes.normal != nullptr;
        layout.tangents |= p.attributes.normal && p.attributes.tangent;
        for (int set = 0; set < 2; ++set) layout.uv[set] |= p.attributes.uv[set] != nullptr;
        layout.colors |= p.attributes.color != nullptr;
        layout.placed.push_back(placed);
    }
    for (const Placed& placed : layout.placed) // these get corners of their own, see flatten_submeshes
        if (layout.normals && !placed.primitive->attributes.normal)
            layout.flat_corners += placed.primitive->triangles * 3;
    if (layout.vertices + layout.flat_corners > 0xFFFFFFF0u)
        doc.fail_limit(mesh_json, {}, "has over 2^32 vertices, more than one mesh can hold");
    return layout;
}

std::uint64_t bytes_of(const Layout& l) {
    const std::uint64_t vertex =
        12 + (l.normals ? 12 : 0) + (l.tangents ? 16 : 0) + (l.uv[0] ? 8 : 0) + (l.uv[1] ? 8 : 0) + (l.colors ? 16 : 0);
    return (l.vertices + l.flat_corners) * vertex + l.triangles * 12;
}

void allocate(const Layout& layout, const MeshSource& source, Mesh& mesh) {
    mesh.positions.reserve(layout.vertices + 1); // Embree's padding
    mesh.positions.resize(layout.vertices);
    if (layout.normals) mesh.normals.resize(layout.vertices);
    if (layout.tangents) mesh.tangents.resize(layout.vertices);
    for (int set = 0; set < 2; ++set)
        if (layout.uv[set]) mesh.uv[set].resize(layout.vertices);
    if (layout.colors) mesh.colors.assign(layout.vertices, Vec4f{1, 1, 1, 1});
    mesh.triangles.resize(layout.triangles);
    for (const Placed& placed : layout.placed) {
        const Primitive& p = *placed.primitive;
        const std::uint32_t material =
            p.material == kNone ? source.material_of.back() : source.material_of[std::size_t(p.material)];
        mesh.submeshes.push_back({placed.first_triangle, static_cast<std::uint32_t>(p.triangles), material});
    }
}

std::vector<Job> split_into_jobs(std::span<const Layout> layouts) {
    std::vector<Job> jobs;
    const auto split = [&](std::size_t request, std::size_t placed, std::uint64_t n, bool triangles) {
        for (std::uint64_t first = 0; first < n; first += kChunk)
            jobs.push_back({request, placed, first, std::min<std::uint64_t>(kChunk, n - first), triangles, {}, {}});
    };
    for (std::size_t r = 0; r < layouts.size(); ++r)
        for (std::size_t i = 0; i < layouts[r].placed.size(); ++i) {
            const Placed& placed = layouts[r].placed[i];
            if (placed.fills_vertices) split(r, i, placed.primitive->vertices, false);
            split(r, i, placed.primitive->triangles, true);
        }
    return jobs;
}

// After the vertices and triangles are there: what needs the whole mesh.
MeshRepair finish(const Layout& layout, bool repair, Mesh& mesh) {
    if (layout.normals) {
        std::vector<std::uint8_t> flat;
        for (const Placed& placed : layout.placed) flat.push_back(placed.primitive->attributes.normal ? 0 : 1);
        if (std::count(flat.begin(), flat.end(), 1) > 0) {
            flatten_submeshes(mesh, flat);
            repair = true; // the shared vertices that it left behind are without normals
        }
    }
    if (repair) repair_normals(mesh);
    return finish_mesh(mesh);
}

void report(Document& doc, std::span<const MeshRequest> requests, std::span<const Layout> layouts,
            std::span<const Job> jobs, std::span<const MeshRepair> repairs) {
    const auto text = [](std::uint64_t n) { return std::to_string(n); };
    std::vector<std::uint64_t> bad_of_request(requests.size());
    for (std::size_t j = 0; j < jobs.size();) { // jobs of one primitive follow each other
        const Job& job = jobs[j];
        BadIndices bad;
        std::uint64_t unknown_joints = 0;
        for (; j < jobs.size() && jobs[j].request == job.request && jobs[j].placed == job.placed; ++j) {
            if (bad.triangles == 0)
                bad = jobs[j].bad;
            else
                bad.triangles += jobs[j].bad.triangles;
            unknown_joints += jobs[j].faults.unknown_joints;
        }
        const Primitive& p = *layouts[job.request].placed[job.placed].primitive;
        bad_of_request[job.request] += bad.triangles;
        if (bad.triangles > 0)
            doc.warn("W0301", *p.json, "indices",
                     text(bad.triangles) + " triangles were left out: triangle " + text(bad.first_triangle) +
                         " has index " + text(bad.first_index) + ", but there are " + text(p.vertices) + " vertices");
        if (unknown_joints > 0)
            doc.warn("W0307", *p.json, "attributes/JOINTS_0",
                     text(unknown_joints) +
                         " vertices name joints that the skin does not have; its first joint is used");
    }
    std::uint64_t degenerate = 0, meshes = 0;
    const Json* last = nullptr;
    const std::span<const Json> mesh_list = doc.list(doc.root(), "meshes");
    std::set<std::uint32_t> counted;
    for (std::size_t r = 0; r < requests.size(); ++r) {
        if (!counted.insert(requests[r].mesh).second) continue;
        const Json& json = mesh_list[requests[r].mesh];
        if (repairs[r].non_finite > bad_of_request[r])
            doc.warn("W0301", json, {},
                     text(repairs[r].non_finite - bad_of_request[r]) +
                         " triangles were left out: vertices are not finite or beyond 1e12");
        if (repairs[r].degenerate == 0) continue;
        degenerate += repairs[r].degenerate;
        ++meshes;
        last = &json;
    }
    if (degenerate > 0)
        doc.warn("W0301", meshes == 1 ? *last : doc.root(), {},
                 text(degenerate) + " triangles without area were left out" +
                     (meshes == 1 ? "" : ", in " + text(meshes) + " meshes"));
}

} // namespace

void parallel_in_order(std::size_t n, const Control& control, const std::function<void(std::size_t)>& body) {
    std::vector<std::exception_ptr> errors(n);
    parallel_for(n, control, [&](std::size_t i) {
        try {
            body(i);
        } catch (...) {
            errors[i] = std::current_exception();
        }
    });
    for (const std::exception_ptr& error : errors)
        if (error) std::rethrow_exception(error);
}

std::vector<std::uint8_t> used_materials(const Document& doc, std::span<const MeshRequest> requests) {
    const std::size_t materials = doc.list_of_objects(doc.root(), "materials").size();
    std::vector<std::uint8_t> used(materials + 1, 0);
    for (const MeshRequest& request : requests)
        for (const Json& primitive : doc.list_of_objects(doc.element("meshes", request.mesh), "primitives"))
            used[doc.index(primitive, "material", materials, "material")
                     .value_or(static_cast<std::uint32_t>(materials))] = 1;
    return used;
}

std::vector<Mesh> build_meshes(Document& doc, const MeshSource& source, std::span<const MeshRequest> requests,
                               const LoadParams& params, const Control& control) {
    const std::span<const Json> mesh_list = doc.list(doc.root(), "meshes");
    std::map<std::uint32_t, Shape> shapes; // several requests may pose one mesh differently
    for (const MeshRequest& request : requests) {
        const auto [shape, fresh] = shapes.try_emplace(request.mesh);
        if (fresh) shape->second.primitives = read_primitives(doc, source.accessors, request.mesh);
    }
    const auto draco = decode_draco_primitives(doc, source, shapes, params, control); // owns what they point to
    for (auto& [mesh, shape] : shapes)
        for (Primitive& p : shape.primitives)
            if (p.topology != Topology::none) settle_counts(doc, p);

    std::vector<Layout> layouts;
    layouts.reserve(requests.size());
    std::uint64_t total = 0;
    for (const MeshRequest& request : requests) {
        const Json& json = mesh_list[request.mesh];
        layouts.push_back(lay_out(doc, shapes.at(request.mesh), json));
        total += bytes_of(layouts.back());
        if (total > params.max_bytes)
            doc.fail_limit(json, {},
                           "the geometry takes more than the allowed " + std::to_string(params.max_bytes) +
                               " bytes (the memory limit, or 64 times the file's data)");
    }

    std::vector<Mesh> meshes(requests.size());
    parallel_for(requests.size(), control, [&](std::size_t r) { allocate(layouts[r], source, meshes[r]); });

    std::vector<Job> jobs = split_into_jobs(layouts);
    parallel_for(jobs.size(), control, [&](std::size_t j) {
        Job& job = jobs[j];
        const Placed& placed = layouts[job.request].placed[job.placed];
        Mesh& mesh = meshes[job.request];
        if (job.triangles)
            job.bad = fill_triangles(*placed.primitive, placed.first_vertex, job.first, job.count,
                                     mesh.triangles.data() + placed.first_triangle + job.first);
        else
            job.faults = fill_vertices(*placed.primitive, requests[job.request], placed.first_vertex, job.first,
                                       job.count, mesh);
    });

    std::vector<std::uint8_t> repair(requests.size(), 0);
    for (const Job& job : jobs) repair[job.request] |= job.faults.no_normal ? 1 : 0;
    std::vector<MeshRepair> repairs(requests.size());
    parallel_for(requests.size(), control, [&](std::size_t r) {
        repairs[r] = finish(layouts[r], repair[r] != 0, meshes[r]);
        if (const Json* name = Document::find(mesh_list[requests[r].mesh], "name"); name && name->is_string())
            meshes[r].name = name->get<std::string>();
    });
    report(doc, requests, layouts, jobs, repairs);
    return meshes;
}

} // namespace porthole::gltf
