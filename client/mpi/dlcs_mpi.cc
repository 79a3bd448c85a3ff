// SPDX-License-Identifier: Apache-2.0
// dlcs-mpi: runs `dlcs solve`, or a job of dlcsd, on the ranks of MPI.

#include <fmt/format.h>
#include <unistd.h>

#include <charconv>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "client/cli/command_line.h"
#include "client/cli/commands/command_support.h"
#include "client/cli/jobs/job_commands.h"
#include "client/local/local_backend.h"
#include "client/mpi/rank_ensemble.h"
#include "client/mpi/rank_job.h"
#include "client/mpi/rank_solve.h"
#include "client/mpi/same_request.h"
#include "core/mpi/mpi_volume.h"
#include "core/mpi/mpi_world.h"
#include "core/mpi/solving_team.h"

namespace dlcs::client {
namespace {

// The command with which dlcsd starts ranks (server/solve_jobs/rank_launcher.cc).
constexpr std::string_view kRunJob = "attend";

constexpr std::string_view kRanksPerGroup = "--ranks-per-group";
// The same for jobs, whose command line is that of dlcsd.
constexpr const char* kRanksPerGroupOfJobs = "DLCS_MPI_RANKS_PER_GROUP";

constexpr const char* kUsage =
    "Usage: mpirun -n RANKS dlcs-mpi [--ranks N] [--ranks-per-group G] [--volume] solve PROBLEM [OPTION...]\n"
    "       mpirun -n RANKS dlcs-mpi [--ranks N] [--volume] ensemble PROBLEM [MEMBERS] [OPTION...]\n"
    "\n"
    "Solves as `dlcs solve` and `dlcs ensemble` do, with their options, output and exit codes, on all ranks together.\n"
    "\n"
    "  --ranks N  Refuse a world of MPI that does not have N ranks; also DLCS_MPI_RANKS\n"
    "  --ranks-per-group G\n"
    "             With --propagator contour: groups of G ranks share the nodes, and the ranks of a group the rows of\n"
    "             states. 1, the default: each rank factors whole matrices\n"
    "  --volume   Print at the end how much each rank has sent\n"
    "\n"
    "The ranks share the work of two propagators, --propagator contour (few pairs) and iterative-stepping\n"
    "(many pairs, with --method time-stepping). Each rank solves its share of the members of an ensemble.\n"
    "`dlcs solve --help` and `dlcs ensemble --help` list the options.\n"
    "\n"
    "`dlcs-mpi attend` is for dlcsd --mpi-launcher, which starts it; it reads the address of dlcsd from the\n"
    "environment, and DLCS_MPI_RANKS_PER_GROUP.\n";

struct Arguments {
  int ranks = 0;  // expected; 0: any number
  int ranks_per_group = 1;
  bool volume = false;
  bool help = false;
  bool runs_job = false;  // of dlcsd
  bool is_ensemble = false;
  std::vector<const char*> argv;  // for the command line of dlcs
  std::string error;
};

// The number of ranks in `text`; 0 if it is not one.
int RanksIn(std::string_view text) {
  int ranks = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), ranks);
  return error == std::errc() && end == text.data() + text.size() && ranks > 0 ? ranks : 0;
}

