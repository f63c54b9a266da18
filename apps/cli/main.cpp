// The command line: its flags, and what becomes of errors and interrupts.
#include <algorithm>
#include <cstdio>
#include <iterator>
#include <new>
#include <system_error>

#include <CLI/CLI.hpp>

#include "config.h"
#include "options.h"
#include "porthole/io/files.h"
#include "porthole/scene/select.h"
#include "session.h"
#include "signals.h"

namespace porthole::cli {
namespace {

/// An option that takes one text and hands it to `read`, whose errors name it.
template <typename Read> CLI::Option* add_read(CLI::App& app, const std::string& names, const std::string& help,
                                               const std::string& type, Read&& read) {
    const std::string option = names.substr(0, names.find(','));
    return app
        .add_option_function<std::string>(
            names, [read, option](const std::string& text) { read(text, option); }, help)
        ->type_name(type);
}

/// A repeatable option: one value each time it is given.
CLI::Option* add_list(CLI::App& app, const std::string& name, std::vector<std::string>& values,
                      const std::string& help) {
    return app.add_option(name, values, help)->type_name("SEL")->allow_extra_args(false);
}

/// An option that takes one of a few words.
template <typename Enum> CLI::Option* add_choice(CLI::App& app, const std::string& name, Enum& value,
                                                 const std::vector<std::pair<std::string, Enum>>& choices,
                                                 const std::string& help) {
    std::string words;
    for (const auto& choice : choices) words += (words.empty() ? "" : "|") + choice.first;
    return add_read(
        app, name, help, words, [&value, choices, words](const std::string& text, const std::string& option) {
            for (const auto& choice : choices)
                if (choice.first == text) {
                    value = choice.second;
                    return;
                }
            throw Error(ErrorKind::usage, "E0105", option, "\"" + text.substr(0, 80) + "\" is not one of " + words);
        });
}

void add_model(CLI::App& app, CommonOptions& o) {
    app.add_option("MODEL", o.model,
                   "The model: glTF, GLB, OBJ, PLY, STL or a scene of primitives; - reads standard input")
        ->type_name("FILE")
        ->required();
}

void add_running(CLI::App& app, CommonOptions& o) {
    app.option_defaults()->group("Running");
    app.add_option("--threads", o.threads, "Threads (default: one per processor)")
        ->type_name("N")
        ->check(CLI::Range(1, 1024));
    add_read(app, "--max-memory", "Most memory to take, such as 4G; exit 5 beyond it", "BYTES",
             [&o](const std::string& text, const std::string& option) { o.max_memory = parse_bytes(text, option); });
    app.add_flag("--quiet", o.quiet, "Say nothing but warnings and errors");
    app.add_flag("--verbose", o.verbose, "Say more");
    add_choice<std::string>(app, "--log", o.log, {{"text", "text"}, {"json", "json"}},
                            "How messages are written to standard error");
}

void add_common(CLI::App& app, CommonOptions& o) {
    app.option_defaults()->group("Reading");
    add_read(app, "--format", "Format of the model, whatever its name", "glb|gltf|obj|ply|scene|stl",
             [&o](const std::string& text, const std::string& option) {
                 for (const char* known : {"glb", "gltf", "obj", "ply", "scene", "stl"})
                     if (text == known) {
                         o.load.format = text;
                         return;
                     }
                 throw Error(ErrorKind::usage, "E0105", option,
                             "\"" + text.substr(0, 80) + "\" is not one of glb, gltf, obj, ply, scene, stl");
             });
    add_read(app, "--up", "Axis of the file that points up (default y)", "y|z",
             [&o](const std::string& text, const std::string& option) { o.load.up = parse_up(text, option); });
    add_read(app, "--units", "Length unit of the file: m, cm, mm, um, km, in, ft or metres", "UNIT",
             [&o](const std::string& text, const std::string& option) {
                 o.load.metres_per_unit = parse_units(text, option);
             });
    app.add_option("--time", o.load.time, "Seconds into the first animation (default: rest pose)")
        ->type_name("SECONDS")
        ->check(CLI::Range(0.0, 1e6));
    add_running(app, o);
}

void add_camera(CLI::App& app, CameraParams& c) {
    app.option_defaults()->group("Camera");
    app.add_option("--camera", c.name,
                   "auto, front, back, left, right, top, bottom, iso, or a camera of the file by name or #N "
                   "(default auto)")
        ->type_name("VIEW");
    const auto add_vector = [&](const char* name, std::optional<Vec3d>& v, const char* help) {
        add_read(app, name, help, "X,Y,Z",
                 [&v](const std::string& text, const std::string& option) { v = parse_vector(text, option); });
    };
    add_vector("--camera-position", c.position, "Where the eye is, metres; no framing then");
    add_vector("--camera-focal-point", c.focal_point, "What it looks at (default: the model's centre)");
    add_vector("--camera-view-up", c.view_up, "What points up in the picture (default 0,1,0)");
    add_vector("--camera-direction", c.direction, "The way it looks");
    app.add_option("--camera-azimuth-angle", c.azimuth_deg, "Carries the eye round to the right")->type_name("DEGREES");
    app.add_option("--camera-elevation-angle", c.elevation_deg, "Carries the eye up")->type_name("DEGREES");
    app.add_option("--camera-zoom-factor", c.zoom, "2 shows things twice as large")->type_name("FACTOR");
    app.add_option("--camera-view-angle", c.view_angle_deg, "Vertical angle of view (default 30)")
        ->type_name("DEGREES");
    app.add_flag("--camera-orthographic", c.orthographic, "Parallel projection");
    add_choice<Framing>(app, "--frame", c.frame, {{"auto", Framing::automatic}, {"all", Framing::all}},
                        "auto: closer until targets span 15 % of the height; all: the whole model (default auto)");
}

void add_picture(CLI::App& app, PictureOptions& o) {
    app.option_defaults()->group("Output");
    app.add_option("-o,--output", o.output,
                   "Picture: .png, .jpg, .jpeg, or - for a PNG on standard output (default out.png)")
        ->type_name("FILE");
    app.add_option("--report", o.report_path, "Write what was done as JSON")->type_name("FILE");
    app.add_flag("--json", o.json, "The report on standard output; no picture unless -o is given");
    add_read(app, "--size,--resolution", "Width and height in pixels (default 1920x1080)", "WxH",
             [&o](const std::string& text, const std::string& option) { o.size = parse_size(text, option); });
    app.add_option("--bits", o.bits, "Bits per channel of a PNG (default 8)")
        ->type_name("N")
        ->check(CLI::IsMember({8, 16}));
    app.add_flag("--no-clobber", o.no_clobber, "Leave existing files alone: exit 4 instead");
    app.option_defaults()->group("Look");
    add_read(
        app, "--background", "#rrggbb, white or black (default white)", "COLOR",
        [&o](const std::string& text, const std::string& option) { o.render.background = parse_color(text, option); });
    app.add_flag("--no-background", o.no_background, "Transparent where there is no model");
    app.add_option("--samples", o.render.samples, "Most samples per pixel, spent where neighbours differ (default 16)")
        ->type_name("N")
        ->check(CLI::Range(1, 4096));
    app.add_flag("--uniform", o.render.uniform, "All the samples in every pixel, to compare with; slow");
    app.add_option("--bounces", o.render.max_bounces,
                   "Most reflections, refractions and see-through surfaces along a path (default 6)")
        ->type_name("N")
        ->check(CLI::Range(0, 64));
    app.add_option("--ao-samples", o.render.ao_samples, "Ambient occlusion rays per pixel (default 4, 0: none)")
        ->type_name("N")
        ->check(CLI::Range(0, 256));
    app.add_flag_callback(
        "--no-shadows", [&o] { o.render.shadows = false; }, "No shadows");
    RefineParams& by = o.render.refine_by;
    add_choice<Refine>(
        app, "--refine", o.render.refine,
        {{"full", Refine::full},
         {"adaptive", Refine::adaptive},
         {"paper1", Refine::paper1},
         {"paper2", Refine::paper2},
         {"expansion", Refine::expansion}},
        "Which pixels are traced: all of them; where blocks differ; or as the paper does, by its two "
        "versions of selective refinement or by selective expansion, one sample a pixel (default adaptive)");
    app.add_option("--macro", by.macro_px, "Size in pixels of the paper's macro pixels, a power of two (default 8)")
        ->type_name("N");
    app.add_option("--threshold", by.threshold_px, "The paper's smallest block in pixels, a power of two (default 1)")
        ->type_name("N");
    using Surface = RefineParams::Surface;
    add_choice<Surface>(app, "--surface", by.surface, {{"part", Surface::part}, {"face", Surface::face}},
                        "What paper1 and paper2 take for one visible surface (default part)");
    add_read(app, "--guides",
             "Positions of paper2's guide pixels in a block, such as \"0,0 1,0 0.5,1\" (default: its "
             "four corners)",
             "X,Y...",
             [&by](const std::string& text, const std::string& option) { by.guides = parse_guides(text, option); });
    app.add_flag("--compare-full", o.compare_full,
                 "Draw the picture with every pixel traced as well; say and report how the two compare");
    add_choice<Lines>(app, "--lines", o.render.lines, {{"none", Lines::none}, {"rim", Lines::rim}, {"all", Lines::all}},
                      "rim: along the hole's rim and where its cut surfaces end; all: outlines and creases of every "
                      "part as well (default rim)");
    add_choice<std::string>(app, "--isa", o.isa, {{"avx2", "avx2"}, {"native", "native"}},
                            "avx2: the same pixels on every machine; native: the fastest");
    add_camera(app, o.camera);
}

void add_reveal(CLI::App& app, RevealOptions& o) {
    add_model(app, o.common);
    app.option_defaults()->group("Who is seen, who is cut");
    add_list(app, "--target", o.target, "Parts that must be seen; may be given several times")->required();
    add_list(app, "--keep", o.keep, "Parts that stay whole; may be given several times");
    add_list(app, "--cut-only", o.cut_only, "Cut no parts but these; may be given several times");
    add_choice<bool>(app, "--see-through", o.keep_see_through, {{"cut", false}, {"keep", true}},
                     "Glass and other see-through parts: cut or kept whole (default cut)");
    add_choice<Rest>(app, "--rest", o.rest,
                     {{"keep", Rest::keep}, {"dim", Rest::dim}, {"line", Rest::line}, {"ghost", Rest::ghost}},
                     "Parts that are neither targets, kept nor cut: as they are, paler, lines alone, or a thin shell "
                     "(default keep)");
    app.option_defaults()->group("Hole");
    add_read(app, "--depth",
             "Width of the band that the hole adds around targets (default 5% of the picture's height, thin lines 3%)",
             "N[px|%|mm]",
             [&o](const std::string& text, const std::string& option) { o.plan.depth = parse_length(text, option); });
    add_choice<HoleStyle>(
        app, "--style", o.plan.style,
        {{"cutaway", HoleStyle::cutaway},
         {"hole", HoleStyle::hole},
         {"paper", HoleStyle::paper},
         {"ghost", HoleStyle::ghost}},
        "cutaway: a readable window with a chamfered rim; hole: straight walls along the outline; paper: as the "
        "paper builds it; ghost: no hole, what hides targets is a thin shell (default cutaway)");
    add_choice<HoleShape>(
        app, "--shape", o.plan.shape,
        {{"smooth", HoleShape::smooth},
         {"silhouette", HoleShape::silhouette},
         {"hull", HoleShape::hull},
         {"box", HoleShape::box}},
        "Outline of a cutaway: the targets' own, smoothed, their convex hull or box (default smooth)");
    add_read(
        app, "--bevel", "Width of a cutaway's chamfer; 0: straight walls (default: as the wall is thick)", "N[px|%|mm]",
        [&o](const std::string& text, const std::string& option) { o.plan.bevel = parse_length(text, option, true); });
    app.add_option("--angle", o.plan.angle_deg,
                   "Degrees by which a cutaway's walls lean back, all the way down, instead of a chamfer")
        ->type_name("DEGREES")
        ->check(CLI::Range(1.0, 89.0))
        ->excludes("--bevel");
    add_choice<bool>(app, "--steps", o.plan.steps, {{"auto", true}, {"off", false}},
                     "Layers that enclose one another open in steps (default auto)");
    add_read(app, "--cap", "How the cut through solid material is drawn (default own: the part's colour, set off)",
             "own|hatch|tint:#rrggbb", [&o](const std::string& text, const std::string& option) {
                 RenderParams& render = o.picture.render;
                 if (text.rfind("tint:", 0) == 0) {
                     render.cap = CapStyle::tint;
                     render.cap_tint = parse_color(text.substr(5), option);
                 } else if (text == "own" || text == "hatch") {
                     render.cap = text == "own" ? CapStyle::own : CapStyle::hatch;
                 } else {
                     throw Error(ErrorKind::usage, "E0105", option,
                                 "\"" + text.substr(0, 80) + "\" is not own, hatch or tint:#rrggbb");
                 }
             });
    add_list(app, "--solid", o.solid, "Parts that are capped wherever they are cut, though they hold a target");
    add_list(app, "--shell", o.shell, "Parts that are capped on the chamfer only, though they hold no target");
    add_choice<ContourMethod>(app, "--contours", o.plan.contours,
                              {{"exact", ContourMethod::exact},
                               {"full", ContourMethod::full},
                               {"fast", ContourMethod::fast},
                               {"paper", ContourMethod::paper}},
                              "How targets' outlines are found (default exact)");
    add_choice<Tight>(app, "--tight", o.plan.tight,
                      {{"refuse", Tight::refuse}, {"open", Tight::open}, {"ghost", Tight::ghost}},
                      "Targets without room for a band: refused, or opened all the same; ghost: the whole picture in "
                      "style ghost then (default refuse)");
    app.add_flag("--strict", o.strict, "Exit 8 if some target is refused or absent, not only if all are");
    app.add_option("--debug-dir", o.debug_dir, "Write every value of the plan as a picture")->type_name("DIR");
    add_picture(app, o.picture);
    app.option_defaults()->group("Look");
    add_choice<Emphasis>(app, "--emphasis", o.picture.render.emphasis,
                         {{"accent", Emphasis::accent}, {"saturate", Emphasis::saturate}, {"none", Emphasis::none}},
                         "How targets stand out (default accent)");
    add_common(app, o.common);
    app.footer("Selectors: a name, a path, a glob with * and **, re:EXPRESSION, #ID, mat:MATERIAL, name:NAME.\n\n"
               "Examples:\n"
               "  porthole reveal engine.glb --target 'rod*' -o rods.png --report rods.json\n"
               "  porthole reveal body.glb --target heart --keep 'mat:Bone' --camera front --size 2000x3000\n"
               "  porthole reveal saw.glb --target '#42' --depth 3% --no-background -o - | display -");
}

void add_render(CLI::App& app, RenderOptions& o) {
    add_model(app, o.common);
    add_list(app, "--focus", o.focus, "Frame the picture on these parts, as reveal does on its targets")
        ->group("Camera");
    add_picture(app, o.picture);
    app.option_defaults()->group("Look");
    using Mode = RenderOptions::Mode;
    add_choice<Mode>(app, "--mode", o.mode,
                     {{"raytraced", Mode::raytraced}, {"flat", Mode::flat}, {"wireframe", Mode::wireframe}},
                     "raytraced; flat: colour without light; wireframe: edges alone (default raytraced)");
    add_choice<Wire>(app, "--wire", o.wire.wire,
                     {{"auto", Wire::automatic}, {"mesh", Wire::mesh}, {"feature", Wire::feature}},
                     "Edges of a wireframe: of all triangles, or outlines, creases and borders; auto: all where "
                     "they are 8 px long on average and hidden ones are left out (default auto)");
    add_choice<HiddenLines>(app, "--hidden-lines", o.wire.hidden,
                            {{"none", HiddenLines::none}, {"dashed", HiddenLines::dashed}},
                            "Edges of a wireframe behind surfaces (default none)");
    add_common(app, o.common);
    app.footer("Examples:\n"
               "  porthole render engine.glb -o engine.png\n"
               "  porthole render part.stl --units mm --up z --camera front --size 800x600 -o part.jpg");
}

void add_parts(CLI::App& app, PartsOptions& o) {
    add_model(app, o.common);
    app.add_flag("--json", o.json, "As JSON, with materials, positions and counts of edges")->group("Output");
    add_common(app, o.common);
    app.footer("Examples:\n"
               "  porthole parts engine.glb\n"
               "  porthole parts engine.glb --json | jq -r '.parts[] | select(.closed | not) | .path'");
}

void add_check(CLI::App& app, CheckOptions& o) {
    app.add_option("REPORT", o.report, "The report that reveal or render wrote; - reads standard input")
        ->type_name("FILE")
        ->required();
    app.add_option("--model", o.common.model, "The model, if it is no longer where the report says")->type_name("FILE");
    app.add_option("--picture", o.picture, "The picture, if it is no longer where the report says")->type_name("FILE");
    app.add_flag("--json", o.json, "What was found as JSON")->group("Output");
    add_running(app, o.common);
    app.footer(
        "Traces the reported view again, densely, and draws both pictures again. Prints each thing that differs:\n"
        "what, where, reported, found. Exit 0 if nothing differs, 9 if something does.\n\n"
        "Examples:\n"
        "  porthole reveal engine.glb --target 'rod*' -o rods.png --report rods.json\n"
        "  porthole check rods.json");
}

/// Gives the keys of a --config file to the subcommand that was called. Keys of the other
/// subcommands are left out, so that one file serves all.
class JsonConfig : public CLI::Config {
public:
    explicit JsonConfig(const CLI::App& app) : app_(app) {}

