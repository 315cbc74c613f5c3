#include "populations/rigid_packing.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace corpuscle {

namespace {

constexpr double enough_um = 0.5 * PackingSpace::spare;  // what a gap may miss of what it is pushed to
constexpr double growing_overlap_um = 0.1, growth = 1.01;
constexpr int most_stalled = 400, most_steps = 3000, steps_between_removals = 150;
constexpr double removed_share = 0.04;

/// Bodies seen under all shifts, sorted by the cubes that they are in.
struct Instances {
  Instances(const std::vector<PackedBody>& bodies, const std::vector<Vec3>& shifts, double reach) {
    upper = lower = bodies.front().center;
    for (const PackedBody& b : bodies)
      for (int d = 0; d < 3; ++d) lower[d] = std::min(lower[d], b.center[d]), upper[d] = std::max(upper[d], b.center[d]);
    for (int d = 0; d < 3; ++d) {
      width[d] = std::max(reach, (upper[d] - lower[d]) / 200);
      n[d] = static_cast<int>((upper[d] - lower[d]) / width[d]) + 1;
    }
    bins.resize(static_cast<std::size_t>(n[0]) * n[1] * n[2]);
    for (std::size_t b = 0; b < bodies.size(); ++b)
      for (std::size_t s = 0; s < shifts.size(); ++s) {
        int at[3];
        bool inside = true;
        const Vec3 seen = bodies[b].center + shifts[s];
        for (int d = 0; d < 3; ++d) {
          at[d] = static_cast<int>(std::floor((seen[d] - lower[d]) / width[d]));
          inside = inside && at[d] >= -1 && at[d] <= n[d];
          at[d] = std::clamp(at[d], 0, n[d] - 1);
        }
        if (inside) bins[bin(at)].push_back({static_cast<int>(b), static_cast<int>(s)});
      }
  }
  std::size_t bin(const int (&at)[3]) const {
    return at[0] + static_cast<std::size_t>(n[0]) * (at[1] + static_cast<std::size_t>(n[1]) * at[2]);
  }
  template <class Use>
  void visit(const Vec3& p, const Use& use) const {
    int low[3], high[3], at[3];
    for (int d = 0; d < 3; ++d) {
      const int here = static_cast<int>((p[d] - lower[d]) / width[d]);
      low[d] = std::max(0, here - 1), high[d] = std::min(n[d] - 1, here + 1);
    }
    for (at[2] = low[2]; at[2] <= high[2]; ++at[2])
      for (at[1] = low[1]; at[1] <= high[1]; ++at[1])
        for (at[0] = low[0]; at[0] <= high[0]; ++at[0])
          for (const auto& [body, shift] : bins[bin(at)]) use(body, shift);
  }
  Vec3 lower, upper;
  double width[3];
  int n[3];
  std::vector<std::vector<std::pair<int, int>>> bins;
};

}  // namespace

void Rotation::matrix(Vec3 (&rows)[3]) const {
  rows[0] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)};
  rows[1] = {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)};
  rows[2] = {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)};
}

Rotation Rotation::turned(const Vec3& by) const {
  Rotation q{w - 0.5 * (by.x * x + by.y * y + by.z * z), x + 0.5 * (by.x * w + by.y * z - by.z * y),
             y + 0.5 * (by.y * w + by.z * x - by.x * z), z + 0.5 * (by.z * w + by.x * y - by.y * x)};
  const double share = 1 / std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {share * q.w, share * q.x, share * q.y, share * q.z};
}

RigidPacking::RigidPacking(const std::vector<PackingShape>& shapes, std::vector<PackedBody> bodies, const PackingSpace& space, double scale)
    : shapes_(shapes), bodies_(std::move(bodies)), space_(space), scale_(scale) {
  for (const PackedBody& b : bodies_) largest_gap_ = std::max(largest_gap_, b.gap + PackingSpace::spare);
  rest();
}

