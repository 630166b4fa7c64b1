// reconstruct/candidates.h: the things on the support plane whose depth lies: glass, metal and what
// looks like them. Each gets silhouettes and a closed hull; what it is made of is decided later.
#pragma once

#include "reconstruct/scan.h"
#include "reconstruct/single_view.h"

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace vitrine {

struct CandidateOptions {
    double voxel_m = 0.005;         ///< of the voting grid
    double max_height_m = 0.5;      ///< objects stand on the support plane and are lower than this
    double min_bad_fraction = 0.6;  ///< of the views that can tell, must have no or wrong depth
    int min_views = 3;              ///< that can tell
    double min_volume_m3 = 1e-5;    ///< about 2 cm cubed
    double hull_spacing_m = 0.0015;
    int rounds = 3;            ///< silhouettes and hull in turn
    bool use_symmetry = true;  ///< complete bodies of revolution by their symmetry
    /// Silhouettes edited by the user, by (candidate id, frame id): taken as they are.
    std::map<std::pair<std::string, std::string>, Mask> edited_silhouettes;
    /// Boxes given by the user, in the world: each becomes a candidate even without bad depth, and
    /// replaces what was found inside it.
    std::vector<Box3> boxes;
};

/// A body of revolution: `axis_point` + h * `axis`, radius profile by height.
struct Revolution {
    bool is_found = false;
    Vec3 axis_point = Vec3::Zero();
    Vec3 axis = Vec3::UnitZ();
    double residual_px = 0.0;  ///< mean distance of its outline to the silhouettes
};

struct Candidate {
    std::string id;  ///< object_0, ...: by falling volume of bad depth, then the boxes given
    std::vector<Mask> silhouettes;   ///< visible pixels, one per frame; empty mask: not seen
    std::vector<Mask> hidden;        ///< pixels of its hull behind nearer surfaces; same layout
    Mesh hull;                       ///< closed, world, unit normals, resting on the support plane
    Box3 box;                        ///< of the hull
    Revolution revolution;           ///< symmetry found and used
    double outline_residual_px = 0;  ///< mean distance of the hull's outline to the silhouettes
    double bad_depth_fraction = 0;   ///< of its silhouettes' pixels: missing, too near or too far
    std::string evidence;            ///< one plain sentence: why it is a candidate
};

struct Candidates {
    std::vector<Candidate> objects;
    std::vector<Outline> outlines;  ///< of a capture with too few views for shapes; then no objects
    std::vector<std::string> notes;
};

/// Fewer than `min_views` frames give outlines only (single_view.h), and the notes say what is
/// missing. Cost: about 1 s a view and object at 640x360 on two cores. No candidates is a valid
/// answer.
Candidates find_candidates(const Capture& capture, const Scan& scan,
                           const CandidateOptions& options = {}, const Progress& progress = {});

}  // namespace vitrine
