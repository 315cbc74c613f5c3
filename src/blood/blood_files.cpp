#include "blood/blood_files.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "core/error.hpp"
#include "core/units.hpp"
#include "output/hdf5_file.hpp"
#include "output/on_root.hpp"

namespace corpuscle {

namespace {

namespace fs = std::filesystem;

constexpr const char* columns =
    "time_us,hematocrit,mean_speed_mm_per_s,cell_speed_mm_per_s,discharge_hematocrit,relative_apparent_viscosity,cell_"
    "free_layer_um";

}  // namespace

BloodFiles::BloodFiles(const std::string& folder, const Comm& comm, std::optional<double> restart_us)
    : folder_(folder), comm_(comm), table_((fs::path(folder) / "blood.csv").string(), comm, columns, restart_us) {}

void BloodFiles::write(const BloodSample& sample) {
  on_root(comm_, [&] {
    std::string line = fmt::format("{:.17g}", sample.time_us);
    for (const double value : {sample.hematocrit, sample.mean_speed / units::mm_per_s, sample.cell_speed / units::mm_per_s,
                               sample.discharge_hematocrit, sample.relative_viscosity, sample.cell_free_layer_um})
      line += std::isfinite(value) ? fmt::format(",{:.17g}", value) : ",";
    table_.write(line);
  });
}

void BloodFiles::write_profile([[maybe_unused]] const BloodSampler& sampler, [[maybe_unused]] double time_us) const {
#ifdef CORPUSCLE_HDF5
  const auto profile = sampler.profile();
  if (profile.hematocrit.empty() || sampler.samples() == 0) return;
  on_root(comm_, [&] {
    const std::string path = (fs::path(folder_) / "blood.h5").string(), temporary = path + ".part";
    auto file = Hdf5File::create(temporary);
    const auto write = [&](const char* name, const std::vector<double>& values) {
      file.write(std::string("profile/") + name, {values.size()}, values.data());
    };
    write("edge_um", profile.edge_um);
    write("hematocrit", profile.hematocrit);
    write("hematocrit_error", profile.hematocrit_error);
    write("velocity_um", profile.velocity_um);
    write("velocity_mm_per_s", profile.velocity_mm_per_s);
    write("velocity_error_mm_per_s", profile.velocity_error_mm_per_s);
    file.attribute("/", "across", std::string(sampler.tube() ? "distance from the centreline" : "height over the lower wall"));
    file.attribute("/", "time_us", time_us);
    file.attribute("/", "samples", static_cast<std::int64_t>(sampler.samples()));
    file.close();
    std::error_code error;
    fs::rename(temporary, path, error);
    if (error) throw ComputationError(fmt::format("{}: cannot put this file in place: {}", path, error.message()));
  });
#endif
}

}  // namespace corpuscle
