// Fields, cells and checkpoints in HDF5, on any number of ranks.
#ifdef CORPUSCLE_HDF5

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.hpp"
#include "folder.hpp"
#include "output/cell_writer.hpp"
#include "output/checkpoint.hpp"
#include "output/field_writer.hpp"

using namespace corpuscle;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

// A grid of 4 x 5 x 12 cells, cut along k over the ranks.
IndexSpace block(const Comm& comm) {
  IndexSpace index;
  const int all[3] = {4, 5, 12};
  for (int d = 0; d < 3; ++d) index.n[d] = index.global[d] = all[d];
  index.n[2] = all[2] / comm.size();
  index.first[2] = index.n[2] * comm.rank();
  return index;
}

// A value that tells its global place.
double place(int i, int j, int k, int component) { return i + 10 * j + 100 * k + 0.1 * component; }

std::vector<double> values(const IndexSpace& index, int components, int more) {
  std::vector<double> out;
  for (int k = 0; k < index.n[2] + more; ++k)
    for (int j = 0; j < index.n[1] + more; ++j)
      for (int i = 0; i < index.n[0] + more; ++i)
        for (int c = 0; c < components; ++c) out.push_back(place(index.first[0] + i, index.first[1] + j, index.first[2] + k, c));
  return out;
}

std::vector<double> whole(int components, int more) {
  IndexSpace all;
  const int n[3] = {4, 5, 12};
  for (int d = 0; d < 3; ++d) all.n[d] = all.global[d] = n[d];
  return values(all, components, more);
}

void store(FieldWriter& writer, const IndexSpace& index, double time, long step) {
  const auto velocity = values(index, 3, 0), pressure = values(index, 1, 0);
  const std::vector<std::int8_t> kind(index.owned(), static_cast<std::int8_t>(step));
  writer.write(time, step, {{"velocity_um_per_us", 3, velocity.data()}, {"pressure_kPa", 1, pressure.data()}}, {{"kind", kind.data()}});
}

CheckpointHeader header() {
  CheckpointHeader h;
  h.resolved = std::string(100000, '#');  // longer than an HDF5 attribute may be
  h.cells = {4, 5, 12};
  h.step = 1234567890123;
  h.time_us = 0.1 + 0.2;
  return h;
}

void write_checkpoint(const std::string& path, const Comm& comm) {
  const auto index = block(comm);
  const auto p = values(index, 1, 0);
  const std::vector<double> x{1.0 / 3, 2.0 / 7, -0.0};
  const std::vector<std::int64_t> number{7, -8};
  CheckpointWriter writer(path, comm, header());
  writer.add("membrane/x", {1, 3}, x.data());
  writer.add("search/number", {2}, number.data());
  const auto first = static_cast<hsize_t>(index.first[2]), count = static_cast<hsize_t>(index.n[2]);
  writer.add("fluid/p", {12, 5, 4}, Slab{{first, 0, 0}, {count, 5, 4}}, p.data());
  writer.commit();
}

std::string read_error(const fs::path& path) {
  return test::message_of<InputError>([&] { CheckpointReader reader(path.string()); });
}

}  // namespace

TEST_CASE("fields written by all ranks are those of the whole grid", "[ranks]") {
  const auto folder = test::fresh_folder("fields");
  const Comm comm;
  const auto index = block(comm);
  const auto nodes = values(index, 3, 1);
  FieldWriter writer(folder.string(), comm, index, nodes.data());
  store(writer, index, 0, 0);
  store(writer, index, 2.5, 5);
  comm.barrier();

  const auto file = Hdf5File::read((folder / "fields.h5").string());
  REQUIRE(file.shape("nodes_um") == Shape{13, 6, 5, 3});
  std::vector<double> found(13 * 6 * 5 * 3);
  file.read("nodes_um", found.data());
  REQUIRE(found == whole(3, 1));
  for (const auto& group : {step_group(0), step_group(5)}) {
    found.resize(12 * 5 * 4 * 3);
    file.read(group + "/velocity_um_per_us", found.data());
    REQUIRE(found == whole(3, 0));
    found.resize(12 * 5 * 4);
    file.read(group + "/pressure_kPa", found.data());
    REQUIRE(found == whole(1, 0));
    std::vector<std::int32_t> kind(12 * 5 * 4);
    file.read(group + "/kind", kind.data());
    REQUIRE(kind == std::vector<std::int32_t>(kind.size(), group == step_group(5) ? 5 : 0));
  }
  REQUIRE(file.number(step_group(5), "time_us") == 2.5);

  const auto xdmf = test::contents(folder / "fields.xdmf");
  REQUIRE_THAT(xdmf, Contains("Time Value=\"0\"") && Contains("Time Value=\"2.5\"") && Contains("3DSMesh") &&
                         Contains("Dimensions=\"13 6 5\"") && Contains("fields/step_000000005.h5:/velocity_um_per_us"));
}

