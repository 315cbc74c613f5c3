#include "transfer/cytosol.hpp"

#include <algorithm>

namespace corpuscle {

Cytosol::Cytosol(Grid& grid, const std::vector<double>& ratio) : grid_(&grid) {
  const IndexSpace& index = grid.index();
  material_ = Array<int>("corpuscle::transfer::inside_material", ratio.size());
  const auto material = Kokkos::create_mirror_view(material_);
  for (std::size_t c = 0; c < ratio.size(); ++c) {
    const auto known = std::find(ratios_.begin(), ratios_.end(), ratio[c]);
    material(c) = ratio[c] == 1 ? -1 : static_cast<int>(known - ratios_.begin());
    if (ratio[c] != 1 && known == ratios_.end()) ratios_.push_back(ratio[c]);
  }
  Kokkos::deep_copy(material_, material);
  for (double r : ratios_) least_ = std::min(least_, r);
  viscosity_ = {Array<double>(uninitialised("corpuscle::transfer::inside_relative_viscosity"), index.size()),
                Array<double>(uninitialised("corpuscle::transfer::inside_fluidity"), index.size())};
  Kokkos::deep_copy(viscosity_.relative, 1.0);
  Kokkos::deep_copy(viscosity_.fluidity, 1.0);
  share_ = Array<double>("corpuscle::transfer::inside_share", index.size());
  broken_ = Array<int>("corpuscle::transfer::inside_broken", 1);
  broken_host_ = HostCopy(broken_);
  int lines = 0;
  for (int d = 0; d < 3; ++d) {
    inside_.part[d] = Array<int>("corpuscle::transfer::inside_part", index.size());
    row_.push_back(std::make_unique<RankRow>(grid.comm(), grid.ranks_per_direction(), d));
    if (row_[d]->size() > 1) lines = std::max(lines, count_lines(index, d));
  }
  around_.inside = inside_, around_.share = share_, around_.index = index;
  for (int d = 0; d < 3; ++d)
    for (int side = 0; side < 2; ++side) around_.closed[d][side] = grid.halo().neighbour(d, side) < 0;
  if (lines == 0) return;
  ends_ = Array<int>("corpuscle::transfer::inside_ends", 2 * lines);
  ends_host_ = HostCopy(ends_);
}

/// Lines go on from one rank's block to the next.
void Cytosol::join_rows(int d) {
  if (row_[d]->size() == 1) return;
  const IndexSpace& index = grid_->index();
  const int lines = count_lines(index, d);
  sum_lines_inside(index, d, inside_.part[d], ends_);
  const auto& ends = ends_host_.read();
  const bool closed = row_[d]->add_up(ends.data(), ends.data() + lines, lines);
  ends_host_.write();
  set_line_starts(index, d, ends_, inside_.part[d]);
  if (!closed) Kokkos::deep_copy(broken_, 1);
}

void Cytosol::update(const Transfer& transfer, const SurfaceSet& surfaces, const BodyKinds& kinds) {
  const IndexSpace& index = grid_->index();
  Kokkos::deep_copy(Exec(), broken_, 0);
  const InsideSurface surface{surfaces, kinds.type, material_, kinds.turns};
  for (std::size_t m = 0; m < ratios_.size(); ++m) {
    count_crossings(transfer.search(), transfer.places(), surface, static_cast<int>(m), inside_);
    for (int d = 0; d < 3; ++d) {
      join_rows(d);
      add_up_inside(index, d, row_[d]->size() == 1, inside_.part[d], broken_);
    }
    find_rough_share(index, inside_, share_);
    grid_->halo().exchange(share_, 1);
    for (const auto& part : inside_.part) grid_->halo().exchange(part, 1);
    add_relative_viscosity(around_, ratios_[m], m == 0, least_, viscosity_);
  }
  grid_->halo().exchange(viscosity_.relative);
  grid_->halo().exchange(viscosity_.fluidity);
}

bool Cytosol::broken() const { return grid_->comm().max(broken_host_.read()(0)) > 0; }

}  // namespace corpuscle
