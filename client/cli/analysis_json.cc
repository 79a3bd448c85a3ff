// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/cli/analysis_output.h"
#include "client/names.h"

namespace dlcs::client {
namespace {

using nlohmann::ordered_json;

// JSON has no infinity; a constant may be infinite, which is something else than not known.
ordered_json Number(double value) {
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  return value;
}

template <typename Values>
ordered_json List(const Values& values) {
  ordered_json list = ordered_json::array();
  for (const auto& value : values) list.push_back(value);
  return list;
}

ordered_json Rows(const v1::Matrix& matrix) {
  ordered_json rows = ordered_json::array();
  const v1::DenseMatrix& dense = matrix.dense();
  for (int i = 0; i < dense.rows(); ++i) {
    const auto begin = dense.values().begin() + i * dense.columns();
    rows.push_back(std::vector<double>(begin, begin + dense.columns()));
  }
  return rows;
}

ordered_json WitnessJson(const v1::Witness& witness) {
  ordered_json root = ordered_json::object();
  if (!witness.indices().empty()) root["indices"] = List(witness.indices());
  if (witness.has_value()) root["value"] = Number(witness.value());
  if (!witness.z().empty()) root["z"] = List(witness.z());
  if (witness.has_x()) root["X"] = Rows(witness.x());
  if (witness.has_y()) root["Y"] = Rows(witness.y());
  if (!witness.r().empty()) root["r"] = List(witness.r());
  if (!witness.s().empty()) root["s"] = List(witness.s());
  return root;
}

ordered_json FindingJson(const v1::Finding& finding) {
  return {{"title", finding.title()},
          {"answer", Word(finding.answer())},
          {"why", finding.why()},
          {"witness", finding.has_witness() ? WitnessJson(finding.witness()) : ordered_json(nullptr)},
          {"source", finding.source()}};
}

ordered_json ConstantJson(const v1::Constant& constant) {
  return {{"symbol", constant.symbol()},
          {"title", constant.title()},
          {"value", constant.has_value() ? Number(constant.value()) : ordered_json(nullptr)},
          {"kind", Word(constant.kind())},
          {"why", constant.why()},
          {"source", constant.source()}};
}

ordered_json SectionJson(const v1::AnalysisSection& section) {
  ordered_json findings = ordered_json::object();
  for (const v1::Finding& finding : section.findings()) findings[finding.id()] = FindingJson(finding);
  ordered_json constants = ordered_json::object();
  for (const v1::Constant& constant : section.constants()) constants[constant.id()] = ConstantJson(constant);
  return {{"title", section.title()},
          {"findings", findings},
          {"constants", constants},
          {"warnings", List(section.warnings())}};
}

ordered_json RecommendationJson(const v1::Recommendation& recommendation) {
  const v1::SolveOptions& options = recommendation.options();
  return {
      {"method", Word(options.method())},
      {"steps", options.has_steps() ? ordered_json(options.steps()) : ordered_json(nullptr)},
      {"step", options.has_step() ? ordered_json(options.step()) : ordered_json(nullptr)},
      {"grid_times", options.has_grid_times() ? List(options.grid_times().times()) : ordered_json(nullptr)},
      {"window_steps", options.window_steps()},
      {"theta", options.theta()},
      {"step_solver", Word(options.step_solver())},
      {"average_y", options.average_y()},
      {"kernel", Word(options.kernel())},
      {"interpolation", Word(options.interpolation())},
      {"contour", Word(options.contour().choice())},
      {"project_initial_state", options.project_initial_state()},
      {"inelastic_impact", options.inelastic_impact()},
      {"reasons", List(recommendation.reasons())},
      {"refusal", recommendation.refusal()}};
}

}  // namespace

void PrintAnalysisJson(const std::string& name, const v1::AnalyzeProblemResponse& analysis, std::FILE* out) {
  ordered_json sections = ordered_json::object();
  for (const v1::AnalysisSection& section : analysis.sections())
    sections[section.id()] = SectionJson(section);
  const ordered_json root = {{"name", name},
                             {"states", analysis.states()},
                             {"constraints", analysis.constraints()},
                             {"horizon", analysis.horizon()},
                             {"matrix_class", analysis.matrix_class()},
                             {"rule", analysis.rule()},
                             {"sections", sections},
                             {"recommendation", RecommendationJson(analysis.recommendation())},
                             {"warnings", List(analysis.warnings())},
                             {"seconds", analysis.seconds()}};
  fmt::print(out, "{}\n", root.dump(2, ' ', /*ensure_ascii=*/false, ordered_json::error_handler_t::replace));
}

}  // namespace dlcs::client