/// As they are now, without any speed.
void RigidPacking::rest() {
  const std::size_t n = bodies_.size();
  velocity_.assign(n, {}), spin_.assign(n, {}), force_.assign(n, {}), torque_.assign(n, {});
  stiffness_.assign(n, 0), overlap_.assign(n, 0);
  rows_.assign(3 * n, {});
  listed_.clear();
  step_ = 0.1, mixing_ = 0.1, downhill_ = 0;
}

bool RigidPacking::lists_hold() const {
  if (listed_.size() != bodies_.size()) return false;
  double farthest = 0;
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    farthest = std::max(farthest, norm(bodies_[b].center - listed_[b]) + (scale_ - listed_scale_) * shapes_[bodies_[b].shape].radius());
  return farthest < 0.5 * skin_;
}

void RigidPacking::make_lists() {
  for (PackedBody& b : bodies_) {
    if (!b.movable) continue;
    for (int d = 0; d < 3; ++d)
      if (space_.frame.periodic[d])
        b.center -= std::floor(dot(b.center - space_.frame.origin, space_.frame.dual[d])) * space_.frame.period[d];
  }
  double largest = 0;
  for (std::size_t b = 0; b < bodies_.size(); ++b) largest = std::max(largest, radius_of(static_cast<int>(b)));
  skin_ = 0.2 * largest;
  const Instances seen(bodies_, space_.shifts, 2 * largest + largest_gap_ + skin_);
  near_.clear();
  listed_.clear();
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const int body = static_cast<int>(b);
    listed_.push_back(bodies_[b].center);
    seen.visit(bodies_[b].center, [&](int other, int shift) {
      if ((other == body && shift == 0) || !(bodies_[b].movable || bodies_[other].movable)) return;
      const double most = radius_of(body) + radius_of(other) + largest_gap_ + skin_;
      const Vec3 apart = bodies_[other].center + space_.shifts[shift] - bodies_[b].center;
      if (dot(apart, apart) < most * most) near_.push_back({body, other, shift});
    });
  }
  listed_scale_ = scale_;
}

void RigidPacking::add_push(int body, const Vec3& arm, const Vec3& force, double weight) {
  const double size = shapes_[bodies_[body].shape].gyration() * scale_of(body);
  force_[body] += force;
  torque_[body] += (1 / size) * cross(arm, force);
  stiffness_[body] += weight * (1 + dot(arm, arm) / (size * size));
}

/// seen_: most of the work, which compilers can do in vectors.
void RigidPacking::see(const PackingPoints& points, const Vec3 (&turn)[3], const Vec3& start, const Vec3& low, const Vec3& high) {
  const int count = static_cast<int>(points.size());
  seen_.resize(4 * points.size());
  double* __restrict x = seen_.data();
  double* __restrict y = seen_.data() + count;
  double* __restrict z = seen_.data() + 2 * count;
  double* __restrict beyond = seen_.data() + 3 * count;
  const double* __restrict px = points.x.data();
  const double* __restrict py = points.y.data();
  const double* __restrict pz = points.z.data();
  const Vec3 middle = 0.5 * (low + high), half = 0.5 * (high - low), a = turn[0], b = turn[1], c = turn[2], at = start;
  for (int n = 0; n < count; ++n) {
    x[n] = a.x * px[n] + a.y * py[n] + a.z * pz[n] + at.x;
    y[n] = b.x * px[n] + b.y * py[n] + b.z * pz[n] + at.y;
    z[n] = c.x * px[n] + c.y * py[n] + c.z * pz[n] + at.z;
    const double far_x = std::abs(x[n] - middle.x) - half.x, far_y = std::abs(y[n] - middle.y) - half.y,
                 far_z = std::abs(z[n] - middle.z) - half.z;
    const double most = far_x > far_y ? far_x : far_y;
    beyond[n] = most > far_z ? most : far_z;
  }
}