TEST_CASE("a restart keeps stored times up to its own and appends", "[ranks]") {
  const auto folder = test::fresh_folder("fields_restart");
  const Comm comm;
  const auto index = block(comm);
  const auto nodes = values(index, 3, 1);
  const std::vector<std::int32_t> triangles{0, 1, 2, 0, 2, 3}, bodies{0, 0};
  const std::vector<double> x(12, 1.5);
  const auto run = [&](int from, int to, std::optional<double> restart) {
    FieldWriter fields(folder.string(), comm, index, nodes.data(), restart);
    CellWriter cells(folder.string(), comm, triangles, bodies, 4, restart);
    for (int step = from; step <= to; ++step) {
      store(fields, index, 0.1 * step, step);
      cells.write(0.1 * step, step, x.data(), {{"velocity_um_per_us", 3, x.data()}});
    }
    comm.barrier();
  };
  run(0, 4, {});
  const auto fields = test::contents(folder / "fields.xdmf"), cells = test::contents(folder / "cells.xdmf");
  comm.barrier();
  run(3, 4, 0.1 * 2);
  REQUIRE(test::contents(folder / "fields.xdmf") == fields);
  REQUIRE(test::contents(folder / "cells.xdmf") == cells);
  run(2, 2, 0.1 * 2);  // the step of the restart itself is replaced, not doubled
  const auto times = stored_times((folder / "fields.h5").string(), "a series of fields of Corpuscle");
  REQUIRE(times.size() == 3);
  REQUIRE(times.back().time_us == 0.1 * 2);
}

TEST_CASE("fields and cells of another case are not continued") {
  const auto folder = test::fresh_folder("fields_other");
  const Comm comm;
  auto index = block(comm);
  const auto nodes = values(index, 3, 1);
  { FieldWriter writer(folder.string(), comm, index, nodes.data()); }
  { CellWriter writer(folder.string(), comm, {0, 1, 2}, {0}, 3); }
  index.global[0] = index.n[0] = 3;
  const auto grid = test::message_of<InputError>([&] { FieldWriter(folder.string(), comm, index, nodes.data(), 1.0); });
  REQUIRE_THAT(grid, Contains("fields.h5") && Contains("13 x 6 x 5 x 3") && Contains("13 x 6 x 4 x 3"));
  const auto surface = test::message_of<InputError>([&] { CellWriter(folder.string(), comm, {0, 1, 2}, {0}, 4, 1.0); });
  REQUIRE_THAT(surface, Contains("cells.h5") && Contains("3 vertices") && Contains("4;"));
  fs::copy_file(folder / "fields.h5", folder / "cells.h5", fs::copy_options::overwrite_existing);
  const auto foreign = test::message_of<InputError>([&] { CellWriter(folder.string(), comm, {0, 1, 2}, {0}, 3, 1.0); });
  REQUIRE_THAT(foreign, Contains("it is not a series of surfaces"));
}

