// blood.csv, with a line for each sample, and blood.h5, with the profiles.
#pragma once

#include "blood/blood_sampler.hpp"
#include "output/sample_table.hpp"

namespace corpuscle {

class BloodFiles {
 public:
  /// Every rank calls. @throws InputError  blood.csv cannot be written, or the one to continue has other columns
  BloodFiles(const std::string& folder, const Comm& comm, std::optional<double> restart_us);

  void write(const BloodSample& sample);
  /// The means so far; the file that was there stays until this one is whole. Nothing without HDF5 or without samples.
  void write_profile(const BloodSampler& sampler, double time_us) const;

 private:
  std::string folder_;
  Comm comm_;
  SampleTable table_;
};

}  // namespace corpuscle
