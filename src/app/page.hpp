// A page of a run's results, by the script that lies beside the cases.
#pragma once

#include <string>

namespace corpuscle {

/// Start cases/report.py in the place of this process: it writes `folder`/report.html, or `out`.
/// @throws InputError  the script, or a Python, is not there
[[noreturn]] void make_page(const std::string& folder, const std::string& out);

}  // namespace corpuscle
