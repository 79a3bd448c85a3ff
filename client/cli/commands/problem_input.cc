// SPDX-License-Identifier: Apache-2.0
#include "client/cli/commands/problem_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "client/cli/commands/command_support.h"
#include "client/files/json_text.h"
#include "client/local/agreement.h"
#include "client/netlist/netlist.h"
#include "client/netlist/sliding.h"
#include "client/rpc/client.h"
#include "proto/shared/title_limit.h"
#include "proto/shared/truncate_text.h"
#include "proto/wire/matrix_shape.h"

namespace dlcs::client {
namespace {

constexpr std::string_view kPrefix = "problems/";

template <typename Request>
Request LinearRequest(const std::string& name, const v1::Problem& problem, const v1::SolveOptions& options) {
  Request request;
  if (name.empty()) {
    *request.mutable_problem() = problem;
  } else {
    request.set_problem_name(name);
  }
  *request.mutable_options() = options;
  return request;
}

}  // namespace

bool IsProblemName(const std::string& text) {
  return text.size() == kPrefix.size() + 64 && text.starts_with(kPrefix) &&
         text.find_first_not_of("0123456789abcdef", kPrefix.size()) == std::string::npos;
}

absl::StatusOr<ProblemInput> ProblemInput::Read(const std::string& path, const ServerTarget& server,
                                                const std::optional<v1::SolutionRule>& rule,
                                                const MatrixFiles& matrix_files) {
  ProblemInput input;
  if (IsProblemName(path)) {
    if (server.address.empty()) {
      return absl::InvalidArgumentError(
          fmt::format("{} is an uploaded problem: name its server with --server HOST:PORT", path));
    }
    if (rule) {
      return absl::InvalidArgumentError("--rule: an uploaded problem has the rule that its file had");
    }
    input.source_ = input.name_ = path;
    input.server_ = server;
    return input;
  }
  const auto text = ReadTextFile(path);
  if (!text.ok()) return text.status();
  input.source_ = SourceName(path);
  if (IsDeck(*text, path)) {
    input.deck_ = *text;
    input.folder_ = FolderOfDeck(path);
    input.rule_ = rule;
    if (absl::Status read = input.ReadDeckText({}); !read.ok()) return read;
    return input;
  }
  absl::StatusOr<ProblemFile> file = ParseProblem(*text, SourceName(path), AreSameFunction, matrix_files);
  if (!file.ok()) return file.status();
  if (file->nonlinear && rule) {
    return absl::InvalidArgumentError("--rule: a nonlinear problem has the rule that its g implies");
  }
  if (rule) file->problem.set_rule(*rule);
  input.file_ = *std::move(file);
  return input;
}

absl::Status ProblemInput::ReadDeckText(const DeckOptions& options) {
  auto netlist = ReadNetlist(deck_, source_, folder_, options);
  if (!netlist.ok()) return netlist.status();
  file_.problem = std::move(netlist->problem);
  file_.name = std::move(netlist->title);
  notes_ = std::move(netlist->notes);
  relays_ = std::move(netlist->relays);
  tolerances_ = std::move(netlist->tolerances);
  if (rule_) file_.problem.set_rule(*rule_);
  return absl::OkStatus();
}

bool ProblemInput::ReachedLimit(const v1::Summary& summary) const {
  const auto is_about_limit = [this](const std::string& concern) {
    return std::ranges::any_of(file_.problem.outputs().limits(), [&](const v1::OutputLimit& limit) {
      return concern.starts_with(file_.problem.outputs().names(limit.output()) + " reaches its limit");
    });
  };
  return HasLimits() && std::ranges::any_of(summary.verdict().concerns(), is_about_limit);
}

absl::Status ProblemInput::RaiseLimits(double factor) { return ReadDeckText({.current_limit = factor}); }

absl::Status ProblemInput::FetchUploaded(const CallLimits& limits) {
  if (!is_uploaded()) return absl::OkStatus();
  const auto options = ConnectionTo(server_);
  if (!options.ok()) return options.status();
  const auto client = Client::Connect(*options);
  if (!client.ok()) return InOptions(client.status(), server_);
  absl::StatusOr<v1::StoredProblem> about = (*client)->problems().Get(name_, limits);
  if (!about.ok()) return about.status();
  about_ = *std::move(about);
  return absl::OkStatus();
}

void ProblemInput::AddConcerns(v1::Summary& summary) const { AddSlidingConcerns(relays_, horizon(), summary); }

void ProblemInput::PrintNotes() const {
  for (const std::string& note : notes_) PrintNotice(note);
}

std::string ProblemInput::title() const {
  std::string title = is_uploaded() ? about_.title() : file_.name;
  if (title.empty()) return source_;
  // It will be printed on a terminal.
  std::ranges::replace_if(
      title, [](unsigned char letter) { return letter < 0x20 || letter == 0x7f; }, '?');
  return title;
}

double ProblemInput::horizon() const {
  if (is_uploaded()) return about_.horizon();
  return file_.nonlinear ? file_.nonlinear->horizon() : file_.problem.horizon();
}

std::int64_t ProblemInput::states() const { return is_uploaded() ? about_.states() : ShapeOf(file_.problem.a()).rows; }

std::int64_t ProblemInput::constraints() const {
  return is_uploaded() ? about_.constraints() : ShapeOf(file_.problem.m()).rows;
}

std::vector<std::string> ProblemInput::StateNames() const {
  return {file_.problem.state_names().begin(), file_.problem.state_names().end()};
}

v1::SolveOptions ProblemInput::WithTolerancesOfDeck(const v1::SolveOptions& options) const {
  return deck_.empty() ? options : WithTolerances(options, tolerances_, file_.problem);
}

v1::SolveRequest ProblemInput::SolveRequest(const v1::SolveOptions& options) const {
  v1::SolveRequest request;
  if (is_uploaded()) {
    request.set_problem_name(name_);
  } else if (file_.nonlinear) {
    *request.mutable_nonlinear() = *file_.nonlinear;
  } else {
    *request.mutable_problem() = file_.problem;
  }
  *request.mutable_options() = WithTolerancesOfDeck(options);
  return request;
}

v1::SolveEnsembleRequest ProblemInput::EnsembleRequest(const v1::SolveOptions& options) const {
  return LinearRequest<v1::SolveEnsembleRequest>(name_, file_.problem, WithTolerancesOfDeck(options));
}

v1::AnalyzeProblemRequest ProblemInput::AnalyzeRequest(const v1::SolveOptions& options) const {
  return LinearRequest<v1::AnalyzeProblemRequest>(name_, file_.problem, WithTolerancesOfDeck(options));
}

v1::ProblemBody ProblemInput::Body() const {
  v1::ProblemBody body;
  if (file_.nonlinear) {
    *body.mutable_nonlinear() = *file_.nonlinear;
  } else {
    *body.mutable_problem() = file_.problem;
  }
  body.set_title(TruncateUtf8(file_.name, kMaxTitleBytes));
  return body;
}

}  // namespace dlcs::client
