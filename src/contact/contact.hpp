// Contact between surfaces: lists of who may touch whom, forces that keep them apart, and crossings, which are found
// and undone.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "contact/contact_law.hpp"
#include "contact/contact_lists.hpp"
#include "contact/contact_report.hpp"
#include "contact/contact_views.hpp"
#include "contact/keep_apart.hpp"
#include "contact/smooth_motion.hpp"
#include "contact/triangle_bins.hpp"
#include "core/workspace.hpp"
#include "input/case.hpp"
#include "parallel/comm.hpp"

namespace corpuscle {

/// The other ranks, where cells are shared out. Every rank makes the same calls.
struct ContactPeers {
  Comm comm;
  std::function<void()> update_copies;                                   // positions of this rank's cells to all their copies
  std::shared_ptr<Workspace> workspace = std::make_shared<Workspace>();  // shared with others that do not use it while Contact does
  GapsWanted gaps{};                                                     // of copies
};

/// Of the lists' entries on a rank. @throws ComputationError  for more than an int counts
int countable_items(std::int64_t items);

struct GapGoal;
struct LongestWay;
struct StepWays;
struct Shortfall;

class Contact {
 public:
  /// @param surfaces  in the place where the bodies start; their areas are taken as those at rest
  /// @param images    shifts under which bodies are seen besides their own place; the identity first
  /// @param viscosity  mPa s, of the fluid between them
  /// @param blend_um  up to this gap to other bodies gaps() are wanted; 0 for none
  Contact(const ContactSettings& settings, const SurfaceSet& surfaces, const Images& images, double viscosity, double blend_um,
          const ContactPeers* peers = nullptr);

  /// The surfaces are others from now on: those of `set`, whose places are of the types of cells in `types` and, behind them, of the
  /// bodies `rigid`. look() must follow.
  void take_up(const SurfaceSet& set, const SurfaceSet& types, const SurfaceSet* rigid = nullptr);

  /// What is near what at the surfaces' present positions. Crossings are counted, told and undone.
  /// @param dt  of the next step, us
  /// @throws ComputationError  if a crossing cannot be undone, or something goes further in a step than contact can follow
  void look(double time_us, double dt);
  /// The same before the first step, where crossings are an error of the input.
  /// @throws InputError
  void look_at_start(double dt);
  /// After a move: no gap has lost more than half of what it was when look() saw it. What went through is counted and
  /// told.
  /// @returns whether anything was moved, on any rank
  /// @throws ComputationError  if it goes on from step to step
  bool limit_approach(double time_us);
  /// The same for positions that are only looked ahead to.
  void limit_ahead();

  /// Adds the forces between surfaces at the present positions, which may be ahead of those that look() saw, to `force`
  /// [vertex, 3].
  void add_forces(double dt, bool ahead, const Components<double>& force);
  /// The law for steps of that length: the stiffest film that they can follow, attraction included, is that of Stokes flow
  /// between two membranes, whose gap opens at most at the rate 0.15 x gap x stiffness / viscosity.
  ContactLaw law(double dt) const;
  /// Fastest rate at which aggregated membranes relax, 1/us; the repulsion adapts to the step.
  double fastest_relaxation_per_us() const;

  /// [vertex] um to the nearest other body, rigid ones included, of look() or add_forces(), whichever was last; large where nothing is
  /// near.
  const Array<double>& gaps() const { return gap_; }
  /// Energy of the contacts that look() saw, fJ, of those that count on this rank.
  double energy(double dt) const;
  /// Their force on a rigid body, nN, of all ranks, and its power, nW. @param body  its number among these
  std::array<double, 4> load_on_rigid(double dt, int body) const;
  const ContactRest& at_rest() const { return rest_; }
  /// Up to which gap other bodies are looked for, um.
  double reach() const { return reach_.other; }
  const ContactReport& report() const { return report_; }
  void resume(const ContactReport& report) { report_ = report; }

  const ContactLists& lists() const { return lists_; }
  const ContactViews& contacts() const { return now_; }

 private:
  void make_arrays();
  void take_workspace(bool ahead);
  void push(const ContactViews& contacts, const Components<double>& sum);
  CrossingCount crossings();
  void note_gaps();
  Shortfall shortfall(const GapGoal& goal);
  std::string told_text(int first) const;
  StepWays ways(double dt) const;
  bool lists_hold(const StepWays& ways, double dt) const;
  StepWays choose_motion(const TriangleBounds& bounds, double dt);
  void make_lists(const StepWays& ways, double dt, bool at_start = false);
  void fill_lists(const ContactSearch& search, const ContactItems& items);
  ContactItems make_bins(double width, const TriangleBounds& bounds, std::size_t items);
  void find(const ContactViews& contacts);
  void find_now();
  Shortfall correct(double share, double least);
  void mend_crossings(double time_us, double dt);
  double fastest_crossing(double dt) const;
  void count_crossings(int vertices, int first, double time_us);
  std::string crossing_text(int contact) const;
  std::string place_text(int vertex) const;
  std::string pair_text(int vertex, int item) const;
  void refuse_far_away(const TriangleBounds& bounds, bool at_start) const;
  StepWays refuse_runaways(double time_us, double dt);
  void refuse_fast_passage(double time_us, double dt);
  void refuse(const LongestWay& found, double most, const std::function<std::string()>& text) const;

  ContactSettings settings_;
  SurfaceSet surface_;
  Images images_;
  double viscosity_;
  ContactReach reach_;  // without the skin
  ContactRest rest_;
  TriangleBins bins_;           // in the workspace, as lists are made
  TriangleSpheres spheres_;     // there: in the order of bins as lists are made, of triangles as contacts are found
  std::size_t items_room_ = 0;  // there, for items
  ContactLists lists_;
  ContactViews now_;        // at the positions of look()
  ContactViews ahead_;      // at those ahead; in the workspace
  ContactPushes pushes_;    // there as well
  Table<float> listed_;     // [vertex, 3] um, where the lists were made
  double skin_ = -1;        // um; negative before there are lists
  double wander_ = 0;       // um, that vertices may drift while lists hold
  MotionSince together_;    // since lists were made
  double steepest_ = 0;     // 1/us, gradient of that motion
  double span_ = 0;         // um, from a vertex to the farthest corner of what is just beyond the lists
  double step_ = 0;         // us, until the next look
  double longest_way_ = 0;  // um, in a step, beyond the mean of all
  Array<int> side_;         // [vertex]
  Array<double> gap_;       // [vertex]
  int movable_ = 0;         // vertices of cells
  int own_ = 0;             // of those of this rank
  std::optional<ContactPeers> peers_;
  std::shared_ptr<Workspace> workspace_;
  ContactReport report_;
  int recurring_ = 0;     // steps with crossings, less those without since
  bool crossed_ = false;  // since the last limit_approach()
};

}  // namespace corpuscle
