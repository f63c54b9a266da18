// Every option that changes pixels, named once: the report writes them and reads them back.
#pragma once

#include <type_traits>

#include "porthole/params.h"

namespace porthole::fields {

// Names of values. A new value without a name does not compile; nullptr: no value at all.
inline const char* name_of(ContourMethod method) {
    switch (method) {
    case ContourMethod::exact: return "exact";
    case ContourMethod::full: return "full";
    case ContourMethod::fast: return "fast";
    case ContourMethod::paper: return "paper";
    }
    return nullptr;
}
inline const char* name_of(HoleStyle style) {
    switch (style) {
    case HoleStyle::cutaway: return "cutaway";
    case HoleStyle::hole: return "hole";
    case HoleStyle::paper: return "paper";
    case HoleStyle::ghost: return "ghost";
    }
    return nullptr;
}
inline const char* name_of(HoleShape shape) {
    switch (shape) {
    case HoleShape::silhouette: return "silhouette";
    case HoleShape::smooth: return "smooth";
    case HoleShape::hull: return "hull";
    case HoleShape::box: return "box";
    }
    return nullptr;
}
inline const char* name_of(Tight tight) {
    switch (tight) {
    case Tight::refuse: return "refuse";
    case Tight::open: return "open";
    case Tight::ghost: return "ghost";
    }
    return nullptr;
}
inline const char* name_of(Length::Unit unit) {
    switch (unit) {
    case Length::Unit::pixel: return "px";
    case Length::Unit::percent: return "%";
    case Length::Unit::millimetre: return "mm";
    }
    return nullptr;
}
inline const char* name_of(Emphasis emphasis) {
    switch (emphasis) {
    case Emphasis::accent: return "accent";
    case Emphasis::saturate: return "saturate";
    case Emphasis::none: return "none";
    }
    return nullptr;
}
inline const char* name_of(CapStyle cap) {
    switch (cap) {
    case CapStyle::own: return "own";
    case CapStyle::tint: return "tint";
    case CapStyle::hatch: return "hatch";
    }
    return nullptr;
}
inline const char* name_of(Lines lines) {
    switch (lines) {
    case Lines::none: return "none";
    case Lines::rim: return "rim";
    case Lines::all: return "all";
    }
    return nullptr;
}
inline const char* name_of(Rest rest) {
    switch (rest) {
    case Rest::keep: return "keep";
    case Rest::dim: return "dim";
    case Rest::line: return "line";
    case Rest::ghost: return "ghost";
    }
    return nullptr;
}
inline const char* name_of(Wire wire) {
    switch (wire) {
    case Wire::none: return "none";
    case Wire::automatic: return "auto";
    case Wire::mesh: return "mesh";
    case Wire::feature: return "feature";
    }
    return nullptr;
}
inline const char* name_of(HiddenLines hidden) {
    switch (hidden) {
    case HiddenLines::none: return "none";
    case HiddenLines::dashed: return "dashed";
    }
    return nullptr;
}
inline const char* name_of(Shading shading) {
    switch (shading) {
    case Shading::raytraced: return "raytraced";
    case Shading::flat: return "flat";
    }
    return nullptr;
}
inline const char* name_of(Refine refine) {
    switch (refine) {
    case Refine::full: return "full";
    case Refine::adaptive: return "adaptive";
    case Refine::paper1: return "paper1";
    case Refine::paper2: return "paper2";
    case Refine::expansion: return "expansion";
    }
    return nullptr;
}

inline const char* name_of(RefineParams::Surface surface) {
    switch (surface) {
    case RefineParams::Surface::part: return "part";
    case RefineParams::Surface::face: return "face";
    }
    return nullptr;
}

/// `Params`, const or not.
template <typename T, typename Params>
concept Is = std::is_same_v<std::remove_const_t<T>, Params>;

// for_each(params, visit) calls visit(name, field) for every field in turn. The structured
// bindings are there so that a new field does not compile until it has a name here.

template <Is<PlanParams> T, typename Visit> void for_each(T& params, Visit&& visit) {
    auto& [contours, style, depth, tight, solidity, shape, bevel, angle_deg, steps] = params;
    visit("contours", contours);
    visit("style", style);
    visit("depth", depth);
    visit("tight", tight);
    visit("solid", solidity.solid);
    visit("shell", solidity.shell);
    visit("shape", shape);
    visit("bevel", bevel);
    visit("angle_deg", angle_deg);
    visit("steps", steps);
}

template <Is<RenderParams> T, typename Visit> void for_each(T& params, Visit&& visit) {
    auto& [samples, uniform, ao_samples, shadows, max_bounces, refine, refine_by, shading, emphasis, lines, cap,
           cap_tint, rim_px, background] = params;
    visit("samples", samples);
    visit("uniform", uniform);
    visit("ao_samples", ao_samples);
    visit("shadows", shadows);
    visit("max_bounces", max_bounces);
    visit("refine", refine);
    auto& [macro_px, threshold_px, surface, guides] = refine_by;
    visit("macro_px", macro_px);
    visit("threshold_px", threshold_px);
    visit("surface", surface);
    visit("guides", guides);
    visit("shading", shading);
    visit("emphasis", emphasis);
    visit("cap", cap);
    visit("cap_tint", cap_tint);
    visit("lines", lines);
    visit("rim_px", rim_px);
    visit("background", background);
}

template <Is<RevealParams> T, typename Visit> void for_each(T& params, Visit&& visit) {
    auto& [targets, keep, cut_only, keep_see_through, rest, camera, width, height, view, plan, render, wire,
           compare_full] = params;
    (void)camera, (void)width, (void)height, (void)view; // the report's camera and size say where from
    visit("targets", targets);
    visit("keep", keep);
    visit("cut_only", cut_only);
    visit("keep_see_through", keep_see_through);
    visit("rest", rest);
    for_each(plan, visit);
    for_each(render, visit);
    visit("wire", wire.wire);
    visit("hidden_lines", wire.hidden);
    visit("wire_px", wire.width_px);
    visit("compare_full", compare_full);
}

} // namespace porthole::fields