TEST_CASE("cells.h5 holds surfaces and their values", "[ranks]") {
  const auto folder = test::fresh_folder("cells");
  const Comm comm;
  const std::vector<std::int32_t> triangles{0, 1, 2, 0, 2, 3}, bodies{0, 1};
  std::vector<double> x(12), p{1, 2, 3, 4};
  std::iota(x.begin(), x.end(), 0.5);
  CellWriter writer(folder.string(), comm, triangles, bodies, 4);
  writer.write(7.25, 3, x.data(), {{"traction_kPa", 3, x.data()}, {"pressure_kPa", 1, p.data()}});
  const auto file = Hdf5File::read((folder / "cells.h5").string());
  std::vector<double> found(12);
  file.read("step_000000003/x_um", found.data());
  REQUIRE(found == x);
  found.resize(4);
  file.read("step_000000003/pressure_kPa", found.data());
  REQUIRE(found == p);
  std::vector<std::int32_t> stored(6);
  file.read("triangles", stored.data());
  REQUIRE(stored == triangles);
  REQUIRE_THAT(test::contents(folder / "cells.xdmf"), Contains("Time Value=\"7.25\"") && Contains("cells/step_000000003.h5:/traction_kPa"));
}

TEST_CASE("a checkpoint reads back bit for bit, on any split of the grid", "[ranks]") {
  const auto folder = test::fresh_folder("checkpoint");
  const Comm comm;
  const auto path = (folder / "checkpoint.h5").string();
  write_checkpoint(path, comm);
  REQUIRE_FALSE(fs::exists(path + ".part"));

  const CheckpointReader reader(path);
  REQUIRE(reader.header().resolved == header().resolved);
  REQUIRE(reader.header().cells == header().cells);
  REQUIRE(reader.header().step == header().step);
  REQUIRE(reader.header().time_us == header().time_us);
  REQUIRE_FALSE(reader.header().git.empty());
  reader.require_grid({4, 5, 12});
  std::vector<double> x(3), p(12 * 5 * 4), part(3 * 5 * 2);
  std::vector<std::int64_t> number(2);
  reader.read("membrane/x", {1, 3}, x.data());
  REQUIRE(x == std::vector<double>{1.0 / 3, 2.0 / 7, -0.0});
  REQUIRE(std::signbit(x[2]));
  reader.read("search/number", {2}, number.data());
  REQUIRE(number == std::vector<std::int64_t>{7, -8});
  reader.read("fluid/p", {12, 5, 4}, p.data());
  REQUIRE(p == whole(1, 0));
  // A box that no writing rank held: it crosses the cuts for 2 and 4 ranks.
  reader.read("fluid/p", {12, 5, 4}, Slab{{5, 0, 1}, {3, 5, 2}}, part.data());
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 5; ++j)
      for (int i = 0; i < 2; ++i) REQUIRE(part[i + 2 * (j + 5 * k)] == place(i + 1, j, k + 5, 0));
}

#ifdef CORPUSCLE_MPI
TEST_CASE("a checkpoint written by one rank is read by all", "[ranks]") {
  const auto folder = test::fresh_folder("checkpoint_one");
  const Comm comm;
  const auto path = (folder / "checkpoint.h5").string();
  if (comm.root()) write_checkpoint(path, Comm(MPI_COMM_SELF));
  comm.barrier();
  const auto index = block(comm);
  const auto first = static_cast<hsize_t>(index.first[2]), count = static_cast<hsize_t>(index.n[2]);
  std::vector<double> p(index.owned());
  CheckpointReader(path).read("fluid/p", {12, 5, 4}, Slab{{first, 0, 0}, {count, 5, 4}}, p.data());
  REQUIRE(p == values(index, 1, 0));
}
#endif

TEST_CASE("a checkpoint that does not fit the case says what differs") {
  const auto folder = test::fresh_folder("checkpoint_fit");
  const auto path = (folder / "checkpoint.h5").string();
  write_checkpoint(path, Comm());
  const CheckpointReader reader(path);
  std::vector<double> room(100);
  std::vector<std::int64_t> numbers(100);
  REQUIRE_THAT(test::message_of<InputError>([&] {
                 reader.require_grid({4, 5, 13});
               }),
               Contains("checkpoint.h5") && Contains("[5, 6, 13]") && Contains("grid.nodes = [5, 6, 14]"));
  REQUIRE_THAT(test::message_of<InputError>([&] {
                 reader.read("membrane/x", {1, 4}, room.data());
               }),
               Contains("'membrane/x' has 1 x 3 entries") && Contains("needs 1 x 4"));
  REQUIRE_THAT(test::message_of<InputError>([&] {
                 reader.read("membrane/v", {1, 3}, room.data());
               }),
               Contains("no 'membrane/v'") && Contains("another scene"));
  REQUIRE_THAT(test::message_of<InputError>([&] {
                 reader.read("membrane/x", {1, 3}, numbers.data());
               }),
               Contains("another type of number"));
}

