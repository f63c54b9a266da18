// What the program measures, by family; a family's name begins the names of its benchmarks.
//
// Every claim is a ratio of two benchmarks of one run: a thing and its yardstick. scripts/bench_table.py
// knows which, and what is wanted.
#pragma once

namespace porthole::bench {

class Launcher;

struct Settings {
    bool quick = false; ///< few scenes, small pictures
};

/// primary/SCENE/{bare,ids}: the nearest hits of a picture, by a bare Embree loop and by the library.
void add_primary(const Settings& settings);

/// refine/SCENE/{1080p,4K}/SAMPLES/{full,adaptive}: a picture. Counters: dB, wrong_ids_%, missed (parts that
/// only `full` shows), traced_% (of the pixels).
void add_refine(const Settings& settings);

/// antialias/SCENE/{one,uniform:16,edges:N,adaptive:N}: 16 samples in every pixel, and at most N where
/// neighbours differ, every pixel traced or by adaptive refinement. Counters: dB against 256 samples in every pixel,
/// samples (a pixel, on average).
void add_antialias(const Settings& settings);

/// contours/SCENE/TARGETS/{paper,paper_flat,full,exact,fast}. Counters: complete (share of the contour pixels of
/// the full target id buffer that were found), missed and false (pixels), rays.
void add_contours(const Settings& settings);

/// cut/SCENE/{plan,plain,cutaway,absent,hole_capped,hole_uncapped}: `absent` is `cutaway` of a scene from which
/// the removed geometry is truly gone. The last four also as ..._one_sample: one sample a pixel and no lines, so
/// that both sides of a ratio draw as much; by default a hole has twice the samples, and lines at its caps.
void add_cut(const Settings& settings);

/// threads/SCENE/{frame,reveal}/{1,2}: wall time on one thread and on two.
void add_threads(const Settings& settings);

/// instances/{1000,1}/{build,top,bounds,ids,direct_frame,rough_frame,frame}: placements of a mesh of a million
/// triangles, on all threads.
void add_instances(const Settings& settings);

/// job/MODEL/{reveal,render}: the program itself, file to PNG. Counters: cpu_s, peak_MB, bytes_per_triangle
/// (peak memory beyond the file's size), and the report's seconds.
/// @param launcher  outlives the benchmarks.
void add_jobs(const Settings& settings, Launcher& launcher);

} // namespace porthole::bench