/// Points of one body against the surface of the other.
void RigidPacking::push_pair(const Near& near) {
  const PackedBody &a = bodies_[near.body], &b = bodies_[near.other];
  const PackingShape &from = shapes_[a.shape], &to = shapes_[b.shape];
  const Vec3 *ra = &rows_[3 * near.body], *rb = &rows_[3 * near.other];
  const double sa = scale_of(near.body), sb = scale_of(near.other), gap = std::max(gap_of(near.body), gap_of(near.other));
  const Vec3 apart = a.center - b.center - space_.shifts[near.shift];
  const double most = from.radius() * sa + to.radius() * sb + gap;
  if (dot(apart, apart) > most * most) return;
  Vec3 turn[3], start;  // a's own places in b's own frame and size
  for (int m = 0; m < 3; ++m) {
    const Vec3 column{rb[0][m], rb[1][m], rb[2][m]};
    start[m] = dot(column, apart) / sb;
    for (int d = 0; d < 3; ++d) turn[m][d] = (sa / sb) * (column.x * ra[0][d] + column.y * ra[1][d] + column.z * ra[2][d]);
  }
  const Vec3 low = to.lower(), high = to.upper();
  double outside = 0;  // squared distance of the box from a's centre
  for (int d = 0; d < 3; ++d) {
    const double beyond = std::max({low[d] - start[d], start[d] - high[d], 0.0});
    outside += beyond * beyond;
  }
  if (outside > from.radius() * from.radius() * (sa / sb) * (sa / sb)) return;
  const auto& points = fine_ ? from.points() : from.few_points();
  const double weight = 1 / static_cast<double>(points.size());
  const int count = static_cast<int>(points.size());
  see(points, turn, start, low, high);
  const double *x = seen_.data(), *y = x + count, *z = y + count, *beyond = z + count;
  for (int n = 0; n < count; ++n) {
    if (beyond[n] > 0) continue;
    const Vec3 at{x[n], y[n], z[n]}, p = points[n];
    double distance;
    Vec3 along;
    if (!to.distance(at, distance, along)) continue;
    const double missing = gap - sb * distance;
    if (missing <= 0) continue;
    const Vec3 push = (weight * missing) * Vec3{dot(rb[0], along), dot(rb[1], along), dot(rb[2], along)};
    const Vec3 arm = sa * Vec3{dot(ra[0], p), dot(ra[1], p), dot(ra[2], p)};
    add_push(near.body, arm, push, weight);
    add_push(near.other, arm + apart, -push, weight);
    overlap_[near.body] = std::max(overlap_[near.body], missing);
    overlap_[near.other] = std::max(overlap_[near.other], missing);
  }
}

/// Walls, and the limits of the body's own group.
void RigidPacking::push_from_outside(int body) {
  const PackedBody& a = bodies_[body];
  const PackingLimits& limits = space_.limits[a.group];
  const bool limited = limits.any();
  const double size = scale_of(body), gap = gap_of(body);
  const bool walls = space_.walls && space_.walls->near(a.center, radius_of(body) + gap);
  if (!walls && !limited) return;
  const Vec3* rows = &rows_[3 * body];
  const auto& points = fine_ ? shapes_[a.shape].points() : shapes_[a.shape].few_points();
  const double weight = 1 / static_cast<double>(points.size());
  const auto push = [&](const Vec3& arm, double missing, const Vec3& along) {
    if (missing <= 0) return;
    add_push(body, arm, (weight * missing) * along, weight);
    overlap_[body] = std::max(overlap_[body], missing);
  };
  for (std::size_t n = 0; n < points.size(); ++n) {
    const Vec3 p = points[n];
    const Vec3 arm = size * Vec3{dot(rows[0], p), dot(rows[1], p), dot(rows[2], p)}, at = a.center + arm;
    double distance;
    Vec3 along;
    if (walls && space_.walls->distance(at, distance, along)) push(arm, gap - distance, along);
    for (int d = 0; d < 3 && limited; ++d) {
      Vec3 up;
      up[d] = 1;
      push(arm, limits.lower[d] + enough_um - at[d], up);
      push(arm, at[d] - limits.upper[d] + enough_um, -up);
    }
  }
}

/// @returns the most that any gap misses, um
double RigidPacking::find_forces() {
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    Vec3 rows[3];
    bodies_[b].rotation.matrix(rows);
    std::copy(rows, rows + 3, rows_.begin() + static_cast<long>(3 * b));
    force_[b] = torque_[b] = {};
    stiffness_[b] = overlap_[b] = 0;
  }
  for (const Near& near : near_) push_pair(near);
  double worst = 0;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    if (!bodies_[b].movable) {
      force_[b] = torque_[b] = {};
      continue;
    }
    push_from_outside(static_cast<int>(b));
    if (!bodies_[b].turns) torque_[b] = {};
    worst = std::max(worst, overlap_[b]);
  }
  return worst;
}