TEST_CASE("broken and foreign checkpoints are refused by name and fault") {
  const auto folder = test::fresh_folder("checkpoint_broken");
  const auto good = folder / "checkpoint.h5", bad = folder / "bad.h5";
  write_checkpoint(good.string(), Comm());
  const auto size = fs::file_size(good);

  REQUIRE_THAT(read_error(folder / "missing.h5"), Contains("missing.h5: there is no such file"));
  std::ofstream(bad) << "";
  REQUIRE_THAT(read_error(bad), Contains("bad.h5: this file is empty"));
  std::ofstream(bad) << "time_us,cell\n0,1\n";
  REQUIRE_THAT(read_error(bad), Contains("bad.h5: this is not an HDF5 file"));
  for (const double fraction : {0.999, 0.9, 0.5, 0.1, 0.01}) {
    fs::copy_file(good, bad, fs::copy_options::overwrite_existing);
    fs::resize_file(bad, static_cast<std::uintmax_t>(fraction * static_cast<double>(size)));
    INFO("cut to " << fraction);
    REQUIRE_THAT(read_error(bad), Contains("bad.h5: this HDF5 file is cut short or damaged"));
  }
  fs::copy_file(good, bad, fs::copy_options::overwrite_existing);
  fs::resize_file(bad, 4);
  REQUIRE_THAT(read_error(bad), Contains("bad.h5: this is not an HDF5 file"));

  Hdf5File::create(bad.string()).attribute("/", "format", "something else");
  REQUIRE_THAT(read_error(bad), Contains("bad.h5: this HDF5 file is not a checkpoint of Corpuscle"));
  {
    auto file = Hdf5File::create(bad.string());
    file.attribute("/", "format", "Corpuscle checkpoint");
    file.attribute("/", "version", std::int64_t{1});
  }
  REQUIRE_THAT(read_error(bad), Contains("format version 1") && Contains("reads version 5") && Contains("another version of the program"));
  {
    auto file = Hdf5File::create(bad.string());
    file.attribute("/", "format", "Corpuscle checkpoint");
    file.attribute("/", "version", std::int64_t{CheckpointHeader::format_version});
  }
  REQUIRE_THAT(read_error(bad), Contains("was not finished"));
}

TEST_CASE("a checkpoint with one wrong bit in any array is refused, and the array is named") {
  const auto folder = test::fresh_folder("checkpoint_damaged");
  const auto good = folder / "checkpoint.h5", bad = folder / "bad.h5";
  write_checkpoint(good.string(), Comm());
  const auto bytes = test::contents(good);
  const auto refuse = [&](const std::string& name, const void* entry) {
    const auto at = bytes.find(std::string(static_cast<const char*>(entry), 8));
    REQUIRE(at != std::string::npos);
    for (const int bit : {0, 37, 63}) {
      auto damaged = bytes;
      damaged[at + bit / 8] = static_cast<char>(damaged[at + bit / 8] ^ (1 << bit % 8));
      std::ofstream(bad, std::ios::binary) << damaged;
      INFO(name << ", bit " << bit);
      REQUIRE_THAT(read_error(bad), Contains("bad.h5: '" + name + "' is damaged"));
    }
  };
  const double x = 2.0 / 7, p = place(3, 4, 11, 0);
  const std::int64_t number = -8;
  refuse("membrane/x", &x);
  refuse("fluid/p", &p);
  refuse("search/number", &number);
  // Two entries that have changed places.
  auto swapped = bytes;
  const double third = 1.0 / 3;
  const auto first = bytes.find(std::string(reinterpret_cast<const char*>(&third), 8));
  std::swap_ranges(swapped.begin() + first, swapped.begin() + first + 8, swapped.begin() + first + 8);
  std::ofstream(bad, std::ios::binary) << swapped;
  REQUIRE_THAT(read_error(bad), Contains("'membrane/x' is damaged"));
}