    std::string to_config(const CLI::App*, bool, bool, std::string) const override { return {}; }

    std::vector<CLI::ConfigItem> from_config(std::istream& in) const override {
        const std::string text(std::istreambuf_iterator<char>(in), {});
        const std::string where = app_.get_option("--config")->as<std::string>();
        std::vector<CLI::ConfigItem> found;
        for (auto& [key, values] : parse_config(text, where)) {
            const auto knows = [option = "--" + key](const CLI::App* sub) {
                return sub->get_option_no_throw(option) != nullptr;
            };
            const auto called = app_.get_subcommands();
            const auto all = app_.get_subcommands([](const CLI::App*) { return true; });
            if (!called.empty() && knows(called.front())) {
                CLI::ConfigItem item;
                item.parents = {called.front()->get_name()};
                item.name = key;
                item.inputs = std::move(values);
                found.push_back(std::move(item));
            } else if (std::none_of(all.begin(), all.end(), knows)) {
                throw Error(ErrorKind::usage, "E0104", where, "\"" + key + "\" is not an option");
            }
        }
        return found;
    }

private:
    const CLI::App& app_;
};

/// An unknown option with the nearest known ones; CLI11's own words for everything else.
Error usage_error(const CLI::App& app, const CLI::ParseError& e) {
    const auto called = app.get_subcommands();
    const std::string command = called.empty() ? "porthole" : "porthole " + called.front()->get_name();
    std::string reason = e.what();
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    const std::vector<std::string> unknown = app.remaining(true);
    const bool extra = dynamic_cast<const CLI::ExtrasError*>(&e) != nullptr;
    if (!unknown.empty() && (extra || dynamic_cast<const CLI::RequiredError*>(&e) != nullptr)) {
        // An unknown option is named rather than the value after it, whatever their order.
        const auto option =
            std::find_if(unknown.begin(), unknown.end(), [](const std::string& u) { return u.starts_with('-'); });
        const std::string& word = option == unknown.end() ? unknown.front() : *option;
        std::vector<std::string> known;
        for (const CLI::App* sub : called)
            for (const CLI::Option* o : sub->get_options())
                for (const std::string& name : o->get_lnames()) known.push_back("--" + name);
        if (called.empty())
            for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; }))
                known.push_back(sub->get_name());
        reason = "\"" + word.substr(0, 80) + "\" is not known here";
        const std::vector<std::string> near =
            word.size() < 3 ? std::vector<std::string>{} : nearest_names(word.substr(0, word.find('=')), known, 2);
        for (std::size_t i = 0; i < near.size(); ++i) {
            reason += i ? " or " : "; did you mean ";
            reason += near[i];
        }
        if (!near.empty()) reason += '?';
    }
    return {ErrorKind::usage, "E0101", command, reason + " (" + command + " --help)"};
}