/// A step of the fast inertial relaxation engine (Bitzek et al., Phys. Rev. Lett. 97, 2006): bodies of unit mass glide down as long as it
/// goes down, and stop otherwise.
void RigidPacking::move(double largest_rate) {
  double power = 0, speeds = 0, forces = 0;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    power += dot(force_[b], velocity_[b]) + dot(torque_[b], spin_[b]);
    speeds += dot(velocity_[b], velocity_[b]) + dot(spin_[b], spin_[b]);
    forces += dot(force_[b], force_[b]) + dot(torque_[b], torque_[b]);
  }
  const double most = 1 / largest_rate;
  if (power > 0) {
    if (++downhill_ > 5) step_ *= 1.1, mixing_ *= 0.99;
  } else {
    step_ *= 0.5, mixing_ = 0.1, downhill_ = 0;
  }
  step_ = std::clamp(step_, 0.1 * most, most);
  const double keep = power > 0 ? 1 - mixing_ : 0, steer = power > 0 && forces > 0 ? mixing_ * std::sqrt(speeds / forces) : 0;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    PackedBody& body = bodies_[b];
    if (!body.movable) continue;
    velocity_[b] = keep * velocity_[b] + (steer + step_) * force_[b];
    spin_[b] = keep * spin_[b] + (steer + step_) * torque_[b];
    body.center += step_ * velocity_[b];
    const double size = shapes_[body.shape].gyration() * scale_;
    if (body.turns) body.rotation = body.rotation.turned((step_ / size) * spin_[b]);
  }
  ++iterations_;
}

/// @returns whether all gaps are there, at full size where bodies grow
bool RigidPacking::settle(int most, bool growing) {
  double best = 1e300;
  int stalled = 0;
  for (int n = 0; n < most || growing; ++n) {
    if (!lists_hold()) make_lists();
    const double worst = find_forces();
    const bool small = growing && scale_ < 1;
    if (small ? worst < growing_overlap_um * scale_ : worst <= enough_um) {
      if (!small) return true;
      scale_ = std::min(1.0, growth * scale_);
      stalled = 0, best = 1e300;
    } else {
      ++stalled;
      if (worst < 0.98 * best) {
        best = worst;
        if (!small) stalled = 0;
      }
      if (growing && stalled > most_stalled) return false;
    }
    double rate = 0;
    for (double k : stiffness_) rate = std::max(rate, k);
    if (rate > 0)
      move(std::sqrt(rate));
    else
      ++iterations_;
  }
  return false;
}

bool RigidPacking::grow() {
  fine_ = false;
  if (!settle(0, true)) return false;
  fine_ = true;
  rest();
  return settle(most_steps, false);
}

bool RigidPacking::shrink(double least) {
  constexpr double step = 0.985;
  fine_ = true;
  for (scale_ *= step; scale_ >= least; scale_ *= step) {
    rest();
    if (settle(steps_between_removals, false)) return true;
  }
  return false;
}

void RigidPacking::thin_out() {
  scale_ = 1;
  for (;;) {
    for (const bool fine : {false, true}) {
      fine_ = fine;
      rest();
      if (!settle(steps_between_removals, false)) break;
      if (fine) return;
    }
    std::vector<int> order;
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      if (bodies_[b].movable) order.push_back(static_cast<int>(b));
    if (order.empty()) return;
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return overlap_[a] > overlap_[b]; });
    order.resize(std::max<std::size_t>(1, static_cast<std::size_t>(removed_share * static_cast<double>(order.size()))));
    std::sort(order.begin(), order.end());
    for (std::size_t n = order.size(); n-- > 0;) bodies_.erase(bodies_.begin() + order[n]);
    if (bodies_.empty()) return;
  }
}

}  // namespace corpuscle
