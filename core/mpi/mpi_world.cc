// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/mpi_world.h"

#include <mpi.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <thread>
#include <utility>

#include "core/mpi/multigrid_cycle.h"
#include "core/mpi/solving_team.h"

namespace dlcs {

struct MpiWorld::Impl {
  MPI_Comm solves = MPI_COMM_NULL, end = MPI_COMM_NULL;
  std::unique_ptr<SolvingTeam> team;
};

std::string MpiWorld::WhyNone() {
  constexpr const char* kTasks = "SLURM_STEP_NUM_TASKS";
  const char* const tasks = std::getenv(kTasks);
  if (!tasks || std::atoi(tasks) < 2) return "";
  for (const char* of_launcher : {"OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK"}) {
    if (std::getenv(of_launcher)) return "";
  }
  return std::string("each process would be a world of 1 rank, and ") + kTasks + " = " + tasks +
         ": srun does not inform Open MPI of the others without --mpi=pmix";
}

MpiWorld::MpiWorld(int& argc, char**& argv) : impl_(std::make_unique<Impl>()) {
  // Threads of the engine never call MPI.
  int provided = 0;
  MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &provided);
  MPI_Comm_dup(MPI_COMM_WORLD, &impl_->solves);
  MPI_Comm_dup(MPI_COMM_WORLD, &impl_->end);
  MultigridCycle::StartLibrary();
  impl_->team = std::make_unique<SolvingTeam>(impl_->solves);
}

MpiWorld::~MpiWorld() {
  impl_->team.reset();
  MultigridCycle::EndLibrary();
  MPI_Comm_free(&impl_->end);
  MPI_Comm_free(&impl_->solves);
  MPI_Finalize();
}

int MpiWorld::rank() const { return impl_->team->rank(); }
int MpiWorld::size() const { return impl_->team->size(); }

std::string MpiWorld::WhyNot(int promised) const {
  const std::string world = "this world of MPI has " + std::to_string(size()) + (size() == 1 ? " rank" : " ranks");
  if (promised > 0) {
    return promised == size() ? "" : world + ", and " + std::to_string(promised) + " were promised";
  }
  if (size() > 1) return "";
  constexpr std::array kLaunchers = {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS", "MPI_LOCALNRANKS"};
  for (const char* variable : kLaunchers) {
    const char* const ranks = std::getenv(variable);
    if (ranks && std::atoi(ranks) > 1) {
      return world + ", and " + variable + " = " + ranks +
             ": the launcher is not one of Open MPI, or does not speak its PMIx (srun --mpi=pmix)";
    }
  }
  return "";
}

std::stop_token MpiWorld::Agreed(std::stop_token own) { return impl_->team->Agreed(std::move(own)); }

std::string MpiWorld::OfFirst(std::string text) { return impl_->team->TextOf(0, std::move(text)); }

SolvingTeam& MpiWorld::team() { return *impl_->team; }

int MpiWorld::RunTogether(const std::function<int()>& run, const std::function<void()>& explain) {
  const TeamScope scope(*impl_->team);
  const int code = run();
  constexpr auto kPatience = std::chrono::seconds(5);
  MPI_Request all_returned = MPI_REQUEST_NULL;
  MPI_Ibarrier(impl_->end, &all_returned);
  const auto until = std::chrono::steady_clock::now() + kPatience;
  for (;;) {
    int done = 0;
    MPI_Test(&all_returned, &done, MPI_STATUS_IGNORE);
    if (done) return code;
    if (code != 0 && std::chrono::steady_clock::now() > until) {
      explain();
      MPI_Abort(MPI_COMM_WORLD, code);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

}  // namespace dlcs
