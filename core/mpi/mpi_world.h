// SPDX-License-Identifier: Apache-2.0
// The ranks that a launcher of MPI started, as one team.

#ifndef DLCS_CORE_MPI_MPI_WORLD_H_
#define DLCS_CORE_MPI_MPI_WORLD_H_

#include <functional>
#include <memory>
#include <stop_token>
#include <string>

namespace dlcs {

class SolvingTeam;

// From MPI_Init to MPI_Finalize; one in a program.
class MpiWorld {
 public:
  MpiWorld(int& argc, char**& argv);
  ~MpiWorld();
  MpiWorld(const MpiWorld&) = delete;
  MpiWorld& operator=(const MpiWorld&) = delete;

  // Before there is a world: why there can be none; empty if it is to be tried. In a step of srun without PMIx, Open
  // MPI makes worlds of one rank, or, as Debian's, ends the process with advice on how to build it.
  static std::string WhyNone();

  int rank() const;
  int size() const;

  // Why this is not the world that was meant; empty if it is. `promised`: the number of ranks that the user named, 0
  // for none. A launcher that does not speak this MPI starts as many worlds of one rank as it was told to start ranks,
  // each of which would solve the whole problem: its variables tell.
  std::string WhyNot(int promised) const;

  // A request to stop for a solve of all ranks: all see it at the same place of their work, once `own` is requested in
  // one of them. That may be a while later: ranks that wait for nobody, as those that factor a matrix, do not see it.
  // Called by all ranks.
  std::stop_token Agreed(std::stop_token own);

  SolvingTeam& team();

  // The text of the first rank, on all. Called by all ranks.
  std::string OfFirst(std::string text);

  // Calls `run` with all ranks as the team of its solves, on every rank, and returns what it returned here. If it
  // returned another code than 0, as on a rank that cannot read a file, and does not return on the others within some
  // seconds, calls `explain` and ends all ranks with that code.
  int RunTogether(const std::function<int()>& run, const std::function<void()>& explain);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_MPI_MPI_WORLD_H_
