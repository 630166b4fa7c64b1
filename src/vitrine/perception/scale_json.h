// perception/scale_json.h: the study as text: scale.json ("vitrine.mlds/1") and the list of stimuli
// ("vitrine.mlds_stimuli/1"). Text in, text out: files are opened by those who call.
#pragma once

#include "perception/study.h"

#include <string>
#include <vector>

namespace vitrine {

/// Fields of interfaces: psi, beta, sigma, log_likelihood, ci95, lambda {value, ci95, local}; the
/// rest of the analysis beside them. Values that do not exist (an unbounded limit) are null.
std::string study_to_json(const StudyAnalysis& study);

/// @throws InputError for anything that `study_to_json` would not have written.
StudyAnalysis study_from_json(const std::string& text, const std::string& name);

/// What chance adds to the lightness L*, exceeded in one pixel of a hundred.
struct StimulusNoise {
    double picture = 0.0;          ///< of one picture
    double picture_seen = 0.0;     ///< the same after the blur of the computational observer
    double difference = 0.0;       ///< of the difference between two neighbours of the series
    double difference_seen = 0.0;  ///< the same after the blur
};

/// A rendered series: what `vitrine mlds stimuli` leaves beside its pictures.
struct StimulusSeries {
    std::vector<double> ior;          ///< rising, one per rank
    std::vector<std::string> images;  ///< PNG file names, one per rank; may be empty (no pictures)
    std::vector<std::string> linear;  ///< EXR file names, may be empty
    std::string title;                ///< for the experimenter
    std::string integrator;           ///< "photon" or "path"
    double exposure = 1.0;            ///< one factor for all pictures
    StimulusNoise noise;
};
std::string series_to_json(const StimulusSeries& series);
StimulusSeries series_from_json(const std::string& text, const std::string& name);

/// `count` equal steps from `begin` to `end`, both included; rounded to 1e-9 so that 1.4 stays 1.4.
std::vector<double> equal_steps(double begin, double end, int count);

}  // namespace vitrine
