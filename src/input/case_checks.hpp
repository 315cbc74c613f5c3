// What no single key can show: sides given twice, an inlet with no way out, modules that contradict each other.
#pragma once

#include <functional>
#include <string>

#include "input/case.hpp"

namespace corpuscle {

/// Reports a problem with a section ("boundary.2") or, where key is not empty, with one of its keys. Does not return.
using Complaint = std::function<void(const std::string& section, const std::string& key, const std::string& problem)>;

/// All six sides once, periodic ones in pairs, tube walls closed, and a way out for what flows in.
void check_boundaries(const Case& scene, const Complaint& complain);

/// Sections that need each other or exclude each other.
void check_modules(const Case& scene, const Complaint& complain);

/// After [time]: whether anything is sampled at all.
void check_sampling(const Case& scene, const Complaint& complain);

/// Whether a run to its end takes a sample of blood. @pre scene.blood
bool is_sampled(const Case& scene);

/// Once [output] is read.
void check_output(const Case& scene, const Complaint& complain);

const char* name_of(BoundarySettings::Side side);

}  // namespace corpuscle
