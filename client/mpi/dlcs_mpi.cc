// SPDX-License-Identifier: Apache-2.0
// dlcs-mpi: `dlcs solve` on the ranks of MPI, and the ranks of a job of dlcsd.

#include <fmt/format.h>
#include <unistd.h>

#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "client/cli/command_line.h"
#include "client/cli/commands/command_support.h"
#include "client/mpi/attend.h"
#include "client/mpi/rank_solve.h"
#include "core/mpi/mpi_volume.h"
#include "core/mpi/mpi_world.h"

namespace dlcs::client {
namespace {

// The command that dlcsd gives to ranks that it starts.
constexpr std::string_view kAttend = "attend";

constexpr const char* kUsage =
    "Usage: mpirun -n RANKS dlcs-mpi [--ranks N] [--volume] solve PROBLEM [OPTION...]\n"
    "\n"
    "Solves as `dlcs solve` does, with its options, output and exit codes, on all ranks together.\n"
    "\n"
    "  --ranks N  Refuse a world of MPI that does not have N ranks; also DLCS_MPI_RANKS\n"
    "  --volume   Say at the end what each rank has sent\n"
    "\n"
    "The ranks share the work of two propagators, --propagator contour (few pairs) and iterative-stepping\n"
    "(many pairs, with --method time-stepping). `dlcs solve --help` lists the options.\n"
    "\n"
    "`dlcs-mpi attend` is what dlcsd --mpi-launcher has started; it finds its worker in the environment.\n";

struct Arguments {
  int ranks = 0;  // promised; 0: none
  bool volume = false;
  bool help = false;
  bool attends = false;               // a worker of dlcsd
  std::vector<const char*> of_solve;  // argv of dlcs
  std::string error;
};

// The number of ranks in `text`; 0 where it is none.
int RanksIn(std::string_view text) {
  int ranks = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), ranks);
  return error == std::errc() && end == text.data() + text.size() && ranks > 0 ? ranks : 0;
}

// What comes before the command belongs to this program.
Arguments Read(int argc, char** argv) {
  Arguments arguments;
  arguments.of_solve = {"dlcs"};
  const auto promise = [&](std::string_view from, std::string_view ranks) {
    arguments.ranks = RanksIn(ranks);
    if (arguments.ranks == 0) arguments.error = fmt::format("{} {}: not a number of ranks from 1 on", from, ranks);
  };
  if (const char* ranks = std::getenv("DLCS_MPI_RANKS")) promise("DLCS_MPI_RANKS", ranks);
  int k = 1;
  for (; k < argc && argv[k][0] == '-' && arguments.error.empty(); ++k) {
    const std::string_view option = argv[k];
    if (option == "--ranks" && k + 1 < argc) {
      promise(option, argv[++k]);
    } else if (option.starts_with("--ranks=")) {
      promise("--ranks", option.substr(std::string_view("--ranks=").size()));
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
  arguments.attends = k < argc && std::string_view(argv[k]) == kAttend;
  if (k < argc && !arguments.attends && std::string_view(argv[k]) != "solve") {
    arguments.error = fmt::format("{}: no command of dlcs-mpi; it has solve, and dlcs has the others", argv[k]);
  }
  arguments.of_solve.insert(arguments.of_solve.end(), argv + k, argv + argc);
  return arguments;
}

// Why not all ranks can do this together; empty if they can.
std::string WhyNot(const SolveCommand& command) {
  if (!command.server.address.empty()) {
    return "a solve on a server is not one of these ranks; leave out --server, and unset DLCS_SERVER";
  }
  if (command.options.ranks() != 0) return "--ranks: stands before the command here, dlcs-mpi --ranks N solve";
  if (command.problem_path == "-") return "standard input reaches one rank only; give a file that all ranks can read";
  if (command.deadline_s != SolveCommand().deadline_s) {
    return "--deadline: the clocks of ranks differ; the launcher has a limit, mpirun --timeout SECONDS";
  }
  if (!command.plot.empty()) return "--plot: draw what --output has written, dlcs plot RESULT.json --output FILE.svg";
  return "";
}

// On every rank the same but for what is printed and written, which the first one does.
int Solve(const Arguments& arguments, MpiWorld& world) {
  ParsedCommandLine parsed = ParseCommandLine(static_cast<int>(arguments.of_solve.size()), arguments.of_solve.data());
  if (const auto* code = std::get_if<ExitCode>(&parsed)) return *code;
  auto& command = std::get<SolveCommand>(parsed);
  if (const std::string why = WhyNot(command); !why.empty()) {
    return PrintError(absl::InvalidArgumentError(why), kBadInput);
  }
  if (command.options.threads() == 0) command.options.set_threads(1);
  // Ranks whose clocks end a solve at different steps would wait for each other; the launcher ends them.
  constexpr double kNoDeadline_s = 1e9;
  command.deadline_s = kNoDeadline_s;
  SolveWays ways = WaysOfRanks(command, world.team());
  if (world.rank() > 0) command.output.clear();
  return Run(command, std::move(ways));
}

void PrintVolume(const MpiVolume& volume, int rank, std::FILE* out) {
  fmt::print(
      out,
      "dlcs-mpi: rank {} sent {:.0f} messages with {:.0f} bytes, {:.0f} broadcasts with {:.0f} bytes, and {:.0f} "
      "bytes in {:.0f} sums and other collective calls\n",
      rank, volume.messages, volume.message_bytes, volume.broadcasts, volume.broadcast_bytes, volume.collective_bytes,
      volume.collectives);
}

// The first rank speaks for all. Others write nowhere, but for errors that they alone have.
class Voice {
 public:
  explicit Voice(bool is_first) : errors_(fdopen(dup(STDERR_FILENO), "w")) {
    if (is_first) return;
    own_ = std::tmpfile();
    if (!own_ || !errors_ || !std::freopen("/dev/null", "w", stdout)) return;
    dup2(fileno(own_), STDERR_FILENO);
  }
  ~Voice() {
    if (own_) std::fclose(own_);
    if (errors_) std::fclose(errors_);
  }
  Voice(const Voice&) = delete;
  Voice& operator=(const Voice&) = delete;

  // Standard error, also of ranks that are silent.
  std::FILE* errors() const { return errors_ ? errors_ : stderr; }
  // Says what this rank has kept to itself.
  void Tell() const {
    if (!own_) return;
    std::fflush(stderr);
    std::rewind(own_);
    for (int byte = 0; (byte = std::fgetc(own_)) != EOF;) std::fputc(byte, errors());
    std::fflush(errors());
  }

 private:
  std::FILE* const errors_;
  std::FILE* own_ = nullptr;
};

template <typename Work>
int OrSay(const Work& work) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return PrintError(absl::ResourceExhaustedError("out of memory; ask for fewer output times"), kServiceFailed);
  } catch (const std::exception& error) {
    return PrintError(absl::InternalError(error.what()), kServiceFailed);
  }
}

