// SPDX-License-Identifier: Apache-2.0
// The problem that a command is about: a file, or the name of one that was uploaded.

#ifndef DLCS_CLIENT_CLI_COMMANDS_PROBLEM_INPUT_H_
#define DLCS_CLIENT_CLI_COMMANDS_PROBLEM_INPUT_H_

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/commands/commands.h"
#include "client/cli/commands/server_target.h"
#include "client/files/problem_file.h"
#include "client/netlist/deck_options.h"
#include "client/result/backend.h"
#include "core/circuits/relay.h"
#include "dlcs/v1/problems.pb.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

class ProblemInput {
 public:
  // Reads the problem file or SPICE deck at `path`, `-` for standard input. A deck is recognized by its ending or its
  // content. A `path` of the form problems/ and 64 characters of 0-9a-f is the name of an uploaded problem, for which
  // FetchUploaded() asks the server. `rule`, if given, overrides that of the file; `matrix_files` is that of
  // ParseProblem(). Errors: InvalidArgument as ReadProblemFile() and ReadNetlist(), for a name without a server, and
  // for a rule that cannot be overridden.
  static absl::StatusOr<ProblemInput> Read(const std::string& path, const ServerTarget& server,
                                           const std::optional<v1::SolutionRule>& rule,
                                           const MatrixFiles& matrix_files = {});

  // Gets the description of an uploaded problem from the server; does nothing for a file. Errors: as
  // ProblemClient::Get().
  absl::Status FetchUploaded(const CallLimits& limits);

  // Whether a switch of the deck has a limit of its current; whether a current reached its limit. A solve with higher
  // limits may then have another result.
  bool HasLimits() const { return !deck_.empty() && file_.problem.outputs().limits_size() > 0; }
  bool ReachedLimit(const v1::Summary& summary) const;
  // Reads the deck again, with limits that are `factor` times as large. Errors: none but those of Read().
  absl::Status RaiseLimits(double factor);

  // Adds to the verdict which switches and comparators of a deck slide.
  void AddConcerns(v1::Summary& summary) const;

  // Prints on standard error what was ignored or assumed when a deck was read.
  void PrintNotes() const;

  // Its name in messages.
  const std::string& source() const { return source_; }
  // The title of the result.
  std::string title() const;
  bool is_uploaded() const { return !name_.empty(); }
  bool is_nonlinear() const { return is_uploaded() ? about_.nonlinear() : file_.nonlinear.has_value(); }
  double horizon() const;
  std::int64_t states() const;
  std::int64_t constraints() const;
  // Empty if it has none, or is uploaded.
  std::vector<std::string> StateNames() const;

  // `options` with the tolerances of a deck, where they give none (client/netlist/netlist.h).
  v1::SolveOptions WithTolerancesOfDeck(const v1::SolveOptions& options) const;
  // A request with the problem, or with its name if it is uploaded; with the tolerances of a deck.
  v1::SolveRequest SolveRequest(const v1::SolveOptions& options) const;
  // For linear problems.
  v1::SolveEnsembleRequest EnsembleRequest(const v1::SolveOptions& options) const;
  v1::AnalyzeProblemRequest AnalyzeRequest(const v1::SolveOptions& options) const;
  v1::ProblemBody Body() const;

 private:
  absl::Status ReadDeckText(const DeckOptions& options);

  std::string source_;
  std::string deck_, folder_;  // the text of a deck, and where its includes are
  std::optional<v1::SolutionRule> rule_;
  ProblemFile file_;
  std::string name_;  // empty if it is a file
  ServerTarget server_;
  std::vector<std::string> notes_;
  std::vector<Relay> relays_;
  v1::SolveOptions tolerances_;  // of a deck
  v1::StoredProblem about_;  // of an uploaded problem, after FetchUploaded()
};

// "problems/" and 64 characters of 0-9a-f.
bool IsProblemName(const std::string& text);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_COMMANDS_PROBLEM_INPUT_H_
