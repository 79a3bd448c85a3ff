// SPDX-License-Identifier: Apache-2.0
// The commands of `dlcs`: the options of each, and the function that runs it.

#ifndef DLCS_CLIENT_CLI_COMMANDS_COMMANDS_H_
#define DLCS_CLIENT_CLI_COMMANDS_COMMANDS_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/commands/server_target.h"
#include "client/cli/output/exit_code.h"
#include "client/local/model.h"
#include "client/netlist/deck_options.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// The default server of commands that cannot run in this process.
inline constexpr const char* kDefaultServer = "localhost:50051";

// The formats from kNpy on are for trajectories only, and need a file.
enum class OutputFormat { kTable, kJson, kCsv, kName, kNpy, kNpz, kHdf5, kMat, kRaw };

struct SolveCommand {
  std::string problem_path;              // "-" is standard input
  ServerTarget server;                   // its address is empty: solve in this process
  v1::SolveOptions options;              // only the fields that were given
  std::string grid;                      // --grid as it was typed
  std::optional<v1::SolutionRule> rule;  // overrides the file's
  OutputFormat format = OutputFormat::kTable;
  std::string output;  // empty or "-" is standard output
  std::string plot;    // FILE.svg or FILE.png of a picture; empty: none
  bool quiet = false;
  bool verbose = false;  // on a terminal: every iterate
  double deadline_s = 600;
};

struct AnalyzeCommand {
  std::string problem_path;  // "-" is standard input
  ServerTarget server;
  v1::SolveOptions options;  // only the fields that were given
  std::string grid;          // --grid as it was typed
  std::optional<v1::SolutionRule> rule;
  OutputFormat format = OutputFormat::kTable;  // table or JSON
  bool verbose = false;                        // the whole analysis, in the table too
  std::string output;                          // empty is standard output
  double deadline_s = 600;
};

struct LcpCommand {
  std::string path;
  ServerTarget server;
  std::optional<v1::SolutionRule> rule;
  bool all = false;                            // all basic solutions too
  OutputFormat format = OutputFormat::kTable;  // table or JSON
  double deadline_s = 60;
};

struct DcpCommand {
  std::string path;
  std::string check;  // file of a path whose certificate is computed; empty: solve
  double step = 0;    // 0: the default of the service
  ServerTarget server;
  OutputFormat format = OutputFormat::kTable;  // table or JSON
  double deadline_s = 60;
};

struct ModelCommand {
  ModelOptions options;
  std::string path;    // of an input-output model or a mesh; "-" is standard input; empty for a model on a grid
  std::string output;  // empty is standard output
};

// Makes a problem file from a SPICE deck.
struct NetlistCommand {
  std::string path;  // "-" is standard input
  DeckOptions options;
  std::string output;    // empty is standard output
  bool message = false;  // the ProblemBody of the contract, serialized, instead of a problem file
  bool quiet = false;
};

// Draws a result with gnuplot.
struct PlotCommand {
  std::string path;               // of the JSON of a solve; "-" is standard input
  std::string output;             // FILE.svg or FILE.png
  std::vector<std::string> show;  // names of components; empty: all of them
  bool profile = false;           // over the components instead of over time
};

struct CapabilitiesCommand {
  ServerTarget server;
  OutputFormat format = OutputFormat::kTable;  // table or JSON
  double deadline_s = 10;
};

// Checks the health of a server.
struct HealthCommand {
  ServerTarget server = ServerAt(kDefaultServer);
  std::string service;  // empty: the server as a whole
  double deadline_s = 3;
};

// Manages named servers (contexts.h).
struct ContextCommand {
  enum class Action { kList, kSet, kUse, kDelete };
  Action action = Action::kList;
  std::string name;  // empty with kUse: no current context
  ServerTarget server;
};

// Writes a file that starts workers: a script for sbatch, or a manifest of Kubernetes.
struct WorkersCommand {
  enum class Manager { kSlurm, kKubernetes };
  Manager manager = Manager::kSlurm;
  std::string store;            // postgresql://...; empty: in the secret
  int count = 2;                // workers; the minimum of an autoscaler
  int most = 20;                // maximum of an autoscaler
  int cpus = 4;                 // of each worker
  double memory_bytes = 8e9;    // of each worker
  double time_limit_s = 0;      // 0: the default of Slurm's script; no limit in Kubernetes
  double exit_when_idle_s = 0;  // 0: the default of Slurm's script; never in Kubernetes
  std::string partition;
  std::string program = "dlcsd";
  std::string image = "dlcs";
  std::string secret = "dlcs-postgresql";
  std::string output;  // empty or "-" is standard output
};

// Each prints its result on standard output and everything else on standard error.
ExitCode Run(const SolveCommand& command);
ExitCode Run(const AnalyzeCommand& command);
ExitCode Run(const LcpCommand& command);
ExitCode Run(const DcpCommand& command);
ExitCode Run(const ModelCommand& command);
ExitCode Run(const NetlistCommand& command);
ExitCode Run(const PlotCommand& command);
ExitCode Run(const CapabilitiesCommand& command);
ExitCode Run(const HealthCommand& command);
ExitCode Run(const ContextCommand& command);
ExitCode Run(const WorkersCommand& command);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMANDS_COMMANDS_H_
