// Rigid bodies beside membranes that are forces.
#include "core/error.hpp"
#include "coupling/force_coupling.hpp"
#include "coupling/periodic_frame.hpp"
#include "coupling/surface_checks.hpp"
#include "transfer/near_body.hpp"

namespace corpuscle {

/// @throws InputError  for rigid bodies that do not fit the grid, each other or cells
void ForceCoupling::check_bodies() {
  if (!bodies_) return;
  bodies_->check_start();
  if (!bodies_->coarse().empty()) coarse_ += (coarse_.empty() ? "" : "; ") + bodies_->coarse();
  loads_->follow_bodies();
  std::string wrong;
  try {
    check_clear_of_bodies(*loads_->joined());
  } catch (const InputError& error) {
    wrong = error.what();
  }
  wrong = agree(fluid_.grid().comm(), wrong);
  if (!wrong.empty()) throw InputError(wrong);
}

/// load_beside_body() of all ranks.
std::array<double, 5> ForceCoupling::load_beside(int body) const {
  const auto& rigid = *bodies_->rigid_bodies();
  const Triple centre = rigid.centre(body), shift = bodies_->wrapped_by()[body], velocity = rigid.velocity(body),
               omega = rigid.angular_velocity(body);
  BodyMotion motion;
  motion.frame = periodic_frame(fluid_.grid());
  for (int d = 0; d < 3; ++d) {
    motion.centre[d] = centre[d] - shift[d];
    motion.velocity[d] = velocity[d], motion.omega[d] = omega[d];
  }
  const Sums<5> here =
      load_beside_body(fluid_.grid().views(), bodies_->immersed()->boundary().nodes(), transfer_->faces(), fluid_.flux(), body, motion);
  std::array<double, 5> all{};
  for (int n = 0; n < 5; ++n) all[n] = here[n];
  fluid_.grid().comm().sum(all.data(), 5);
  return all;
}

std::array<double, 4> ForceCoupling::contact_load(int body, double dt) {
  auto load = loads_->load_on_rigid(dt, body);
  const auto beside = load_beside(body);
  for (int n = 0; n < 4; ++n) load[n] += beside[n];
  return load;
}

/// Friction between membranes and bodies, nW.
double ForceCoupling::loss_beside_bodies() const {
  double loss = 0;
  for (int body = 0; bodies_ && body < bodies_->surfaces().bodies; ++body) loss += load_beside(body)[4];
  return loss;
}

}  // namespace corpuscle