TEST_CASE("a checkpoint with any other number or text of its header, or any other checksum, is refused") {
  const auto folder = test::fresh_folder("checkpoint_header");
  const auto good = folder / "checkpoint.h5", bad = folder / "bad.h5";
  write_checkpoint(good.string(), Comm());
  REQUIRE(read_error(good).empty());
  CHECK(read_checkpoint_header(good.string()).time_us == header().time_us);
  const auto change = [&](const char* object, const char* name, hid_t type, const void* value) {
    fs::copy_file(good, bad, fs::copy_options::overwrite_existing);
    const hid_t file = H5Fopen(bad.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    const hid_t owner = H5Oopen(file, object, H5P_DEFAULT), at = H5Aopen(owner, name, H5P_DEFAULT);
    INFO(object << " " << name);
    REQUIRE(at >= 0);
    REQUIRE(H5Awrite(at, type, value) >= 0);
    H5Aclose(at);
    H5Oclose(owner);
    H5Fclose(file);
    CHECK_THAT(read_error(bad), Contains("bad.h5") && (Contains("is damaged") || Contains("format version")));
    CHECK_FALSE(test::message_of<InputError>([&] { read_checkpoint_header(bad.string()); }).empty());
  };
  const std::int64_t number = 77;
  double time = header().time_us;
  reinterpret_cast<unsigned char*>(&time)[7] ^= 0x40;
  change("/", "time_us", H5T_NATIVE_DOUBLE, &time);
  for (const char* name : {"step", "cells_i", "cells_j", "cells_k", "version"}) change("/", name, H5T_NATIVE_INT64, &number);
  for (const char* array : {"membrane/x", "search/number", "fluid/p"}) change(array, "checksum", H5T_NATIVE_INT64, &number);
  // Any bit of what the file holds in full: of the case, the lists of names and the time's own bytes.
  const auto bytes = test::contents(good);
  const double stored = header().time_us;
  for (const auto& what :
       {std::string("########"), std::string("membrane/x\nsearch"), std::string(reinterpret_cast<const char*>(&stored), 8)}) {
    const auto at = bytes.find(what);
    REQUIRE(at != std::string::npos);
    for (std::size_t bit = 0; bit < 8 * what.size(); bit += 5) {
      auto damaged = bytes;
      damaged[at + bit / 8] = static_cast<char>(damaged[at + bit / 8] ^ (1 << bit % 8));
      std::ofstream(bad, std::ios::binary) << damaged;
      INFO("bit " << bit << " of " << what);
      CHECK_FALSE(read_error(bad).empty());
    }
  }
}

TEST_CASE("a stored time costs the same however many there are, and each is listed at once") {
  const auto folder = test::fresh_folder("many_times");
  const std::vector<double> x(9, 1.5);
  const auto read_and_written = [] {
    std::ifstream counts("/proc/self/io");
    std::string name;
    long value = 0, sum = 0;
    while (counts >> name >> value)
      if (name == "rchar:" || name == "wchar:") sum += value;
    return sum;
  };
  if (read_and_written() == 0) return;  // not Linux
  const auto path = (folder / "cells.h5").string();
  {
    CellWriter cells(folder.string(), Comm(), {0, 1, 2}, {0}, 3);
    const auto store = [&](int from, int to) {
      const long before = read_and_written();
      for (int step = from; step < to; ++step) cells.write(step, step, x.data(), {});
      return read_and_written() - before;
    };
    store(0, 100);
    const long early = store(100, 200);
    CHECK(stored_times(path, "a series of surfaces of Corpuscle").size() == 200);
    store(200, 1500);
    const long late = store(1500, 1600);
    INFO(early << " bytes for a hundred times, then " << late);
    // HDF5 keeps links in blocks, read and written whole, that double up to 64 kB: 3.0 times as much. All links anew: see above.
    CHECK(static_cast<double>(late) < 4 * static_cast<double>(early));
    // Somebody reads the file: it stays what it is for them, and the run goes on.
    const auto reader = Hdf5File::read(path);
    for (int step = 1600; step < 1604; ++step) cells.write(step, step, x.data(), {});
    CHECK(reader.entries("/").size() == 1602);
  }
  CHECK(stored_times(path, "a series of surfaces of Corpuscle").size() == 1604);
  const auto xdmf = test::contents(folder / "cells.xdmf");
  std::size_t times = 0;
  for (auto at = xdmf.find("<Time"); at != std::string::npos; at = xdmf.find("<Time", at + 1)) ++times;
  CHECK(times == 1604);
  CHECK_THAT(xdmf, Catch::EndsWith("</Xdmf>\n"));
  for (const auto& entry : fs::directory_iterator(folder))
    CHECK((entry.path().extension() == ".h5" || entry.path().extension() == ".xdmf" || entry.is_directory()));
}

TEST_CASE("a checkpoint that was not finished leaves the last good one", "[ranks]") {
  const auto folder = test::fresh_folder("checkpoint_unfinished");
  const Comm comm;
  const auto path = (folder / "checkpoint.h5").string();
  write_checkpoint(path, comm);
  comm.barrier();
  const auto before = test::contents(path);
  {
    CheckpointWriter writer(path, comm, header());
    const double x = 1;
    writer.add("x", {1}, &x);
  }
  comm.barrier();
  REQUIRE(test::contents(path) == before);
  REQUIRE_FALSE(fs::exists(path + ".part"));
}

TEST_CASE("what one rank cannot write is an error on all ranks", "[ranks]") {
  const auto folder = test::fresh_folder("one_rank");
  const Comm comm;
  const hsize_t rank = static_cast<hsize_t>(comm.rank()), ranks = static_cast<hsize_t>(comm.size());
  const double value = 1;
  const auto message = test::message_of<ComputationError>([&] {
    auto file = Hdf5File::create((folder / "file.h5").string(), comm);
    file.write("good", {ranks}, Slab{{rank}, {1}}, &value);
    file.write("bad", {ranks}, Slab{{rank + 1}, {1}}, &value);  // beyond the end on the last rank alone
  });
  REQUIRE_THAT(message, Contains("file.h5: writing bad failed") && Contains("outside the array"));
}

TEST_CASE("a full disk: what does not fit is refused with sizes, and the last good checkpoint stays", "[ranks]") {
  const auto folder = test::fresh_folder("checkpoint_full");
  const Comm comm;
  const auto path = (folder / "checkpoint.h5").string();
  write_checkpoint(path, comm);
  comm.barrier();
  const auto before = test::contents(path);
  const double value = 1;
  const hsize_t huge = hsize_t{1} << 56;  // 576 PB: more than any disk has
  const auto message = test::message_of<ComputationError>([&] {
    CheckpointWriter writer(path, comm, header());
    writer.add("before", {1}, &value);
    writer.add("large", {huge}, &value);
    writer.commit();
  });
  REQUIRE_THAT(message, Contains("checkpoint.h5.part: the disk is full: large needs 5.765e+11 MB") && Contains("are free"));
  comm.barrier();
  REQUIRE(test::contents(path) == before);
  REQUIRE_FALSE(fs::exists(path + ".part"));
}

TEST_CASE("files below something that is not a folder cannot be created") {
  const auto folder = test::fresh_folder("hdf5_unwritable");
  std::ofstream(folder / "file") << "in the way";
  const auto path = (folder / "file" / "checkpoint.h5").string();
  REQUIRE_THAT(test::message_of<InputError>([&] { write_checkpoint(path, Comm()); }),
               Contains("checkpoint.h5.part: cannot create this file") && Contains("Not a directory"));
}

#else

#include <catch2/catch.hpp>

TEST_CASE("HDF5 output") { WARN("skipped: this build has no HDF5"); }

#endif