// Options before the command are those of this program; the others are those of dlcs.
Arguments Read(int argc, char** argv) {
  Arguments arguments;
  arguments.argv = {"dlcs"};
  const auto set_ranks = [&](std::string_view from, std::string_view ranks) {
    arguments.ranks = RanksIn(ranks);
    if (arguments.ranks == 0) arguments.error = fmt::format("{} {}: not a number of ranks from 1 on", from, ranks);
  };
  const auto set_ranks_per_group = [&](std::string_view ranks) {
    arguments.ranks_per_group = RanksIn(ranks);
    if (arguments.ranks_per_group == 0) {
      arguments.error = fmt::format("{} {}: not a number of ranks from 1 on", kRanksPerGroup, ranks);
    }
  };
  if (const char* ranks = std::getenv("DLCS_MPI_RANKS")) set_ranks("DLCS_MPI_RANKS", ranks);
  int k = 1;
  for (; k < argc && argv[k][0] == '-' && arguments.error.empty(); ++k) {
    const std::string_view option = argv[k];
    if (option == "--ranks" && k + 1 == argc) {
      arguments.error = "--ranks: give the number of ranks behind it";
    } else if (option == "--ranks") {
      set_ranks(option, argv[++k]);
    } else if (option.starts_with("--ranks=")) {
      set_ranks("--ranks", option.substr(std::string_view("--ranks=").size()));
    } else if (option == kRanksPerGroup && k + 1 == argc) {
      arguments.error = "--ranks-per-group: give the number of ranks behind it";
    } else if (option == kRanksPerGroup) {
      set_ranks_per_group(argv[++k]);
    } else if (option.starts_with(kRanksPerGroup) && option[kRanksPerGroup.size()] == '=') {
      set_ranks_per_group(option.substr(kRanksPerGroup.size() + 1));
    } else if (option == "--volume") {
      arguments.volume = true;
    } else if (option == "--help" || option == "-h") {
      arguments.help = true;
    } else {
      arguments.error = fmt::format("{}: unknown before the command; dlcs-mpi --help lists what there is", option);
    }
  }
  if (!arguments.error.empty()) return arguments;
  if (k == argc && !arguments.help) arguments.error = "give a command: dlcs-mpi solve PROBLEM";
  const std::string_view command = k < argc ? argv[k] : "solve";
  arguments.runs_job = command == kRunJob;
  arguments.is_ensemble = command == "ensemble";
  if (!arguments.runs_job && !arguments.is_ensemble && command != "solve") {
    arguments.error =
        fmt::format("{}: no command of dlcs-mpi; it has solve and ensemble, and dlcs has the others", command);
  }
  if (arguments.runs_job && arguments.ranks_per_group > 1) {
    arguments.error = fmt::format("{}: of solve; jobs have {}", kRanksPerGroup, kRanksPerGroupOfJobs);
  }
  arguments.argv.insert(arguments.argv.end(), argv + k, argv + argc);
  return arguments;
}

// Why not all ranks can do this together; empty if they can.
std::string WhyNot(const SolveCommand& command) {
  if (!command.server.address.empty()) {
    return "a solve on a server is not one of these ranks; leave out --server, and unset DLCS_SERVER";
  }
  if (command.options.ranks() != 0) return "--ranks: must precede the command here, dlcs-mpi --ranks N solve";
  if (command.problem_path == "-") return "standard input reaches one rank only; give a file that all ranks can read";
  if (command.deadline_s != SolveCommand().deadline_s) {
    return "--deadline: the clocks of ranks differ; the launcher has a limit, mpirun --timeout SECONDS";
  }
  if (!command.plot.empty()) return "--plot: draw what --output has written, dlcs plot RESULT.json --output FILE.svg";
  return "";
}

std::string WhyNot(const EnsembleCommand& command) {
  if (command.detach) return "--detach: creates a job on a server, which dlcs ensemble does";
  if (command.members_path == "-") return "standard input reaches one rank only; give a file that all ranks can read";
  return WhyNot(command.solve);
}

// Why groups do not serve such a command; empty if they do.
std::string WhyNoGroups(const SolveCommand& command) {
  if (command.options.propagator() == v1::PROPAGATOR_KIND_CONTOUR) return "";
  return "groups share the nodes of contours; add --propagator contour";
}

std::string WhyNoGroups(const EnsembleCommand& /*command*/) {
  return "each member of an ensemble is solved by one rank";
}

