// SPDX-License-Identifier: Apache-2.0
// Processes that solve a problem together.

#ifndef DLCS_CORE_PARALLEL_TEAM_H_
#define DLCS_CORE_PARALLEL_TEAM_H_

#include <cstdint>
#include <vector>

#include "core/types.h"

namespace dlcs {

class DistributedSteps;
class NodeSolverGroups;

// Every process of a team runs the same code on the same problem, and so makes the same decisions; where work is worth
// dividing, each does a part of it, and all get the result. This class is a process alone; core/mpi has one with MPI.
//
// All functions but rank() and size() must be called by all processes, in the same order. So nothing may depend on the
// clock of one of them, or on when a request to stop reaches it: all must see the request at the same call.
class Team {
 public:
  Team() = default;
  virtual ~Team() = default;
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  virtual int rank() const { return 0; }
  virtual int size() const { return 1; }
  bool is_alone() const { return size() == 1; }

  // Part `part` of what is divided belongs to this process.
  int OwnerOf(Index part) const { return static_cast<int>(part % size()); }
  bool Owns(Index part) const { return OwnerOf(part) == rank(); }

  // Sets the `count` values of all processes to those of `owner`.
  virtual void Share(int /*owner*/, double* /*values*/, Index /*count*/) {}
  // The value of each process, by rank.
  virtual std::vector<double> Gather(double value) { return {value}; }

  // In the order of ranks, so that all processes get the same bits.
  double Sum(double value);
  double Max(double value);  // NaN if one is
  bool Any(bool value);
  // Whether `hash` is the same in all processes. Compares its upper 32 bits, which a double holds.
  bool IsSame(std::uint64_t hash);

  // Iterative steps with rows distributed over the team; null if there are none.
  virtual DistributedSteps* distributed_steps() { return nullptr; }
  // Groups of processes that share the nodes of a contour, each with rows distributed over its processes; null where
  // each process is alone with a node.
  virtual NodeSolverGroups* node_solver_groups() { return nullptr; }

  static Team& Alone();
  // That of this thread; Alone() if there is none.
  static Team& Current();
};

// While it lives, solves that this thread begins are those of `team`.
class TeamScope {
 public:
  explicit TeamScope(Team& team);
  ~TeamScope();
  TeamScope(const TeamScope&) = delete;
  TeamScope& operator=(const TeamScope&) = delete;

 private:
  Team* const outer_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_PARALLEL_TEAM_H_