struct CommandLine {
    RevealOptions reveal;
    RenderOptions render;
    PartsOptions parts;
    CheckOptions check;
};

/// Where pictures go when -o is not given.
void default_output(PictureOptions& options) {
    if (options.output.empty() && !options.json && options.report_path != "-") options.output = "out.png";
}

int run(const CLI::App& app, CommandLine& line, Output& out, const std::stop_token& stop) {
    const auto start = [&](const CommonOptions& common) {
        out.configure(common.quiet, common.verbose, common.log == "json");
        limit_memory(common);
        return Control{stop, [&out](std::string_view stage, double share) { out.progress(stage, share); },
                       common.threads};
    };
    if (app.got_subcommand("reveal")) {
        default_output(line.reveal.picture);
        return run_reveal(line.reveal, out, start(line.reveal.common));
    }
    if (app.got_subcommand("render")) {
        default_output(line.render.picture);
        return run_render(line.render, out, start(line.render.common));
    }
    if (app.got_subcommand("check")) return run_check(line.check, out, start(line.check.common));
    return run_parts(line.parts, out, start(line.parts.common));
}

int parse_and_run(int argc, char** argv, Output& out, const std::stop_token& stop) {
    CommandLine line;
    CLI::App app("See the parts hidden inside a 3D model without taking it apart.", "porthole");
    app.set_version_flag("--version", std::string("porthole ") + PORTHOLE_VERSION);
    app.require_subcommand(1);
    app.footer("Examples:\n"
               "  porthole parts engine.glb\n"
               "  porthole reveal engine.glb --target 'rod*' -o rods.png\n"
               "  porthole render engine.glb -o engine.png\n\n"
               "porthole COMMAND --help lists the options of a command; --config FILE reads options from JSON:\n"
               "  { \"size\": \"1280x720\", \"target\": [\"rod*\"], \"no-shadows\": true }\n\n"
               "Exit codes: 0 done, 1 a bug, 2 usage, 3 input, 4 output, 5 a limit, 8 nothing revealed,\n"
               "9 check found differences, 130 and 143 interrupted.");
    app.set_config("--config", "", "Read options from a JSON file; the command line wins");
    app.config_formatter(std::make_shared<JsonConfig>(app));
    const auto command = [&](const char* name, const char* help) {
        CLI::App* const sub = app.add_subcommand(name, help);
        sub->fallthrough(); // --config after the command
        return sub;
    };
    add_reveal(*command("reveal", "Open a hole so that parts inside can be seen"), line.reveal);
    add_render(*command("render", "Draw the plain picture"), line.render);
    add_parts(*command("parts", "List the parts: ids, triangles, closed or open, size"), line.parts);
    add_check(*command("check", "Trace a report's view again and compare"), line.check);
    try {
        app.parse(argc, argv);
    } catch (const CLI::Success& e) { // --help, --version
        return app.exit(e);
    } catch (const CLI::ParseError& e) {
        if (argc <= 1) {
            std::fputs(app.help().c_str(), stderr);
            return kExitUsage;
        }
        throw usage_error(app, e);
    }
    return run(app, line, out, stop);
}

} // namespace
} // namespace porthole::cli

int main(int argc, char** argv) {
    using namespace porthole;
    using namespace porthole::cli;
    const Signals signals;
    Output out;
    int code = kExitBug;
    const auto fail = [&](ErrorKind kind, const char* error_code, const std::string& where, const std::string& reason) {
        out.error({kind, error_code, where, reason});
        code = exit_code(kind);
    };
    try {
        code = parse_and_run(argc, argv, out, signals.token());
    } catch (const Cancelled&) {
        fail(ErrorKind::bug, "E0903", "", "interrupted");
    } catch (const Error& e) {
        out.error(e);
        code = exit_code(e.kind);
    } catch (const std::bad_alloc&) {
        fail(ErrorKind::limit, "E0902", "", "out of memory");
    } catch (const std::system_error& e) {
        // The only one that good programs meet: no further thread can be started.
        fail(ErrorKind::limit, "E0904", "", std::string("the system refuses resources: ") + e.what());
    } catch (const std::exception& e) {
        fail(ErrorKind::bug, "E0001", "", std::string("this is a bug: ") + e.what());
    }
    return signals.received() != 0 && code != kExitDone ? 128 + signals.received() : code;
}