// Called by all ranks, which make groups if they can. Otherwise returns why not. 0 stands for what is no number.
std::string MakeGroups(int ranks_per_group, MpiWorld& world) {
  constexpr int kNotCompared = 32;  // bits of a hash
  if (!world.team().IsSame(static_cast<std::uint64_t>(ranks_per_group) << kNotCompared)) {
    return "the number is not the same in all ranks";
  }
  if (ranks_per_group == 0) return "not a number of ranks from 1 on";
  if (world.size() % ranks_per_group != 0) {
    return fmt::format("must divide the number of ranks, which is {}", world.size());
  }
  if (ranks_per_group > 1) world.team().MakeGroups(ranks_per_group);
  return "";
}

void SetDefaultsForRanks(SolveCommand& command) {
  // Ranks whose clocks end a solve at different steps would wait for each other; the launcher ends them.
  constexpr double kNoDeadline_s = 1e9;
  command.deadline_s = kNoDeadline_s;
  if (command.options.threads() == 0) command.options.set_threads(1);
}

int Solve(SolveCommand& command, MpiWorld& world) {
  SetDefaultsForRanks(command);
  absl::StatusOr<SolveHooks> hooks = HooksForRanks(command, world.team());
  if (!hooks.ok()) return PrintError(hooks.status(), kBadInput);
  if (world.rank() > 0) command.output.clear();
  return Run(command, *std::move(hooks));
}

int Solve(EnsembleCommand& command, MpiWorld& world) {
  SetDefaultsForRanks(command.solve);
  if (absl::Status same = CheckSameOptions(command.solve, world.team()); !same.ok()) return PrintError(same, kBadInput);
  if (world.rank() > 0) command.solve.output.clear();
  LocalHooks hooks;
  hooks.run_ensemble = [&world](const v1::SolveEnsembleRequest& request, const SessionLimits& limits,
                                const SolveControl& control, const EnsembleEvents& take) {
    return RunEnsembleOnRanks(request, limits, control, take, world.team());
  };
  hooks.receives_members = world.rank() == 0;
  return Run(command, std::make_unique<LocalBackend>(std::move(hooks)));
}

// Called by all ranks. Only the first one prints and writes the result.
int Solve(const Arguments& arguments, MpiWorld& world) {
  ParsedCommandLine parsed = ParseCommandLine(static_cast<int>(arguments.argv.size()), arguments.argv.data());
  if (const auto* code = std::get_if<ExitCode>(&parsed)) return *code;
  const auto solve = [&](auto& command) -> int {
    if (const std::string why = WhyNot(command); !why.empty()) {
      return PrintError(absl::InvalidArgumentError(why), kBadInput);
    }
    const int ranks_per_group = arguments.ranks_per_group;
    std::string why = ranks_per_group > 1 ? WhyNoGroups(command) : "";
    if (why.empty()) why = MakeGroups(ranks_per_group, world);
    if (!why.empty()) {
      return PrintError(absl::InvalidArgumentError(fmt::format("{} {}: {}", kRanksPerGroup, ranks_per_group, why)),
                        kBadInput);
    }
    return Solve(command, world);
  };
  auto* const ensemble = std::get_if<EnsembleCommand>(&parsed);
  return ensemble ? solve(*ensemble) : solve(std::get<SolveCommand>(parsed));
}

void PrintVolume(const MpiVolume& volume, int rank, std::FILE* out) {
  fmt::print(
      out,
      "dlcs-mpi: rank {} sent {:.0f} messages with {:.0f} bytes, {:.0f} broadcasts with {:.0f} bytes, and {:.0f} "
      "bytes in {:.0f} sums and other collective calls\n",
      rank, volume.messages, volume.message_bytes, volume.broadcasts, volume.broadcast_bytes, volume.collective_bytes,
      volume.collectives);
}

// Only the first rank prints. The output of the others is discarded, and their errors are captured, in case that they
// alone fail.
class RankOutput {
 public:
  explicit RankOutput(bool is_first) : errors_(fdopen(dup(STDERR_FILENO), "w")) {
    if (is_first) return;
    captured_ = std::tmpfile();
    if (!captured_ || !errors_ || !std::freopen("/dev/null", "w", stdout)) return;
    dup2(fileno(captured_), STDERR_FILENO);
  }
  ~RankOutput() {
    if (captured_) std::fclose(captured_);
    if (errors_) std::fclose(errors_);
  }
  RankOutput(const RankOutput&) = delete;
  RankOutput& operator=(const RankOutput&) = delete;

