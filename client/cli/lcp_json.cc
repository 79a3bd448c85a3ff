// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "client/cli/lcp_output.h"
#include "client/names.h"

namespace dlcs::client {
namespace {

using nlohmann::ordered_json;

template <typename Values>
ordered_json List(const Values& values) {
  return ordered_json(std::vector<typename Values::value_type>(values.begin(), values.end()));
}

ordered_json SetsJson(const v1::IndexSets& sets) {
  return {{"J", List(sets.j())}, {"I", List(sets.i())}, {"K", List(sets.k())}};
}

ordered_json AllJson(const v1::BasicSolutions& all) {
  ordered_json solutions = ordered_json::array();
  for (const v1::BasicSolution& solution : all.solutions()) {
    solutions.push_back({{"y", List(solution.y())},
                         {"w", List(solution.w())},
                         {"sets", SetsJson(solution.sets())},
                         {"basis", List(solution.basis())},
                         {"bases", solution.bases()}});
  }
  ordered_json faces = ordered_json::array();
  for (const v1::SolutionFace& face : all.faces()) {
    faces.push_back(
        {{"basis", List(face.basis())}, {"nearest", List(face.nearest())}, {"point", face.point()}});
  }
  return {{"complete", all.complete()}, {"solutions", solutions}, {"faces", faces}};
}

void Print(const ordered_json& root, std::FILE* out) {
  fmt::print(out, "{}\n", root.dump(2, ' ', /*ensure_ascii=*/false, ordered_json::error_handler_t::replace));
}

// A row of values per time, as in files.
ordered_json PathJson(const v1::PiecewiseLinearPath& path) {
  ordered_json rows = ordered_json::array();
  const int size = path.times().empty() ? 0 : path.values_size() / path.times_size();
  for (int k = 0; k < path.times_size(); ++k) {
    const auto begin = path.values().begin() + k * size;
    rows.push_back(std::vector<double>(begin, begin + size));
  }
  return {{"times", List(path.times())}, {"values", rows}};
}

}  // namespace

void PrintLcpJson(const v1::SolveLcpResponse& response, std::FILE* out) {
  const bool solved = response.verdict() == v1::LCP_SOLVED;
  Print({{"verdict", VerdictName(response.verdict())},
         {"message", response.message()},
         {"y", solved ? ordered_json(List(response.y())) : ordered_json(nullptr)},
         {"w", solved ? ordered_json(List(response.w())) : ordered_json(nullptr)},
         {"residual", solved ? ordered_json(response.residual()) : ordered_json(nullptr)},
         {"pivots", response.pivots()},
         {"method", response.method()},
         {"matrix_class", response.matrix_class()},
         {"rule", response.rule()},
         {"only_choice", response.only_choice()},
         {"sets", response.has_sets() ? SetsJson(response.sets()) : ordered_json(nullptr)},
         {"all", response.has_all() ? AllJson(response.all()) : ordered_json(nullptr)}},
        out);
}

void PrintDcpJson(const v1::SolveDcpResponse& response, bool measured, std::FILE* out) {
  const v1::DcpCertificate& c = response.certificate();
  const bool has_certificate = measured || response.solved();
  Print({{"solved", measured ? ordered_json(nullptr) : ordered_json(response.solved())},
         {"message", response.message()},
         {"certificate", has_certificate ? ordered_json{{"start", c.start()},
                                                        {"least_increase", c.least_increase()},
                                                        {"least_w", c.least_w()},
                                                        {"complementarity", c.complementarity()}}
                                         : ordered_json(nullptr)},
         {"unique", {{"answer", Word(response.unique().answer())}, {"why", response.unique().why()}}},
         {"v", measured ? ordered_json(nullptr) : PathJson(response.v())}},
        out);
}

}  // namespace dlcs::client