int AttendOrSay(MpiWorld& world, int promised) {
  const auto explain = [&] { fmt::print(stderr, "dlcs-mpi: rank {} failed where others did not\n", world.rank()); };
  return world.RunTogether([&] { return OrSay([&] { return Attend(world, world.WhyNot(promised)); }); }, explain);
}

int RunOn(MpiWorld& world, const Arguments& arguments) {
  const bool is_first = world.rank() == 0;
  if (arguments.attends && arguments.error.empty() && !arguments.help) return AttendOrSay(world, arguments.ranks);
  const Voice voice(is_first);
  if (arguments.help) {
    fmt::print("{}", kUsage);
    return kSolved;
  }
  std::string error = arguments.error;
  if (error.empty()) error = world.WhyNot(arguments.ranks);
  if (!error.empty()) return PrintError(absl::InvalidArgumentError(error), kBadInput);
  const auto explain = [&] {
    fmt::print(voice.errors(), "dlcs-mpi: rank {} failed where others did not:\n", world.rank());
    voice.Tell();
  };
  const int code = world.RunTogether([&] { return OrSay([&] { return Solve(arguments, world); }); }, explain);
  const MpiVolume& volume = VolumeOfMpi();
  if (code == kSolved && world.size() > 1 && volume.messages + volume.broadcasts == 0) {
    PrintNotice(
        "every rank did the same work, since this solve has no part that ranks share; --propagator contour and "
        "iterative-stepping have");
  }
  if (arguments.volume) PrintVolume(volume, world.rank(), voice.errors());
  return code;
}

}  // namespace
}  // namespace dlcs::client

int main(int argc, char** argv) {
  using namespace dlcs::client;
  setenv("GRPC_VERBOSITY", "NONE", /*overwrite=*/0);
  setenv("NO_COLOR", "1", /*overwrite=*/0);  // mpirun gives ranks a terminal whatever reads its own output
  const Arguments arguments = Read(argc, argv);
  dlcs::MpiWorld world(argc, argv);
  return RunOn(world, arguments);
}