  // The real standard error, on every rank.
  std::FILE* errors() const { return errors_ ? errors_ : stderr; }
  // Prints the captured errors.
  void PrintCaptured() const {
    if (!captured_) return;
    std::fflush(stderr);
    std::rewind(captured_);
    for (int byte = 0; (byte = std::fgetc(captured_)) != EOF;) std::fputc(byte, errors());
    std::fflush(errors());
  }

 private:
  std::FILE* const errors_;
  std::FILE* captured_ = nullptr;
};

// Returns the exit code of `work()`. Prints an exception as an error.
template <typename Work>
int CatchErrors(const Work& work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return PrintError(absl::ResourceExhaustedError("out of memory; ask for fewer output times"), kServiceFailed);
  } catch (const std::exception& error) {
    return PrintError(absl::InternalError(error.what()), kServiceFailed);
  }
}

// Why the ranks are not those for a job; empty if they are.
std::string PrepareForJob(MpiWorld& world, int expected_ranks) {
  if (std::string why = world.WhyNot(expected_ranks); !why.empty()) return why;
  const char* const of_groups = std::getenv(kRanksPerGroupOfJobs);
  const std::string why = MakeGroups(of_groups ? RanksIn(of_groups) : 1, world);
  return why.empty() ? "" : fmt::format("{} {}: {}", kRanksPerGroupOfJobs, of_groups ? of_groups : "", why);
}

int RunJob(MpiWorld& world, int expected_ranks) {
  const auto explain = [&] { fmt::print(stderr, "dlcs-mpi: rank {} failed where others did not\n", world.rank()); };
  const auto run = [&] { return RunRankJob(world, PrepareForJob(world, expected_ranks)); };
  return world.RunTogether([&] { return CatchErrors(run); }, explain);
}

int RunOn(MpiWorld& world, const Arguments& arguments) {
  const bool is_first = world.rank() == 0;
  if (arguments.runs_job && arguments.error.empty() && !arguments.help) return RunJob(world, arguments.ranks);
  const RankOutput output(is_first);
  if (arguments.help) {
    fmt::print("{}", kUsage);
    return kSolved;
  }
  std::string error = arguments.error;
  if (error.empty()) error = world.WhyNot(arguments.ranks);
  if (!error.empty()) return PrintError(absl::InvalidArgumentError(error), kBadInput);
  const auto explain = [&] {
    fmt::print(output.errors(), "dlcs-mpi: rank {} failed where others did not:\n", world.rank());
    output.PrintCaptured();
  };
  const MpiVolume start = VolumeOfMpi();
  const int code = world.RunTogether([&] { return CatchErrors([&] { return Solve(arguments, world); }); }, explain);
  const MpiVolume& volume = VolumeOfMpi();
  if (code == kSolved && world.size() > 1 && !arguments.is_ensemble && !volume.SharesMoreThan(start)) {
    PrintNotice(
        "every rank did the same work, since this solve has no part that ranks share; --propagator contour and "
        "iterative-stepping have");
  }
  if (arguments.volume) PrintVolume(volume, world.rank(), output.errors());
  return code;
}

}  // namespace
}  // namespace dlcs::client

int main(int argc, char** argv) {
  using namespace dlcs::client;
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  setenv("NO_COLOR", "1", /*overwrite=*/0);  // mpirun gives ranks a terminal even if its own output is not one
  const Arguments arguments = Read(argc, argv);
  if (const std::string why = dlcs::MpiWorld::WhyNone(); !why.empty()) {
    const char* const rank = std::getenv("SLURM_PROCID");
    if (!rank || std::string_view(rank) == "0") PrintNotice(why);
    return kBadInput;
  }
  dlcs::MpiWorld world(argc, argv);
  return RunOn(world, arguments);
}
