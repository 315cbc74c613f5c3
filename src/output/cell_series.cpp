#ifdef CORPUSCLE_HDF5

#include "output/cell_series.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "core/error.hpp"
#include "output/on_root.hpp"

namespace corpuscle {
namespace {

const std::string format_name = "a series of cells' figures of Corpuscle";
const std::string name = "cell_series", shared = "numbers", places = "centroid_um";

}  // namespace

CellSeries::CellSeries(const std::string& folder, const Comm& comm, hsize_t cells, const Rows& mine, std::optional<double> restart_us)
    : comm_(comm),
      cells_(cells),
      series_(folder, name, format_name, comm, shared, {"number"},
              [this](const StoredTime& time, const Hdf5File& file) { return describe(time, file); }) {
  if (restart_us && series_.exists()) {
    on_root(comm_, [&] {
      const auto path = (std::filesystem::path(folder) / (name + ".h5")).string();
      stored_times(path, format_name);
      const auto found = Hdf5File::read(path).shape("number");
      if (found != Shape{cells_})
        throw InputError(fmt::format("{}: cannot continue this file, it has {} cells and this case {}; choose another folder with --out",
                                     path, found.at(0), cells_));
    });
    series_.resume(*restart_us);
    return;
  }
  series_.create();
  std::vector<std::int32_t> numbers;
  for (const auto& piece : mine.pieces)
    for (hsize_t n = 0; n < piece.count; ++n) numbers.push_back(static_cast<std::int32_t>(piece.first + n));
  auto file = Hdf5File::create(series_.shared_path(), comm_);
  file.write("number", {cells_}, mine, numbers.data());
  file.close();
  series_.finish_shared();
}

void CellSeries::write(double time_us, long step, const Rows& mine, const std::vector<CellTable>& tables) {
  auto file = Hdf5File::create(series_.step_path(step), comm_);
  for (const auto& table : tables)
    file.write(table.name, table.components == 1 ? Shape{cells_} : Shape{cells_, static_cast<hsize_t>(table.components)}, mine,
               table.values);
  file.attribute("/", "time_us", time_us);
  file.attribute("/", "step", static_cast<std::int64_t>(step));
  file.close();
  series_.finish(step, time_us);
}

std::string CellSeries::describe(const StoredTime& time, const Hdf5File& file) const {
  const std::string own = name + "/" + time.group + ".h5";
  const auto number = xdmf_item(name + "/" + shared + ".h5", "number", {cells_}, "Int", 4);
  // With the points' numbers, which are the cells': without a list of them ParaView shows none.
  auto text = fmt::format(
      "    <Topology TopologyType=\"Polyvertex\" NumberOfElements=\"{}\" NodesPerElement=\"1\">\n     {}\n    "
      "</Topology>\n"
      "    <Geometry GeometryType=\"XYZ\">\n     {}\n    </Geometry>\n",
      cells_, number, xdmf_item(own, places, {cells_, 3}, "Float", 8));
  for (const auto& table : file.entries("/")) {
    if (table == places) continue;
    const auto shape = file.shape(table);
    text += xdmf_attribute(table, shape.size() == 2 ? 3 : 1, "Node", xdmf_item(own, table, shape, "Float", 8));
  }
  return text + xdmf_attribute("cell", 1, "Node", number);
}

}  // namespace corpuscle

#endif
