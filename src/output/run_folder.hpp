// The folder of a run's results: found or made, locked, and not touched before the run is sure to begin.
#pragma once

#include <optional>
#include <string>

#include "parallel/comm.hpp"

namespace corpuscle {

/// What a run may do with results that are there already.
enum class EarlierResults { refuse, overwrite, go_on };

/// The checkpoint that a run goes on from.
struct Continued {
  std::string checkpoint;  // path
  std::string run;         // of which run it is a state
  long step = 0;
};

/// Each folder of results belongs to one run, whose name lies in a hidden file there and in every checkpoint, so that no
/// restart joins the results of two.
class RunFolder {
 public:
  /// Claims the folder for as long as this lives; rank 0 does the work.
  /// @param named      by the user; empty: runs/CASE-001 or the first number that is free
  /// @param continued  for a restart
  /// @throws InputError  on every rank: it cannot be made or written in, another run uses it, or it holds results that
  ///                     `earlier` does not allow for, or that the checkpoint is not of
  RunFolder(const Comm& comm, const std::string& named, const std::string& case_name, EarlierResults earlier,
            const std::optional<Continued>& continued = {});
  /// Gives the folder back; if the run never began, it is as it was before.
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  const std::string& path() const { return path_; }
  /// Which run this is: of the folder's results where a restart goes on from them, a new one otherwise.
  const std::string& run() const { return run_; }
  /// The run begins: results to be overwritten are removed, and runs/latest leads here if the folder is a numbered one.
  void begin();

 private:
  void claim(const std::string& named, const std::string& case_name, const std::optional<Continued>& continued);
  void make(const std::string& path);
  void make_numbered(const std::string& case_name);
  void lock();
  void settle_run(const Continued& continued);
  void refuse_shared(const std::string& path, int why);
  void give_back();
  void point_latest() const;

  Comm comm_;
  std::string path_, run_;
  std::string label_;  // what the file that names the run is to hold
  EarlierResults earlier_;
  std::string first_made_;  // outermost folder that did not exist before; empty: all did
  bool numbered_ = false, begun_ = false;
  int lock_ = -1;
};

/// Remove what an earlier run has written in a folder, and nothing else.
void remove_results(const std::string& folder);

}  // namespace corpuscle
