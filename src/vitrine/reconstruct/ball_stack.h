// reconstruct/ball_stack.h: which ball of a cluster lies before which, and those mostly hidden.
#pragma once

#include "reconstruct/circle_edges.h"

#include <vector>

namespace vitrine {

/// Where the mask shows what no ball covers, there are balls behind, mostly hidden: as large as the
/// others, within the mask but for what balls before them hide, their few edges on the outline.
/// Appended to `balls`; their heights are left to stack_heights.
/// @param small_mask share of the object in each pixel of the picture shrunk by `shrink`
void add_partly_hidden(std::vector<Ball>& balls, const ImageF& small_mask,
                       const std::vector<EdgePoint>& points, double shrink);

/// Who is in front of whom, by whose outline shows where two discs overlap: edge points inside the
/// other disc. Mostly hidden balls, last, lie behind those before them. Solid bodies: who is in
/// front is so by as much as touching asks for, or more; as little more as all pairs allow.
void stack_heights(std::vector<Ball>& balls, const std::vector<EdgePoint>& points, double shrink);

}  // namespace vitrine
