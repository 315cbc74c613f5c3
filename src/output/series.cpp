#ifdef CORPUSCLE_HDF5

#include "output/series.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.hpp"
#include "output/text_file.hpp"

namespace corpuscle {

std::string step_group(long step) { return fmt::format("step_{:09d}", step); }

std::vector<StoredTime> stored_times(const std::string& path, const std::string& format) {
  const auto file = Hdf5File::read(path);
  if (!file.has_attribute("/", "format") || file.text("/", "format") != format)
    throw InputError(
        fmt::format("{}: cannot continue this file, it is not {}; choose another folder with --out", path, format));
  std::vector<StoredTime> times;
  for (const auto& name : file.entries("/"))
    if (name.rfind("step_", 0) == 0 && file.has_attribute(name, "time_us"))
      times.push_back({name, file.number(name, "time_us")});
  return times;
}

void remove_later(Hdf5File& file, std::vector<StoredTime>& times, double last_us) {
  // Times are multiples of the step; the slack keeps the one at which the run starts again.
  const auto later = [&](const StoredTime& t) { return t.time_us > last_us * (1 + 1e-12); };
  for (const auto& time : times)
    if (later(time)) file.remove(time.group);
  times.erase(std::remove_if(times.begin(), times.end(), later), times.end());
}

void remove_step(Hdf5File& file, std::vector<StoredTime>& times, const std::string& group) {
  const auto same = std::find_if(times.begin(), times.end(), [&](const StoredTime& t) { return t.group == group; });
  if (same == times.end()) return;
  file.remove(group);
  times.erase(same);
}

void write_xdmf(const std::string& path, const std::string& title, const std::vector<StoredTime>& times,
                const std::function<std::string(const StoredTime&)>& grid) {
  std::string text = fmt::format(
      "<?xml version=\"1.0\" ?>\n<Xdmf Version=\"3.0\">\n <Domain>\n"
      "  <Grid Name=\"{}\" GridType=\"Collection\" CollectionType=\"Temporal\">\n",
      title);
  for (const auto& time : times)
    text += fmt::format("   <Grid Name=\"{}\" GridType=\"Uniform\">\n    <Time Value=\"{}\"/>\n{}   </Grid>\n", title,
                        time.time_us, grid(time));
  replace_text_file(path, text + "  </Grid>\n </Domain>\n</Xdmf>\n");
}

std::string xdmf_item(const std::string& file, const std::string& data_set, const Shape& shape, const char* number,
                      int bytes) {
  return fmt::format("<DataItem Dimensions=\"{}\" NumberType=\"{}\" Precision=\"{}\" Format=\"HDF\">{}:/{}</DataItem>",
                     fmt::join(shape, " "), number, bytes, file, data_set);
}

std::string xdmf_attribute(const std::string& name, int components, const char* center, const std::string& item) {
  return fmt::format("    <Attribute Name=\"{}\" AttributeType=\"{}\" Center=\"{}\">\n     {}\n    </Attribute>\n",
                     name, components == 3 ? "Vector" : "Scalar", center, item);
}

}  // namespace corpuscle

#endif
